"""Configuration of the mock autopilot. `MockConfig()` is the default mock: a PX4 1.13 that flies SIH's quadcopter."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self, get_args

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from mavquad.schema import Section
from sitl_mock.config.faults import Fault, wrong_mode
from sitl_mock.config.link import LinkConfig
from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.config.signing import SigningConfig
from sitl_mock.config.streams import StreamsConfig
from sitl_mock.config.vehicle import VehicleConfig, load_vehicle
from sitl_mock.plant import TICK_US

__all__ = ["ArduPilotRelease", "Autopilot", "Firmware", "MockConfig", "Px4Release"]


def _number_as_text(value: Any) -> Any:
    """`firmware = 1.16` without quotes is a number in TOML."""
    return str(value) if isinstance(value, float) else value


Autopilot = Literal["px4", "ardupilot"]
Px4Release = Literal["1.13", "1.14", "1.15", "1.16", "1.17"]
ArduPilotRelease = Literal["4.7"]
Firmware = Annotated[Literal["auto", Px4Release, ArduPilotRelease], BeforeValidator(_number_as_text)]
_TICK_MS = TICK_US // 1000
_PX4_RELEASES: dict[str, Px4Release] = {"auto": "1.13", **{release: release for release in get_args(Px4Release)}}
_ARDUPILOT_RELEASES: dict[str, ArduPilotRelease] = {"auto": "4.7", "4.7": "4.7"}


class MockConfig(Section):
    """A mock autopilot, its vehicle, its link and what goes wrong."""

    autopilot: Autopilot = "px4"
    """Whose manners: PX4's, or those of ArduPilot's Copter."""
    firmware: Firmware = "auto"
    """Release imitated: PX4 1.13 (takes SET_ACTUATOR_CONTROL_TARGET), 1.14, 1.15, 1.16 or 1.17 (the last two
    acknowledge modes twice); ArduCopter 4.7. "auto": 1.13, or 4.7."""
    lockstep_build: bool = False
    """PX4 1.13: a build with lockstep, which ignores SET_ACTUATOR_CONTROL_TARGET without a word on the link."""
    system_id: Annotated[int, Field(ge=1, le=255)] = 1
    """MAVLink system id; the component is 1, the autopilot."""
    com_rcl_except: Annotated[int, Field(ge=0, le=31)] = 4
    """PX4's COM_RCL_EXCEPT at boot; without its bit 4, PX4 1.13 leaves OFFBOARD at once when it has no RC."""
    mavlink: Literal["in_kind", "as_real"] = "in_kind"
    """Which version of MAVLink a link speaks: "in_kind", the one it was last spoken to in; "as_real", like the real ones:
    2, also to those who speak 1; PX4 1.13 begins with 1 and goes on with 2 once it hears 2."""
    ready_s: Annotated[float, Field(ge=0, le=300)] = 1.0
    """Time from boot until arming is allowed in s. ArduCopter: in GUIDED; its other moments of the start go
    with it, and 42.5 is the real one's."""
    clock_drift: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Share by which its clock is slow against the wall's; real PX4 in lockstep, 1.14 and later: 0.01 to 0.025."""
    wind_ned_m_s: tuple[
        Annotated[float, Field(ge=-50, le=50)],
        Annotated[float, Field(ge=-50, le=50)],
        Annotated[float, Field(ge=-50, le=50)],
    ] = (0.0, 0.0, 0.0)
    """Wind towards north, east, down in m/s."""
    gusts_m_s: Annotated[float, Field(ge=0, le=20)] = 0.0
    """Standard deviation of the gusts in m/s; 0 for none. "ou": towards north and towards east each. "dryden": of the
    vertical ones, the others being 1.1 (300 m) to 2 (3 m) times as strong."""
    gusts_time_s: Annotated[float, Field(ge=0.01, le=1000)] = 1.0
    """Correlation time of the gusts in s; "dryden" has its own, by height and airspeed."""
    gusts_model: Literal["ou", "dryden"] = "ou"
    """Ornstein-Uhlenbeck processes, or Dryden's gusts for low altitude (MIL-F-8785C)."""
    vehicle: VehicleConfig = VehicleConfig()
    """The vehicle; what is left out is SIH's, or with autopilot = "ardupilot" that of ArduCopter's SITL."""
    sensors: SensorsConfig = SensorsConfig()
    """Errors of the estimator's output."""
    streams: StreamsConfig = StreamsConfig()
    """Limits of the telemetry."""
    link: LinkConfig = LinkConfig()
    """The link to the far side."""
    signing: SigningConfig = SigningConfig()
    """Signatures of MAVLink 2 on its links."""
    faults: tuple[Fault, ...] = ()
    """Scripted faults."""

    @field_validator("vehicle", mode="before")
    @classmethod
    def _copter_flies_its_own(cls, given: Any, info: ValidationInfo) -> Any:
        if isinstance(given, dict):
            # No longer JSON for pydantic, whose strict tuples take no lists then.
            given = {key: tuple(value) if isinstance(value, list) else value for key, value in given.items()}
        if info.data.get("autopilot") != "ardupilot":
            return given
        if isinstance(given, VehicleConfig):
            return given if given.model_fields_set else load_vehicle("arducopter")
        return {**load_vehicle("arducopter").model_dump(), **given} if isinstance(given, dict) else given

    @model_validator(mode="after")
    def _release_exists(self) -> Self:
        releases = _PX4_RELEASES if self.autopilot == "px4" else _ARDUPILOT_RELEASES
        if self.firmware not in releases:
            raise ValueError(f"firmware {self.firmware} is none of {self.autopilot}'s: {', '.join(releases)}")
        return self

    @model_validator(mode="after")
    def _modes_exist(self) -> Self:
        for number, fault in enumerate(self.faults):
            key, reason = wrong_mode(fault, self.autopilot)
            if key:
                raise ValueError(f"faults.{number}.{fault.kind}.{key}: {reason}")
        return self

    @property
    def px4_release(self) -> Px4Release:
        """The release of PX4 that is imitated."""
        return _PX4_RELEASES[self.firmware]

    @property
    def ardupilot_release(self) -> ArduPilotRelease:
        """The release of ArduCopter that is imitated."""
        return _ARDUPILOT_RELEASES[self.firmware]

    @property
    def estimator(self) -> SensorsConfig:
        """The errors of the estimator; the samples of PX4 in lockstep (from 1.14) are of whole ticks, as their stamps are."""
        sensors = self.sensors
        if self.autopilot != "px4" or self.px4_release == "1.13":
            return sensors
        return sensors.model_copy(update={"age_ms": sensors.age_ms // _TICK_MS * _TICK_MS})
