"""The controller: observer, law, limits and actuator replica composed, at each of the three depths.

    measurement at t -> predict the chains to t, correct the rows that it measures
    command at t     -> predict to when it will act (t + delay + dead time, and the lag)
                     -> w = ref^(r) - sigma - sum gamma_i (zeta_i - ref^(i-1)) -> U = sat_N(B^-1 w) -> the integrators before
                        thrust and yaw -> remember the w that U really makes, for the observer

Output feedback is Kim, Pyrkin, Borisov, eqs. (7), (8); at depth torque, with measurements position_yaw and constant
decoupling it is the paper's own. State feedback is eq. (6): the chains are the autopilot's own estimate, sigma is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from mavquad.control.estimator import YAW, Estimator, X, Y, Z
from mavquad.control.euler import body_acceleration, body_rates, euler_rates, trig
from mavquad.control.integrators import Integrator, advanced, allowed_drive, driven
from mavquad.control.inversion import Gain, apply, solve
from mavquad.control.limits import demand
from mavquad.control.params import LawParams
from mavquad.control.reference import shifted
from mavquad.control.saturation import is_saturated, smooth_saturation
from mavquad.control.tuning import Tuning, tuning
from mavquad.frames import unwrap_near, wrap_pi
from mavquad.types import (
    Attitude,
    AttitudeCommand,
    Depth,
    LawCommand,
    Position,
    RateCommand,
    ReferencePoint,
    TorqueCommand,
    Vec3,
    Vec4,
)

HOLD_MAX_S = 0.1
"""The vehicle holds a thrust, it does not go on integrating: a longer gap counts as this much for the integrators."""

YAW_LEAD_MAX_RAD = 0.7
"""Depth attitude: how far the angle sent may be ahead of the vehicle's."""
_COSINE_MIN = 0.2
Values = list[float]
Channel = tuple[float, ...]
References = tuple[Channel, Channel, Channel, Channel]


class Trace(NamedTuple):
    """The law's evidence for one step. 4-vectors are in the order z, yaw, x, y, but for `inputs`."""

    stamp_us: int
    zeta_hat: tuple[tuple[float, ...], ...]
    """The estimate at the latest measurement: (zeta_1 .. zeta_r) of each channel."""
    sigma: Vec4
    wind: Vec3
    """The acceleration of x, y, z that is not the thrust's, as far as it is told apart, m/s^2."""
    measured: Vec4
    """The latest outputs; yaw continuous, beside the reference."""
    reference: Vec4
    """At the moment of each."""
    demanded: Vec4
    """w: the highest derivatives asked for."""
    inputs: Vec4
    """U after saturation and limits: thrust, yaw, roll, pitch; their units are the depth's."""
    limits_active: tuple[str, ...]


