"""A rigid-body quadcopter: 6 degrees of freedom, rotor lag, thrust curve, drag, wind, a ground plane.

World NED, body FRD, unit quaternion q from FRD to NED. With u_i the motor levels, T_i the rotors' thrusts, T their sum,
v the velocity, v_w the wind, w the body rates, s_i the strengths and e the thrust curve:

    T_i   = s_i T_max ((1 - e) u_i + e u_i^2),      u_i' = (command_i - u_i) / tau
    m v'  = -T R e3 + m g e3 - (k_v + k_2 |v - v_w| + k_r sqrt(T / m g)) (v - v_w)
    J w'  = M - w x J w - k_w w,                    q' = q (0, w) / 2
    M     = [l (-T1+T2+T3-T4),  l (T1-T2+T3-T4),  Q_max/T_max (T1+T2-T3-T4)]     frame "x"
    M     = [l (-T1+T2),        l (T3-T4),        Q_max/T_max (T1+T2-T3-T4)]     frame "plus"

Source: PX4's SIH simulator (equations and numbers), which has e = k_2 = k_r = 0 and no wind; ArduPilot's SIM_Frame for
the curve and the other drags, there along each axis of the body.

One step of h is of second order, and takes each force once, at the mean of the levels over the step, which for the lag
is exact: the rates go by the midpoint rule; the attitude turns by exp(h w_mid / 2); the velocity goes with the thrust
along the mean of R e3 before and after, implicit in the drag (trapezoid), whose speed in the middle is foretold from
the step before; the position by the trapezoid. The tests state how far that is from RK4 in steps of 1 ms.
"""

from __future__ import annotations

import math

from sitl_mock.geometry import ZERO3, Vec3, Vec4, down_axis, from_euler, tilt_rad, turned, yaw_of
from sitl_mock.plant import TICK_S, Impact, VehicleParams, VehicleState

FLIPPED_RAD = math.radians(60.0)
"""A vehicle that comes down with more tilt stays lying on its side or back."""
_STILL: Vec4 = (0.0, 0.0, 0.0, 0.0)


def lag_shares(time_constant_s: float, dt_s: float) -> tuple[float, float]:
    """What is left of a first-order lag's first distance: in the mean over a step, and at its end; (0, 0) without lag.

    The mean of exp(-t / tau) over h is (1 - exp(-h / tau)) tau / h.
    """
    if time_constant_s == 0.0:
        return 0.0, 0.0
    end = math.exp(-dt_s / time_constant_s)
    return (1.0 - end) * time_constant_s / dt_s, end


def lagged(levels: Vec4, commands: Vec4, share: float) -> Vec4:
    """Levels on their way to constant commands, with this share of the distance left."""
    (u1, u2, u3, u4), (c1, c2, c3, c4) = levels, commands
    return (c1 + (u1 - c1) * share, c2 + (u2 - c2) * share, c3 + (u3 - c3) * share, c4 + (u4 - c4) * share)


