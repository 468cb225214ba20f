"""ArduCopter's motors: from torques and thrust to what each motor gets, and how they spool up after arming.

Thrusts t_i are shares of one motor's full thrust. With roll, pitch, yaw within -1..1 (FRD) and the collective T,

    plus:  t = T + (-r/2, r/2, p/2, -p/2) + (y/2, y/2, -y/2, -y/2)      motors 1 right, 2 left, 3 front, 4 rear
    x:     t = T + r/2 (-s, s, s, -s) + p/2 (s, -s, s, -s) + y/2 (1, 1, -1, -1),  s = 0.707, PX4's order

Roll and pitch come first, then the collective as far as it must move to make room for them, then what is left of yaw,
but never less of it than the headroom (MOT_YAW_HEADROOM 200 of 1000).
"""

from __future__ import annotations

import math

from sitl_mock.geometry import Vec3, Vec4
from sitl_mock.plant import Frame, VehicleParams

ARMING_DELAY_S = 2.0
SPOOLED_S = 2.36
"""Seconds after arming at which the motors take thrust, as measured: 2 s of delay, then up to idle."""
_THRUST_RAMP_S = 0.5
"""MOT_SPOOL_TIME: from nothing allowed to full thrust allowed."""
_YAW_HEADROOM = 0.2
_HALF = 0.5
_S = 0.5 * math.sqrt(0.5)
_ROLL: dict[Frame, Vec4] = {"plus": (-_HALF, _HALF, 0.0, 0.0), "x": (-_S, _S, _S, -_S)}
_PITCH: dict[Frame, Vec4] = {"plus": (0.0, 0.0, _HALF, -_HALF), "x": (_S, -_S, _S, -_S)}
_YAW: Vec4 = (_HALF, _HALF, -_HALF, -_HALF)


def mix(frame: Frame, torque_frd_norm: Vec3, thrust_norm: float) -> Vec4:
    """Each motor's share of its full thrust, 0 to 1."""
    roll, pitch, yaw = torque_frd_norm
    tilt = [roll * r + pitch * p for r, p in zip(_ROLL[frame], _PITCH[frame], strict=True)]
    spread = max(tilt) - min(tilt)
    if spread > 1.0:
        tilt = [part / spread for part in tilt]
    lift = max(-min(tilt), min(1.0 - max(tilt), thrust_norm))
    room = min(lift + min(tilt), 1.0 - lift - max(tilt))
    most = max(room, _HALF * _YAW_HEADROOM)
    turn = max(-most, min(most, _HALF * yaw))
    wanted = [part + 2.0 * turn * y for part, y in zip(tilt, _YAW, strict=True)]
    lift = max(-min(wanted), min(1.0 - max(wanted), thrust_norm))
    a, b, c, d = (max(0.0, min(1.0, lift + part)) for part in wanted)
    return (a, b, c, d)


def commands(vehicle: VehicleParams, shares: Vec4) -> Vec4:
    """The motor commands u that give these shares of full thrust: (1 - e) u + e u^2 = t (MOT_THST_EXPO)."""
    e = vehicle.thrust_curve
    if e == 0.0:
        return shares
    linear = 1.0 - e
    a, b, c, d = (2.0 * t / (linear + math.sqrt(linear * linear + 4.0 * e * t)) if t > 0.0 else 0.0 for t in shares)
    return (a, b, c, d)


def allowed_thrust(since_s: float) -> float:
    """The most thrust, 0 to 1, of idling motors that have begun to lift so long ago."""
    return max(0.0, min(1.0, since_s / _THRUST_RAMP_S))


def idle_pwm(since_armed_s: float) -> int:
    """What an output shows while no thrust is given: 1000 disarmed and delayed, then up to MOT_SPIN_ARM's 1100."""
    part = (since_armed_s - ARMING_DELAY_S) / (SPOOLED_S - ARMING_DELAY_S)
    return round(1000 + 100 * max(0.0, min(1.0, part)))


def pwm(command: float) -> int:
    """What an output shows for a motor command 0 to 1: from MOT_SPIN_MIN 0.15 to MOT_SPIN_MAX 0.95 of 1000 to 2000."""
    return round(1150 + 800 * command)
