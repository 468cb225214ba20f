"""A closed loop for the controller's tests, written apart from it: rigid body with rotors, noisy pose, delayed link.

World NWU, body FLU, attitude as a rotation matrix in a flat list (row by row) that is renormalised now and then. The
vehicle is PX4's SIH quadcopter by default. Physics step 2.5 ms, semi-implicit.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from mavquad.control.controller import Controller, Trace
from mavquad.control.params import LawParams
from mavquad.types import (
    Attitude,
    AttitudeCommand,
    Depth,
    LawCommand,
    Position,
    ReferencePoint,
    TorqueCommand,
)

STEP_US = 2500
STEP_S = STEP_US * 1e-6


@dataclass(frozen=True)
class Vehicle:
    mass_kg: float = 1.0
    inertia: tuple[float, float, float] = (0.025, 0.025, 0.03)
    motor_n: float = 5.0
    lever_m: float = 0.2 * math.sqrt(0.5)
    yaw_nm_per_motor: float = 0.1
    drag_n_s_m: float = 1.0
    angular_drag: float = 0.025
    rotor_lag_s: float = 0.05
    # What the law's wire is scaled by: it does not know the true values.
    torque_per_control: tuple[float, float, float] = (113.137, 113.137, 13.3333)
    hover_control: float = 0.4905
    # The autopilot's own loops: angular acceleration per rate error, rate per angle error.
    rate_gain: float = 13.0
    attitude_gain: float = 6.5
    yaw_gain: float = 1.2
    # Whether rates, or attitude and yaw, are there as soon as they are commanded: the chain itself, without loops.
    perfect_loops: bool = False


@dataclass(frozen=True)
class Link:
    rate_hz: float = 100.0
    attitude_per_position: int = 1
    delay_s: float = 0.025
    loss: float = 0.0
    white_m: float = 0.003
    wander_m: float = 0.05
    wander_s: float = 20.0
    yaw_white_rad: float = 0.001
    rate_white_rad_s: float = 0.005
    velocity_white_m_s: float = 0.0
    attitude_offset_us: int = 0


@dataclass
class Body:
    position: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    velocity: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    rotation: list[float] = field(default_factory=lambda: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    rates: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    motors: list[float] = field(default_factory=lambda: [0.4905] * 4)

    def euler(self) -> tuple[float, float, float]:
        r = self.rotation
        return math.atan2(r[7], r[8]), -math.asin(max(-1.0, min(1.0, r[6]))), math.atan2(r[3], r[0])


@dataclass
class Flight:
    time_s: list[float] = field(default_factory=list)
    error_m: list[tuple[float, float, float]] = field(default_factory=list)
    yaw_error: list[float] = field(default_factory=list)
    tilt: list[float] = field(default_factory=list)
    traces: list[Trace] = field(default_factory=list)
    commands: list[LawCommand] = field(default_factory=list)
    truth: list[tuple[float, float, float]] = field(default_factory=list)
    crashed: bool = False

    def rms_m(self, after_s: float) -> float:
        picked = [sum(c * c for c in e) for t, e in zip(self.time_s, self.error_m, strict=True) if t >= after_s]
        return math.sqrt(sum(picked) / max(1, len(picked)))

    def max_m(self, after_s: float) -> float:
        return max(
            math.sqrt(sum(c * c for c in e)) for t, e in zip(self.time_s, self.error_m, strict=True) if t >= after_s
        )

    def yaw_rms(self, after_s: float) -> float:
        picked = [e * e for t, e in zip(self.time_s, self.yaw_error, strict=True) if t >= after_s]
        return math.sqrt(sum(picked) / max(1, len(picked)))


def euler_matrix(roll: float, pitch: float, yaw: float) -> list[float]:
    sr, cr, sp, cp, sy, cy = (
        math.sin(roll),
        math.cos(roll),
        math.sin(pitch),
        math.cos(pitch),
        math.sin(yaw),
        math.cos(yaw),
    )
    return [
        cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
        sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
        -sp, cp * sr, cp * cr,
    ]  # fmt: skip


def motor_commands(v: Vehicle, command: TorqueCommand) -> list[float]:
    """PX4's quad-X mixer, motors front right, rear left, front left, rear right; clipped."""
    p, q, r = command.angular_acceleration_flu_rad_s2
    roll, pitch, yaw = (a / k for a, k in zip((p, q, r), v.torque_per_control, strict=True))
    thrust = command.specific_thrust_m_s2 / 9.81 * v.hover_control
    roll, pitch = roll * math.sqrt(0.5), pitch * math.sqrt(0.5)
    mixed = (
        thrust - roll - pitch - yaw,
        thrust + roll + pitch - yaw,
        thrust + roll - pitch + yaw,
        thrust - roll + pitch + yaw,
    )
    return [min(max(u, 0.0), 1.0) for u in mixed]


