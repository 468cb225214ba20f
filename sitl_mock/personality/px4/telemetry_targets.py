"""PX4's messages of what its controllers follow and what they command, filled as PX4 fills them."""

from __future__ import annotations

import math

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import Px4Release
from sitl_mock.geometry import Vec3, rotate, wrap_pi
from sitl_mock.inner_loops import PositionSetpoint, velocity_errors
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.picture import Picture, degrees_e7

_LEAST_THRUST = 0.001
"""What ATTITUDE_TARGET shows at rest, disarmed or armed, as recorded."""
_DISARMED_US = 900
_OTHER_SERVOS: dict[Px4Release, tuple[int, ...]] = {
    "1.13": (1500, 1500, 900, 900, *(0,) * 8),
    **dict.fromkeys(("1.14", "1.15", "1.16", "1.17"), (900,) * 12),
}
"""What the outputs without a motor, 5 to 16, show when armed, as recorded; the first eight are 900 disarmed."""
_NAN3 = (math.nan, math.nan, math.nan)
_FALLING_M_S2: Vec3 = (0.0, 0.0, 100.0)
"""The acceleration that PX4 shows while its position controller keeps the thrust at zero on the ground."""
_GEAR_DOWN, _GEAR_UP = -1.0, 1.0
_OUTPUTS = 8
_MOST_OUTPUTS = 32


def attitude_target(picture: Picture) -> Message | None:
    """ATTITUDE_TARGET: the rates that are followed (NaN: an axis left alone), and the last input of the attitude loop.

    While body rates come from outside, that attitude and thrust stand still, and the thrust is not the one in force
    (seen on 1.16.2). Pauses under torque control.
    """
    if picture.is_torque_control():
        return None
    return mavlink.MAVLink_attitude_target_message(
        picture.boot_us // 1000,
        0,
        list(picture.attitude_target),
        *picture.rates_target_rad_s,
        max(picture.attitude_thrust_norm, _LEAST_THRUST),
    )


def position_target_local_ned(picture: Picture) -> Message | None:
    """POSITION_TARGET_LOCAL_NED: what the position controller follows and what its loops ask for inside; fields that are
    not controlled are NaN and ignored by the mask. Pauses while OFFBOARD goes past the position controller."""
    followed = picture.followed
    if followed is None and picture.mode is Mode.OFFBOARD and picture.armed:
        return None
    position = _NAN3 if followed is None else _or_nan(followed)
    velocity, acceleration = _inner_targets(picture)
    return mavlink.MAVLink_position_target_local_ned_message(
        picture.boot_us // 1000,
        mavlink.MAV_FRAME_LOCAL_NED,
        _ignored(*position, *velocity),
        *position,
        *velocity,
        *acceleration,
        *_yaw_target(picture),
    )


def position_target_global_int(picture: Picture) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT, while one of PX4's own modes is armed: where it leads, with the inner targets of the
    message before. In a landing there is no altitude to reach: 1.16 tells 0 for it, 1.13 nothing at all."""
    leads_nowhere = picture.mode is Mode.OFFBOARD or (picture.mode is Mode.LAND and picture.is_113)
    if leads_nowhere or not picture.armed:
        return None
    here, followed = picture.position.position_ned_m, picture.followed
    n, e, d = here if followed is None else followed.position_ned_m
    place = (here[0] if n is None else n, here[1] if e is None else e, 0.0 if d is None else d)
    latitude, longitude, altitude_m = picture.origin.geographic(place)
    velocity, acceleration = _inner_targets(picture)
    return mavlink.MAVLink_position_target_global_int_message(
        picture.boot_us // 1000,
        mavlink.MAV_FRAME_GLOBAL_INT,
        0,
        degrees_e7(latitude),
        degrees_e7(longitude),
        0.0 if d is None else altitude_m,
        *velocity,
        *acceleration,
        *_yaw_target(picture),
    )


def actuator_control_target(picture: Picture) -> Message:
    """ACTUATOR_CONTROL_TARGET of 1.13: torques and thrust as they enter the mixer, and the landing gear."""
    gear = _GEAR_DOWN if picture.landed else _GEAR_UP
    thrust = max(picture.controls.thrust_norm, _LEAST_THRUST)
    return mavlink.MAVLink_actuator_control_target_message(
        picture.boot_us, 0, [*picture.controls.torque_frd_norm, thrust, 0.0, 0.0, 0.0, gear]
    )


def servo_output_raw(picture: Picture) -> Message:
    """SERVO_OUTPUT_RAW: 1000 + 1000 u of each motor command; 900 when disarmed."""
    return mavlink.MAVLink_servo_output_raw_message(picture.boot_us & 0xFFFFFFFF, 0, *_servos_us(picture))


def actuator_output_status(picture: Picture) -> Message:
    """ACTUATOR_OUTPUT_STATUS: the same outputs."""
    outputs = [float(pulse) for pulse in _servos_us(picture)[:_OUTPUTS]]
    return mavlink.MAVLink_actuator_output_status_message(
        picture.boot_us, _OUTPUTS, outputs + [0.0] * (_MOST_OUTPUTS - _OUTPUTS)
    )


def _servos_us(picture: Picture) -> list[int]:
    others = _OTHER_SERVOS[picture.firmware]
    if picture.motor_commands is None:
        return [_DISARMED_US] * _OUTPUTS + list(others[_OUTPUTS - 4 :])
    return [*(round(1000 + 1000 * u) for u in picture.motor_commands), *others]


def _or_nan(followed: PositionSetpoint) -> Vec3:
    n, e, d = (math.nan if wanted is None else wanted for wanted in followed.position_ned_m)
    return n, e, d


def _inner_targets(picture: Picture) -> tuple[Vec3, Vec3]:
    """What the position loop asks of the velocity loop, and that of the attitude loop."""
    followed = picture.followed
    if followed is None:
        return _NAN3, _FALLING_M_S2
    return _velocity_target(picture, followed), _acceleration_target(picture)


def _velocity_target(picture: Picture, followed: PositionSetpoint) -> Vec3:
    """What the position loop asks of the velocity loop: what lacks, on top of what is; NaN where nothing is asked."""
    lacking = velocity_errors(picture.gains, followed, picture.position)
    axes = zip(
        followed.position_ned_m, followed.velocity_ned_m_s, picture.position.velocity_ned_m_s, lacking, strict=True
    )
    north, east, down = (math.nan if p is None and v is None else now + more for p, v, now, more in axes)
    return north, east, down


def _acceleration_target(picture: Picture) -> Vec3:
    """What the velocity loop asks of the attitude loop: a = g e3 - (thrust / hover thrust) g z, z the body's axis."""
    gains = picture.gains
    zn, ze, zd = rotate(picture.attitude_target, (0.0, 0.0, 1.0))
    lift = gains.gravity_m_s2 * picture.attitude_thrust_norm / gains.hover_thrust_norm
    return -lift * zn, -lift * ze, gains.gravity_m_s2 - lift * zd


def _yaw_target(picture: Picture) -> tuple[float, float]:
    """Yaw, and how fast it is to turn."""
    followed = picture.followed
    if followed is None or followed.yaw_rad is None:
        turning = 0.0 if followed is None else followed.yaw_rate_rad_s
        return wrap_pi(picture.estimate.euler_rad[2]), turning
    return wrap_pi(followed.yaw_rad), followed.yaw_rate_rad_s


def _ignored(*fields: float) -> int:
    """The type_mask: a bit for each field that is NaN."""
    return sum(1 << bit for bit, value in enumerate(fields) if math.isnan(value))
