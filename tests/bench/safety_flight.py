"""One flight of the campaign, and what is held of it: it ends safe, and nothing of ours is sent after a take-over."""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random

from mavquad.drivers.lockstep import START_US
from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import decode, frame_sequence, frame_version, mavlink, message_id
from mavquad.types import Depth
from tests.bench.scenarios import HOVER, Craft, Keys, Scenario
from tests.support import LockstepFlight, prepare, run

LIMIT_S = 400.0
AFTERWARDS_S = 60.0
STEADY_S = 8.0
COPIES_US = 5_000_000
OFFBOARD = {"PX4": 6 << 16, "ArduCopter": 4}
SETPOINTS = frozenset(
    (
        mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
        mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET,
        mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    )
)
HANDS_OFF = ("POSCTL", "ALTCTL", "ALT_HOLD", "LOITER")
HOLDS = ("AUTO.LOITER", "BRAKE")


@dataclass(frozen=True)
class Verdict:
    """How a flight ended.

    Attributes:
        end: "completed", "landed", "holds", "pilot"; else what is wrong.
        error: why the agent says that it did not complete, "" if it did.
        name: of the flight, to find it again.
        seconds: of virtual time.
    """

    end: str
    error: str
    name: str
    seconds: float

    @property
    def safe(self) -> bool:
        return self.end in ("completed", "landed", "holds", "pilot")


def fly_scenario(scenario: Scenario, craft: Craft, depth: Depth, seed: int, keys: Keys | None = None) -> Verdict:
    """Fly it, and judge."""
    return judged(flown(scenario, craft, depth, seed, keys), f"{scenario.name} / {craft.name} / {depth} / seed {seed}")


def flown(scenario: Scenario, craft: Craft, depth: Depth, seed: int, keys: Keys | None = None) -> LockstepFlight:
    """The flight, from the boot until the agent is done."""
    random = Random(f"{scenario.name} {seed}")
    given = {**HOVER, **craft.keys, "law.depth": f'"{depth}"', "seed": seed, **scenario.keys, **(keys or {})}
    flight = prepare(given, scenario.draw(random, craft))
    run(flight, LIMIT_S)
    return flight


def judged(flight: LockstepFlight, name: str) -> Verdict:
    """Let the vehicle go on by itself until it is down or has held still for a while, and say how it ended."""
    seconds, error = flight.seconds, str(flight.agent.error or "")
    if not flight.agent.done:
        return Verdict(f"the agent is still {flight.agent.phase.value}", error, name, seconds)
    sent_us = sent_after_take_over(flight)
    if sent_us is not None:
        return Verdict(
            f"sent a setpoint after a take-over, at {(sent_us - START_US) * 1e-6:.2f} s", error, name, seconds
        )
    end = ended(flight)
    if end == "landed" and not error:
        end = "completed"
    return Verdict(end, error, name, seconds)


def ended(flight: LockstepFlight) -> str:
    """Where the vehicle ends, left to itself."""
    lockstep, mock = flight.lockstep, flight.mock
    limit_us = lockstep.now_us + round(AFTERWARDS_S * 1e6)
    still_since_us = lockstep.now_us

    def over() -> bool:
        nonlocal still_since_us
        if not is_still(flight):
            still_since_us = lockstep.now_us
        down = (mock.landed and not mock.armed) or mock.next_deadline_us() == NEVER_US
        return down or mock.crashed or lockstep.now_us > min(still_since_us + round(STEADY_S * 1e6), limit_us)

    lockstep.run(over, 1e6)
    truth = mock.truth()
    if truth.crashed:
        return "crashed"
    if truth.mode in HANDS_OFF and truth.armed:
        return "pilot"
    if truth.landed or mock.next_deadline_us() == NEVER_US:
        return "landed" if not truth.armed else "on the ground, armed"
    if is_still(flight):
        return "holds"
    return f"in the air in {truth.mode}"


def is_still(flight: LockstepFlight) -> bool:
    """In the air, upright and hardly moving, in a mode that stays so by itself."""
    truth = flight.mock.truth()
    roll, pitch, _ = truth.euler_rad
    slow = math.hypot(*truth.velocity_ned_m_s) < 1.0 and max(abs(roll), abs(pitch)) < 0.7
    # ArduCopter hovers in GUIDED after its takeoff as long as no setpoint comes.
    by_itself = truth.mode == "GUIDED" and not flight.agent.status().setpoints_sent
    return slow and truth.armed and (by_itself or truth.mode in (*HOLDS, *HANDS_OFF))


def sent_after_take_over(flight: LockstepFlight) -> int | None:
    """The stamp of a setpoint after the first HEARTBEAT that shows that the vehicle has left our mode in the air; None if
    there is none. It is told from the wire alone.
    """
    ours = OFFBOARD["ArduCopter" if flight.config.mock["autopilot"] == "ardupilot" else "PX4"]
    flew = left = False
    shown = -1
    heartbeats, copies = InOrder(), Copies()
    for record in flight.recording.records:
        number = message_id(record.frame)
        if record.outbound and number in SETPOINTS:
            flew = True
            if left:
                return record.stamp_us
        elif (
            not record.outbound and frame_version(record.frame) == 2 and not copies.take(record.frame, record.stamp_us)
        ):
            is_next = heartbeats.take(frame_sequence(record.frame), number == mavlink.MAVLINK_MSG_ID_HEARTBEAT)
            if is_next and (mode := mode_shown(record.frame)) is not None:
                left |= flew and shown == ours and mode != ours
                shown = mode
    return None


def mode_shown(frame: bytes) -> int | None:
    """custom_mode of a HEARTBEAT of an autopilot; None of a forged one."""
    heartbeat = decode(frame)
    return None if heartbeat.autopilot == mavlink.MAV_AUTOPILOT_INVALID else int(heartbeat.custom_mode)


class Copies:
    """Tells frames that came before, in the last seconds."""

    def __init__(self) -> None:
        self._stamps_us: dict[bytes, int] = {}

    def take(self, frame: bytes, stamp_us: int) -> bool:
        """The next frame; whether it is a copy."""
        before_us = self._stamps_us.setdefault(frame, stamp_us)
        if stamp_us - before_us > COPIES_US:
            self._stamps_us[frame] = before_us = stamp_us
        return before_us != stamp_us


class InOrder:
    """Tells HEARTBEATs that come late by their place among all frames (sequence numbers, unwrapped)."""

    def __init__(self) -> None:
        self._newest = -1
        self._heartbeat = -1

    def take(self, sequence: int, is_heartbeat: bool) -> bool:
        """The next frame; whether it is a HEARTBEAT sent after all that came before."""
        ahead = (sequence - self._newest + 128) % 256 - 128
        place = self._newest + ahead if self._newest >= 0 else sequence
        self._newest = max(self._newest, place)
        if not is_heartbeat or place <= self._heartbeat:
            return False
        self._heartbeat = place
        return True
