"""PX4's custom modes and its torque setpoint.

custom_mode carries the main mode in bits 16..23 and, for AUTO, the sub mode in bits 24..31 (PX4, px4_custom_mode.h).
"""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.frames import frd_from_flu
from mavquad.protocol.codec import Message, mavlink
from mavquad.types import TorqueCommand, Vec3, Vec4

MAIN_OFFBOARD = 6
MAIN_AUTO = 4
SUB_TAKEOFF = 2
SUB_LOITER = 3
SUB_LAND = 6

_MAIN_NAMES = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE"}
_AUTO_NAMES = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}


@dataclass(frozen=True, slots=True)
class Mode:
    """A PX4 flight mode: main mode and sub mode (0 where there is none)."""

    main: int
    sub: int = 0

    @property
    def custom_mode(self) -> int:
        """The number in HEARTBEAT.custom_mode."""
        return self.main << 16 | self.sub << 24

    @property
    def name(self) -> str:
        """The name that PX4's users know, e.g. AUTO.LOITER."""
        if self.main == MAIN_AUTO:
            return f"AUTO.{_AUTO_NAMES.get(self.sub, self.sub)}"
        return _MAIN_NAMES.get(self.main, f"mode {self.main}")


OFFBOARD = Mode(MAIN_OFFBOARD)
TAKEOFF = Mode(MAIN_AUTO, SUB_TAKEOFF)
LOITER = Mode(MAIN_AUTO, SUB_LOITER)
LAND = Mode(MAIN_AUTO, SUB_LAND)


def mode_from_custom(custom_mode: int) -> Mode:
    """The mode that HEARTBEAT.custom_mode shows."""
    return Mode(custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)


LAST_TORQUE_VERSION = (1, 13)
"""SET_ACTUATOR_CONTROL_TARGET is handled up to PX4 1.13; later releases ignore it silently."""


def takes_torque(version: tuple[int, int, int]) -> bool:
    """Whether this release of PX4 takes torque over MAVLink (message 139)."""
    return version[:2] <= LAST_TORQUE_VERSION


def torque_controls(
    command: TorqueCommand, scale_frd_rad_s2: Vec3, hover_thrust_norm: float, gravity_m_s2: float
) -> Vec4:
    """The law's command as controls of the mixer: roll, pitch, yaw in -1..1 (FRD) and thrust in 0..1.

    Args:
        command: angular acceleration in FLU and thrust per mass.
        scale_frd_rad_s2: angular acceleration at a control of 1, per axis (a property of the airframe).
        hover_thrust_norm: the thrust control that carries the weight when level.
        gravity_m_s2: the gravity that the law calls hover.
    """
    roll, pitch, yaw = frd_from_flu(command.angular_acceleration_flu_rad_s2)
    thrust = hover_thrust_norm * command.specific_thrust_m_s2 / gravity_m_s2
    return (
        _clip(roll / scale_frd_rad_s2[0], -1.0),
        _clip(pitch / scale_frd_rad_s2[1], -1.0),
        _clip(yaw / scale_frd_rad_s2[2], -1.0),
        _clip(thrust, 0.0),
    )


def _clip(value: float, low: float) -> float:
    return min(max(value, low), 1.0)


def torque_setpoint(stamp_us: int, controls: Vec4, system_id: int, component_id: int) -> Message:
    """SET_ACTUATOR_CONTROL_TARGET for the flight control group (group_mlx 0) of the vehicle."""
    return mavlink.MAVLink_set_actuator_control_target_message(
        stamp_us, 0, system_id, component_id, [*controls, 0.0, 0.0, 0.0, 0.0]
    )
