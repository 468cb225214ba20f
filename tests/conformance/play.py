"""The client's side of a recording, sent to the mock at the same times on the vehicle's clock, in virtual time.

Before the first record the mock is brought to where the real autopilot stood: past its start, or at boot if the
recording begins there, in the mode that the first HEARTBEAT shows, and with the streams that earlier clients had asked for.
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
_ASKED_EARLIER = {
    "px4-v1.13.3-a": (
        (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 10_000),
        (mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET, 10_000),
    ),
    "px4-v1.13.3-c": ((mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 20_000),),
    "px4-v1.16.2-c": ((mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 20_000),),
}
"""Message intervals (us) still in force from earlier recordings of the same boot; those before 1.13.3-a are inferred."""
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
        "com_rcl_except": 0,
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
    list(advance(mock, START_US + before_us - GRID_US))


def _into_first_state(recording: Recording) -> list[Message]:
    first = next(message.custom_mode for _, message in recording.vehicle if message.get_type() == "HEARTBEAT")
    mode = (first >> 16 & 0xFF, first >> 24 & 0xFF) if recording.autopilot == "px4" else (first, 0)
    commands = [(mavlink.MAV_CMD_DO_SET_MODE, (_CUSTOM, *mode))]
    for name, intervals in _ASKED_EARLIER.items():
        if recording.name.startswith(name):
            commands += [(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, interval) for interval in intervals]
    return [mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), *(_command(*command) for command in commands)]


def _command(command: int, params: tuple[int, ...]) -> Message:
    padded = [*map(float, params), *[0.0] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(1, 1, command, 0, *padded)
