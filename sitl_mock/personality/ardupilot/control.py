"""From what a mode asks for to the motors: the attitude control, the angle boost, the mixer, the spooling."""

from __future__ import annotations

import math

from sitl_mock.geometry import ZERO3, Quaternion, Vec3, Vec4
from sitl_mock.personality.ardupilot import attitude, motors
from sitl_mock.personality.ardupilot.demand import LIFT_COMPENSATION, Demand, boosted
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.plant import VehicleParams
from sitl_mock.sensors import Estimate

_STILL: Vec4 = (0.0, 0.0, 0.0, 0.0)
_CENTI = 100.0


class Control:
    """Drives the motors.

    Attributes:
        lift_norm: thrust asked for as a share of all motors' full one, before the angle boost.
        rates_target_rad_s: body rates asked for.
    """

    def __init__(self, vehicle: VehicleParams, params: Parameters) -> None:
        self._vehicle = vehicle
        self._params = params
        self._gains = attitude.rate_gains(vehicle)
        self._state = attitude.AttitudeState()
        self._shape = attitude.Shape(ZERO3, 0.0)
        self._shape_version = -1
        self._commands: Vec4 | None = None
        self._idle_us = 1000
        self.lift_norm = 0.0
        self.rates_target_rad_s: Vec3 = ZERO3

    @property
    def target(self) -> Quaternion:
        """The attitude that is followed."""
        return self._state.target

    @property
    def thrust_norm(self) -> float:
        """The thrust asked for, on the scale of the field `thrust`."""
        return self.lift_norm / LIFT_COMPENSATION

    @property
    def outputs_us(self) -> tuple[int, int, int, int]:
        """PWM of the four motors."""
        if self._commands is None:
            return (self._idle_us,) * 4
        a, b, c, d = (motors.pwm(command) for command in self._commands)
        return (a, b, c, d)

    def stand_idle(self, since_armed_s: float | None, estimate: Estimate) -> Vec4:
        """No thrust; `since_armed_s` is None while disarmed."""
        self._state = attitude.AttitudeState(estimate.quaternion)
        self.rates_target_rad_s, self.lift_norm = ZERO3, 0.0
        self._commands = None
        self._idle_us = 1000 if since_armed_s is None else motors.idle_pwm(since_armed_s)
        return _STILL

    def drive(self, demand: Demand, share: float, on_ground: bool, estimate: Estimate, dt_s: float) -> Vec4:
        """The motor commands for a demand, with this share of its thrust; the ground holds the vehicle's attitude."""
        state = attitude.move_target(self._shape_in_force(), self._state, demand.attitude, dt_s)
        if on_ground:
            state = attitude.AttitudeState(state.target, state.target_rates_rad_s)
        is_rates = isinstance(demand.attitude, attitude.RatesInput)
        torque, self.rates_target_rad_s, self._state = attitude.follow(self._gains, state, is_rates, estimate, dt_s)
        self.lift_norm = lift = demand.thrust_norm * share
        if self._params["ATC_ANGLE_BOOST"]:
            lift = boosted(lift, self._state.target)
        self._commands = motors.commands(self._vehicle, motors.mix(self._vehicle.frame, torque, min(1.0, lift)))
        return self._commands

    def _shape_in_force(self) -> attitude.Shape:
        params = self._params
        if self._shape_version != params.version:
            self._shape_version = params.version
            roll, pitch, yaw = (math.radians(params[f"ATC_ACCEL_{axis}_MAX"] / _CENTI) for axis in "RPY")
            self._shape = attitude.Shape((roll, pitch, yaw), params["ATC_INPUT_TC"])
        return self._shape
