"""The simulated vehicle's keys, and the files that they come from; the defaults are those of PX4's SIH quadcopter."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mavquad.errors import ConfigError
from mavquad.schema import Section, parse_section, read_toml
from sitl_mock.battery import BatteryParams
from sitl_mock.config.numbers import NotNegative, Positive
from sitl_mock.plant import TICK_S, Frame, VehicleParams

_LEAST_THRUST_TO_WEIGHT, _MOST_THRUST_TO_WEIGHT = 1.2, 20.0
_LEAST_VOLTAGE = 0.5
"""Share of a full battery's voltage that must be there at full thrust when it is empty."""
_VEHICLES = Path(__file__).resolve().parent.parent / "vehicles"
_Share = Annotated[float, Field(ge=0, le=1)]


class VehicleConfig(Section):
    """The simulated vehicle; the defaults are those of PX4's SIH quadcopter."""

    model: Literal["rigid_body", "paper"] = "rigid_body"
    """Equations of motion: the rigid body with full kinematics, or the paper's simplified model."""
    frame: Frame = "x"
    """Where the motors are. "x": 1 front right, 2 rear left, 3 front left, 4 rear right; "plus": 1 right, 2 left,
    3 front, 4 rear. 1 and 2 turn the nose right."""
    mass_kg: Positive = 1.0
    """Mass in kg, with the payload."""
    payload_kg: NotNegative = 0.0
    """The part of the mass that can be dropped, in kg; it hangs at the centre of gravity."""
    inertia_kg_m2: tuple[Positive, Positive, Positive] = (0.025, 0.025, 0.030)
    """Moments of inertia about roll, pitch and yaw axis in kg m^2."""
    motor_thrust_max_n: Positive = 5.0
    """Thrust of one motor at full command in N."""
    motor_torque_max_nm: NotNegative = 0.1
    """Reaction torque of one motor at full command in Nm; it goes with the thrust."""
    thrust_curve: _Share = 0.0
    """Share e of the square in the thrust at the command u, motor_thrust_max_n ((1 - e) u + e u^2); 0: linear."""
    rotor_strengths: tuple[_Share, _Share, _Share, _Share] = (1.0, 1.0, 1.0, 1.0)
    """Share of its thrust and torque that each rotor gives."""
    arm_m: Positive = 0.2
    """Lever of each motor about the roll and the pitch axis in m ("plus": about the one that it acts on)."""
    linear_drag_n_s_m: NotNegative = 1.0
    """Drag force per airspeed in N/(m/s)."""
    quadratic_drag_n_s2_m2: NotNegative = 0.0
    """Drag force per square of the airspeed in N/(m/s)^2."""
    rotor_drag_n_s_m: NotNegative = 0.0
    """Drag force of the rotors per airspeed at hover thrust in N/(m/s); it goes with the square root of the thrust."""
    angular_drag_nm_s_rad: NotNegative = 0.025
    """Drag torque per body rate in Nm/(rad/s)."""
    motor_time_constant_s: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Time constant of a motor's first-order lag in s; 0 for none."""
    heading_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    """Heading on the ground at the start, in degrees from north."""
    battery_full_v: Positive = 16.2
    """Voltage of a full battery without load in V; the thrusts above are those at this voltage, and go with its square."""
    battery_empty_v: Positive = 14.0
    """Voltage of an empty battery without load in V; in between it goes with the charge."""
    battery_resistance_ohm: NotNegative = 0.0
    """Resistance of the battery in ohm: the voltage sags by this times the current."""
    battery_capacity_ah: NotNegative = 0.0
    """Capacity of the battery in Ah; 0: it never empties."""
    hover_current_a: NotNegative = 0.0
    """Current of all motors at hover thrust in A; it goes with the power 1.5 of the thrusts. 0: no load at all."""

    @model_validator(mode="after")
    def _can_be_flown_in_steps(self) -> Self:
        step = f"{TICK_S * 1e3:.0f} ms, the step of the simulation"
        if self.linear_drag_n_s_m * TICK_S >= self.mass_kg:
            raise ValueError(f"mass_kg / linear_drag_n_s_m must be more than {step}")
        if self.angular_drag_nm_s_rad * TICK_S >= min(self.inertia_kg_m2):
            raise ValueError(f"each of inertia_kg_m2 / angular_drag_nm_s_rad must be more than {step}")
        ratio = self.params().thrust_to_weight
        if not _LEAST_THRUST_TO_WEIGHT <= ratio <= _MOST_THRUST_TO_WEIGHT:
            raise ValueError(
                f"4 motor_thrust_max_n / (mass_kg g), thrust to weight, must be {_LEAST_THRUST_TO_WEIGHT:g} to"
                f" {_MOST_THRUST_TO_WEIGHT:g} (it is {ratio:.3g})"
            )
        return self

    @model_validator(mode="after")
    def _payload_is_part_of_the_mass(self) -> Self:
        if self.payload_kg >= self.mass_kg:
            raise ValueError("payload_kg must be less than mass_kg, of which it is a part")
        light = 4 * self.motor_thrust_max_n / ((self.mass_kg - self.payload_kg) * self.params().gravity_m_s2)
        if light > _MOST_THRUST_TO_WEIGHT:
            raise ValueError(
                f"without payload_kg thrust to weight must be {_MOST_THRUST_TO_WEIGHT:g} at most (it is {light:.3g})"
            )
        return self

    @model_validator(mode="after")
    def _paper_has_no_more(self) -> Self:
        beyond = {
            "frame": self.frame != "x",
            "thrust_curve": self.thrust_curve > 0,
            "quadratic_drag_n_s2_m2": self.quadratic_drag_n_s2_m2 > 0,
            "rotor_drag_n_s_m": self.rotor_drag_n_s_m > 0,
        }
        for key, is_set in beyond.items():
            if self.model == "paper" and is_set:
                raise ValueError(f'{key} is not in the equations of model = "paper"; leave it out')
        return self

    @model_validator(mode="after")
    def _battery_can_feed_the_motors(self) -> Self:
        if self.battery_empty_v > self.battery_full_v:
            raise ValueError("battery_empty_v must be battery_full_v at most")
        if self.battery_capacity_ah > 0 and self.hover_current_a == 0:
            raise ValueError("battery_capacity_ah needs hover_current_a: without a current no battery empties")
        most_a = self.hover_current_a * self.params().thrust_to_weight ** 1.5
        if self.battery_empty_v - self.battery_resistance_ohm * most_a < _LEAST_VOLTAGE * self.battery_full_v:
            raise ValueError(
                f"battery_resistance_ohm takes too much: at full thrust ({most_a:.3g} A) an empty battery must still"
                f" give {_LEAST_VOLTAGE:g} battery_full_v"
            )
        return self

    def params(self) -> VehicleParams:
        """The constants that the equations of motion take."""
        return VehicleParams(
            mass_kg=self.mass_kg,
            inertia_kg_m2=self.inertia_kg_m2,
            motor_thrust_max_n=self.motor_thrust_max_n,
            motor_torque_max_nm=self.motor_torque_max_nm,
            arm_m=self.arm_m,
            linear_drag_n_s_m=self.linear_drag_n_s_m,
            angular_drag_nm_s_rad=self.angular_drag_nm_s_rad,
            motor_time_constant_s=self.motor_time_constant_s,
            frame=self.frame,
            thrust_curve=self.thrust_curve,
            quadratic_drag_n_s2_m2=self.quadratic_drag_n_s2_m2,
            rotor_drag_n_s_m=self.rotor_drag_n_s_m,
            payload_kg=self.payload_kg,
            rotor_strengths=self.rotor_strengths,
        )

    def battery(self) -> BatteryParams:
        """The constants of its battery."""
        return BatteryParams(
            self.battery_full_v,
            self.battery_empty_v,
            self.battery_resistance_ohm,
            self.battery_capacity_ah,
            self.hover_current_a,
        )


def vehicle_names() -> list[str]:
    """The vehicles that come with the mock."""
    return sorted(path.stem for path in _VEHICLES.glob("*.toml"))


def load_vehicle(name_or_path: str) -> VehicleConfig:
    """A vehicle by its name, or from a TOML file with the keys of `VehicleConfig`; keys left out are SIH's.

    Raises:
        ConfigError: there is no such vehicle, or the file is wrong: with the file, the key and what is allowed.
    """
    path = Path(name_or_path)
    if name_or_path in vehicle_names():
        path = _VEHICLES / f"{name_or_path}.toml"
    elif not os.path.lexists(path):
        names = ", ".join(vehicle_names())
        raise ConfigError(str(path), "", f"no such file, and no vehicle of that name (there are: {names})")
    return parse_section(VehicleConfig, read_toml(path), str(path))
