"""The simulated vehicle's keys; the defaults are those of PX4's SIH quadcopter."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mavquad.schema import Section
from sitl_mock.config.numbers import NotNegative, Positive
from sitl_mock.plant import TICK_US, VehicleParams

_TICK_S = TICK_US / 1e6
_LEAST_THRUST_TO_WEIGHT, _MOST_THRUST_TO_WEIGHT = 1.2, 20.0


class VehicleConfig(Section):
    """The simulated vehicle; the defaults are those of PX4's SIH quadcopter."""

    model: Literal["rigid_body", "paper"] = "rigid_body"
    """Equations of motion: the rigid body with full kinematics, or the paper's simplified model."""
    mass_kg: Positive = 1.0
    """Mass in kg."""
    inertia_kg_m2: tuple[Positive, Positive, Positive] = (0.025, 0.025, 0.030)
    """Moments of inertia about roll, pitch and yaw axis in kg m^2."""
    motor_thrust_max_n: Positive = 5.0
    """Thrust of one motor at full command in N."""
    motor_torque_max_nm: NotNegative = 0.1
    """Reaction torque of one motor at full command in Nm."""
    arm_m: Positive = 0.2
    """Lever of each motor about the roll and the pitch axis in m."""
    linear_drag_n_s_m: NotNegative = 1.0
    """Drag force per airspeed in N/(m/s)."""
    angular_drag_nm_s_rad: NotNegative = 0.025
    """Drag torque per body rate in Nm/(rad/s)."""
    motor_time_constant_s: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Time constant of a motor's first-order lag in s; 0 for none."""
    heading_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    """Heading on the ground at the start, in degrees from north."""

    @model_validator(mode="after")
    def _can_be_flown_in_steps(self) -> Self:
        step = f"{_TICK_S * 1e3:.0f} ms, the step of the simulation"
        if self.linear_drag_n_s_m * _TICK_S >= self.mass_kg:
            raise ValueError(f"mass_kg / linear_drag_n_s_m must be more than {step}")
        if self.angular_drag_nm_s_rad * _TICK_S >= min(self.inertia_kg_m2):
            raise ValueError(f"each of inertia_kg_m2 / angular_drag_nm_s_rad must be more than {step}")
        ratio = 1 / self.params().hover_thrust_norm
        if not _LEAST_THRUST_TO_WEIGHT <= ratio <= _MOST_THRUST_TO_WEIGHT:
            raise ValueError(
                f"4 motor_thrust_max_n / (mass_kg g), thrust to weight, must be {_LEAST_THRUST_TO_WEIGHT:g} to"
                f" {_MOST_THRUST_TO_WEIGHT:g} (it is {ratio:.3g})"
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
        )
