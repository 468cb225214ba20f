"""ArduCopter's position control: a target that moves within speed and acceleration limits, and the cascade after it.

The target runs to where it is asked with a speed that can be braked away (square-root controller), its velocity changes
by no more than the acceleration limit, and it never gets further from the vehicle than a leash, so that a vehicle that
cannot keep up is not pulled along for ever. The cascade (position P, velocity PI) follows the target with its velocity
and acceleration fed forward. A plain controller: it has no jerk limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from sitl_mock import inner_loops
from sitl_mock.geometry import ZERO3, Quaternion, Vec3, from_euler, wrap_pi
from sitl_mock.personality.ardupilot.attitude import AttitudeInput, sqrt_control
from sitl_mock.personality.ardupilot.guided import KinematicSetpoint
from sitl_mock.personality.ardupilot.leg import Leg, Route
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.sensors import Estimate

_POSITION_P = 1.0
_BRAKING = 0.6
"""Part of the vertical acceleration that is planned for braking, as the recorded takeoff shows."""
_LEASH_M = 3.0
_FASTEST_M_S = 50.0
_UNLIMITED = 1e3
_TURN_ABOVE_M_S = 0.5
_CM = 0.01


@dataclass(frozen=True, slots=True)
class Limits:
    """Speeds and accelerations: horizontal, up, down, vertical."""

    speed_m_s: float
    up_m_s: float
    down_m_s: float
    acceleration_m_s2: float
    vertical_m_s2: float

    @classmethod
    def of(cls, params: Parameters) -> Limits:
        """Those of the WPNAV_ parameters."""
        return cls(*(max(0.1, _CM * params[f"WPNAV_{name}"]) for name in _LIMITS))


_LIMITS = ("SPEED", "SPEED_UP", "SPEED_DN", "ACCEL", "ACCEL_Z")


class Navigator:
    """Holds the moving target and flies the vehicle after it.

    Attributes:
        target_ned_m: where the target is now.
        velocity_ned_m_s: how it moves.
        yaw_rad: the heading asked for.
        speed_m_s: the horizontal speed instead of WPNAV_SPEED's, if not None.
    """

    def __init__(self, hover_thrust_norm: float, gravity_m_s2: float, params: Parameters) -> None:
        self._params = params
        self._gains = inner_loops.Gains(
            hover_thrust_norm,
            gravity_m_s2,
            position_p=(_POSITION_P, _POSITION_P, _POSITION_P),
            velocity_p=(2.0, 2.0, 4.0),
            velocity_i=(1.0, 1.0, 1.5),
            speed_max_m_s=(_FASTEST_M_S, _FASTEST_M_S, _FASTEST_M_S),
            tilt_max_rad=math.radians(30.0),
            thrust_min_norm=0.0,
        )
        self._loops = inner_loops.LoopState()
        self.target_ned_m: Vec3 = ZERO3
        self.velocity_ned_m_s: Vec3 = ZERO3
        self._acceleration_ned_m_s2: Vec3 = ZERO3
        self.yaw_rad = 0.0
        self._yaw_rate_rad_s = 0.0
        self.speed_m_s: float | None = None
        self._limits_version = -1
        self._limits_of_params = Limits.of(params)

    def _limits(self) -> Limits:
        if self._limits_version != self._params.version:
            self._limits_version, self._limits_of_params = self._params.version, Limits.of(self._params)
        limits = self._limits_of_params
        return limits if self.speed_m_s is None else replace(limits, speed_m_s=self.speed_m_s)

    def start(self, estimate: Estimate) -> None:
        """Begin from where the vehicle is and how it moves; what the integrators know of the wind is kept."""
        self.target_ned_m = estimate.position_ned_m
        self.velocity_ned_m_s = estimate.velocity_ned_m_s
        self.yaw_rad, self._yaw_rate_rad_s = wrap_pi(estimate.euler_rad[2]), 0.0

    def reset(self) -> None:
        """Forget the integrators: the vehicle stands on the ground."""
        self._loops = inner_loops.LoopState()

    def hold_height(self, down_m: float) -> None:
        """Put the target's height."""
        n, e, _ = self.target_ned_m
        self.target_ned_m = (n, e, down_m)

    # --- what moves the target ---------------------------------------------------------------------------------

    def fly_to(self, goal_ned_m: Vec3, dt_s: float) -> None:
        """Towards a place, to stop there."""
        limits = self._limits()
        n, e, d = (goal - now for goal, now in zip(goal_ned_m, self.target_ned_m, strict=True))
        distance = math.hypot(n, e)
        speed = min(limits.speed_m_s, sqrt_control(distance, _POSITION_P, limits.acceleration_m_s2))
        part = speed / distance if distance > 1e-9 else 0.0
        self.follow_velocity((n * part, e * part, self._vertical(d, limits)), dt_s, limits)

    def leg_to(self, start_ned_m: Vec3, goal_ned_m: Vec3) -> Leg:
        """The way of a mission or a return, within the limits of the WPNAV_ parameters."""
        limits = self._limits()
        n, e, d = (goal - here for goal, here in zip(goal_ned_m, start_ned_m, strict=True))
        level, length = math.hypot(n, e), math.hypot(n, e, d)
        vertical = limits.down_m_s if d > 0 else limits.up_m_s
        speed = min(_of_part(limits.speed_m_s, level, length), _of_part(vertical, d, length))
        acceleration = min(_of_part(limits.acceleration_m_s2, level, length), _of_part(limits.vertical_m_s2, d, length))
        return Leg.between(start_ned_m, goal_ned_m, speed, acceleration, max(0.1, self._params["WPNAV_JERK"]))

    def fly_leg(self, route: Route, dt_s: float) -> None:
        """Go on along a leg."""
        self.target_ned_m, self.velocity_ned_m_s, self._acceleration_ned_m_s2 = route.go_on(dt_s)

    def descend(self, speed_m_s: float, dt_s: float, acceleration_m_s2: float | None = None) -> None:
        """Straight down (or up, below 0), at most with an acceleration: that of WPNAV_ACCEL_Z if none is given."""
        limits = self._limits()
        if acceleration_m_s2 is not None:
            limits = replace(limits, vertical_m_s2=acceleration_m_s2)
        self.follow_velocity((0.0, 0.0, speed_m_s), dt_s, limits)

    def _vertical(self, distance_m: float, limits: Limits) -> float:
        speed = sqrt_control(distance_m, _POSITION_P, _BRAKING * limits.vertical_m_s2)
        return max(-limits.up_m_s, min(limits.down_m_s, speed))

    def follow_velocity(self, wanted_ned_m_s: Vec3, dt_s: float, limits: Limits | None = None) -> None:
        """Change the target's velocity towards this one, within the accelerations."""
        limits = limits or self._limits()
        vn, ve, vd = self.velocity_ned_m_s
        dn, de, dd = (w - v for w, v in zip(wanted_ned_m_s, self.velocity_ned_m_s, strict=True))
        step = limits.acceleration_m_s2 * dt_s
        change = math.hypot(dn, de)
        part = step / change if change > step else 1.0
        rise = limits.vertical_m_s2 * dt_s
        self._move((vn + part * dn, ve + part * de, vd + max(-rise, min(rise, dd))), dt_s)

    def accelerate(self, acceleration_ned_m_s2: Vec3, dt_s: float) -> None:
        """Change the target's velocity by an acceleration."""
        vn, ve, vd = (
            max(-_FASTEST_M_S, min(_FASTEST_M_S, v + a * dt_s))
            for v, a in zip(self.velocity_ned_m_s, acceleration_ned_m_s2, strict=True)
        )
        self._move((vn, ve, vd), dt_s)

    def follow(self, setpoint: KinematicSetpoint, dt_s: float) -> None:
        """One tick of a setpoint of GUIDED."""
        position, velocity = setpoint.position_ned_m, setpoint.velocity_ned_m_s
        if position is not None and velocity is not None:
            self.target_ned_m, self.velocity_ned_m_s = position, _clipped(velocity)
            self._acceleration_ned_m_s2 = setpoint.acceleration_ned_m_s2 or ZERO3
        elif position is not None:
            self.fly_to(position, dt_s)
        elif velocity is not None:
            self.follow_velocity(_clipped(velocity), dt_s)
        elif setpoint.acceleration_ned_m_s2 is not None:
            self.accelerate(setpoint.acceleration_ned_m_s2, dt_s)

    def _move(self, velocity_ned_m_s: Vec3, dt_s: float) -> None:
        vn, ve, vd = velocity_ned_m_s
        was_n, was_e, was_d = self.velocity_ned_m_s
        self._acceleration_ned_m_s2 = ((vn - was_n) / dt_s, (ve - was_e) / dt_s, (vd - was_d) / dt_s)
        n, e, d = self.target_ned_m
        self.target_ned_m = (n + vn * dt_s, e + ve * dt_s, d + vd * dt_s)
        self.velocity_ned_m_s = velocity_ned_m_s

    # --- heading -----------------------------------------------------------------------------------------------

    def turn_to(self, yaw_rad: float, dt_s: float, rate_rad_s: float | None = None) -> None:
        """Turn the heading towards an angle, no faster than ATC_SLEW_YAW, or at a rate."""
        fastest = math.radians(_CM * self._params["ATC_SLEW_YAW"])
        most_rad = (fastest if rate_rad_s is None else min(fastest, abs(rate_rad_s))) * dt_s
        change = max(-most_rad, min(most_rad, wrap_pi(yaw_rad - self.yaw_rad)))
        self.yaw_rad, self._yaw_rate_rad_s = wrap_pi(self.yaw_rad + change), change / dt_s

    def turn(self, yaw_rate_rad_s: float, dt_s: float) -> None:
        """Turn the heading at a rate."""
        self.yaw_rad = wrap_pi(self.yaw_rad + yaw_rate_rad_s * dt_s)
        self._yaw_rate_rad_s = yaw_rate_rad_s

    def keep_heading(self) -> None:
        """Stop turning."""
        self._yaw_rate_rad_s = 0.0

    def look_ahead(self, dt_s: float) -> None:
        """Turn the nose to where the target goes, if it goes anywhere."""
        vn, ve, _ = self.velocity_ned_m_s
        if math.hypot(vn, ve) > _TURN_ABOVE_M_S:
            self.turn_to(math.atan2(ve, vn), dt_s)
        else:
            self.keep_heading()

    # --- the cascade -------------------------------------------------------------------------------------------

    def control(self, estimate: Estimate, dt_s: float) -> tuple[AttitudeInput, float]:
        """(attitude asked for, thrust as a share of all motors' full one): the vehicle follows the target."""
        n, e, d = self.target_ned_m
        here_n, here_e, here_d = estimate.position_ned_m
        behind = math.hypot(n - here_n, e - here_e)
        if behind > _LEASH_M:
            n, e = here_n + (n - here_n) * _LEASH_M / behind, here_e + (e - here_e) * _LEASH_M / behind
        d = max(here_d - _LEASH_M, min(here_d + _LEASH_M, d))
        self.target_ned_m = (n, e, d)
        setpoint = inner_loops.PositionSetpoint(
            self.target_ned_m, self.velocity_ned_m_s, self._acceleration_ned_m_s2, self.yaw_rad
        )
        attitude, self._loops = inner_loops.position_loop(self._gains, self._loops, setpoint, estimate, dt_s)
        return AttitudeInput(attitude.quaternion, (0.0, 0.0, self._yaw_rate_rad_s)), attitude.thrust_norm

    def level(self, estimate: Estimate, dt_s: float) -> tuple[AttitudeInput, float]:
        """The same with the vehicle level: the height is kept, what happens sideways is not looked at."""
        _, thrust = self.control(estimate, dt_s)
        self._loops = inner_loops.LoopState((0.0, 0.0, self._loops.velocity_integral_m_s2[2]))
        return AttitudeInput(self._level(), (0.0, 0.0, self._yaw_rate_rad_s)), thrust

    def _level(self) -> Quaternion:
        return from_euler(0.0, 0.0, self.yaw_rad)


def _of_part(limit: float, part: float, whole: float) -> float:
    """The limit of the whole vector when one of its part is given."""
    return limit * whole / abs(part) if abs(part) > 1e-6 else _UNLIMITED


def _clipped(velocity: Vec3) -> Vec3:
    n, e, d = (max(-_FASTEST_M_S, min(_FASTEST_M_S, part)) for part in velocity)
    return (n, e, d)