class RigidBody:
    """The rigid-body quadcopter as a `Plant`.

    Attributes:
        state: the true state now.
    """

    def __init__(self, params: VehicleParams, state: VehicleState | None = None, dt_s: float = TICK_S) -> None:
        self.state = state or VehicleState()
        self._down = down_axis(self.state.quaternion)
        self._dt_s = dt_s
        self.change(params)

    def change(self, params: VehicleParams) -> None:
        """From now on it has these constants."""
        mass, (jx, jy, jz), thrust_max = params.mass_kg, params.inertia_kg_m2, params.motor_thrust_max_n
        k_w = params.angular_drag_nm_s_rad
        self._lag_mean, self._lag_end = lag_shares(params.motor_time_constant_s, self._dt_s)
        self._curve = (1.0 - params.thrust_curve, params.thrust_curve)
        self._gains = tuple([thrust_max * strength for strength in params.rotor_strengths])
        self._is_plus = params.frame == "plus"
        self._per_thrust = (params.arm_m / jx, params.arm_m / jy, params.motor_torque_max_nm / thrust_max / jz)
        self._per_rate = (k_w / jx, k_w / jy, k_w / jz)
        self._per_rates = ((jy - jz) / jx, (jz - jx) / jy, (jx - jy) / jz)
        self._weight_n = mass * params.gravity_m_s2
        self._gravity_m_s2 = params.gravity_m_s2
        self._drag = params.linear_drag_n_s_m / mass
        self._quadratic_drag = params.quadratic_drag_n_s2_m2 / mass
        self._rotor_drag = params.rotor_drag_n_s_m / mass / math.sqrt(self._weight_n)
        self._mass_kg = mass

    def step(self, motor_commands: Vec4, wind_ned_m_s: Vec3) -> None:
        """Let one tick pass with constant motor commands (each 0 to 1, motor 1 first) and wind."""
        before = self.state
        if before.on_ground and self._rests(before, motor_commands):
            return
        thrusts, motors = self._driven(before.motors, motor_commands)
        rates_in_the_middle, rates = self._rates_after(before.rates_frd_rad_s, thrusts)
        quaternion = turned(before.quaternion, rates_in_the_middle, self._dt_s)
        down = down_axis(quaternion)
        position, velocity, acceleration = self._moved(before, down, sum(thrusts), wind_ned_m_s)
        self._down = down
        self.state = VehicleState(position, velocity, quaternion, rates, motors, False, None, acceleration)
        if position[2] >= 0.0 and velocity[2] >= 0.0:
            self._touch_down()

    def _driven(self, levels: Vec4, commands: Vec4) -> tuple[Vec4, Vec4]:
        """Thrusts at the mean levels of the step, and the levels at its end: `_thrusts` and `lagged` in one."""
        (u1, u2, u3, u4), (c1, c2, c3, c4) = levels, commands
        linear, square = self._curve
        f1, f2, f3, f4 = self._gains
        mean, end = self._lag_mean, self._lag_end
        u1, u2, u3, u4 = u1 - c1, u2 - c2, u3 - c3, u4 - c4
        a, b, c, d = c1 + u1 * mean, c2 + u2 * mean, c3 + u3 * mean, c4 + u4 * mean
        return (
            f1 * a * (linear + square * a),
            f2 * b * (linear + square * b),
            f3 * c * (linear + square * c),
            f4 * d * (linear + square * d),
        ), (c1 + u1 * end, c2 + u2 * end, c3 + u3 * end, c4 + u4 * end)

    def _thrusts(self, levels: Vec4) -> Vec4:
        """Thrust of each rotor in N."""
        a, b, c, d = levels
        linear, square = self._curve
        f1, f2, f3, f4 = self._gains
        return (
            f1 * a * (linear + square * a),
            f2 * b * (linear + square * b),
            f3 * c * (linear + square * c),
            f4 * d * (linear + square * d),
        )

    def _rates_after(self, rates_frd_rad_s: Vec3, thrusts: Vec4) -> tuple[Vec3, Vec3]:
        """Body rates in the middle of the step, by Euler's rule, and at its end, with the derivative in the middle."""
        (p, q, r), (f1, f2, f3, f4), h = rates_frd_rad_s, thrusts, self._dt_s
        (lx, ly, lz), (kx, ky, kz), (gx, gy, gz) = self._per_thrust, self._per_rate, self._per_rates
        if self._is_plus:
            ax, ay = lx * (f2 - f1), ly * (f3 - f4)
        else:
            ax, ay = lx * (f2 + f3 - f1 - f4), ly * (f1 + f3 - f2 - f4)
        az = lz * (f1 + f2 - f3 - f4)
        half = 0.5 * h
        pm = p + half * (ax - kx * p + gx * q * r)
        qm = q + half * (ay - ky * q + gy * r * p)
        rm = r + half * (az - kz * r + gz * p * q)
        return (pm, qm, rm), (
            p + h * (ax - kx * pm + gx * qm * rm),
            q + h * (ay - ky * qm + gy * rm * pm),
            r + h * (az - kz * rm + gz * pm * qm),
        )

    def _moved(
        self, before: VehicleState, down_after: Vec3, thrust_n: float, wind_ned_m_s: Vec3
    ) -> tuple[Vec3, Vec3, Vec3]:
        """Position, velocity and mean acceleration: a = (-T R e3 / m + g e3 - k (v - v_w)) / (1 + k h / 2)."""
        (n, e, d), (vn, ve, vd), (wn, we, wd) = before.position_ned_m, before.velocity_ned_m_s, wind_ned_m_s
        rn, re, rd = vn - wn, ve - we, vd - wd
        h = self._dt_s
        half = 0.5 * h
        drag = self._drag
        if self._quadratic_drag or self._rotor_drag:
            an, ae, ad = before.acceleration_ned_m_s2
            airspeed = math.hypot(rn + half * an, re + half * ae, rd + half * ad)
            drag += self._quadratic_drag * airspeed + self._rotor_drag * math.sqrt(thrust_n)
        k = 1.0 / (1.0 + half * drag)
        lift = -0.5 * thrust_n / self._mass_kg
        (xn, xe, xd), (yn, ye, yd) = self._down, down_after
        an, ae = k * (lift * (xn + yn) - drag * rn), k * (lift * (xe + ye) - drag * re)
        ad = k * (lift * (xd + yd) + self._gravity_m_s2 - drag * rd)
        return (
            (n + h * (vn + half * an), e + h * (ve + half * ae), d + h * (vd + half * ad)),
            (vn + h * an, ve + h * ae, vd + h * ad),
            (an, ae, ad),
        )

    def _rests(self, state: VehicleState, motor_commands: Vec4) -> bool:
        """Whether the ground holds it for this step too; its motors turn all the same."""
        if state.motors == motor_commands == _STILL and state.impact is None:
            return True
        motors = lagged(state.motors, motor_commands, self._lag_end)
        if sum(self._thrusts(motors)) * self._down[2] > self._weight_n:
            return False
        self.state = state._replace(motors=motors, impact=None)
        return True

    def _touch_down(self) -> None:
        """Held by the ground: at rest, level at its heading (or as it fell, if flipped)."""
        fallen = self.state
        n, e, _ = fallen.position_ned_m
        tilt = tilt_rad(fallen.quaternion)
        resting = fallen.quaternion if tilt > FLIPPED_RAD else from_euler(0.0, 0.0, yaw_of(fallen.quaternion))
        impact = Impact(math.hypot(*fallen.velocity_ned_m_s), tilt)
        self.state = VehicleState((n, e, 0.0), ZERO3, resting, ZERO3, fallen.motors, True, impact)
        self._down = down_axis(resting)
