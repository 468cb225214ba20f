"""PX4 1.13's quad mixers: roll, pitch, yaw torque and thrust, normalised, to four motor commands.

    x:     u = thrust + s (-+ roll +- pitch) +- yaw,   s = 0.707, motors 1 front right, 2 rear left, 3 front left, 4 rear right
    plus:  u = thrust + (-roll, roll, pitch, -pitch) +- yaw,      motors 1 right, 2 left, 3 front, 4 rear

When a motor would leave 0..1 PX4 (MC_AIRMODE 0) first lowers the thrust, then gives up roll and pitch, then yaw.
Source: PX4 v1.13 src/lib/mixer/MultirotorMixer; x checked against its recorded SERVO_OUTPUT_RAW.
"""

from __future__ import annotations

from sitl_mock.geometry import Vec4
from sitl_mock.plant import Frame

_S = 0.707107
_ROLL: dict[Frame, Vec4] = {"x": (-_S, _S, _S, -_S), "plus": (-1.0, 1.0, 0.0, 0.0)}
_PITCH: dict[Frame, Vec4] = {"x": (_S, -_S, _S, -_S), "plus": (0.0, 0.0, 1.0, -1.0)}
_YAW: Vec4 = (1.0, 1.0, -1.0, -1.0)
_THRUST: Vec4 = (1.0, 1.0, 1.0, 1.0)
_YAW_HEADROOM = 0.15
"""At full thrust yaw may ask for this much more, and the thrust then gives way."""


def mix(roll: float, pitch: float, yaw: float, thrust: float, frame: Frame = "x") -> Vec4:
    """Motor commands, each 0 to 1, for torques within -1..1 (FRD) and thrust 0..1."""
    (r1, r2, r3, r4), (p1, p2, p3, p4) = _ROLL[frame], _PITCH[frame]
    tilted = (
        thrust + r1 * roll + p1 * pitch,
        thrust + r2 * roll + p2 * pitch,
        thrust + r3 * roll + p3 * pitch,
        thrust + r4 * roll + p4 * pitch,
    )
    u1, u2, u3, u4 = wanted = _along(tilted, _YAW, yaw)
    if 0.0 <= u1 <= 1.0 and 0.0 <= u2 <= 1.0 and 0.0 <= u3 <= 1.0 and 0.0 <= u4 <= 1.0:
        return wanted
    return _mix_saturated(tilted, yaw, frame)


def _mix_saturated(out: Vec4, yaw: float, frame: Frame) -> Vec4:
    out = _unsaturated(out, _THRUST, 1.0, reduce_only=True)
    out = _unsaturated(out, _ROLL[frame], 1.0)
    out = _unsaturated(out, _PITCH[frame], 1.0)
    out = _unsaturated(_along(out, _YAW, yaw), _YAW, 1.0 + _YAW_HEADROOM)
    out = _unsaturated(out, _THRUST, 1.0, reduce_only=True)
    return (_within(out[0]), _within(out[1]), _within(out[2]), _within(out[3]))


def _within(level: float) -> float:
    return max(0.0, min(1.0, level))


def _unsaturated(out: Vec4, direction: Vec4, upper: float, reduce_only: bool = False) -> Vec4:
    """Move along `direction` until the motors are within 0..upper, or evenly beyond it at both ends."""
    gain = _gain(out, direction, upper)
    if reduce_only and gain > 0:
        return out
    out = _along(out, direction, gain)
    return _along(out, direction, 0.5 * _gain(out, direction, upper))


def _gain(out: Vec4, direction: Vec4, upper: float) -> float:
    lowest = highest = 0.0
    for level, part in zip(out, direction, strict=True):
        if part == 0.0 or 0.0 <= level <= upper:
            continue
        gain = ((0.0 if level < 0.0 else upper) - level) / part
        lowest, highest = min(lowest, gain), max(highest, gain)
    return lowest + highest


def _along(out: Vec4, direction: Vec4, gain: float) -> Vec4:
    return (
        out[0] + gain * direction[0],
        out[1] + gain * direction[1],
        out[2] + gain * direction[2],
        out[3] + gain * direction[3],
    )
