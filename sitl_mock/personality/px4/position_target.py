"""SET_POSITION_TARGET_LOCAL_NED (84) and SET_POSITION_TARGET_GLOBAL_INT (86) as PX4 takes them.

Each axis follows what is given of position, velocity and acceleration together. An axis of which nothing is given,
NaN or ignored, is kept at rest. A yaw rate turns the vehicle when no yaw is given, and leads it when one is.
"""

from __future__ import annotations

import math

from mavquad.protocol.codec import Message
from sitl_mock.geodesy import Origin
from sitl_mock.inner_loops import PositionSetpoint

_IGNORE_POSITION, _IGNORE_VELOCITY, _IGNORE_ACCELERATION = 0x007, 0x038, 0x1C0
_IGNORE_YAW, _IGNORE_YAW_RATE = 0x400, 0x800
_LOCAL_NED, _BODY_NED = 1, 8
_AMSL_FRAMES, _RELATIVE_FRAMES = (0, 5), (3, 6)

_Axes = tuple[float | None, float | None, float | None]
_NONE: _Axes = (None, None, None)


def local_setpoint(message: Message, heading_rad: float) -> tuple[PositionSetpoint | None, str]:
    """(the setpoint, PX4's complaint if there is none). BODY_NED has no position, and is turned by the heading."""
    name, mask, frame = "SET_POSITION_TARGET_LOCAL_NED", message.type_mask, message.coordinate_frame
    if frame not in (_LOCAL_NED, _BODY_NED):
        return None, f"{name} coordinate frame {frame} unsupported"
    is_body = frame == _BODY_NED
    position = _NONE if is_body else _axes(message.x, message.y, message.z, mask & _IGNORE_POSITION)
    return _setpoint(name, message, position, heading_rad if is_body else 0.0)


def global_setpoint(message: Message, origin: Origin, home_altitude_m: float) -> tuple[PositionSetpoint | None, str]:
    """The same for a place on the earth; altitudes above mean sea level, or above home in the relative frames."""
    name, frame = "SET_POSITION_TARGET_GLOBAL_INT", message.coordinate_frame
    position = _NONE
    if not message.type_mask & _IGNORE_POSITION:
        if frame not in _AMSL_FRAMES + _RELATIVE_FRAMES:
            return None, f"{name} invalid coordinate frame {frame}"
        altitude_m = message.alt + (home_altitude_m if frame in _RELATIVE_FRAMES else 0.0)
        position = _axes(*origin.local(message.lat_int * 1e-7, message.lon_int * 1e-7, altitude_m), 0)
    return _setpoint(name, message, position, 0.0)


def _setpoint(name: str, message: Message, position: _Axes, turn_rad: float) -> tuple[PositionSetpoint | None, str]:
    mask = message.type_mask
    velocity = _axes(message.vx, message.vy, message.vz, mask & _IGNORE_VELOCITY)
    acceleration = _axes(message.afx, message.afy, message.afz, mask & _IGNORE_ACCELERATION)
    if position == velocity == acceleration == _NONE:
        return None, f"{name} invalid"
    speeds = _speeds(position, _turned(velocity, turn_rad), acceleration)
    pushed = _turned(acceleration, turn_rad)
    setpoint = PositionSetpoint(
        position,
        speeds,
        (pushed[0] or 0.0, pushed[1] or 0.0, pushed[2] or 0.0),
        None if mask & _IGNORE_YAW else _finite(message.yaw),
        0.0 if mask & _IGNORE_YAW_RATE else _finite(message.yaw_rate) or 0.0,
    )
    return setpoint, ""


def _speeds(position: _Axes, velocity: _Axes, acceleration: _Axes) -> _Axes:
    """The velocity that each axis follows; None: none, where the acceleration alone acts."""
    n, e, d = (
        None if v is None and p is None and a is not None else v or 0.0
        for p, v, a in zip(position, velocity, acceleration, strict=True)
    )
    return (n, e, d)


def _axes(x: float, y: float, z: float, ignored: int) -> _Axes:
    return _NONE if ignored else (_finite(x), _finite(y), _finite(z))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _turned(axes: _Axes, turn_rad: float) -> _Axes:
    if turn_rad == 0.0 or axes[0] is None or axes[1] is None:
        return axes
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    return (c * axes[0] - s * axes[1], s * axes[0] + c * axes[1], axes[2])
