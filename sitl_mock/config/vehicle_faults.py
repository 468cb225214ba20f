"""Faults of the vehicle and its surroundings: each happens once."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sitl_mock.config.fault_base import Duration, Moment

_Metres = Annotated[float, Field(ge=-10_000, le=10_000)]
_WindSpeed = Annotated[float, Field(ge=-50, le=50)]
Share = Annotated[float, Field(ge=0, le=1)]


class ModeChange(Moment):
    """The pilot takes over: the mode switch selects another mode."""

    kind: Literal["mode_change"]
    """Discriminates the fault."""
    mode: str
    """The autopilot's own name of the mode, e.g. "POSCTL" on PX4, "LOITER" on ArduPilot."""


class GeofenceBreach(Moment):
    """The vehicle is found outside its geofence; it does what its parameters say."""

    kind: Literal["geofence_breach"]
    """Discriminates the fault."""


class EstimatorReset(Moment):
    """The estimated position jumps and the reset counter counts; the vehicle itself stays where it is."""

    kind: Literal["estimator_reset"]
    """Discriminates the fault."""
    offset_ned_m: tuple[_Metres, _Metres, _Metres]
    """How far towards north, east, down in m."""


class LowBattery(Moment):
    """The battery is nearly empty."""

    kind: Literal["low_battery"]
    """Discriminates the fault."""
    remaining: Share = 0.05
    """Share of the charge that is left, 0 to 1."""


class PayloadDrop(Moment):
    """The payload of the vehicle's configuration falls off."""

    kind: Literal["payload_drop"]
    """Discriminates the fault."""


class WeakRotor(Moment):
    """A rotor gives less than it should from then on."""

    kind: Literal["weak_rotor"]
    """Discriminates the fault."""
    rotor: Annotated[int, Field(ge=1, le=4)]
    """The rotor's number, as the autopilot counts."""
    share: Share = 0.0
    """Share of its thrust and torque that it still gives; 0: it stands still."""


class WindStep(Moment):
    """The wind changes at once, and stays so; gusts go on."""

    kind: Literal["wind_step"]
    """Discriminates the fault."""
    change_ned_m_s: tuple[_WindSpeed, _WindSpeed, _WindSpeed]
    """How much more it blows towards north, east, down in m/s."""


class Reboot(Moment):
    """The autopilot starts anew: motors off, time since boot from 0, modes and streams as at power-up."""

    kind: Literal["reboot"]
    """Discriminates the fault."""
    down_s: Duration = 2.0
    """How long it is away in s."""


class Die(Moment):
    """The autopilot stops for ever: it neither sends nor obeys, and its motors stand still."""

    kind: Literal["die"]
    """Discriminates the fault."""
