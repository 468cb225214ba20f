"""Why a flight did not complete, in words: whose fault it is and what to do."""

from __future__ import annotations

from mavquad.errors import FlightEnded, MavquadError, VehicleRefused, VehicleTimeout
from mavquad.flight.guards import Tripped
from mavquad.flight.machine import IN_FLIGHT, Phase
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.codec import mavlink
from mavquad.protocol.command import CommandExchange
from mavquad.protocol.firmware import Firmware, Mode, Version

_RESTORE = "mavquad restore RUN puts back what this flight changed"

_WAITING_FOR = {
    Phase.CONNECTING: ("HEARTBEAT of an autopilot", "is the vehicle on, and is this its address and port?"),
    Phase.IDENTIFYING: ("the vehicle's version and parameters", "is the link two-way?"),
    Phase.PREPARING: ("its parameters as wanted", "is the link two-way? section [parameters] says what is changed"),
    Phase.WAITING: ("ready to arm", "the vehicle's own texts say what it waits for"),
    Phase.PROBING: ("mode {offboard} while torques of zero come", "is the link two-way?"),
    Phase.WITHDRAWING: ("mode {hold}", "it is disarmed; choose another mode than OFFBOARD before it is armed"),
    Phase.ARMING: ("the armed bit in HEARTBEAT", "the command was acknowledged, but the vehicle did not arm"),
    Phase.TAKING_OFF: ("hover at the takeoff altitude", "the vehicle was told to land"),
    Phase.ENGAGING: ("mode {offboard}", "the vehicle was told to land; see its own texts"),
    Phase.HANDING_BACK: ("mode {hold}", "the vehicle was told to land"),
    Phase.LANDING: ("touch-down and disarm", "watch the vehicle: it may still be in the air"),
    Phase.DISARMING: ("disarm", "the motors may still run"),
    Phase.RESTORING: ("its parameters as they were", _RESTORE),
}

RC_LOSS_IN_OFFBOARD_ALLOWED = 4
_NO_TRANSMITTER = "PX4 without a transmitter needs COM_RCL_EXCEPT = 4; the vehicle was told to land"
_REFUSED_HINTS = {
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: "resolve what the vehicle says, then fly again",
    mavlink.MAV_CMD_NAV_TAKEOFF: "the vehicle was disarmed again",
    mavlink.MAV_CMD_DO_SET_MODE: "the vehicle was told to land; PX4 without a transmitter needs COM_RCL_EXCEPT = 4",
}


def _quoted(said: str) -> str:
    return f'; the vehicle says: "{said}"' if said else ""


def no_torque(firmware: Firmware, version: Version) -> VehicleRefused:
    """The autopilot takes no torque over MAVLink."""
    what = f"{firmware.name} {'.'.join(map(str, version))} ignores torque setpoints silently"
    hint = "only PX4 up to 1.13 takes torque over MAVLink (SET_ACTUATOR_CONTROL_TARGET); --depth rate flies the others"
    return VehicleRefused("flight at depth torque", what, hint=hint)


def ignores_torque(firmware: Firmware, version: Version, result: str, times: int, said: str) -> VehicleRefused:
    """The release takes torque over MAVLink, this build of it does not."""
    name = f"{firmware.name} {'.'.join(map(str, version))}"
    what = f"this build of {name} ignores torque setpoints: while they come it refuses {firmware.offboard.name}"
    hint = (
        "a build with lockstep does that: fly one without (px4_sitl_nolockstep; flight controllers are without), "
        "or --depth rate; nothing was flown, and what was changed is put back"
    )
    return VehicleRefused("flight at depth torque", f"{what} ({result}, {times} times)", said, hint)


def not_flown(autopilot: int, vehicle_type: int) -> VehicleRefused:
    """The autopilot, or what it flies, is another one (MAV_AUTOPILOT, MAV_TYPE)."""
    words = f"the autopilot is {_enum('MAV_AUTOPILOT', autopilot)}, the vehicle {_enum('MAV_TYPE', vehicle_type)}"
    hint = "mavquad flies multicopters of PX4 and of ArduPilot (ArduCopter)"
    return VehicleRefused("flight of this vehicle", words, hint=hint)


def _enum(name: str, value: int) -> str:
    entry = mavlink.enums[name].get(value)
    return entry.name.removeprefix(f"{name}_") if entry else f"number {value}"


def parameters_refused(failed: str) -> VehicleRefused:
    """Its parameters cannot be what the flight wants."""
    hint = "section [parameters] says what is changed; nothing was flown, and what was changed is put back"
    return VehicleRefused("its parameters as wanted", failed, hint=hint)


