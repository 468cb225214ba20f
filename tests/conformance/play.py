"""The client's side of a recording, sent to the mock at the same times on the vehicle's clock, in virtual time.

Before the first record the mock is brought to where the real autopilot stood: past its start, or at boot if the
recording begins there, in the mode that the first HEARTBEAT shows, and with the streams and parameters of earlier clients.
"""

from __future__ import annotations

from dataclasses import replace

from mavquad.endpoint import GRID_US, advance, deliver, floor_to_grid_us
from mavquad.protocol.codec import Encoder, Message, decode, mavlink
from mavquad.schema import parse_section
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from tests.conformance.recording import Recording

START_US = 1_700_000_000_000_000
_COLD_US = 1_000_000
_READY_S = {"1.13": 9.2, "1.15": 38.0, "1.16": 4.5, "4.7": 42.5}
_BEFORE_US = {"px4": 25_000_000, "ardupilot": 45_000_000}
_MODE_US = {"px4": 11_000_000, "ardupilot": 43_000_000}
_TAKEOFF_5_M = ("MIS_TAKEOFF_ALT", 5.0)
_EARLIER = {
    "px4-v1.13.3-a": (
        (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 10_000),
        (mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET, 10_000),
        ("MIS_TAKEOFF_ALT", 6.0),
    ),
    "px4-v1.13.3-c": ((mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 20_000), _TAKEOFF_5_M),
    "px4-v1.13.3-d": (_TAKEOFF_5_M,),
    "px4-v1.16.2-c": ((mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 20_000), _TAKEOFF_5_M),
}
"""What earlier clients of the same boot had set: message intervals (us) and a parameter; 1.13.3's COM_RCL_EXCEPT was 4.

The recordings before show it, and for 1.13.3-a its own list of parameters; its intervals are inferred from its rates.
"""
_WITHOUT_CLIENT = ("px4-v1.13.3-a", "px4-v1.13.3-c-reject")
"""There "Data link regained" tells that nobody had been there for a while; else a client's HEARTBEATs went before."""
_BEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
_BEAT_US = 1_000_000
_CUSTOM = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


def play(recording: Recording, seed: int = 1) -> Recording:
    """What the mock answers: the same recording with the mock's messages in place of the vehicle's."""
    mock = MockAutopilot(_config(recording), seed, START_US, (_port(recording),))
    before_us = _time_before(recording)
    _prepare(mock, recording, before_us)
    start_us = START_US + before_us
    frames: list[tuple[int, bytes]] = []
    for at_us, frame in recording.client:
        frames += deliver(mock, frame, start_us + at_us)
    frames += advance(mock, start_us + recording.end_us)
    answers = [(stamp_us - start_us, decode(frame)) for stamp_us, frame in frames]
    return replace(recording, boot_us=before_us, vehicle=[answer for answer in answers if answer[0] >= 0])


def _config(recording: Recording) -> MockConfig:
    keys: dict[str, object] = {
        "autopilot": recording.autopilot,
        "firmware": recording.firmware,
        "com_rcl_except": 4 if recording.firmware == "1.13" else 0,
        "ready_s": _READY_S[recording.firmware],
    }
    return parse_section(MockConfig, keys, "conformance")


def _port(recording: Recording) -> str:
    return "onboard" if recording.autopilot == "px4" else "serial"


def _time_before(recording: Recording) -> int:
    """The mock's time since boot at the first record: the real one's at a cold start, long enough to be ready else."""
    is_cold = recording.autopilot == "ardupilot" and recording.boot_us < _COLD_US
    return max(floor_to_grid_us(recording.boot_us), 0) if is_cold else _BEFORE_US[recording.autopilot]


def _prepare(mock: MockAutopilot, recording: Recording, before_us: int) -> None:
    mode_us = _MODE_US[recording.autopilot]
    if before_us > mode_us:
        encoder = Encoder(255, 190)
        for order, message in enumerate(_into_first_state(recording)):
            list(deliver(mock, encoder.encode(message), START_US + mode_us + GRID_US * order))
        for beat_us in range(mode_us + _BEAT_US, before_us, _BEAT_US) if recording.name not in _WITHOUT_CLIENT else ():
            list(deliver(mock, encoder.encode(_BEAT), START_US + beat_us))
    list(advance(mock, START_US + before_us - GRID_US))


def _into_first_state(recording: Recording) -> list[Message]:
    first = next(message.custom_mode for _, message in recording.vehicle if message.get_type() == "HEARTBEAT")
    mode = (first >> 16 & 0xFF, first >> 24 & 0xFF) if recording.autopilot == "px4" else (first, 0)
    earlier = next((told for name, told in _EARLIER.items() if recording.name.startswith(name)), ())
    return [
        _BEAT,
        _command(mavlink.MAV_CMD_DO_SET_MODE, (_CUSTOM, *mode)),
        *(_set(what, value) for what, value in earlier),
    ]


def _set(what: int | str, value: float) -> Message:
    """SET_MESSAGE_INTERVAL of a message id, or PARAM_SET of a name."""
    if isinstance(what, int):
        return _command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (what, value))
    return mavlink.MAVLink_param_set_message(1, 1, what.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32)


def _command(command: int, params: tuple[float, ...]) -> Message:
    padded = [*map(float, params), *[0.0] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(1, 1, command, 0, *padded)
