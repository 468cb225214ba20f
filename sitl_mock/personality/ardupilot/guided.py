"""What GUIDED takes from outside: SET_ATTITUDE_TARGET (82), SET_POSITION_TARGET_LOCAL_NED (84) and _GLOBAL_INT (86).

Each message becomes one of the setpoints below, or is rejected: then the vehicle stops where it is, without a word.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavquad.protocol.codec import Message
from sitl_mock.geometry import Quaternion, Vec3, normalised

_IGNORE_RATES = 0x07
_IGNORE_THROTTLE = 0x40
_IGNORE_ATTITUDE = 0x80
_IGNORE_POSITION, _IGNORE_VELOCITY, _IGNORE_ACCELERATION = 0x007, 0x038, 0x1C0
_FORCE, _IGNORE_YAW, _IGNORE_YAW_RATE = 0x200, 0x400, 0x800
_LOCAL_NED, _LOCAL_OFFSET_NED, _BODY_NED, _BODY_OFFSET_NED = 1, 7, 8, 9
_FROM_HERE = (_LOCAL_OFFSET_NED, _BODY_NED, _BODY_OFFSET_NED)
_GLOBAL_FRAMES = {0: "msl", 5: "msl", 3: "home", 6: "home", 10: "home", 11: "home"}
"""Height above mean sea level, or above home; the mock's terrain is flat at home's height."""
_UNIT = 1e-3
_MOST_RAD_S = 100.0
_FAR_M = 1e6


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint:
    """Body rates (FRD), an attitude (FRD to NED) or both, with the field `thrust` as it came."""

    quaternion: Quaternion | None
    rates_frd_rad_s: Vec3
    thrust: float


@dataclass(frozen=True, slots=True)
class KinematicSetpoint:
    """A position, a velocity, an acceleration, or several of them, NED; yaw and yaw rate if given."""

    position_ned_m: Vec3 | None = None
    velocity_ned_m_s: Vec3 | None = None
    acceleration_ned_m_s2: Vec3 | None = None
    yaw_rad: float | None = None
    yaw_rate_rad_s: float | None = None

    @property
    def moves(self) -> bool:
        """Whether it is good for GUID_TIMEOUT alone; a position is kept for ever."""
        return self.velocity_ned_m_s is not None or self.acceleration_ned_m_s2 is not None


@dataclass(frozen=True, slots=True)
class Rejected:
    """Nothing to follow: stop. `is_lost`: nothing of that kind is followed any more."""

    is_lost: bool = False


def attitude_setpoint(message: Message) -> tuple[AttitudeSetpoint | Rejected, bool]:
    """(the setpoint of SET_ATTITUDE_TARGET, whether ArduPilot calls it an internal error).

    All three rates or none; a throttle; a quaternion, if not ignored, of unit length. A rate that is NaN counts as 0,
    a thrust that is NaN as none.
    """
    mask = message.type_mask
    ignored = mask & _IGNORE_RATES
    if mask & _IGNORE_THROTTLE or ignored not in (0, _IGNORE_RATES):
        return Rejected(), False
    attitude = None if mask & _IGNORE_ATTITUDE else _unit(message.q)
    if attitude is None and not mask & _IGNORE_ATTITUDE:
        return Rejected(), False
    rates = (0.0, 0.0, 0.0) if ignored else (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    has_nan = any(map(math.isnan, rates))
    roll, pitch, yaw = (_limited(rate) for rate in rates)
    thrust = 0.0 if math.isnan(message.thrust) else float(message.thrust)
    return AttitudeSetpoint(attitude, (roll, pitch, yaw), thrust), has_nan


def local_setpoint(message: Message, here_ned_m: Vec3, yaw_rad: float) -> KinematicSetpoint | Rejected | None:
    """The setpoint of SET_POSITION_TARGET_LOCAL_NED; None: no effect."""
    frame = message.coordinate_frame
    if frame not in (_LOCAL_NED, *_FROM_HERE):
        return Rejected()
    turn_rad = yaw_rad if frame in (_BODY_NED, _BODY_OFFSET_NED) else 0.0
    x, y, z = _turned((message.x, message.y, message.z), turn_rad)
    if frame in _FROM_HERE:
        x, y, z = x + here_ned_m[0], y + here_ned_m[1], z + here_ned_m[2]
    return _kinematic(message, (x, y, z), turn_rad)


def global_setpoint(
    message: Message, north_east_m: tuple[float, float], down_m: float
) -> KinematicSetpoint | Rejected | None:
    """The setpoint of SET_POSITION_TARGET_GLOBAL_INT, its place already turned into NED."""
    return _kinematic(message, (*north_east_m, down_m), 0.0)


def height_reference(frame: int) -> str | None:
    """What a MAV_FRAME counts heights from: "msl" or "home"; None for one that is not taken."""
    return _GLOBAL_FRAMES.get(frame)


def _kinematic(message: Message, place_ned_m: Vec3, turn_rad: float) -> KinematicSetpoint | Rejected | None:
    mask = message.type_mask
    position = None if mask & _IGNORE_POSITION else place_ned_m
    velocity = None if mask & _IGNORE_VELOCITY else _turned((message.vx, message.vy, message.vz), turn_rad)
    acceleration = None if mask & _IGNORE_ACCELERATION else _turned((message.afx, message.afy, message.afz), turn_rad)
    refusal = _refusal(position, velocity, acceleration, bool(mask & _FORCE))
    if refusal is not None:
        return refusal
    if position is not None and not all(abs(part) < _FAR_M for part in position):
        return Rejected(is_lost=True) if math.isnan(position[2]) else None
    if acceleration is not None and not all(map(math.isfinite, acceleration)):
        acceleration = (0.0, 0.0, 0.0)
    yaw_rad = None if mask & _IGNORE_YAW else _finite(message.yaw)
    yaw_rate = None if mask & _IGNORE_YAW_RATE else _finite(message.yaw_rate)
    if yaw_rad is not None:
        yaw_rad += turn_rad
    return KinematicSetpoint(position, velocity, acceleration, yaw_rad, yaw_rate)


def _refusal(
    position: Vec3 | None, velocity: Vec3 | None, acceleration: Vec3 | None, is_force: bool
) -> Rejected | None:
    """Combinations that ArduCopter stops at: nothing, position and acceleration alone, a force, a velocity of NaN."""
    if position is None and velocity is None and acceleration is None:
        return Rejected()
    if position is not None and velocity is None and acceleration is not None:
        return Rejected()
    if is_force and acceleration is not None:
        return Rejected()
    if velocity is not None and not all(map(math.isfinite, velocity)):
        return Rejected()
    return None


def _unit(q: tuple[float, ...]) -> Quaternion | None:
    w, x, y, z = q
    length = math.sqrt(w * w + x * x + y * y + z * z)
    return normalised((w, x, y, z)) if abs(length - 1.0) <= _UNIT else None


def _limited(rate: float) -> float:
    return 0.0 if math.isnan(rate) else max(-_MOST_RAD_S, min(_MOST_RAD_S, rate))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _turned(vector: Vec3, turn_rad: float) -> Vec3:
    if turn_rad == 0.0:
        return vector
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2])
