"""A million random and mutated datagrams into the mock: `python tests/bench/fuzz.py [--count N] [--seed N]`.

Each autopilot gets them on the ground and in a hover, a datagram a millisecond of virtual time, through the `Framer`
as a socket would hand them over. Half of them must change nothing (damaged frames, unknown messages, other people's
targets, telemetry of other vehicles): a twin that is left alone must stay in the same true state, mode and parameters.
The other half are valid frames with any values: commands, setpoints, parameters, a thousand a second; the mock must go
on with a finite state. A vehicle on its back or wherever the values took it is replaced now and then by a fresh one.
"""

from __future__ import annotations

import argparse
import copy
import copyreg
import math
import random
import struct
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from fastcrc.crc16 import mcrf4xx
from rich.console import Console
from rich.table import Table

from mavquad.protocol.codec import MAGIC_V1, Encoder, Framer, is_known, is_valid, mavlink
from mavquad.schema import parse_section
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig

copyreg.pickle(struct.Struct, lambda compiled: (struct.Struct, (compiled.format,)))

START_US = 1_700_000_000_000_000
STEP_US = 1000
FRESH_EVERY = 4000
BEAT_EVERY = 500
POOL = 3000
PERSONALITIES = {"px4 1.13": ("px4", "1.13"), "px4 1.16": ("px4", "1.16"), "ardupilot": ("ardupilot", "4.7")}
HANDLED = (
    "COMMAND_INT", "COMMAND_LONG", "COMMAND_LONG", "COMMAND_LONG", "HEARTBEAT", "MANUAL_CONTROL", "MISSION_ACK",
    "MISSION_CLEAR_ALL", "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_REQUEST", "MISSION_REQUEST_INT",
    "MISSION_REQUEST_LIST", "MISSION_SET_CURRENT", "PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET", "PING",
    "RC_CHANNELS_OVERRIDE", "REQUEST_DATA_STREAM", "SETUP_SIGNING", "SET_ACTUATOR_CONTROL_TARGET", "SET_ATTITUDE_TARGET",
    "SET_GPS_GLOBAL_ORIGIN", "SET_HOME_POSITION", "SET_MODE", "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_POSITION_TARGET_LOCAL_NED", "TIMESYNC",
)  # fmt: skip
CLASSES = {cls.msgname: cls for cls in mavlink.mavlink_map.values()}
EXTRA = {number: cls.crc_extra for number, cls in mavlink.mavlink_map.items()}
UNKNOWN = next(number for number in range(20_000, 60_000) if number not in EXTRA)
SIZES = {
    "int8_t": 8,
    "uint8_t": 8,
    "int16_t": 16,
    "uint16_t": 16,
    "int32_t": 32,
    "uint32_t": 32,
    "int64_t": 64,
    "uint64_t": 64,
}
ODD = (
    math.nan,
    math.inf,
    -math.inf,
    0.0,
    -0.0,
    1.0,
    -1.0,
    2.0,
    4.0,
    6.0,
    9.0,
    1e-45,
    3.4028234663852886e38,
    -3.4e38,
    21196.0,
)
COMMANDS = (16, 20, 21, 22, 176, 178, 179, 185, 192, 241, 246, 300, 400, 410, 420, 511, 512, 519, 520, 2500, 31000)
PARAMETERS = (
    "MIS_TAKEOFF_ALT",
    "COM_OF_LOSS_T",
    "MPC_TKO_SPEED",
    "GUID_OPTIONS",
    "GUID_TIMEOUT",
    "SYSID_THISMAV",
    "NO_SUCH",
)


