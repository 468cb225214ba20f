"""The values that pass between the rooms. Frames: NWU (x north, y west, z up) for the world, FLU (x forward, y left,
z up) for the body, as the paper's model; `mavquad.frames` owns the flips to MAVLink's NED and FRD."""

from __future__ import annotations

from typing import Literal, NamedTuple

Vec3 = tuple[float, float, float]
Vec4 = tuple[float, float, float, float]

CHANNELS = ("z", "yaw", "x", "y")
"""Order of the regulated outputs in every 4-vector of the law (paper, xi_1 = (z, phi), xi_3 = (x, y))."""

Depth = Literal["torque", "rate", "attitude"]
"""Which input of the autopilot the law commands: chains of length 4, 3 and 2 from it to the position."""


class Attitude(NamedTuple):
    """Attitude and body rates at `stamp_us` of the vehicle's clock.

    Euler angles of R = Rz(yaw) Ry(pitch) Rx(roll), FLU to NWU: positive pitch is nose DOWN here.
    """

    stamp_us: int
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    rates_flu_rad_s: Vec3


class Position(NamedTuple):
    """Position and velocity at `stamp_us` of the vehicle's clock."""

    stamp_us: int
    position_nwu_m: Vec3
    velocity_nwu_m_s: Vec3


class AttitudeTarget(NamedTuple):
    """What the autopilot commands its inner loops: angles as in `Attitude`, body rates, and thrust 0..1."""

    stamp_us: int
    euler_rad: Vec3
    rates_flu_rad_s: Vec3
    thrust_norm: float


class ReferencePoint(NamedTuple):
    """The reference of each output and its derivatives at one moment.

    `z_m[i]` is the i-th derivative of z in m/s^i, `yaw_rad[i]` that of yaw in rad/s^i (yaw continuous, not wrapped);
    i = 0 .. 4.
    """

    z_m: tuple[float, ...]
    yaw_rad: tuple[float, ...]
    x_m: tuple[float, ...]
    y_m: tuple[float, ...]

    def channels(self) -> tuple[tuple[float, ...], ...]:
        """The four outputs in the order of `CHANNELS`."""
        return (self.z_m, self.yaw_rad, self.x_m, self.y_m)


class TorqueCommand(NamedTuple):
    """What the law asks of the body: angular acceleration (rad/s^2, FLU) and thrust per mass T = u1 + g (m/s^2)."""

    angular_acceleration_flu_rad_s2: Vec3
    specific_thrust_m_s2: float


class RateCommand(NamedTuple):
    """What the law asks at depth "rate": body rates (rad/s, FLU) and thrust per mass (m/s^2)."""

    rates_flu_rad_s: Vec3
    specific_thrust_m_s2: float


class AttitudeCommand(NamedTuple):
    """What the law asks at depth "attitude": Euler angles as in `Attitude` (rad) and thrust per mass (m/s^2)."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    specific_thrust_m_s2: float


LawCommand = TorqueCommand | RateCommand | AttitudeCommand
"""One command of the law, at whichever depth."""