def inner_loops(v: Vehicle, b: Body, command: LawCommand) -> list[float]:
    """A command of any depth to motors: P on the rates, P on the lean of the thrust and on the yaw."""
    if isinstance(command, TorqueCommand):
        return motor_commands(v, command)
    if isinstance(command, AttitudeCommand):
        turn = (command.yaw_rad - b.euler()[2] + math.pi) % (2 * math.pi) - math.pi
        about_x, about_y = _lean_error(b, command)
        rates = (v.attitude_gain * about_x, v.attitude_gain * about_y, min(max(v.yaw_gain * turn, -0.8), 0.8))
    else:
        rates = command.rates_flu_rad_s
    gains = (v.rate_gain, v.rate_gain, 0.6 * v.rate_gain)
    p, q, r = (k * (w - b) for k, w, b in zip(gains, rates, b.rates, strict=True))
    turn = (p, q, min(max(r, -2.5), 2.5))
    return motor_commands(v, TorqueCommand(turn, command.specific_thrust_m_s2))


def _lean_error(b: Body, command: AttitudeCommand) -> tuple[float, float]:
    """About which body axes the thrust must turn to where it is commanded in the world, whatever the yaw is: PX4's way."""
    wanted = euler_matrix(command.roll_rad, command.pitch_rad, command.yaw_rad)
    x, y, z = (sum(b.rotation[3 * i + k] * wanted[3 * i + 2] for i in range(3)) for k in range(3))
    size = math.hypot(x, y)
    angle = math.atan2(size, z) / size if size > 1e-9 else 0.0
    return -angle * y, angle * x


def obey(v: Vehicle, b: Body, command: LawCommand) -> list[float]:
    """The same without loops: the body has the rates, or the attitude, that are commanded."""
    if isinstance(command, TorqueCommand):
        return motor_commands(v, command)
    if isinstance(command, AttitudeCommand):
        b.rotation = euler_matrix(command.roll_rad, command.pitch_rad, command.yaw_rad)
        b.rates = [0.0, 0.0, 0.0]
    else:
        b.rates = list(command.rates_flu_rad_s)
    return motor_commands(v, TorqueCommand((0.0, 0.0, 0.0), command.specific_thrust_m_s2))


def advance(v: Vehicle, b: Body, wanted: list[float], wind: tuple[float, float, float]) -> None:
    h = STEP_S
    blend = 1.0 - math.exp(-h / v.rotor_lag_s) if v.rotor_lag_s > 0 else 1.0
    m = b.motors
    for i in range(4):
        m[i] += blend * (wanted[i] - m[i])
    r = b.rotation
    thrust = v.motor_n * (m[0] + m[1] + m[2] + m[3]) / v.mass_kg
    for i in range(3):
        drag = v.drag_n_s_m / v.mass_kg * (b.velocity[i] - wind[i])
        b.velocity[i] += h * (thrust * r[3 * i + 2] - drag - (9.81 if i == 2 else 0.0))
        b.position[i] += h * b.velocity[i]
    arm = 0.2 * v.motor_n
    torque = (
        arm * (-m[0] + m[1] + m[2] - m[3]),
        arm * (-m[0] + m[1] - m[2] + m[3]),
        v.yaw_nm_per_motor * (-m[0] - m[1] + m[2] + m[3]),
    )
    p, q, s = b.rates
    jx, jy, jz = v.inertia
    b.rates[0] += h * (torque[0] - v.angular_drag * p - (jz - jy) * q * s) / jx
    b.rates[1] += h * (torque[1] - v.angular_drag * q - (jx - jz) * p * s) / jy
    b.rates[2] += h * (torque[2] - v.angular_drag * s - (jy - jx) * p * q) / jz
    _turn(r, b.rates, h)