class Controller:
    """The law with its memory, from one take-over on.

    Attributes:
        command_given: the latest.
        trace: evidence of the latest step, None before the first.
    """

    def __init__(
        self, params: LawParams, depth: Depth, position: Position, attitude: Attitude, specific_thrust_m_s2: float
    ) -> None:
        """Take over without a bump.

        Args:
            params: the law's configuration.
            depth: what it commands.
            position: the latest.
            attitude: the latest.
            specific_thrust_m_s2: the thrust per mass that holds the hover now.
        """
        self._tune = tune = tuning(params, depth)
        self._estimator = Estimator(tune, position, attitude, specific_thrust_m_s2)
        self._length = tune.horizontal.spec.length
        self._ratios = _ratios(tune)
        self._thrust = Integrator(tune.vertical.integrators, specific_thrust_m_s2)
        self._yaw_input = Integrator(tune.yaw.integrators, 0.0)
        self._yaw_sent_rad = attitude.yaw_rad
        self._arrive_us = self._estimator.commands[-1][0]
        self.command_given = self._still(attitude, specific_thrust_m_s2)
        self.trace: Trace | None = None

    @property
    def estimator(self) -> Estimator:
        """The observer."""
        return self._estimator

    @property
    def arrives_us(self) -> int:
        """When the latest command acts."""
        return self._arrive_us

    def retune(self, params: LawParams) -> None:
        """Other gains, lags and dead times from now on, of the same form and measurements; nothing else changes."""
        self._tune = tuning(params, self._tune.depth)
        self._ratios = _ratios(self._tune)
        self._estimator.retune(self._tune)

    def observe_attitude(self, attitude: Attitude) -> bool:
        """Take in an attitude; False when it brings nothing new."""
        return self._estimator.observe_attitude(attitude)

    def observe_position(self, position: Position) -> bool:
        """Take in a position; False when it brings nothing new."""
        return self._estimator.observe_position(position)

    def acted(self, stamp_us: int, command: RateCommand | AttitudeCommand) -> None:
        """From this moment on the vehicle follows a command of the autopilot's own; the observer is fed that.

        Args:
            stamp_us: of the vehicle's clock.
            command: of the depth that the law commands.
        """
        thrust_m_s2 = command.specific_thrust_m_s2
        if isinstance(command, AttitudeCommand):
            gain = Gain(self._length, self._tune.constant_gain, trig(0.0, 0.0, command.yaw_rad))
            inputs, turning = (thrust_m_s2, command.roll_rad, command.pitch_rad), 0.0
        else:
            p, q, turning = command.rates_flu_rad_s
            gain = Gain(self._length, self._tune.constant_gain, self._estimator.angles, thrust_m_s2)
            inputs = (0.0, p, q)
        wz, wx, wy = apply(gain, inputs)
        self._estimator.sent(stamp_us, (wz, turning, wx, wy), thrust_m_s2)

    def begin(self, attitude: Attitude, specific_thrust_m_s2: float) -> None:
        """The integrators before thrust and yaw start afresh: what they held did not act."""
        tune = self._tune
        self._thrust = Integrator(tune.vertical.integrators, specific_thrust_m_s2)
        self._yaw_input = Integrator(tune.yaw.integrators, 0.0)
        self._yaw_sent_rad = attitude.yaw_rad
        self._arrive_us = max(self._estimator.stamp_us, self._estimator.yaw_us) + tune.delay_us

    def command(
        self, reference: Callable[[int], ReferencePoint], authority: float = 1.0, acts: bool = True
    ) -> LawCommand:
        """One command from all that was measured so far.

        Args:
            reference: the reference at a moment of the vehicle's clock, us.
            authority: share of the limits of thrust and tilt that may be used; less than 1 flies on prediction.
            acts: whether the vehicle will follow it; else the observer does not hear of it.
        """
        tune, limits, estimator = self._tune, self._tune.limits, self._estimator
        if authority < 1.0:
            limits = limits.shrunk(authority)
        stamp_us = max(estimator.stamp_us, estimator.yaw_us)
        arrive_us = stamp_us + tune.delay_us
        point = reference(stamp_us)
        chains = estimator.ahead(arrive_us)
        references = self._references(point, arrive_us - stamp_us, chains)
        known = self._friction(references, chains)
        winds = estimator.wind()
        if self._length == 2:
            winds = (winds[0] + known[0], winds[1] + known[1], winds[2] + known[2])
        asked = demand(self._ratios, references, chains, winds, limits)
        dt_s = max(0.0, min((arrive_us - self._arrive_us) * 1e-6, HOLD_MAX_S))
        self._thrust = advanced(self._thrust, dt_s, limits.thrust_low_m_s2, limits.thrust_high_m_s2)
        self._turn_on(dt_s)
        self._yaw_input = advanced(self._yaw_input, dt_s, -tune.yaw_input_max, tune.yaw_input_max)
        self._arrive_us = max(arrive_us, self._arrive_us)
        gain = self._gain(known)
        w, inputs, active = self._realised(gain, asked.w, self._friction_of_yaw(references, chains))
        self.command_given = self._on_the_wire(gain, inputs)
        if acts:
            estimator.sent(arrive_us, w, self._thrust.value)
        self.trace = self._traced(stamp_us, point, winds, asked.w, inputs, asked.active + active)
        return self.command_given

    # ------------------------------------------------------------------ from the demand to the inputs

    def _references(self, point: ReferencePoint, until_us: int, chains: tuple[Values, ...]) -> References:
        """The reference carried on to the moments that the law acts for; yaw by the turn that is nearest."""
        tune = self._tune
        place_s = (until_us + tune.horizontal.ahead_us) * 1e-6
        yaw = shifted(point.yaw_rad, (until_us + tune.yaw.ahead_us) * 1e-6)
        return (
            shifted(point.z_m, (until_us + tune.vertical.ahead_us) * 1e-6),
            (unwrap_near(yaw[0], chains[YAW][0]), *yaw[1:]),
            shifted(point.x_m, place_s),
            shifted(point.y_m, place_s),
        )

    def _gain(self, known: Vec3) -> Gain:
        """B and what is known without inputs, at the attitude that the measured rates lead to until the command acts."""
        estimator, tune = self._estimator, self._tune
        attitude = estimator.attitude
        rates = attitude.rates_flu_rad_s
        t = estimator.angles
        if self._length == 2:
            # The thrust leans as seen from the yaw that goes with it, whatever the yaw is by then.
            t = trig(0.0, 0.0, self._yaw_sent_rad)
        elif not tune.constant_gain:
            ahead_s = (tune.delay_us + tune.horizontal.ahead_us) * 1e-6
            roll_d, pitch_d, yaw_d = euler_rates(t, rates)
            t = trig(
                attitude.roll_rad + ahead_s * roll_d,
                attitude.pitch_rad + ahead_s * pitch_d,
                attitude.yaw_rad + ahead_s * yaw_d,
            )
        return Gain(self._length, tune.constant_gain, t, self._thrust.value, self._thrust.rate, rates, known)

    def _turn_on(self, dt_s: float) -> None:
        """Depth attitude: the yaw rate in force is integrated to the angle, which does not run away from a slow vehicle."""
        yaw_rad = self._estimator.attitude.yaw_rad
        lead_rad = wrap_pi(self._yaw_sent_rad + dt_s * self._yaw_input.value - yaw_rad)
        self._yaw_sent_rad = wrap_pi(yaw_rad + min(max(lead_rad, -YAW_LEAD_MAX_RAD), YAW_LEAD_MAX_RAD))

    def _friction(self, references: References, chains: tuple[Values, ...]) -> Vec3:
        """What friction adds to the highest derivative of z, x, y.

        With x_dd = T theta - a x_d, the derivative of order r has -a times that of order r - 1; at depth torque, where
        theta_dd = u - b theta_d, it is -(a + b) x_ddd - a b x_dd. Output feedback takes the motion of the reference for it,
        so that nothing is fed back; state feedback takes the measured one, as q4 does.
        """
        a, b = self._tune.friction_1_s, self._tune.angular_friction_1_s
        last = self._length - 1
        z, _, x, y = chains if self._tune.state_feedback else references
        if self._length < 4:
            return (-a * z[last], -a * x[last], -a * y[last])
        return (-a * z[3], -(a + b) * x[3] - a * b * x[2], -(a + b) * y[3] - a * b * y[2])

    def _friction_of_yaw(self, references: References, chains: tuple[Values, ...]) -> float:
        """The same of yaw, -b times the derivative before its highest; a rate loop takes care of its own."""
        if self._tune.depth != "torque":
            return 0.0
        motion = chains[YAW] if self._tune.state_feedback else references[YAW]
        return -self._tune.angular_friction_1_s * motion[self._tune.yaw.spec.length - 1]

    def _realised(self, gain: Gain, asked: Vec4, slowed: float) -> tuple[Vec4, Vec4, tuple[str, ...]]:
        """U = sat_N(B^-1 (w - q)), thrust and yaw kept to what their integrators may take, and w = q + B U again.

        `slowed` is the q of yaw.
        """
        tune = self._tune
        wanted_thrust, wanted_roll, wanted_pitch = solve(gain, (asked[Z], asked[X], asked[Y]))
        thrust_level, yaw_level, level = tune.levels
        wanted_yaw = asked[YAW] - slowed
        thrust = allowed_drive(
            self._thrust,
            smooth_saturation(wanted_thrust, thrust_level),
            tune.limits.thrust_low_m_s2,
            tune.limits.thrust_high_m_s2,
        )
        yaw = allowed_drive(
            self._yaw_input, smooth_saturation(wanted_yaw, yaw_level), -tune.yaw_input_max, tune.yaw_input_max
        )
        roll, pitch = smooth_saturation(wanted_roll, level), smooth_saturation(wanted_pitch, level)
        self._thrust, self._yaw_input = driven(self._thrust, thrust), driven(self._yaw_input, yaw)
        active = []
        if thrust != wanted_thrust:
            active.append("thrust")
        if yaw != wanted_yaw:
            active.append("yaw_input")
        if is_saturated(wanted_roll, level):
            active.append("saturation_roll")
        if is_saturated(wanted_pitch, level):
            active.append("saturation_pitch")
        wz, wx, wy = apply(gain, (thrust, roll, pitch))
        return (wz, yaw + slowed, wx, wy), (thrust, yaw, roll, pitch), tuple(active)

    def _on_the_wire(self, gain: Gain, inputs: Vec4) -> LawCommand:
        """The inputs as the vehicle takes them: of the body, not of the Euler angles."""
        _, _, roll, pitch = inputs
        thrust, yaw = self._thrust.value, self._yaw_input.value
        t = gain.t
        if self._length == 2:
            return AttitudeCommand(roll, pitch, self._yaw_sent_rad, thrust)
        if gain.constant:
            rates = euler_rates(t, gain.rates_flu_rad_s)
            if self._length == 3:
                return RateCommand(body_rates(t, (roll, pitch, yaw)), thrust)
            return TorqueCommand(body_acceleration(t, rates, (roll, pitch, yaw)), thrust)
        about_z = (yaw * t.c_pitch - pitch * t.s_roll) / max(t.c_roll, _COSINE_MIN)
        if self._length == 3:
            return RateCommand((roll, pitch, about_z), thrust)
        return TorqueCommand((roll, pitch, about_z), thrust)

    def _still(self, attitude: Attitude, thrust_m_s2: float) -> LawCommand:
        if self._length == 2:
            return AttitudeCommand(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad, thrust_m_s2)
        if self._length == 3:
            return RateCommand((0.0, 0.0, 0.0), thrust_m_s2)
        return TorqueCommand((0.0, 0.0, 0.0), thrust_m_s2)

    def _traced(
        self,
        stamp_us: int,
        point: ReferencePoint,
        winds: Vec3,
        demanded: Vec4,
        inputs: Vec4,
        active: tuple[str, ...],
    ) -> Trace:
        estimator = self._estimator
        px, py, pz = estimator.position.position_nwu_m
        # The latest position may be older than the attitude that this step is of.
        age_s = (stamp_us - estimator.position.stamp_us) * 1e-6
        rx, ry, rz = _before(point.x_m, age_s), _before(point.y_m, age_s), _before(point.z_m, age_s)
        z, yaw, x, y = estimator.values()
        yaw_ref = point.yaw_rad[0]
        return Trace(
            stamp_us,
            (tuple(z[:-1]), tuple(yaw[:-1]), tuple(x[:-1]), tuple(y[:-1])),
            (z[-1], yaw[-1], x[-1], y[-1]),
            (winds[1], winds[2], winds[0]),
            (pz, unwrap_near(estimator.attitude.yaw_rad, yaw_ref), px, py),
            (rz, yaw_ref, rx, ry),
            demanded,
            inputs,
            active,
        )


def _ratios(tune: Tuning) -> tuple[Channel, Channel, Channel, Channel]:
    return (tune.vertical.ratios, tune.yaw.ratios, tune.horizontal.ratios, tune.horizontal.ratios)


def _before(derivatives: tuple[float, ...], age_s: float) -> float:
    """A reference a little earlier."""
    return derivatives[0] - age_s * (derivatives[1] - 0.5 * age_s * derivatives[2])
