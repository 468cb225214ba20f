"""Everything of the law that can be configured: the section [law] of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from mavquad.control.gains import Polynomial, chain_gains
from mavquad.schema import Section

CHAIN_LENGTH = 4
"""r at depth "torque": from angular acceleration to position."""

Modulus = Annotated[float, Field(gt=0.0, le=10.0)]
PolePart = Annotated[float, Field(ge=-100.0, le=100.0)]


class SaturationParams(Section):
    """[law.saturation]: the levels N of sat_N, one for each input of U = (v1, v2, u3, u4)."""

    thrust_snap_m_s4: float = Field(default=150.0, gt=0.0, le=10000.0)
    """v1, second derivative of the thrust per mass, m/s^4."""
    yaw_snap_rad_s4: float = Field(default=60.0, gt=0.0, le=10000.0)
    """v2, second derivative of the yaw acceleration, rad/s^4."""
    roll_rad_s2: float = Field(default=25.0, gt=0.0, le=1000.0)
    """u3, roll acceleration, rad/s^2."""
    pitch_rad_s2: float = Field(default=25.0, gt=0.0, le=1000.0)
    """u4, pitch acceleration, rad/s^2."""


class LimitParams(Section):
    """[law.limits]: what the law may ask for."""

    thrust_min_g: float = Field(default=0.4, gt=0.05, lt=1.0)
    """Least thrust per mass, as a share of the thrust that holds the hover. b4 is singular at zero."""
    thrust_max_g: float = Field(default=1.6, gt=1.0, le=5.0)
    """Greatest thrust per mass, as a share of the thrust that holds the hover."""
    tilt_max_deg: float = Field(default=30.0, gt=0.0, le=60.0)
    """The horizontal acceleration demanded is kept within g tan(tilt), deg."""
    approach_speed_max_m_s: float = Field(default=2.0, gt=0.0, le=20.0)
    """Speed at which a horizontal error may be reduced, m/s, above the reference's own."""
    climb_speed_max_m_s: float = Field(default=1.5, gt=0.0, le=20.0)
    """Speed at which a vertical error may be reduced, m/s, above the reference's own."""
    yaw_rate_max_deg_s: float = Field(default=60.0, gt=0.0, le=720.0)
    """Rate at which a yaw error may be reduced, deg/s, above the reference's own."""
    yaw_acceleration_max_deg_s2: float = Field(default=170.0, gt=0.0, le=5000.0)
    """Limit of u2, the yaw acceleration commanded, deg/s^2: what the rotors' drag can do."""


class LawParams(Section):
    """[law]: the law, its observer, and what it knows of the actuator."""

    form: Literal["output_feedback", "state_feedback"] = "output_feedback"
    """Position and yaw only, eqs. (7), (8); or the full state, eq. (6), without an observer."""
    depth: Literal["torque"] = "torque"
    """Which input the law commands. "torque": angular accelerations and thrust, chains of length 4."""
    polynomial: Polynomial = "binomial"
    """Where the gains gamma come from: "binomial" (Newton), "butterworth", or "poles" (modal)."""
    poles: tuple[tuple[PolePart, PolePart], ...] = ()
    """For polynomial = "poles": four pairs [real, imaginary] in units of omega0, conjugates both listed."""
    omega0_rad_s: float = Field(default=2.7, gt=0.05, le=20.0)
    """Bandwidth of z, x and y, rad/s."""
    yaw_omega0_rad_s: float = Field(default=2.2, gt=0.05, le=20.0)
    """Bandwidth of yaw, rad/s."""
    kappa_rad_s: float = Field(default=7.5, gt=0.1, le=200.0)
    """Observer gain of z, x and y, rad/s: a noise budget. Above omega0."""
    yaw_kappa_rad_s: float = Field(default=7.5, gt=0.1, le=200.0)
    """Observer gain of yaw, rad/s. Above yaw_omega0."""
    observer_moduli: tuple[Modulus, Modulus, Modulus, Modulus, Modulus] = (0.25, 0.5, 1.0, 2.0, 4.0)
    """The eigenvalues of the paper's matrix A are minus these; the observer's poles, minus kappa times these."""
    friction_1_s: float = Field(default=1.0, ge=0.0, le=5.0)
    """The paper's a_x = a_y = a_z as far as known, 1/s; here PX4 SIH's. Used along the reference only; 0 leaves it to
    sigma, as the paper does."""
    angular_friction_1_s: float = Field(default=0.9, ge=0.0, le=5.0)
    """The paper's a_psi = a_theta = a_phi likewise, 1/s."""
    delay_s: float = Field(default=0.025, ge=0.0, le=0.3)
    """From the stamp of a measurement until the command that was computed from it acts, s."""
    lag_s: float = Field(default=0.05, ge=0.0, le=0.5)
    """First-order lag of the rotors, s."""
    lag_bridged: float = Field(default=1.0, ge=0.0, le=1.0)
    """Share of the lag that the prediction bridges: the law acts on the state at delay + lag_bridged * lag ahead."""
    saturation: SaturationParams = SaturationParams()
    """Levels of the smooth saturation."""
    limits: LimitParams = LimitParams()
    """Limits of thrust, tilt, speed and yaw."""

    @model_validator(mode="after")
    def _check(self) -> LawParams:
        if self.kappa_rad_s <= self.omega0_rad_s:
            raise ValueError("kappa_rad_s must be greater than omega0_rad_s: the observer leads the law")
        if self.yaw_kappa_rad_s <= self.yaw_omega0_rad_s:
            raise ValueError("yaw_kappa_rad_s must be greater than yaw_omega0_rad_s: the observer leads the law")
        if self.polynomial == "poles":
            self._check_poles()
        return self

    def _check_poles(self) -> None:
        if any(real > -0.05 for real, _ in self.poles):
            raise ValueError("poles must have real parts of -0.05 or less")
        chain_gains("poles", CHAIN_LENGTH, 1.0, self.poles)