def _turn(r: list[float], rates: list[float], h: float) -> None:
    """R exp(h w^) by Rodrigues, then one step of orthonormalisation of the rows' lengths."""
    x, y, z = (h * w for w in rates)
    angle2 = x * x + y * y + z * z
    a, c = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
    e = (
        1 - c * (y * y + z * z), c * x * y - a * z, c * x * z + a * y,
        c * x * y + a * z, 1 - c * (x * x + z * z), c * y * z - a * x,
        c * x * z - a * y, c * y * z + a * x, 1 - c * (x * x + y * y),
    )  # fmt: skip
    for i in (0, 3, 6):
        u, v, w = r[i], r[i + 1], r[i + 2]
        n0, n1, n2 = u * e[0] + v * e[3] + w * e[6], u * e[1] + v * e[4] + w * e[7], u * e[2] + v * e[5] + w * e[8]
        size = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        r[i], r[i + 1], r[i + 2] = n0 / size, n1 / size, n2 / size


class Sensor:
    """True pose plus white noise plus a slow wander (OU); what it says without the white part is what is flown to."""

    def __init__(self, link: Link, rng: random.Random) -> None:
        self.link, self.rng = link, rng
        self.wander = [rng.gauss(0.0, link.wander_m) for _ in range(3)]

    def sample(self, body: Body, stamp_us: int) -> tuple[Position, Attitude]:
        link, gauss = self.link, self.rng.gauss
        keep = math.exp(-1.0 / link.rate_hz / link.wander_s)
        for i in range(3):
            self.wander[i] = keep * self.wander[i] + gauss(0.0, link.wander_m * math.sqrt(1 - keep * keep))
        px, py, pz = (p + w + gauss(0.0, link.white_m) for p, w in zip(body.position, self.wander, strict=True))
        roll, pitch, yaw = (a + gauss(0.0, link.yaw_white_rad) for a in body.euler())
        p, q, r = (w + gauss(0.0, link.rate_white_rad_s) for w in body.rates)
        size = link.velocity_white_m_s
        vx, vy, vz = (v + gauss(0.0, size) for v in body.velocity) if size else body.velocity
        return (
            Position(stamp_us, (px, py, pz), (vx, vy, vz)),
            Attitude(stamp_us - link.attitude_offset_us, roll, pitch, yaw, (p, q, r)),
        )


