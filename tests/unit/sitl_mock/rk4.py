"""The rigid body's equations, written down again with numpy and integrated by RK4 in small steps; far too slow to fly."""

import math

import numpy as np

from sitl_mock.plant import VehicleParams, VehicleState

SIDES = {
    "x": np.array([[-1, 1, 1, -1], [1, -1, 1, -1]]),
    "plus": np.array([[-1, 1, 0, 0], [0, 0, 1, -1]]),
}
SPIN = np.array([1, 1, -1, -1])


def rotation(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def cross(a, b):
    """numpy's own takes 20 times as long for one pair."""
    (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def derivative(params: VehicleParams, y, commands, wind):
    """Of (position, velocity, quaternion, rates, motors), in free flight."""
    velocity, q, rates, levels = y[3:6], y[6:10], y[10:13], y[13:17]
    e = params.thrust_curve
    thrusts = params.motor_thrust_max_n * np.array(params.rotor_strengths) * ((1 - e) * levels + e * levels**2)
    thrust, weight = thrusts.sum(), params.mass_kg * params.gravity_m_s2
    airspeed = velocity - wind
    drag = params.linear_drag_n_s_m + params.quadratic_drag_n_s2_m2 * np.linalg.norm(airspeed)
    drag += params.rotor_drag_n_s_m * math.sqrt(thrust / weight)
    force = rotation(q) @ np.array([0.0, 0.0, -thrust]) - drag * airspeed
    roll_pitch = params.arm_m * (SIDES[params.frame] @ thrusts)
    moment = np.append(roll_pitch, params.motor_torque_max_nm / params.motor_thrust_max_n * (SPIN @ thrusts))
    inertia = np.array(params.inertia_kg_m2)
    moment -= cross(rates, inertia * rates) + params.angular_drag_nm_s_rad * rates
    w, v = q[0], q[1:]
    turning = 0.5 * np.append(-v @ rates, w * rates + cross(v, rates))
    lag = (np.array(commands) - levels) / params.motor_time_constant_s
    gravity = np.array([0.0, 0.0, params.gravity_m_s2])
    return np.concatenate([velocity, force / params.mass_kg + gravity, turning, moment / inertia, lag])


def fly(params: VehicleParams, start: VehicleState, commands, wind, dt_s=0.001):
    """Flat states after each 4 ms; `commands` one each of these."""
    y = np.concatenate(
        [start.position_ned_m, start.velocity_ned_m_s, start.quaternion, start.rates_frd_rad_s, start.motors]
    )
    for command in commands:
        for _ in range(round(0.004 / dt_s)):
            k1 = derivative(params, y, command, wind)
            k2 = derivative(params, y + dt_s / 2 * k1, command, wind)
            k3 = derivative(params, y + dt_s / 2 * k2, command, wind)
            k4 = derivative(params, y + dt_s * k3, command, wind)
            y = y + dt_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            y[6:10] /= np.linalg.norm(y[6:10])
        yield y
