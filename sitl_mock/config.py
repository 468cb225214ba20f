"""Configuration of the mock autopilot. `MockConfig()` is the default mock: a PX4 1.13 that flies SIH's quadcopter."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from mavquad.schema import Section
from sitl_mock.plant import TICK_US, VehicleParams


def _number_as_text(value: Any) -> Any:
    """`firmware = 1.16` without quotes is a number in TOML."""
    return str(value) if isinstance(value, float) else value


Positive = Annotated[float, Field(gt=0, le=1000)]
NotNegative = Annotated[float, Field(ge=0, le=1000)]
Firmware = Annotated[Literal["1.13", "1.15", "1.16"], BeforeValidator(_number_as_text)]
ModeName = Literal["POSCTL", "OFFBOARD", "AUTO.TAKEOFF", "AUTO.LOITER", "AUTO.LAND", "AUTO.RTL"]


StreamName = Literal[
    "HEARTBEAT",
    "ATTITUDE",
    "ATTITUDE_QUATERNION",
    "LOCAL_POSITION_NED",
    "GLOBAL_POSITION_INT",
    "ATTITUDE_TARGET",
    "SERVO_OUTPUT_RAW",
    "TIMESYNC",
    "SYS_STATUS",
    "EXTENDED_SYS_STATE",
    "SYSTEM_TIME",
    "BATTERY_STATUS",
    "HOME_POSITION",
]


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


class SensorsConfig(Section):
    """Errors of the estimator's output. Every one may be 0."""

    position_noise_m: NotNegative = 0.003
    """Standard deviation of the white position noise per axis in m."""
    position_wander_m: NotNegative = 0.05
    """Standard deviation of the slow position wander per axis in m."""
    position_wander_time_s: Positive = 20.0
    """Correlation time of the wander in s."""
    velocity_noise_m_s: NotNegative = 0.01
    """Standard deviation of the white velocity noise per axis in m/s."""
    attitude_noise_deg: NotNegative = 0.1
    """Standard deviation of the white noise of each Euler angle in degrees."""
    rates_noise_rad_s: NotNegative = 0.01
    """Standard deviation of the white body-rate noise per axis in rad/s."""
    age_ms: Annotated[int, Field(ge=0, le=200)] = 5
    """Age of the sample in a telemetry message in ms; the message carries the sample's own time stamp."""


class StreamsConfig(Section):
    """What telemetry can deliver, whatever is asked for."""

    max_attitude_hz: Annotated[float, Field(gt=0, le=250)] = 250.0
    """Fastest ATTITUDE and ATTITUDE_QUATERNION in Hz."""
    max_position_hz: Annotated[float, Field(gt=0, le=250)] = 100.0
    """Fastest LOCAL_POSITION_NED in Hz (real PX4: 89 on 1.13, 125 on 1.16)."""


class LinkConfig(Section):
    """The link between the vehicle and the far side, each direction for itself."""

    latency_ms: Annotated[float, Field(ge=0, le=5000)] = 10.0
    """Delay of every frame in ms."""
    jitter_ms: Annotated[float, Field(ge=0, le=5000)] = 0.0
    """Largest additional delay in ms, uniform from 0; frames may overtake each other."""
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Probability that a frame is lost."""


class Timed(Section):
    """A scripted fault that starts at a moment."""

    since: Literal["boot", "offboard"] = "boot"
    """What `from_s` or `at_s` counts from: boot, or the first entry into OFFBOARD."""


class Refuse(Section):
    """The autopilot refuses a command."""

    kind: Literal["refuse"]
    """Discriminates the fault."""
    command: Annotated[int, Field(ge=0, le=65535)]
    """MAV_CMD number."""
    result: Annotated[int, Field(ge=0, le=9)] = 2
    """MAV_RESULT of the answer (2: DENIED)."""
    times: Annotated[int, Field(ge=1)] = 1_000_000
    """How many times, before it is obeyed."""
    text: Annotated[str, Field(max_length=50)] = ""
    """STATUSTEXT sent along, if any."""


class AckWithoutActing(Section):
    """The autopilot acknowledges a command and does nothing."""

    kind: Literal["ack_without_acting"]
    """Discriminates the fault."""
    command: Annotated[int, Field(ge=0, le=65535)]
    """MAV_CMD number."""
    times: Annotated[int, Field(ge=1)] = 1_000_000
    """How many times, before it is obeyed."""


class Silent(Timed):
    """No telemetry and no answer for a while; the vehicle still listens."""

    kind: Literal["silent"]
    """Discriminates the fault."""
    from_s: NotNegative
    """Start in s."""
    for_s: Positive
    """Duration in s."""


class StreamStops(Timed):
    """One message is not sent for a while."""

    kind: Literal["stream_stops"]
    """Discriminates the fault."""
    message: StreamName
    """Name of the message."""
    from_s: NotNegative
    """Start in s."""
    for_s: Positive
    """Duration in s."""


class NanPose(Timed):
    """LOCAL_POSITION_NED carries NaN for a while."""

    kind: Literal["nan_pose"]
    """Discriminates the fault."""
    from_s: NotNegative
    """Start in s."""
    for_s: Positive
    """Duration in s."""


class Die(Timed):
    """The autopilot neither sends nor obeys from then on, for ever."""

    kind: Literal["die"]
    """Discriminates the fault."""
    at_s: NotNegative
    """Moment in s."""


class ModeChange(Timed):
    """The pilot selects another mode."""

    kind: Literal["mode_change"]
    """Discriminates the fault."""
    at_s: NotNegative
    """Moment in s."""
    mode: ModeName
    """PX4's name of the mode."""


Fault = Annotated[
    Refuse | AckWithoutActing | Silent | StreamStops | NanPose | Die | ModeChange, Field(discriminator="kind")
]


class MockConfig(Section):
    """A mock autopilot, its vehicle, its link and what goes wrong."""

    firmware: Firmware = "1.13"
    """PX4 version imitated: 1.13 takes SET_ACTUATOR_CONTROL_TARGET, 1.15 and 1.16 do not; 1.16 acknowledges modes twice."""
    system_id: Annotated[int, Field(ge=1, le=255)] = 1
    """MAVLink system id; the component is 1, the autopilot."""
    com_rcl_except: Annotated[int, Field(ge=0, le=31)] = 4
    """PX4's COM_RCL_EXCEPT at boot; without its bit 4, PX4 1.13 leaves OFFBOARD at once when it has no RC."""
    ready_s: Annotated[float, Field(ge=0, le=300)] = 1.0
    """Time from boot until arming is allowed in s."""
    wind_ned_m_s: tuple[
        Annotated[float, Field(ge=-50, le=50)],
        Annotated[float, Field(ge=-50, le=50)],
        Annotated[float, Field(ge=-50, le=50)],
    ] = (0.0, 0.0, 0.0)
    """Wind towards north, east, down in m/s."""
    gusts_m_s: Annotated[float, Field(ge=0, le=20)] = 0.0
    """Standard deviation of the gusts in m/s, towards north and towards east; 0 for none."""
    gusts_time_s: Annotated[float, Field(ge=0.01, le=1000)] = 1.0
    """Correlation time of the gusts in s."""
    vehicle: VehicleConfig = VehicleConfig()
    """The vehicle."""
    sensors: SensorsConfig = SensorsConfig()
    """Errors of the estimator's output."""
    streams: StreamsConfig = StreamsConfig()
    """Limits of the telemetry."""
    link: LinkConfig = LinkConfig()
    """The link to the far side."""
    faults: tuple[Fault, ...] = ()
    """Scripted faults."""