def fly(
    params: LawParams,
    reference: Callable[[float], ReferencePoint],
    duration_s: float,
    *,
    depth: Depth = "torque",
    vehicle: Vehicle = Vehicle(),
    link: Link = Link(),
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    gusts_m_s: float = 0.0,
    seed: int = 1,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start_yaw: float = 0.0,
    start_lean: tuple[float, float] = (0.0, 0.0),
    start_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    trim_m_s2: float | None = None,
    blackout_s: tuple[float, float] = (-1.0, -1.0),
) -> Flight:
    """Hover at `start` (in balance with the wind), hand over at once, fly the reference; error against the measured frame.

    `start_lean` is a roll and a pitch to begin with instead of the balance, at the thrust that holds the weight.

    Positions come `attitude_per_position` times more slowly than attitudes; the law answers every attitude.
    """
    rng = random.Random(seed)
    gust_rng, gusts = random.Random(seed + 1), [0.0, 0.0]
    body = _balanced(vehicle, start, start_yaw, wind)
    body.velocity = list(start_velocity)
    if start_lean != (0.0, 0.0):
        body.rotation = euler_matrix(*start_lean, start_yaw)
        body.motors = [vehicle.mass_kg * 9.81 / 4.0 / vehicle.motor_n] * 4
    sensor = Sensor(link, rng)
    flight = Flight()
    period = round(1e6 / link.rate_hz / STEP_US)
    delay_us = round(link.delay_s * 1e6)
    in_force, flying = None, []
    controller: Controller | None = None
    seen = 0
    for k in range(round(duration_s / STEP_S)):
        now = k * STEP_US
        if k % period == 0:
            position, attitude = sensor.sample(body, now)
            if controller is None:
                leaning = start_lean != (0.0, 0.0)
                level = 9.81 / (1.0 if leaning else body.rotation[8]) if trim_m_s2 is None else trim_m_s2
                controller = Controller(params, depth, position, attitude, level)
            lost = rng.random() < link.loss or blackout_s[0] <= now * 1e-6 < blackout_s[1]
            if not lost:
                controller.observe_attitude(attitude)
                if seen % link.attitude_per_position == 0:
                    controller.observe_position(position)
                command = controller.command(lambda stamp_us: reference(stamp_us * 1e-6))
                flight.traces.append(controller.trace)
                flight.commands.append(command)
                if rng.random() >= link.loss:
                    flying.append((now + delay_us, command))
            seen += 1
            if not record(flight, body, sensor, reference(now * 1e-6), now):
                return flight
        while flying and flying[0][0] <= now:
            in_force = flying.pop(0)[1]
        loops = obey if vehicle.perfect_loops else inner_loops
        wanted = list(body.motors) if in_force is None else loops(vehicle, body, in_force)
        if gusts_m_s:
            keep = math.exp(-STEP_S)
            gusts = [keep * g + gust_rng.gauss(0.0, gusts_m_s * math.sqrt(1 - keep * keep)) for g in gusts]
        advance(vehicle, body, wanted, (wind[0] + gusts[0], wind[1] + gusts[1], wind[2]))
    return flight


def record(flight: Flight, body: Body, sensor: Sensor, point: ReferencePoint, now_us: int) -> bool:
    seen = [p + w for p, w in zip(body.position, sensor.wander, strict=True)]
    error = (seen[0] - point.x_m[0], seen[1] - point.y_m[0], seen[2] - point.z_m[0])
    flight.time_s.append(now_us * 1e-6)
    flight.error_m.append(error)
    yaw = body.euler()[2] - point.yaw_rad[0]
    flight.yaw_error.append((yaw + math.pi) % (2 * math.pi) - math.pi)
    flight.tilt.append(math.acos(max(-1.0, min(1.0, body.rotation[8]))))
    flight.truth.append((body.position[0], body.position[1], body.position[2]))
    flight.crashed = math.sqrt(sum(e * e for e in error)) > 30.0 or body.rotation[8] < 0.0
    return not flight.crashed


def _balanced(v: Vehicle, start: tuple[float, float, float], yaw: float, wind: tuple[float, float, float]) -> Body:
    """At rest against the wind: the thrust vector holds weight and drag."""
    fx, fy, fz = (-v.drag_n_s_m * w for w in wind)
    fz += v.mass_kg * 9.81
    along, left = math.cos(yaw) * fx + math.sin(yaw) * fy, -math.sin(yaw) * fx + math.cos(yaw) * fy
    size = math.sqrt(fx * fx + fy * fy + fz * fz)
    pitch = math.atan2(along, fz)
    roll = math.asin(-left / size)
    body = Body(position=list(start), rotation=euler_matrix(roll, pitch, yaw))
    body.motors = [size / 4.0 / v.motor_n] * 4
    return body


__all__ = ["Body", "Flight", "Link", "Vehicle", "fly", "replace"]