HEARTBEAT = Encoder(255, 190).encode(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


class Fuzz:
    """Makes datagrams; every one is drawn from the seeded generator."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self._encoders = [Encoder(255, 190), Encoder(42, 191), Encoder(1, 1), Encoder(0, 0)]
        self.pool = [self._frame(self.rng.choice(HANDLED)) for _ in range(POOL)]
        others = [name for name in CLASSES if name not in HANDLED and "BAD" not in name and "UNKNOWN" not in name]
        self.neutral = [self._frame(self.rng.choice(others), target=2) for _ in range(POOL // 3)]
        self.neutral += [
            self._frame(name, target=2) for name in HANDLED if "target_system" in CLASSES[name].fieldnames
        ] * 20

    def _frame(self, name: str, target: int = 1) -> bytes:
        cls, rng = CLASSES[name], self.rng
        lengths = dict(zip(cls.ordered_fieldnames, cls.array_lengths, strict=True))
        values = {}
        for field, kind in zip(cls.fieldnames, cls.fieldtypes, strict=True):
            values[field] = self._value(field, kind, lengths[field], target)
        return rng.choice(self._encoders[: 2 if target == 2 else 4]).encode(cls(**values))

    def _value(self, field: str, kind: str, length: int, target: int) -> object:
        rng = self.rng
        if field == "target_system":
            return target if target != 1 or rng.random() < 0.9 else rng.randrange(256)
        if field == "command" and not length and rng.random() < 0.9:
            return rng.choice(COMMANDS)
        if kind == "char":
            return rng.choice(PARAMETERS).encode()[:length] if rng.random() < 0.7 else rng.randbytes(length)
        if length:
            return [self._number(kind) for _ in range(length)]
        return rng.choice((0, 1)) if field == "target_component" else self._number(kind)

    def _number(self, kind: str) -> int | float:
        rng = self.rng
        if kind in ("float", "double"):
            return rng.choice(ODD) if rng.random() < 0.5 else struct.unpack("<f", rng.randbytes(4))[0]
        bits = SIZES.get(kind, 8)
        low = 0 if kind.startswith("u") else -(1 << bits - 1)
        high = low + (1 << bits) - 1
        return (
            rng.choice((low, high, 0, 1, min(high, 6), min(high, 100)))
            if rng.random() < 0.5
            else rng.randint(low, high)
        )

    def harmless(self) -> tuple[str, bytes]:
        """A datagram that must change nothing, and its kind."""
        kind = self.rng.choice(
            ("random", "truncated", "bit flipped", "wrong CRC", "unknown id", "other target", "pieces")
        )
        return kind, getattr(self, f"_{kind.replace(' ', '_').lower()}")()

    def valid(self) -> tuple[str, bytes]:
        """A datagram of valid frames with any values, and its kind."""
        kind = self.rng.choice(("from the pool", "other payload", "shortened", "version 1", "several"))
        return kind, getattr(self, f"_{kind.replace(' ', '_')}")()

    def _random(self) -> bytes:
        data = self.rng.randbytes(self.rng.randrange(1, 80))
        return bytes((self.rng.choice((0xFD, 0xFE)),)) + data if self.rng.random() < 0.5 else data

    def _truncated(self) -> bytes:
        frame = self._from_the_pool()
        return frame[: self.rng.randrange(1, len(frame))]

    def _bit_flipped(self) -> bytes:
        frame = bytearray(self._from_the_pool())
        frame[self.rng.randrange(len(frame))] ^= 1 << self.rng.randrange(8)
        return bytes(frame)

    def _wrong_crc(self) -> bytes:
        frame = bytearray(self._from_the_pool())
        frame[-1] ^= self.rng.randrange(1, 256)
        return bytes(frame)

    def _unknown_id(self) -> bytes:
        payload = self.rng.randbytes(self.rng.randrange(40))
        return bytes((0xFD, len(payload), 0, 0, 0, 255, 190)) + UNKNOWN.to_bytes(3, "little") + payload + b"\0\0"

    def _other_target(self) -> bytes:
        return self.rng.choice(self.neutral)

    def _pieces(self) -> bytes:
        return b"".join(self._truncated() for _ in range(3)) + b"\x55"

    def _from_the_pool(self) -> bytes:
        return self.rng.choice(self.pool)

    def _other_payload(self) -> bytes:
        frame = bytearray(self._from_the_pool())
        for _ in range(self.rng.randrange(1, 5)):
            frame[self.rng.randrange(10, len(frame) - 2)] = self.rng.randrange(256)
        return sealed(frame)

    def _shortened(self) -> bytes:
        """MAVLink 2 may leave out the payload's end: it reads as zeros."""
        frame = bytearray(self._from_the_pool())
        keep = self.rng.randrange(1, frame[1] + 1)
        del frame[10 + keep : 10 + frame[1]]
        frame[1] = keep
        return sealed(frame)

    def _version_1(self) -> bytes:
        frame = self._from_the_pool()
        number = frame[7] | frame[8] << 8 | frame[9] << 16
        if number > 255:
            return frame
        length = struct.calcsize(mavlink.mavlink_map[number].unpacker.format)
        payload = frame[10:-2].ljust(length, b"\0")[: min(length, 255)]
        head = bytes((MAGIC_V1, len(payload), frame[4], frame[5], frame[6], number))
        return sealed(bytearray(head + payload + b"\0\0"))

    def _several(self) -> bytes:
        return b"".join(self._other_payload() for _ in range(self.rng.randrange(2, 6)))


def sealed(frame: bytearray) -> bytes:
    """The frame with its right CRC."""
    number = frame[5] if frame[0] == MAGIC_V1 else frame[7] | frame[8] << 8 | frame[9] << 16
    crc = mcrf4xx(bytes(frame[1:-2]) + bytes((EXTRA[number],)))
    frame[-2:] = struct.pack("<H", crc)
    return bytes(frame)


class Side:
    """A mock with its framer, as a socket would feed it, in virtual time."""

    def __init__(self, autopilot: str, firmware: str) -> None:
        table = {"autopilot": autopilot, "firmware": firmware, "ready_s": 1.0}
        kind = "onboard" if autopilot == "px4" else "serial"
        self.mock = MockAutopilot(parse_section(MockConfig, table, "fuzz"), 1, START_US, (kind,))
        self.framer = Framer()
        self.now_us = START_US
        self.frames = 0

    def push(self, datagram: bytes) -> None:
        """A datagram comes in, a millisecond after the last one."""
        self.run(STEP_US)
        for frame in self.framer.push(datagram):
            if is_known(frame):
                self.frames += 1
                self.mock.receive(frame, self.now_us)
        self.mock.datagrams_to_send()

    def run(self, duration_us: int) -> None:
        """Let time pass."""
        self.now_us += duration_us
        while self.mock.next_deadline_us() <= self.now_us:
            self.mock.on_deadline(self.mock.next_deadline_us())
        self.mock.datagrams_to_send()

    def hover(self, autopilot: str) -> None:
        """Arm, take off, and be in the air."""
        encoder = Encoder(255, 190)
        ready_s, climb = (2, math.nan) if autopilot == "px4" else (60, 5.0)
        mode = [] if autopilot == "px4" else [(176, 1, 4)]
        self.run(ready_s * 1_000_000)
        self.beat()
        for command in (*mode, (400, 1), (22, 0, 0, 0, math.nan, math.nan, math.nan, climb)):
            params = [*map(float, command[1:]), *[0.0] * (8 - len(command))]
            message = mavlink.MAVLink_command_long_message(1, 1, command[0], 0, *params)
            self.mock.receive(encoder.encode(message), self.now_us + 4)
            self.run(100_000)
        for _ in range(80):
            self.beat()
            self.run(100_000)
        assert not self.mock.truth().landed

    def beat(self) -> None:
        """A ground station's HEARTBEAT: without it PX4 1.13 goes home."""
        self.mock.receive(HEARTBEAT, self.now_us)

    def state(self) -> tuple[object, ...]:
        """What nobody may change by invalid frames, beside the parameters: the true state, mode, arming."""
        return (repr(self.mock.truth()), self.mock.mode, self.mock.armed)

    def parameters(self) -> list[bytes]:
        """Every parameter as the mock tells it, its frames' sequence numbers left out."""
        other = copy.deepcopy(self)
        ask = mavlink.MAVLink_param_request_list_message(1, 1)
        other.mock.receive(Encoder(255, 190).encode(ask), other.now_us)
        told = []
        for _ in range(3000):
            other.mock.on_deadline(other.mock.next_deadline_us())
            for frame in other.mock.datagrams_to_send():
                if frame[7] == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
                    told.append(frame[7:-2])
        return told


def is_finite(side: Side) -> bool:
    truth = side.mock.truth()
    state = (*truth.position_ned_m, *truth.velocity_ned_m_s, *truth.quaternion, *truth.rates_frd_rad_s)
    return all(map(math.isfinite, state + truth.motor_commands))


def must_change_nothing(fresh: Callable[[], Side], fuzz: Fuzz, count: int, counts: Counter[str]) -> Iterator[str]:
    """Feed harmless datagrams; yields complaints."""
    side, twin = fresh(), fresh()
    for number in range(count):
        if number % BEAT_EVERY == 0:
            side.beat()
            twin.beat()
        kind, datagram = fuzz.harmless()
        # Cut, flipped or random bytes hold a whole frame with a right CRC once in a great while.
        if kind != "other target" and any(is_valid(frame) for frame in Framer().push(datagram) if is_known(frame)):
            continue
        counts[kind] += 1
        side.push(datagram)
        side.framer.forget_rest()
        twin.run(STEP_US)
    counts["bad bytes"] += side.framer.bad_bytes
    counts["unknown frames"] += side.framer.unknown
    if side.state() != twin.state():
        yield f"changed: {side.state()} instead of {twin.state()}"
    if side.parameters() != twin.parameters():
        yield "parameters changed"


def must_go_on(fresh: Callable[[], Side], fuzz: Fuzz, count: int, counts: Counter[str]) -> Iterator[str]:
    """Feed valid frames with any values; yields complaints."""
    side = fresh()
    for number in range(count):
        if number and number % FRESH_EVERY == 0:
            counts["frames obeyed or answered"] += side.frames
            side = fresh()
        if number % BEAT_EVERY == 0:
            side.beat()
        kind, datagram = fuzz.valid()
        counts[kind] += 1
        try:
            side.push(datagram)
        except Exception as error:  # noqa: BLE001 - counted and told
            at = traceback.extract_tb(error.__traceback__)[-1]
            yield f"{type(error).__name__}: {error} at {Path(at.filename).name}:{at.lineno}, last datagram {datagram.hex()}"
            side = fresh()
        if number % 100 == 0 and not is_finite(side):
            yield f"not finite: {side.mock.truth()}"
            side = fresh()
    counts["frames obeyed or answered"] += side.frames


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    console = Console(width=140)
    table = Table("autopilot", "where", "datagrams", "seconds", "a second", "times real time", "complaints")
    complaints, share = 0, arguments.count // (4 * len(PERSONALITIES))
    all_counts: Counter[str] = Counter()
    for name, (autopilot, firmware) in PERSONALITIES.items():
        for where in ("ground", "hover"):
            start = Side(autopilot, firmware)
            start.hover(autopilot) if where == "hover" else start.run(2_000_000)
            counts: Counter[str] = Counter()
            fuzz = Fuzz(arguments.seed)
            begin = time.perf_counter()
            found = []
            for check in (must_change_nothing, must_go_on):
                found += check(lambda start=start: copy.deepcopy(start), fuzz, share, counts)
            seconds = time.perf_counter() - begin
            total = sum(counts[kind] for kind in counts if " bytes" not in kind and "frames" not in kind)
            speed = total * STEP_US * 1e-6 / seconds
            table.add_row(
                name, where, str(total), f"{seconds:.0f}", f"{total / seconds:.0f}", f"{speed:.1f}", str(len(found))
            )
            for complaint in found[:5]:
                console.print(f"{name}, {where}: {complaint}", markup=False)
            complaints += len(found)
            all_counts += counts
    console.print(table)
    for kind, number in sorted(all_counts.items()):
        console.print(f"{kind:28}{number:>10}")
    console.print(f"complaints: {complaints}")
    return 1 if complaints else 0


if __name__ == "__main__":
    raise SystemExit(main())
