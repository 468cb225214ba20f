"""Flying by the sticks of MANUAL_CONTROL: POSCTL, ALTCTL, STABILIZED, ACRO. RC_CHANNELS_OVERRIDE is not looked at.

POSCTL: sticks are speeds in the direction of the nose, and released sticks hold the place. ALTCTL: tilt, and climb
speed. STABILIZED, MANUAL: tilt and thrust, half a stick is the hover. ACRO: body rates and thrust.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavquad.protocol.codec import Message
from sitl_mock.geometry import Vec3, from_euler, rotate, wrap_pi
from sitl_mock.inner_loops import AttitudeSetpoint, PositionSetpoint, RatesSetpoint, Setpoint
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.view import IDLE, View

_DEADZONE = 0.1
_TAKEOVER = 0.3
_STOPPED_M_S = 0.3


@dataclass(frozen=True, slots=True)
class Sticks:
    """Right, ahead, up and turn to the right, each -1 to 1; up at 0 is half the throttle."""

    roll: float = 0.0
    pitch: float = 0.0
    throttle: float = 0.0
    yaw: float = 0.0

    @property
    def wants_control(self) -> bool:
        """Whether they are moved so far that the pilot takes over from an AUTO mode (COM_RC_STICK_OV)."""
        return max(abs(self.roll), abs(self.pitch), abs(self.yaw)) > _TAKEOVER


def sticks_of(message: Message) -> Sticks:
    """The sticks in MANUAL_CONTROL."""
    return Sticks(
        _unit(message.y / 1000), _unit(message.x / 1000), _unit(message.z / 500 - 1.0), _unit(message.r / 1000)
    )


def _unit(value: float) -> float:
    return max(-1.0, min(1.0, value))


def _without_deadzone(value: float) -> float:
    rest = abs(value) - _DEADZONE
    return math.copysign(rest / (1 - _DEADZONE), value) if rest > 0 else 0.0


class Manual:
    """Turns the sticks into setpoints of one of the manual modes; `sticks` None is nobody there."""

    def __init__(self, hover_thrust_norm: float) -> None:
        self._hover_thrust_norm = hover_thrust_norm
        self._yaw_rad = 0.0
        self._held_ned_m: list[float | None] = [None, None, None]
        self._has_left = False
        self.mode = Mode.POSCTL
        self.sticks = Sticks()

    def enter(self, view: View) -> None:
        """Begin with what it does now."""
        self._yaw_rad = view.estimate.euler_rad[2]
        self._held_ned_m = [None, None, None]
        self._has_left = not view.landed

    def setpoint(self, view: View) -> Setpoint:
        """What the sticks ask for."""
        self._has_left = (self._has_left and not view.landed) or self.sticks.throttle > _DEADZONE
        if self.mode in (Mode.STABILIZED, Mode.MANUAL):
            return AttitudeSetpoint(self._leaning(view), self._thrust())
        if self.mode is Mode.ACRO:
            return self._rates(view)
        if not self._has_left or (view.on_ground and self.sticks.throttle < _DEADZONE):
            return IDLE
        return self._altitude(view) if self.mode is Mode.ALTCTL else self._position(view)

    def _thrust(self) -> float:
        """Of the throttle: the hover at its middle, straight lines to nothing and to full thrust."""
        throttle, hover = self.sticks.throttle, self._hover_thrust_norm
        return hover * (1 + throttle) if throttle < 0 else hover + throttle * (1 - hover)

    def _turn(self, view: View) -> float:
        rate_rad_s = _without_deadzone(self.sticks.yaw) * math.radians(view.settings.mpc_man_y_max)
        if view.on_ground:
            self._yaw_rad = view.estimate.euler_rad[2]
        self._yaw_rad = wrap_pi(self._yaw_rad + rate_rad_s * view.dt_s)
        return self._yaw_rad

    def _leaning(self, view: View) -> tuple[float, float, float, float]:
        most = math.radians(view.settings.mpc_man_tilt_max)
        roll, pitch = self.sticks.roll, self.sticks.pitch
        size = math.hypot(roll, pitch)
        scale = most / max(1.0, size)
        return from_euler(roll * scale, -pitch * scale, self._turn(view))

    def _rates(self, view: View) -> RatesSetpoint:
        settings, sticks = view.settings, self.sticks
        return RatesSetpoint(
            (
                math.radians(settings.mc_acro_r_max) * sticks.roll,
                -math.radians(settings.mc_acro_p_max) * sticks.pitch,
                math.radians(settings.mc_acro_y_max) * sticks.yaw,
            ),
            self._thrust(),
        )

    def _climb(self, view: View) -> float:
        """Speed downwards; near the ground that of a landing."""
        throttle, settings = _without_deadzone(self.sticks.throttle), view.settings
        if throttle > 0:
            return -throttle * settings.mpc_z_vel_max_up
        is_low = view.height_m < settings.mpc_land_alt2
        return -throttle * (settings.mpc_land_speed if is_low else settings.mpc_z_vel_max_dn)

    def _position(self, view: View) -> PositionSetpoint:
        settings = view.settings
        speed = min(settings.mpc_vel_manual, settings.mpc_xy_vel_max)
        ahead, right = _without_deadzone(self.sticks.pitch) * speed, _without_deadzone(self.sticks.roll) * speed
        yaw_rad = self._turn(view)
        north = ahead * math.cos(yaw_rad) - right * math.sin(yaw_rad)
        east = ahead * math.sin(yaw_rad) + right * math.cos(yaw_rad)
        velocity = (north, east, self._climb(view))
        held = self._held(velocity, view)
        return PositionSetpoint(held, velocity, yaw_rad=yaw_rad)

    def _altitude(self, view: View) -> PositionSetpoint:
        """Tilt as an acceleration: the position control turns it back into the same tilt."""
        q = self._leaning(view)
        x, y, z = rotate(q, (0.0, 0.0, -1.0))
        gravity = 9.81
        acceleration: Vec3 = (gravity * x / -z, gravity * y / -z, 0.0)
        down_m_s = self._climb(view)
        held = self._held((None, None, down_m_s), view)
        return PositionSetpoint((None, None, held[2]), (None, None, down_m_s), acceleration, self._yaw_rad)

    def _held(
        self, velocity: tuple[float | None, float | None, float], view: View
    ) -> tuple[float | None, float | None, float | None]:
        """Where released axes stay, once they are slow: north and east together, and down."""
        vn, ve, vd = view.estimate.velocity_ned_m_s
        position = view.estimate.position_ned_m
        held = self._held_ned_m
        if velocity[0] == 0.0 and velocity[1] == 0.0:
            if held[0] is None and math.hypot(vn, ve) < _STOPPED_M_S:
                held[0], held[1] = position[0], position[1]
        else:
            held[0] = held[1] = None
        if velocity[2] == 0.0:
            if held[2] is None and abs(vd) < _STOPPED_M_S:
                held[2] = position[2]
        else:
            held[2] = None
        return (held[0], held[1], held[2])
