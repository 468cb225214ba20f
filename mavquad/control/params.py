"""Everything of the law that can be configured: the section [law] of a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from mavquad.control.defaults import (
    CHAIN_LENGTHS,
    DEPTHS,
    MISTRUSTING,
    Autopilot,
    Defaults,
    Measurements,
    defaults,
)
from mavquad.control.gains import Polynomial, chain_gains
from mavquad.schema import Section
from mavquad.types import Depth

PolePart = Annotated[float, Field(ge=-100.0, le=100.0)]

_AUTO = (
    BeforeValidator(lambda value: None if value == "auto" else value),
    PlainSerializer(lambda value: "auto" if value is None else value),
)
Bandwidth = Annotated[Annotated[float, Field(gt=0.05, le=50.0)] | None, *_AUTO]
Kappa = Annotated[Annotated[float, Field(gt=0.1, le=500.0)] | None, *_AUTO]
Seconds = Annotated[Annotated[float, Field(ge=0.0, le=0.5)] | None, *_AUTO]
Friction = Annotated[Annotated[float, Field(ge=0.0, le=5.0)] | None, *_AUTO]
Spread = Annotated[Annotated[float, Field(ge=1.0, le=4.0)] | None, *_AUTO]


_OPEN = (None, "auto")


class SaturationParams(Section):
    """[law.saturation]: the levels N of sat_N, one for each input of U, at the depth that has it."""

    thrust_snap_m_s4: float = Field(default=150.0, gt=0.0, le=10000.0)
    """Depth torque: v1, second derivative of the thrust per mass, m/s^4."""
    thrust_jerk_m_s3: float = Field(default=40.0, gt=0.0, le=10000.0)
    """Depth rate: first derivative of the thrust per mass, m/s^3."""
    roll_pitch_rad_s2: float = Field(default=25.0, gt=0.0, le=1000.0)
    """Depth torque: u3 and u4, roll and pitch acceleration, rad/s^2."""
    roll_pitch_rad_s: float = Field(default=3.5, gt=0.0, le=50.0)
    """Depth rate: roll and pitch rate, rad/s."""
    padded_yaw: float = Field(default=60.0, gt=0.0, le=10000.0)
    """Level of the yaw input before its integrators, when there are any, rad/s^n."""


class LimitParams(Section):
    """[law.limits]: what the law may ask for."""

    thrust_min_g: float = Field(default=0.3, gt=0.05, lt=1.0)
    """Least thrust per mass, as a share of the thrust that holds the hover. b4 is singular at zero."""
    thrust_max_g: float = Field(default=2.0, gt=1.0, le=5.0)
    """Greatest thrust per mass, as a share of the thrust that holds the hover; what the wire can say, if that is less."""
    tilt_max_deg: float = Field(default=50.0, gt=0.0, le=75.0)
    """The thrust that is asked for leans no more than this, deg."""
    turn_rate_max_rad_s: float = Field(default=2.0, gt=0.0, le=50.0)
    """Depth torque: roll and pitch rate that is aimed at, rad/s: what is asked to turn faster is late to stop."""
    approach_speed_max_m_s: float = Field(default=2.0, gt=0.0, le=20.0)
    """Speed at which a horizontal error may be reduced, m/s, above the reference's own."""
    climb_speed_max_m_s: float = Field(default=1.5, gt=0.0, le=20.0)
    """Speed at which a vertical error may be reduced, m/s, above the reference's own."""
    yaw_rate_max_deg_s: float = Field(default=60.0, gt=0.0, le=720.0)
    """Rate at which a yaw error may be reduced, deg/s, above the reference's own."""
    yaw_acceleration_max_deg_s2: float = Field(default=170.0, gt=0.0, le=5000.0)
    """Depth torque: limit of u2, the yaw acceleration commanded, deg/s^2: what the rotors' drag can do."""


