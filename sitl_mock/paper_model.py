"""The paper's simplified quadcopter (Kim, Pyrkin, Borisov, arXiv:2605.14945, section 2) as a plant.

World z up with x north and y west, body x forward and y left; R = Rz(yaw) Ry(pitch) Rx(roll). The paper's letters are
phi = yaw, theta = pitch, psi = roll, and its rotors 1 front right, 2 front left, 3 rear left, 4 rear right:

    m v'     = (F1+F2+F3+F4) r3 - m g e3 - m diag(a) (v - v_wind)
    psi''    = (l / J_psi)   (-F1 + F2 + F3 - F4) - a_psi psi'
    theta''  = (l / J_theta) (-F1 - F2 + F3 + F4) - a_theta theta'
    phi''    = (C / J_phi)   ( F1 - F2 + F3 - F4) - a_phi phi'

with r3 the third column of R. The Euler angles themselves are accelerated: no gyroscopic terms, right near level only.
Wind and the rotors' first-order lag are additions. C is negative here: PX4's rotors turn the other way round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.geometry import ZERO3, Quaternion, Vec3, Vec4, from_euler
from sitl_mock.plant import TICK_S, Impact, VehicleParams, VehicleState
from sitl_mock.quadcopter import FLIPPED_RAD

_PAPER_ROTOR_OF_PX4_MOTOR = (0, 2, 1, 3)
"""Paper's rotors 1 FR, 2 FL, 3 RL, 4 RR, as indices into PX4's motors 1 FR, 2 RL, 3 FL, 4 RR."""


@dataclass(frozen=True, slots=True)
class PaperState:
    """Position and velocity z-up (north, west, up); angles and their rates; rotor levels 0 to 1, paper's order."""

    position_nwu_m: Vec3 = ZERO3
    velocity_nwu_m_s: Vec3 = ZERO3
    roll_pitch_yaw_rad: Vec3 = ZERO3
    roll_pitch_yaw_rates_rad_s: Vec3 = ZERO3
    rotors: Vec4 = (0.0, 0.0, 0.0, 0.0)
    on_ground: bool = True
    impact: Impact | None = None


def accelerations(
    params: VehicleParams,
    velocity_nwu_m_s: Vec3,
    angles_rad: Vec3,
    angle_rates_rad_s: Vec3,
    forces_n: Vec4,
    wind_nwu_m_s: Vec3,
) -> tuple[Vec3, Vec3]:
    """(acceleration in NWU, second derivatives of roll, pitch, yaw) for rotor forces in the paper's order."""
    psi, theta, phi = angles_rad
    f1, f2, f3, f4 = forces_n
    lift = (f1 + f2 + f3 + f4) / params.mass_kg
    friction = params.linear_drag_n_s_m / params.mass_kg
    r3x = math.cos(phi) * math.sin(theta) * math.cos(psi) + math.sin(phi) * math.sin(psi)
    r3y = math.sin(phi) * math.sin(theta) * math.cos(psi) - math.cos(phi) * math.sin(psi)
    r3z = math.cos(theta) * math.cos(psi)
    jx, jy, jz = params.inertia_kg_m2
    arm, drag = params.arm_m, params.angular_drag_nm_s_rad
    torque_per_thrust_m = -params.motor_torque_max_nm / params.motor_thrust_max_n
    linear = (
        lift * r3x - friction * (velocity_nwu_m_s[0] - wind_nwu_m_s[0]),
        lift * r3y - friction * (velocity_nwu_m_s[1] - wind_nwu_m_s[1]),
        lift * r3z - friction * (velocity_nwu_m_s[2] - wind_nwu_m_s[2]) - params.gravity_m_s2,
    )
    angular = (
        (arm * (-f1 + f2 + f3 - f4) - drag * angle_rates_rad_s[0]) / jx,
        (arm * (-f1 - f2 + f3 + f4) - drag * angle_rates_rad_s[1]) / jy,
        (torque_per_thrust_m * (f1 - f2 + f3 - f4) - drag * angle_rates_rad_s[2]) / jz,
    )
    return linear, angular


def step(params: VehicleParams, state: PaperState, motor_commands: Vec4, wind_ned_m_s: Vec3, dt_s: float) -> PaperState:
    """The state after `dt_s`: exact rotor lag, RK4 for the rest; `motor_commands` 0 to 1 in PX4's order."""
    commands = tuple(motor_commands[i] for i in _PAPER_ROTOR_OF_PX4_MOTOR)
    middle = _lag(params, state.rotors, commands, dt_s / 2)
    end = _lag(params, state.rotors, commands, dt_s)
    weight_n = params.mass_kg * params.gravity_m_s2
    upright = math.cos(state.roll_pitch_yaw_rad[0]) * math.cos(state.roll_pitch_yaw_rad[1])
    if state.on_ground and sum(_forces(params, end)) * upright <= weight_n:
        return _at_rest(state.position_nwu_m, state.roll_pitch_yaw_rad, end, None)
    flown = _runge_kutta(params, state, (state.rotors, middle, middle, end), wind_ned_m_s, dt_s)
    if flown.position_nwu_m[2] <= 0.0 and flown.velocity_nwu_m_s[2] <= 0.0:
        return _touch_down(flown)
    return flown


