"""Synthetic flights and logs, small and exact."""

from __future__ import annotations

import io
import math
import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.control.defaults import CHAIN_LENGTHS, YAW_LENGTHS
from mavquad.flight_record import TraceRow
from mavquad.tlog import TlogWriter, scan
from mavquad.types import CHANNELS, Depth


def _trace(seconds: float, rate_hz: int = 100, seed: int = 1, depth: Depth = "torque") -> list[TraceRow]:
    """A hover, then a 2 m box with a quarter turn, with errors of some centimetres and two limits now and then."""
    noise = random.Random(seed)
    return [_row(k / rate_hz, noise, depth) for k in range(int(seconds * rate_hz))]


def _row(t: float, noise: random.Random, depth: Depth) -> TraceRow:
    side, part = divmod(max(t - 10.0, 0.0) / 8.0, 1.0)
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0, -2.0), (0.0, -2.0)]
    (x0, y0), (x1, y1) = corners[int(side) % 4], corners[int(side + 1) % 4]
    s = min(part * 1.6, 1.0)
    s = s * s * s * (10 - 15 * s + 6 * s * s)
    yaw = math.radians(90) * min(max(t - 26.0, 0.0) / 6.0, 1.0)
    reference = (3.0, yaw, x0 + s * (x1 - x0), y0 + s * (y1 - y0))
    decay = 0.2 * math.exp(-t / 1.5)
    wobble = [0.02 * math.sin(0.9 * t + i) + noise.gauss(0.0, 0.003) for i in range(4)]
    measured = tuple(r + w + decay for r, w in zip(reference, wobble, strict=True))
    zero = (0.0, 0.0, 0.0, 0.0)
    lengths = [YAW_LENGTHS[depth] if channel == "yaw" else CHAIN_LENGTHS[depth] for channel in CHANNELS]
    return TraceRow(
        stamp_us=1_700_000_000_000_000 + round(t * 1e6) // 4 * 4,
        vehicle_stamp_us=5_000_000 + round(t * 1e6),
        phase="hover" if t < 10.0 else "mission",
        measured=measured,
        reference=reference,
        zeta_hat=tuple((value, 0.1, 0.2, 0.3)[:length] for value, length in zip(measured, lengths, strict=True)),
        sigma=tuple(math.sin(t / 3 + i) * (1 + i) + noise.gauss(0, 0.2) for i in range(4)),
        wind=(1.5, -0.5, 0.25),
        demanded=zero,
        input=(noise.gauss(0, 1.0), 0.0, 0.5, -0.5),
        controls=(noise.gauss(0, 0.02), noise.gauss(0, 0.02), noise.gauss(0, 0.01), 0.5 + noise.gauss(0, 0.01)),
        limits=("tilt", "snap") if 12.0 < t < 12.6 else ("snap",) if t < 0.5 else (),
    )


@pytest.fixture(scope="session")
def make_trace():
    """`make_trace(seconds, depth=...)`: the rows of a synthetic flight."""
    return _trace


T0_US = 1_700_000_000_000_000


class LogBuilder:
    """Writes a log message by message; times are seconds since it began."""

    def __init__(self) -> None:
        self._stream = io.BytesIO()
        self._writer = TlogWriter(self._stream)
        self._senders = {}

    def add(self, t_s: float, message, sender=(1, 1), version=2) -> None:
        if sender not in self._senders:
            self._senders[sender] = dialect.MAVLink(None, srcSystem=sender[0], srcComponent=sender[1])
        mav = self._senders[sender]
        frame = bytes(message.pack(mav, force_mavlink1=version == 1))
        self._writer.write(T0_US + round(t_s * 1e6) // 4 * 4, frame, outbound=False)

    def heartbeat(
        self, t_s: float, armed=False, sender=(1, 1), vehicle_type=2, autopilot=12, version=2, mode=0
    ) -> None:
        message = dialect.MAVLink_heartbeat_message(vehicle_type, autopilot, armed * 128, mode, 4, 3)
        self.add(t_s, message, sender, version)

    def local(self, t_s: float, position_ned, velocity_ned, boot_s=None, sender=(1, 1)) -> None:
        boot_ms = round((t_s if boot_s is None else boot_s) * 1000)
        self.add(t_s, dialect.MAVLink_local_position_ned_message(boot_ms, *position_ned, *velocity_ned), sender)

    def attitude(self, t_s: float, roll, pitch, yaw, rates=(0.0, 0.0, 0.0), boot_s=None) -> None:
        boot_ms = round((t_s if boot_s is None else boot_s) * 1000)
        self.add(t_s, dialect.MAVLink_attitude_message(boot_ms, roll, pitch, yaw, *rates))

    def contents(self):
        return scan(self.data())

    def data(self) -> bytes:
        return self._stream.getvalue()


@pytest.fixture
def log():
    """An empty log to write into."""
    return LogBuilder()