class LawParams(Section):
    """[law]: the law, its observer, and what it knows of the actuator. "auto" is the depth's own value."""

    form: Literal["output_feedback", "state_feedback"] = "output_feedback"
    """From an extended observer, eqs. (7), (8); or from the autopilot's full estimate, eq. (6), without an observer."""
    depth: Literal["auto", "torque", "rate", "attitude"] = "auto"
    """Which input the law commands: angular accelerations (chains of length 4, the paper), body rates (3) or attitude
    (2), each with thrust. "auto": torque where the firmware takes it (PX4 up to 1.13), else rate."""
    autopilot: Literal["auto", "px4", "arducopter"] = "auto"
    """Whose measured gains, inner loops and friction "auto" stands for below. "auto": the vehicle's that is met; before one
    is met, PX4's."""
    measurements: Literal["auto", "position_yaw", "position_attitude", "full"] = "auto"
    """What the observer is corrected by: position and yaw (the paper); roll and pitch besides; velocity and body rates
    besides. "auto": full, at every depth."""
    decoupling: Literal["auto", "attitude", "constant"] = "auto"
    """The input gain that is inverted: at the measured attitude, or b(0, yaw), as the paper has it. "auto": attitude, but
    constant at depth torque with position and yaw alone, whose noisy thrust demand would shake roll and pitch."""
    polynomial: Polynomial = "binomial"
    """Where the gains gamma come from: "binomial" (Newton), "butterworth", or "poles" (modal)."""
    poles: tuple[tuple[PolePart, PolePart], ...] = ()
    """For polynomial = "poles": a pair [real, imaginary] for each state of the chain, in units of omega0, conjugates both
    listed. Yaw, whose chain is shorter, is binomial then."""
    omega0_rad_s: Bandwidth = None
    """Bandwidth of z, x and y, rad/s."""
    yaw_omega0_rad_s: Bandwidth = None
    """Bandwidth of yaw, rad/s."""
    kappa_rad_s: Kappa = None
    """Observer gain on the position, rad/s: a noise budget. Above omega0."""
    velocity_kappa_rad_s: Kappa = None
    """Observer gain on the velocity, rad/s."""
    attitude_kappa_rad_s: Kappa = None
    """Observer gain on the acceleration that roll, pitch and thrust amount to, rad/s."""
    rates_kappa_rad_s: Kappa = None
    """Observer gain on the jerk that body rates and thrust amount to, and on the yaw rate, rad/s. Depth torque."""
    yaw_kappa_rad_s: Kappa = None
    """Observer gain on yaw, rad/s. Above yaw_omega0."""
    observer_spread: Spread = None
    """The eigenvalues of the paper's A are -spread^k, k symmetrical about 0: 1 puts all in one place."""
    velocity: Literal["auto", "measured", "ignored"] = "auto"
    """Whether the set full has the estimated velocity in it. "auto": it has; but not where that
    velocity, as seen before the law takes over, is not the position's slope (PX4's SIH)."""
    velocity_slopes: Annotated[Annotated[int, Field(ge=0, le=2)] | None, *_AUTO] = None
    """How many derivatives of the offset of the estimated velocity are estimated beside it. "auto": 0; 2, with a kappa of 12,
    makes use of a velocity that is not the position's slope, and pays in gusts."""
    wind_slopes: int = Field(default=1, ge=0, le=2)
    """How many derivatives of the wind's acceleration are estimated beside it, where roll and pitch tell it from the
    thrust's: 0 takes it for constant, and what varies (gusts, drag that is not known) costs accuracy; 2 takes more noise."""
    yaw_padding: int = Field(default=0, ge=0, le=2)
    """Integrators before the yaw input: 0, or as many as make its chain as long as the others', as the paper has it."""
    friction_1_s: Friction = None
    """The paper's a_x = a_y = a_z as far as known, 1/s. 0 leaves it to sigma, as the paper does."""
    angular_friction_1_s: Friction = None
    """The paper's a_psi = a_theta = a_phi likewise, 1/s. Depth torque."""
    inner_loop: Literal["measured", "told"] = "measured"
    """Whether the law, at depths rate and attitude, goes by how late roll and pitch are seen to answer in flight, where that
    is another time than `dead_time_s` + `lag_s` (both "auto"), and by gains that are as much lower: "measured", or "told"."""
    delay_s: Annotated[Annotated[float, Field(ge=0.0, le=0.3)] | None, *_AUTO] = None
    """From the stamp of a measurement until the command that was computed from it arrives at the autopilot, s. "auto": as
    TIMESYNC shows it in the takeoff; 25 ms where it does not."""
    dead_time_s: Seconds = None
    """From there until roll and pitch begin to answer, s."""
    lag_s: Seconds = None
    """First-order lag of that answer, s: the rotors' at depth torque, the autopilot's own loop's at the others."""
    thrust_lag_s: Seconds = None
    """First-order lag of the thrust, s."""
    yaw_dead_time_s: Seconds = None
    """Dead time of the yaw, s."""
    yaw_lag_s: Seconds = None
    """First-order lag of the yaw, s."""
    lag_bridged: float = Field(default=1.0, ge=0.0, le=1.0)
    """Share of the lag that the prediction bridges: the law acts on the state when the command acts, and this later."""
    saturation: SaturationParams = SaturationParams()
    """Levels of the smooth saturation."""
    limits: LimitParams = LimitParams()
    """Limits of thrust, tilt, speed and yaw."""

    @property
    def depths(self) -> tuple[Depth, ...]:
        """The depths that this configuration may fly at."""
        return DEPTHS if self.depth == "auto" else (self.depth,)

    def of(self, autopilot: Autopilot) -> LawParams:
        """For the vehicle that was met."""
        return self if self.autopilot != "auto" else self.model_copy(update={"autopilot": autopilot})

    def told(self, found: Mapping[str, Any]) -> LawParams:
        """With values for keys that are left open here."""
        return self.model_copy(update={key: value for key, value in found.items() if getattr(self, key) in _OPEN})

    def found(self, met: LawParams) -> dict[str, Any]:
        """What another one, made from this for a vehicle that was met, has for keys that are left open here."""
        keys = (key for key in type(self).model_fields if getattr(self, key) in _OPEN)
        return {key: getattr(met, key) for key in keys if getattr(met, key) not in _OPEN}

    def own(self, depth: Depth) -> Defaults:
        """What "auto" stands for at a depth."""
        return defaults(self._autopilot(), depth, self.measured())

    def delay(self) -> float:
        """`delay_s`, "auto" resolved; s. It is the same at every depth."""
        own = self.own(self.depths[-1]).delay_s
        return own if self.delay_s is None else self.delay_s

    def frictions(self) -> tuple[float, float]:
        """`friction_1_s` and `angular_friction_1_s`, "auto" resolved."""
        own = self.own(self.depths[0])
        a = own.friction_1_s if self.friction_1_s is None else self.friction_1_s
        b = own.angular_friction_1_s if self.angular_friction_1_s is None else self.angular_friction_1_s
        return a, b

    def measured(self) -> Measurements:
        """The measurement set, "auto" resolved."""
        return "full" if self.measurements == "auto" else self.measurements

    def mistrusting(self, depth: Depth) -> LawParams:
        """For a vehicle whose estimated velocity misleads; the same where the configuration leaves nothing open."""
        told = self.velocity != "auto" or self.velocity_slopes is not None
        if told or self.measured() != "full":
            return self
        return self.told(MISTRUSTING[depth])

    def _autopilot(self) -> Autopilot:
        return "px4" if self.autopilot == "auto" else self.autopilot

    def constant_gain(self, depth: Depth) -> bool:
        """The decoupling, "auto" resolved."""
        if self.decoupling == "auto":
            return depth == "torque" and self.measured() == "position_yaw" and self.form == "output_feedback"
        return self.decoupling == "constant"

    @model_validator(mode="after")
    def _check(self) -> LawParams:
        for depth in self.depths:
            self._check_observer(depth)
        if self.polynomial == "poles":
            self._check_poles()
        elif self.poles:
            raise ValueError('poles are used with polynomial = "poles" only')
        return self

    def _check_observer(self, depth: Depth) -> None:
        known = self.own(depth)
        omega0 = self.omega0_rad_s or known.omega0_rad_s
        if self.kappa_rad_s is not None and self.kappa_rad_s <= omega0:
            raise ValueError(
                f"kappa_rad_s must be greater than omega0_rad_s ({omega0:g} at depth {depth}): the observer leads the law"
            )
        yaw_omega0 = self.yaw_omega0_rad_s or known.yaw_omega0_rad_s
        if self.yaw_kappa_rad_s is not None and self.yaw_kappa_rad_s <= yaw_omega0:
            raise ValueError(
                f"yaw_kappa_rad_s must be greater than yaw_omega0_rad_s ({yaw_omega0:g} at depth {depth}): "
                "the observer leads the law"
            )

    def _check_poles(self) -> None:
        if self.depth == "auto":
            raise ValueError('poles want a depth of their own: "torque" takes 4, "rate" 3, "attitude" 2')
        if any(real > -0.05 for real, _ in self.poles):
            raise ValueError("poles must have real parts of -0.05 or less")
        chain_gains("poles", CHAIN_LENGTHS[self.depth], 1.0, self.poles)