def _forces(params: VehicleParams, rotors: Vec4) -> Vec4:
    """Force of each rotor in N, paper's order."""
    a, b, c, d = rotors
    f1, f3, f2, f4 = params.rotor_strengths
    full = params.motor_thrust_max_n
    return (full * f1 * a, full * f2 * b, full * f3 * c, full * f4 * d)


def _lag(params: VehicleParams, rotors: Vec4, commands: tuple[float, ...], dt_s: float) -> Vec4:
    tau = params.motor_time_constant_s
    gain = 1.0 - math.exp(-dt_s / tau) if tau > 0 else 1.0
    a, b, c, d = (level + gain * (command - level) for level, command in zip(rotors, commands, strict=True))
    return (a, b, c, d)


def _runge_kutta(
    params: VehicleParams,
    state: PaperState,
    rotors_at_stage: tuple[Vec4, Vec4, Vec4, Vec4],
    wind_ned_m_s: Vec3,
    dt_s: float,
) -> PaperState:
    wind_nwu = (wind_ned_m_s[0], -wind_ned_m_s[1], -wind_ned_m_s[2])
    start = (
        *state.position_nwu_m,
        *state.roll_pitch_yaw_rad,
        *state.velocity_nwu_m_s,
        *state.roll_pitch_yaw_rates_rad_s,
    )

    def rate(y: tuple[float, ...], rotors: Vec4) -> tuple[float, ...]:
        v, w = (y[6], y[7], y[8]), (y[9], y[10], y[11])
        linear, angular = accelerations(params, v, (y[3], y[4], y[5]), w, _forces(params, rotors), wind_nwu)
        return (*v, *w, *linear, *angular)

    def moved(k: tuple[float, ...], h: float) -> tuple[float, ...]:
        return tuple([a + h * b for a, b in zip(start, k, strict=True)])

    k1 = rate(start, rotors_at_stage[0])
    k2 = rate(moved(k1, dt_s / 2), rotors_at_stage[1])
    k3 = rate(moved(k2, dt_s / 2), rotors_at_stage[2])
    k4 = rate(moved(k3, dt_s), rotors_at_stage[3])
    mean = tuple([(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)])
    y = moved(mean, dt_s)
    return PaperState(
        (y[0], y[1], y[2]), (y[6], y[7], y[8]), (y[3], y[4], y[5]), (y[9], y[10], y[11]), rotors_at_stage[3], False
    )


def _at_rest(position_nwu_m: Vec3, angles_rad: Vec3, rotors: Vec4, impact: Impact | None) -> PaperState:
    x, y, _ = position_nwu_m
    return PaperState((x, y, 0.0), ZERO3, angles_rad, ZERO3, rotors, True, impact)


def _touch_down(state: PaperState) -> PaperState:
    roll, pitch, yaw = state.roll_pitch_yaw_rad
    tilt = math.acos(max(-1.0, min(1.0, math.cos(roll) * math.cos(pitch))))
    resting = (0.0, 0.0, yaw) if tilt <= FLIPPED_RAD else (roll, pitch, yaw)
    return _at_rest(state.position_nwu_m, resting, state.rotors, Impact(math.hypot(*state.velocity_nwu_m_s), tilt))


def to_vehicle_state(state: PaperState) -> VehicleState:
    """The same state in NED and FRD: y, z, pitch and yaw change sign, and Euler rates become body rates.

    p = psi' - phi' sin(theta);  q = theta' cos(psi) + phi' sin(psi) cos(theta);
    r = -theta' sin(psi) + phi' cos(psi) cos(theta)  (FLU; q and r change sign in FRD).
    """
    psi, theta, phi = state.roll_pitch_yaw_rad
    psi_d, theta_d, phi_d = state.roll_pitch_yaw_rates_rad_s
    p = psi_d - phi_d * math.sin(theta)
    q = theta_d * math.cos(psi) + phi_d * math.sin(psi) * math.cos(theta)
    r = -theta_d * math.sin(psi) + phi_d * math.cos(psi) * math.cos(theta)
    x, y, z = state.position_nwu_m
    vx, vy, vz = state.velocity_nwu_m_s
    f1, f2, f3, f4 = state.rotors
    attitude: Quaternion = from_euler(psi, -theta, -phi)
    return VehicleState(
        (x, -y, -z), (vx, -vy, -vz), attitude, (p, -q, -r), (f1, f3, f2, f4), state.on_ground, state.impact
    )


class PaperModel:
    """The paper's model as a `Plant`."""

    def __init__(self, params: VehicleParams, state: PaperState | None = None, dt_s: float = TICK_S) -> None:
        self._params = params
        self._own = state or PaperState()
        self._dt_s = dt_s
        self._state = to_vehicle_state(self._own)

    @property
    def state(self) -> VehicleState:
        """The true state now, in NED and FRD."""
        return self._state

    def step(self, motor_commands: Vec4, wind_ned_m_s: Vec3) -> None:
        """Let one tick pass."""
        self._own = step(self._params, self._own, motor_commands, wind_ned_m_s, self._dt_s)
        seen = to_vehicle_state(self._own)
        if not seen.on_ground:
            pairs = zip(self._state.velocity_ned_m_s, seen.velocity_ned_m_s, strict=True)
            an, ae, ad = ((after - before) / self._dt_s for before, after in pairs)
            seen = seen._replace(acceleration_ned_m_s2=(an, ae, ad))
        self._state = seen

    def change(self, params: VehicleParams) -> None:
        """From now on it has these constants."""
        self._params = params
