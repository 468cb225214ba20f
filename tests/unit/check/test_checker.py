"""The check in lockstep against the mock: what it finds, and that it leaves the vehicle as it was."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pytest

from mavquad.check.arrivals import Arrivals
from mavquad.check.checker import Checker, Stage
from mavquad.check.findings import Findings, findings
from mavquad.check.words import Texts, git_hash, version_name
from mavquad.drivers.lockstep import START_US, Lockstep
from mavquad.protocol.codec import Encoder, decode, mavlink
from mavquad.protocol.link import LinkParams
from mavquad.protocol.signing import key_of_passphrase
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink
from tests.support import Recording

LINK = LinkParams(url="udpout:127.0.0.1:1")


def mock_config(**keys: object) -> MockConfig:
    return MockConfig.model_validate_json(json.dumps(keys))


def checked(
    duration_s: float = 2.0, rate_hz: float = 100.0, link: LinkParams = LINK, key: bytes | None = None, **mock: object
) -> tuple[Checker, Recording, MockAutopilot]:
    config = mock_config(**mock)
    checker = Checker(link, START_US, duration_s, rate_hz, key)
    autopilot = MockAutopilot(config, 1, START_US)
    recording = Recording()
    lockstep = Lockstep(checker, ImpairedLink(autopilot, config.link, 1), recording)
    lockstep.run(lambda: checker.stage is Stage.DONE, 60.0)
    assert checker.stage is Stage.DONE
    return checker, recording, autopilot


def found(**keys: object) -> Findings:
    return findings(checked(**keys)[0])


def sent(recording: Recording) -> list[object]:
    return [decode(record.frame) for record in recording.records if record.outbound]


def test_a_px4_that_is_ready() -> None:
    result = found(firmware="1.16", clock_drift=0.013)
    assert (result.vehicle, result.autopilot, result.kind, result.mode) == ((1, 1), "PX4", "QUADROTOR", "AUTO.LOITER")
    assert result.ready
    assert result.version is not None
    assert result.version.numbers[:2] == (1, 16)
    assert "MAVLINK2" in result.version.capabilities
    assert result.hover_thrust == {"MPC_THR_HOVER": pytest.approx(0.5)}
    assert result.depths["torque"].startswith("no: PX4 1.16")
    assert result.depths["rate"] == result.depths["attitude"] == "yes"
    attitude = result.streams["ATTITUDE"]
    assert attitude.rate_hz == pytest.approx(99, abs=2)
    assert attitude.age_ms == pytest.approx(15, abs=3)  # its link delays by 10, its estimate is 4 to 8 old
    assert result.clock.drift_ms_s == pytest.approx(-13.0, abs=0.5)
    assert result.clock.round_trips is not None
    assert result.clock.round_trips.p50_ms == pytest.approx(20, abs=1)


def test_a_px4_that_takes_torque() -> None:
    assert found(firmware="1.13").depths["torque"].startswith("yes")


def test_an_arducopter_that_waits_for_its_position() -> None:
    result = found(autopilot="ardupilot", ready_s=42.5)
    assert not result.ready
    assert "its own pre-arm checks have not passed" in result.reasons
    assert any("LOCAL_POSITION_NED does not come" in reason for reason in result.reasons)
    assert "PREARM_CHECK" in result.unhealthy
    assert result.depths["torque"].startswith("no")
    assert "bit 3 of GUID_OPTIONS (now 0)" in result.depths["rate"]
    assert result.parameters["GUID_OPTIONS"] == 0


def test_an_arducopter_that_is_ready() -> None:
    result = found(autopilot="ardupilot", ready_s=1.0, duration_s=4.0)
    assert result.mode == "STABILIZE"
    assert result.streams["ATTITUDE"].rate_hz == pytest.approx(100, abs=1)


def test_a_shortfall_is_told() -> None:
    result = found(rate_hz=200.0)
    assert [
        reason for reason in result.reasons if "LOCAL_POSITION_NED comes at 8" in reason and "200 Hz asked" in reason
    ]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_nothing_is_changed_but_rates_and_these_are_put_back(autopilot: str) -> None:
    checker, recording, _ = checked(autopilot=autopilot)
    messages = sent(recording)
    kinds = {message.get_type() for message in messages}
    assert kinds <= {"HEARTBEAT", "TIMESYNC", "COMMAND_LONG", "PARAM_REQUEST_READ"}
    commands = [message for message in messages if message.get_type() == "COMMAND_LONG"]
    assert {command.command for command in commands} == {
        mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_RUN_PREARM_CHECKS,
    }  # fmt: skip
    asked = {c.param1: c.param2 for c in commands if c.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL}
    assert len(asked) == 5
    assert set(asked.values()) == {0.0}  # the last word on each
    assert findings(checker).not_restored == ()


def test_a_vehicle_that_flies_is_not_asked_for_its_pre_arm_checks_and_tells_its_hover_thrust() -> None:
    checker = Checker(LINK, START_US, 0.5, 50.0)
    vehicle = Vehicle(checker)
    vehicle.run(14.0, armed=True, landed=mavlink.MAV_LANDED_STATE_IN_AIR)
    assert checker.stage is Stage.DONE
    result = findings(checker)
    assert mavlink.MAV_CMD_RUN_PREARM_CHECKS not in vehicle.commands
    assert result.hover_thrust == {"ATTITUDE_TARGET": pytest.approx(0.42)}
    assert "it is armed already" in result.reasons
    assert result.armed


def test_a_vehicle_that_answers_nothing_is_given_up_in_time() -> None:
    checker = Checker(LINK, START_US, 0.5, 50.0)
    vehicle = Vehicle(checker, answers=False)
    vehicle.run(14.0)
    assert checker.stage is Stage.DONE
    result = findings(checker)
    assert result.version is None
    assert result.depths["torque"].startswith("?")
    assert result.clock.round_trips is None
    assert "SYS_STATUS does not come" in result.reasons[0]


def test_stopping_puts_the_streams_back() -> None:
    checker = Checker(LINK, START_US, 1000.0, 50.0)
    vehicle = Vehicle(checker)
    vehicle.run(9.0)
    assert checker.stage is Stage.MEASURING
    vehicle.commands.clear()
    checker.stop(vehicle.now_us)
    vehicle.run(1.0)
    assert vehicle.commands == [mavlink.MAV_CMD_SET_MESSAGE_INTERVAL] * 5
    assert checker.stage is Stage.DONE


def test_nobody_is_found_where_a_ground_station_speaks() -> None:
    checker = Checker(LINK, START_US, 1.0, 50.0)
    vehicle = Vehicle(checker, Encoder(255, 190), kind=mavlink.MAV_TYPE_GCS, autopilot=mavlink.MAV_AUTOPILOT_INVALID)
    vehicle.run(11.0)
    assert checker.stage is Stage.DONE
    assert checker.link.vehicle is None
    assert [(p.system_id, p.kind, p.autopilot) for p in checker.roster.everybody()] == [(255, "GCS", "")]


def test_everybody_on_the_link_is_listed() -> None:
    checker = Checker(LINK, START_US, 0.5, 50.0)
    vehicle = Vehicle(checker)
    camera = Encoder(1, mavlink.MAV_COMP_ID_CAMERA, version=1)
    vehicle.deliver(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_CAMERA, 8, 0, 0, 0, 3), camera)
    vehicle.run(3.0)
    roster = {(p.system_id, p.component): (p.kind, p.autopilot, p.versions) for p in checker.roster.everybody()}
    assert roster == {
        (1, "AUTOPILOT1"): ("QUADROTOR", "PX4", {2}),
        (1, "CAMERA"): ("CAMERA", "", {1}),
    }


def test_a_signed_vehicle_is_checked_with_its_key() -> None:
    key = key_of_passphrase("a secret")
    signing = {"mode": "require", "passphrase": "a secret"}
    assert findings(checked(key=key, signing=signing)[0]).version is not None
    assert checked(signing=signing)[0].sync.round_trip_us is None  # it is heard, and does not take our questions


def test_invented_names_fill_no_memory() -> None:
    checker = Checker(LINK, START_US, 0.5, 50.0)
    vehicle = Vehicle(checker)
    for number in range(1, 2000):
        vehicle.deliver(mavlink.MAVLink_ping_message(0, 0, 0, 0), Encoder(number % 255 + 1, number // 255 + 1))
    assert len(checker.roster.everybody()) <= 1000


class Vehicle:
    """A PX4 by hand, at 50 Hz."""

    def __init__(
        self,
        checker: Checker,
        encoder: Encoder | None = None,
        answers: bool = True,
        kind: int = mavlink.MAV_TYPE_QUADROTOR,
        autopilot: int = mavlink.MAV_AUTOPILOT_PX4,
    ) -> None:
        self.checker, self.answers = checker, answers
        self.encoder = encoder or Encoder(1, 1)
        self.kind, self.autopilot = kind, autopilot
        self.now_us = START_US
        self.commands: list[int] = []

    def deliver(self, message: object, encoder: Encoder | None = None) -> None:
        self.now_us += 4
        self.checker.receive((encoder or self.encoder).encode(message), self.now_us)
        self.hear(self.checker.datagrams_to_send())

    def hear(self, frames: Sequence[bytes]) -> None:
        for message in map(decode, frames):
            if message.get_type() == "COMMAND_LONG":
                self.commands.append(message.command)
                if self.answers:
                    self.deliver(mavlink.MAVLink_command_ack_message(message.command, 0))

    def run(self, seconds: float, armed: bool = False, landed: int = mavlink.MAV_LANDED_STATE_ON_GROUND) -> None:
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.now_us += 20_000
            while (due_us := self.checker.next_deadline_us()) <= self.now_us:
                self.checker.on_deadline(due_us)
                self.hear(self.checker.datagrams_to_send())
            base = 81 | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
            self.deliver(mavlink.MAVLink_heartbeat_message(self.kind, self.autopilot, base, 3 << 16, 3, 3))
            if self.answers:
                self.deliver(mavlink.MAVLink_extended_sys_state_message(0, landed))
                self.deliver(mavlink.MAVLink_attitude_target_message(1, 0, [1, 0, 0, 0], 0, 0, 0, 0.42))


# ---------------------------------------------------------------------- words


@pytest.mark.parametrize(
    ("number", "name"),
    [(0x010D03FF, "1.13.3"), (0x04070000, "4.7.0-dev"), (0x04050740, "4.5.7-alpha"), (0x011002C1, "1.16.2-rc")],
)
def test_versions_are_told_as_their_makers_write_them(number: int, name: str) -> None:
    assert version_name(number) == name


def test_the_commit_is_told_in_both_ways_of_writing_it() -> None:
    def version(custom: bytes) -> object:
        return mavlink.MAVLink_autopilot_version_message(
            0, 0, 0, 0, 0, list(custom.ljust(8, b"\0")), [0] * 8, [0] * 8, 0, 0, 0
        )

    assert git_hash(version(b"8fdb6a37")) == "8fdb6a37"
    assert git_hash(version(bytes.fromhex("54f0455ffc112233")[::-1])) == "54f0455f"
    assert git_hash(version(b"")) == ""


def test_long_texts_are_put_together_and_said_once() -> None:
    texts = Texts()
    long = "PreArm: what is said here is longer than fifty characters are"
    for _ in range(2):
        texts.take(mavlink.MAVLink_statustext_message(2, long[:50].encode(), 7, 0))
        texts.take(mavlink.MAVLink_statustext_message(2, long[50:].encode(), 7, 1))
    texts.take(mavlink.MAVLink_statustext_message(6, b"EKF3 IMU0 is using GPS", 0, 0))
    texts.take(mavlink.MAVLink_statustext_message(2, b"another\t", 0, 0))
    assert texts.said == (long, "another")


def test_a_burst_is_no_stream_and_has_no_rate() -> None:
    burst, stream = Arrivals(), Arrivals()
    for n in range(10):
        burst.add(n * 100, None)
        stream.add(n * 100_000, 5_000 + n)
    assert (burst.stream(0, 1_000_000).count, burst.stream(0, 1_000_000).rate_hz) == (10, None)
    found = stream.stream(0, 1_000_000)
    assert found.rate_hz == pytest.approx(10.0)
    assert found.jitter_ms == pytest.approx(0.0)
    assert found.gap_ms == pytest.approx(100.0)
    assert found.age_ms == pytest.approx(5.0045)
    assert Arrivals().stream(0, 1_000_000).rate_hz is None
