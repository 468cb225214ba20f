"""The four chains kept at the moment of the latest measurement, whichever stream it came by.

z, x and y share one moment, yaw has its own. Every measurement predicts the chains to its stamp and corrects the rows that
it measures:

    position     zeta_1, and in the set "full" zeta_2 by the velocity
    attitude     yaw; zeta_3 = T r3 - g e3 - a v; in the set "full" zeta_4 = R (T q, -T p, T_d) - a zeta_3 and the yaw rate;
                 as far as the chain has these states

T is the thrust commanded, behind a replica of the rotors' lag; a is the friction as far as known.
"""

from __future__ import annotations

from mavquad.control.actuation import Command, appended
from mavquad.control.euler import euler_rates, trig
from mavquad.control.inversion import to_world
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.observer import Chain, ChainSpec, Together, usable
from mavquad.control.thrust import ThrustReplica
from mavquad.control.tuning import ACCELERATION, JERK, VELOCITY, Tuning
from mavquad.frames import unwrap_near
from mavquad.types import Attitude, Position, Vec3, Vec4

Z, YAW, X, Y = range(4)
"""Places of the outputs in every 4-vector of the law."""

_XYZ = (X, Y, Z)


class Estimator:
    """Observer of the four channels.

    Attributes:
        chains: z, yaw, x, y.
        attitude: the latest.
        position: the latest.
        angles: its sines and cosines.
        thrust: replica of the thrust that acts.
        stamp_us: moment of z, x and y.
        yaw_us: moment of yaw.
        stale: measurements refused: older than the last of their kind, or too old to be of use.
    """

    def __init__(self, tune: Tuning, position: Position, attitude: Attitude, thrust_m_s2: float) -> None:
        self._tune = tune
        self.position = position
        self.attitude = attitude
        self.angles = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
        self.stamp_us = max(position.stamp_us, attitude.stamp_us)
        self.yaw_us = attitude.stamp_us
        self.thrust = ThrustReplica(tune.vertical.spec.lag_s, thrust_m_s2, self.stamp_us)
        self.stale = 0
        self._velocity, self._acceleration, self._jerk = map(tune.horizontal.row, (VELOCITY, ACCELERATION, JERK))
        self._yaw_rate = tune.yaw.row(VELOCITY)
        self._start_us = min(position.stamp_us, attitude.stamp_us)
        push = self.push()
        held = push if tune.horizontal.spec.length == 2 else (0.0, 0.0, 0.0)
        self.commands: tuple[Command, ...] = ((self._start_us, (held[2], 0.0, held[0], held[1])),)
        self.chains = self._begun(push, held)
        z, yaw, x, y = self.chains
        self._place, self._turn = Together(x, y, z), Together(yaw)
        # x, y and z go through the same intervals where their actuators are alike.
        self._alike = _actuator(z.spec) == _actuator(x.spec)
        self._oldest_us = _oldest_us(tune)
        if tune.state_feedback:
            self._copy_state()

    def retune(self, tune: Tuning) -> None:
        """Other gains, lags and dead times from now on, of the same measurements; the estimate stays."""
        self._tune = tune
        for chain, kind in zip(self.chains, (tune.vertical, tune.yaw, tune.horizontal, tune.horizontal), strict=True):
            chain.retune(kind.spec)
        self._place.retune()
        self._turn.retune()
        z, _, x, _ = self.chains
        self._alike = _actuator(z.spec) == _actuator(x.spec)
        self._oldest_us = _oldest_us(tune)

    def _begun(self, push: Vec3, held: Vec3) -> tuple[Chain, Chain, Chain, Chain]:
        """At rest but for velocity and yaw rate; what the thrust does not hold is the wind's."""
        tune = self._tune
        place = [
            self._rest(tune.vertical.spec if axis == 2 else tune.horizontal.spec, axis, push[axis], held[axis])
            for axis in range(3)
        ]
        yaw_rate = euler_rates(self.angles, self.attitude.rates_flu_rad_s)[2]
        values = (self.attitude.yaw_rad, yaw_rate, 0.0, 0.0)[: tune.yaw.spec.length]
        yaw = Chain(tune.yaw.spec, (*values, 0.0), self.attitude.stamp_us)
        return (place[2], yaw, place[0], place[1])

    def _rest(self, spec: ChainSpec, axis: int, push: float, held: float) -> Chain:
        position = self.position
        values = [position.position_nwu_m[axis], position.velocity_nwu_m_s[axis], 0.0, 0.0][: spec.length]
        values.append(-held)
        chain = Chain(spec, tuple(values), self._start_us, held)
        if self._acceleration and spec.length > ACCELERATION:
            chain.drifts[self._acceleration - 1][0] = -push + self._tune.friction_1_s * values[1]
        return chain

    def values(self) -> tuple[list[float], list[float], list[float], list[float]]:
        """zeta_1 .. zeta_r, sigma of z, yaw, x, y."""
        z, yaw, x, y = self.chains
        return z.values, yaw.values, x.values, y.values

    def push(self) -> Vec3:
        """T r3 - g e3 at the latest attitude and thrust, NWU."""
        x, y, z = to_world(self.angles, (0.0, 0.0, self.thrust.value_m_s2))
        return (x, y, z - GRAVITY_M_S2)

    def wind(self) -> Vec3:
        """The acceleration of z, x, y that is not the thrust's, as far as it is told apart: z, x, y.

        At depth attitude it is sigma, to which the law adds what it knows of friction.
        """
        z, _, x, y = self.chains
        a, row = self._tune.friction_1_s, self._acceleration
        if z.spec.length == ACCELERATION:
            return (z.sigma, x.sigma, y.sigma)
        if self._tune.state_feedback:
            return (-a * z.values[1], -a * x.values[1], -a * y.values[1])
        if not row:
            return (0.0, 0.0, 0.0)
        return (
            z.offset(row) - a * z.values[1],
            x.offset(row) - a * x.values[1],
            y.offset(row) - a * y.values[1],
        )

    # ------------------------------------------------------------------ measurements

    def observe_attitude(self, attitude: Attitude) -> bool:
        """Take in an attitude; False when its stamp was seen before, or is older."""
        stamp_us = attitude.stamp_us
        if stamp_us <= self.yaw_us:
            self.stale += stamp_us < self.yaw_us
            return False
        self.attitude = attitude
        self.angles = t = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
        yaw = self.chains[YAW]
        yaw.predict(yaw.span(self.commands, self.yaw_us, stamp_us), YAW)
        self.yaw_us = stamp_us
        self._turn.take(0, (unwrap_near(attitude.yaw_rad, yaw.values[0]),), stamp_us)
        if self._yaw_rate:
            self._turn.take(self._yaw_rate, (euler_rates(t, attitude.rates_flu_rad_s)[2],), stamp_us)
        if self._acceleration and usable(stamp_us, self.stamp_us):
            self._advance(stamp_us)
            self._correct(self._acceleration, self._measured_acceleration(), stamp_us)
            if self._jerk:
                self._correct(self._jerk, self._measured_jerk(), stamp_us)
        if self._tune.state_feedback:
            self._advance(stamp_us)
            self._copy_state()
        return True

    def observe_position(self, position: Position) -> bool:
        """Take in a position; False when its stamp was seen before, or is older than the last or too old."""
        stamp_us = position.stamp_us
        if stamp_us <= self.position.stamp_us or not usable(stamp_us, self.stamp_us):
            self.stale += stamp_us != self.position.stamp_us
            return False
        self.position = position
        self._advance(stamp_us)
        if self._tune.state_feedback:
            self._copy_state()
            return True
        self._correct(0, position.position_nwu_m, stamp_us)
        if self._velocity:
            self._correct(self._velocity, position.velocity_nwu_m_s, stamp_us)
        return True

    def _advance(self, stamp_us: int) -> None:
        """Predict z, x and y to a later moment."""
        if stamp_us <= self.stamp_us:
            return
        z, _, x, y = self.chains
        along = x.span(self.commands, self.stamp_us, stamp_us)
        if self._alike:
            x.code.predict((x, y, z), _XYZ, along)
        else:
            x.code.predict((x, y), (X, Y), along)
            z.code.predict((z,), (Z,), z.span(self.commands, self.stamp_us, stamp_us))
        self.stamp_us = stamp_us
        self.thrust.advance(stamp_us)

    def _correct(self, row: int, measured_nwu: Vec3, stamp_us: int) -> None:
        """One row of x, y and z."""
        self._place.take(row, measured_nwu, stamp_us, self.stamp_us - stamp_us)

    def _measured_acceleration(self) -> Vec3:
        push_x, push_y, push_z = self.push()
        a, (z, _, x, y) = self._tune.friction_1_s, self.chains
        return (push_x - a * x.values[1], push_y - a * y.values[1], push_z - a * z.values[1])

    def _measured_jerk(self) -> Vec3:
        turn_x, turn_y, turn_z = self._measured_turn()
        a, (z, _, x, y) = self._tune.friction_1_s, self.chains
        return (turn_x - a * x.values[2], turn_y - a * y.values[2], turn_z - a * z.values[2])

    def _copy_state(self) -> None:
        """State feedback: the chains are what is measured now, friction as far as known, and sigma is zero."""
        ahead_s = (self.stamp_us - self.position.stamp_us) * 1e-6
        length, a = self._tune.horizontal.spec.length, self._tune.friction_1_s
        push, turn = self.push(), self._measured_turn()
        for axis, channel in enumerate(_XYZ):
            speed = self.position.velocity_nwu_m_s[axis]
            acceleration = push[axis] - a * speed
            place = self.position.position_nwu_m[axis] + ahead_s * speed
            values = [place, speed, acceleration, turn[axis] - a * acceleration][:length]
            self.chains[channel].values = [*values, 0.0]
        yaw = self.chains[YAW]
        yaw_rate = euler_rates(self.angles, self.attitude.rates_flu_rad_s)[2]
        turned = unwrap_near(self.attitude.yaw_rad, yaw.values[0])
        values = [turned, yaw_rate, *yaw.values[2:]][: yaw.spec.length]
        yaw.values = [*values, 0.0]

    def _measured_turn(self) -> Vec3:
        """R (T q, -T p, T_d): the derivative of `push`, NWU."""
        p, q, _ = self.attitude.rates_flu_rad_s
        thrust = self.thrust.value_m_s2
        return to_world(self.angles, (thrust * q, -thrust * p, self.thrust.rate_m_s3))

    # ------------------------------------------------------------------ commands

    def ahead(self, arrive_us: int) -> tuple[list[float], list[float], list[float], list[float]]:
        """zeta_1 .. zeta_r, sigma of each channel at the moment that the law acts for, with the commands in flight."""
        tune, commands = self._tune, self._before(arrive_us)
        z, yaw, x, y = self.chains
        from_us, turn_us = self.stamp_us, arrive_us + tune.yaw.ahead_us
        along_us, up_us = arrive_us + tune.horizontal.ahead_us, arrive_us + tune.vertical.ahead_us
        along = x.span(commands, from_us, along_us)
        [turned] = yaw.code.ahead((yaw,), (YAW,), yaw.span(commands, self.yaw_us, turn_us))
        if self._alike and up_us == along_us:
            there_x, there_y, there_z = x.code.ahead((x, y, z), _XYZ, along)
        else:
            there_x, there_y = x.code.ahead((x, y), (X, Y), along)
            [there_z] = z.code.ahead((z,), (Z,), z.span(commands, from_us, up_us))
        return there_z, turned, there_x, there_y

    def sent(self, arrive_us: int, w: Vec4, thrust_m_s2: float) -> None:
        """Remember what a command really makes of the chains, and its thrust."""
        needed_us = min(self.stamp_us, self.yaw_us) - self._oldest_us
        self.commands = appended(self.commands, (arrive_us, w), needed_us)
        self.thrust.command(arrive_us, thrust_m_s2)

    def _before(self, arrive_us: int) -> tuple[Command, ...]:
        """The commands that the new one comes after; it replaces the answer to an earlier look at the same moment."""
        if self.commands[-1][0] < arrive_us:
            return self.commands
        return tuple(command for command in self.commands if command[0] < arrive_us) or self.commands[:1]


def _oldest_us(tune: Tuning) -> int:
    """How far back the observer looks for commands."""
    return max(tune.vertical.spec.dead_us, tune.horizontal.spec.dead_us, tune.yaw.spec.dead_us)


def _actuator(spec: ChainSpec) -> tuple[int, float, int]:
    return spec.length, spec.lag_s, spec.dead_us
