"""What happens to the vehicle, its surroundings and its software when a fault's moment has come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from sitl_mock.config.faults import ClockJump
from sitl_mock.config.vehicle_faults import (
    EstimatorReset,
    GeofenceBreach,
    LowBattery,
    ModeChange,
    PayloadDrop,
    WeakRotor,
    WindStep,
)
from sitl_mock.personality import Personality
from sitl_mock.spoiler import Spoiler
from sitl_mock.world import World

Mishap = Callable[[Any, World, Personality, Spoiler], None]


def _mode_change(fault: ModeChange, world: World, personality: Personality, spoiler: Spoiler) -> None:
    personality.pilot_selects(fault.mode)


def _geofence_breach(fault: GeofenceBreach, world: World, personality: Personality, spoiler: Spoiler) -> None:
    personality.breach_geofence()


def _estimator_reset(fault: EstimatorReset, world: World, personality: Personality, spoiler: Spoiler) -> None:
    world.jump_position(fault.offset_ned_m)


def _low_battery(fault: LowBattery, world: World, personality: Personality, spoiler: Spoiler) -> None:
    world.drain_battery(fault.remaining)


def _payload_drop(fault: PayloadDrop, world: World, personality: Personality, spoiler: Spoiler) -> None:
    world.drop_payload()


def _weak_rotor(fault: WeakRotor, world: World, personality: Personality, spoiler: Spoiler) -> None:
    world.weaken_rotor(fault.rotor, fault.share)


def _wind_step(fault: WindStep, world: World, personality: Personality, spoiler: Spoiler) -> None:
    world.change_wind(fault.change_ned_m_s)


def _clock_jump(fault: ClockJump, world: World, personality: Personality, spoiler: Spoiler) -> None:
    spoiler.jump_us += round(fault.jump_s * 1e6)


MISHAPS: Mapping[type, Mishap] = {
    ModeChange: _mode_change,
    GeofenceBreach: _geofence_breach,
    EstimatorReset: _estimator_reset,
    LowBattery: _low_battery,
    PayloadDrop: _payload_drop,
    WeakRotor: _weak_rotor,
    WindStep: _wind_step,
    ClockJump: _clock_jump,
}