def parameters_left(failed: str) -> VehicleRefused:
    """The flight is over, and its parameters are not what they were."""
    return VehicleRefused("its parameters as they were", failed, hint=_RESTORE)


def armed_already(mode_name: str) -> VehicleRefused:
    """Somebody is flying it, or about to."""
    hint = "mavquad takes over no vehicle that somebody else armed: land and disarm it first"
    return VehicleRefused("a flight from the ground", f"the vehicle is armed already, mode {mode_name}", hint=hint)


def armed_again(mode_name: str) -> FlightEnded:
    """Somebody armed it while its parameters were being put back."""
    return FlightEnded(
        f"the pilot took over: armed again, mode {mode_name}, before its parameters were put back", _RESTORE
    )


def armed_meanwhile(mode_name: str, phase: Phase) -> FlightEnded:
    """Somebody armed it while it was seen what it takes."""
    return FlightEnded(
        f"the pilot took over: armed, mode {mode_name}, while {phase.value}",
        "the vehicle is in its pilot's hands; nothing was sent to it after that",
    )


def taken_over(mode: Mode, phase: Phase, said: str) -> FlightEnded:
    """HEARTBEAT shows a mode that we did not ask for."""
    return FlightEnded(
        f"the pilot or a failsafe took over: mode {mode.name} while {phase.value}{_quoted(said)}",
        "the vehicle is in its own or its pilot's hands; nothing was sent to it after that",
    )


def disarmed(phase: Phase, said: str) -> FlightEnded:
    """The vehicle disarmed in the middle of a flight."""
    return FlightEnded(f"the vehicle disarmed while {phase.value}{_quoted(said)}", "look at its own log")


def lost(phase: Phase, silent_s: float) -> MavquadError:
    """Nothing of the vehicle was heard for too long."""
    if phase in IN_FLIGHT:
        words = f"lost in flight: the vehicle has been silent for {silent_s:g} s"
        return FlightEnded(words, "check the link, and that the autopilot still runs")
    return VehicleTimeout("HEARTBEAT", 1, silent_s)


def guard(tripped: Tripped) -> FlightEnded:
    """A guard ended the control of the law."""
    return FlightEnded(
        f"guard '{tripped.name}': {tripped.words}", "the vehicle was handed back to the autopilot, and told to land"
    )


def refused(exchange: CommandExchange, result: str, said: str) -> VehicleRefused:
    """The pending command was answered with a no."""
    assert exchange.command is not None
    hint = _REFUSED_HINTS.get(exchange.command.command_id, "")
    return VehicleRefused(exchange.command.words, result, said, hint)


def unanswered(exchange: CommandExchange, said: str, now_us: int) -> VehicleTimeout:
    """The pending command was never answered."""
    assert exchange.command is not None
    waited_s = (now_us - exchange.requested_us) * 1e-6
    return VehicleTimeout(exchange.command.words, exchange.tries, waited_s, said)


def not_engaged(
    exchange: CommandExchange, vehicle: Vehicle, rc_loss_exceptions: float | None, said: str
) -> VehicleRefused:
    """HEARTBEAT never showed the offboard mode, whatever the ACK said.

    Args:
        exchange: the mode change.
        vehicle: as it shows itself.
        rc_loss_exceptions: PX4's COM_RCL_EXCEPT; bit 2 lets it fly OFFBOARD without a transmitter. None: unknown.
        said: the vehicle's texts.
    """
    result = f"acknowledged {exchange.result}" if exchange.result else "no ACK"
    words = f"{result}, but HEARTBEAT stays in {vehicle.mode_name or 'no mode'}"
    hint = _WAITING_FOR[Phase.ENGAGING][1]
    if rc_loss_exceptions is not None and not int(rc_loss_exceptions) & RC_LOSS_IN_OFFBOARD_ALLOWED:
        hint = f"COM_RCL_EXCEPT is {rc_loss_exceptions:g}: {_NO_TRANSMITTER}"
    return VehicleRefused(f"mode {vehicle.firmware.offboard.name}", words, said, hint)


def too_high_or_low(fault: str) -> FlightEnded:
    """The mission would leave the volume from where the takeoff ended."""
    return FlightEnded(f"the law does not take over: {fault}", "change the mission, the guard, or the takeoff's height")


def too_long(phase: Phase, firmware: Firmware, details: str, tries: int, waited_s: float, said: str) -> VehicleTimeout:
    """A phase took longer than its limit."""
    words, hint = _WAITING_FOR.get(phase, (phase.value, ""))
    words = words.format(offboard=firmware.offboard.name, hold=firmware.hold.name)
    return VehicleTimeout(f"{words}: {details}" if details else words, tries, waited_s, said, hint)
