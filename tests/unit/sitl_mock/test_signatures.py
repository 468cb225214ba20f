"""Which version a port answers in, and what it asks of signatures; the far side signs as pymavlink does."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.endpoint import deliver
from mavquad.errors import ConfigError
from mavquad.protocol.codec import Encoder, decode, frame_version, is_signed, message_id
from mavquad.protocol.signing import Signing, key_of_passphrase, timestamp_at
from mavquad.schema import parse_section
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig

KEY = key_of_passphrase("open sesame")
HEARTBEAT = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1.0, *[0.0] * 6)
RADIO_STATUS = dialect.MAVLink_radio_status_message(200, 200, 100, 50, 50, 0, 0)
ASK_VERSION = dialect.MAVLink_command_long_message(1, 1, 512, 0, 148.0, *[0.0] * 6)
ACK, SETUP_SIGNING_ID = 77, 256


def mock_with(mode, **more):
    return {"signing": {"mode": mode, "passphrase": "open sesame", **more}}


def theirs(pilot, key=KEY):
    """pymavlink's end of the link; also its parser."""
    mav = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    mav.signing.secret_key, mav.signing.link_id, mav.signing.sign_outgoing = key, 7, True
    mav.signing.timestamp = timestamp_at(pilot.now_us)
    return mav


def send(pilot, frame):
    """Hand over bytes; returns the frames that come back at once."""
    pilot.now_us += 400
    return [answer for _, answer in deliver(pilot.mock, frame, pilot.now_us)]


def acks(frames):
    return [decode(frame).result for frame in frames if message_id(frame) == ACK]


AUTOPILOTS = [({}, 1), ({"firmware": "1.16"}, 2), ({"autopilot": "ardupilot"}, 2)]


@pytest.mark.parametrize(("options", "first"), AUTOPILOTS)
@pytest.mark.parametrize("mavlink", ["in_kind", "as_real"])
def test_who_is_answered_in_which_version(pilot, mavlink, options, first):
    """The real ones: 1.13's MAV_PROTO_VER is 0, 1.16's is 2; ArduPilot's ports speak 2. None goes back to 1."""
    p = pilot(mavlink=mavlink, **options).run(2.0)
    assert {frame_version(frame) for _, frame in p.frames} == {first}
    for version, answered in ((1, 1), (2, 2), (1, 1)) if mavlink == "in_kind" else ((1, first), (2, 2), (1, 2)):
        encoder = Encoder(255, 190, version)
        p.forget()
        p.send(HEARTBEAT, encoder)
        p.run(2.0)
        assert {frame_version(frame) for _, frame in p.frames} == {answered}
        [ack] = [m for m in p.send(ASK_VERSION, encoder) if m.get_type() == "AUTOPILOT_VERSION"]
        assert ack.flight_sw_version


def test_after_a_reboot_version_1_is_spoken_again(pilot):
    p = pilot().run(1.0)
    p.send(HEARTBEAT, Encoder(255, 190))
    for port in p.mock.ports:
        port.restart()
    p.forget()
    p.run(1.0)
    assert {frame_version(frame) for _, frame in p.frames} == {1}


def test_a_radios_report_says_nothing_of_the_version(pilot):
    p = pilot()
    send(p, Encoder(51, 68, version=2).encode(RADIO_STATUS))
    p.run(1.1)
    assert {frame_version(frame) for _, frame in p.frames} == {1}


def test_version_1_gets_no_message_with_an_id_above_255(pilot):
    p = pilot()
    [port] = p.mock.ports
    send(p, Encoder(255, 190, version=1).encode(HEARTBEAT))
    big = dialect.MAVLink_button_change_message(1, 2, 3)
    port.send(big)
    assert port.take() == []
    send(p, Encoder(255, 190).encode(HEARTBEAT))
    port.send(big)
    assert [message_id(frame) for frame in port.take()] == [257]


def test_off_takes_all_and_signs_nothing(pilot):
    p = pilot(signing={"mode": "off"}).run(1.1)
    for frame in (bytes(ARM.pack(theirs(p))), bytes(ARM.pack(theirs(p, bytes(32)))), Encoder(255, 190).encode(ARM)):
        answers = send(p, frame)
        assert acks(answers) == [0]
        assert not any(map(is_signed, answers))
    assert p.mock.rejected == {}


def test_accept_takes_unsigned_frames_and_rejects_wrong_signatures(pilot):
    p = pilot(**mock_with("accept")).run(1.1)
    answers = send(p, Encoder(255, 190).encode(ARM))
    assert acks(answers) == [0]
    assert not any(map(is_signed, answers))
    assert send(p, bytes(ARM.pack(theirs(p, bytes(32))))) == []
    assert p.mock.rejected == {"wrong signature": 1}
    answers = send(p, bytes(ARM.pack(theirs(p))))
    assert acks(answers) == [0]
    assert all(map(is_signed, answers))


def test_require_takes_nothing_but_good_signatures(pilot):
    p = pilot(**mock_with("require")).run(1.1)
    assert all(is_signed(frame) for _, frame in p.frames)
    for frame in (
        Encoder(255, 190).encode(ARM),
        Encoder(255, 190, version=1).encode(ARM),
        bytes(ARM.pack(theirs(p, bytes(32)))),
    ):
        assert send(p, frame) == []
    assert not p.mock.armed
    mav = theirs(p)
    good = bytes(ARM.pack(mav))
    answers = send(p, good)
    assert acks(answers) == [0]
    assert p.mock.armed
    assert send(p, good) == []
    assert p.mock.rejected == {"unsigned": 2, "wrong signature": 1, "old timestamp": 1}


def test_require_lets_radio_status_pass_unsigned(pilot):
    p = pilot(**mock_with("require"))
    send(p, Encoder(51, 68, version=1).encode(RADIO_STATUS))
    assert p.mock.rejected == {}
    p.run(1.1)
    assert all(is_signed(frame) for _, frame in p.frames)


def test_pymavlink_believes_every_signature_of_a_whole_second(pilot):
    p = pilot(**mock_with("require")).run(1.1)
    mav = theirs(p)
    messages = [mav.decode(bytearray(frame)) for _, frame in p.frames]
    assert len(messages) > 300
    assert all(message.get_signed() for message in messages)
    assert mav.signing.badsig_count == 0


def test_each_port_has_a_link_id_of_its_own_and_no_replay_passes_from_one_to_the_other(pilot):
    p = pilot()
    config = parse_section(MockConfig, mock_with("require", link_id=255), "test")
    mock = MockAutopilot(config, 1, p.now_us, ports=("onboard", "gcs"))
    for _ in mock.ports:
        mock.on_deadline(mock.next_deadline_us())
    frames = [mock.datagrams_to_send(port) for port in (0, 1)]
    assert [{frame[-13] for frame in sent} for sent in frames] == [{255}, {0}]
    good = Signing(KEY, 9).sign(Encoder(255, 190).encode(HEARTBEAT, signed=True), p.now_us)
    mock.receive(good, p.now_us + 9000, 0)
    mock.receive(good, p.now_us + 9004, 1)
    assert mock.rejected == {"old timestamp": 1}


def test_the_key_may_come_from_a_file(pilot, tmp_path):
    (tmp_path / "key").write_text(KEY.hex() + "\n")
    p = pilot(signing={"mode": "require", "key_file": str(tmp_path / "key")}).run(1.1)
    assert acks(send(p, bytes(ARM.pack(theirs(p))))) == [0]


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"mode": "require"}, "wants a passphrase or a key_file"),
        ({"mode": "accept", "key_file": "nowhere"}, "nowhere: No such file"),
        ({"mode": "accept", "key_file": __file__}, "64 hexadecimal digits"),
        ({"mode": "accept", "key_file": __file__, "passphrase": "x"}, "exclude each other"),
        ({"mode": "must"}, "'off', 'accept' or 'require'"),
        ({"link_id": 256}, "255"),
    ],
)
def test_what_cannot_be_used_as_a_key_is_refused(keys, reason):
    with pytest.raises(ConfigError, match=reason):
        parse_section(MockConfig, {"signing": keys}, "test", "mock")


def setup_signing(key=KEY, timestamp=5, system_id=1):
    return dialect.MAVLink_setup_signing_message(system_id, 1, list(key), timestamp)


@pytest.fixture
def copter(pilot):
    """An ArduCopter with two ports, as far as signing is concerned."""

    def make(**config):
        parsed = parse_section(MockConfig, {"autopilot": "ardupilot", **config}, "test")
        return MockAutopilot(parsed, 1, pilot().now_us, ports=("serial", "serial"))

    return make


def told(mock, message, port=0, now_us=1_700_000_000_100_000):
    mock.receive(Encoder(255, 190).encode(message), now_us, port)
    return [port.signatures is not None for port in mock.ports]


def test_arducopter_takes_a_key_over_the_link_and_gives_it_up_again(copter):
    mock = copter()
    assert told(mock, setup_signing(system_id=2)) == [False, False]
    assert told(mock, setup_signing()) == [True, True]
    mock.receive(Encoder(255, 190).encode(HEARTBEAT), 1_700_000_000_200_000, 1)
    assert mock.rejected == {"unsigned": 1}
    told(mock, HEARTBEAT)
    assert mock.rejected == {"unsigned": 1}, "the first port goes on taking unsigned frames"
    assert told(mock, setup_signing(bytes(32), 0)) == [False, False]


def test_a_mode_that_was_configured_stays_when_the_key_changes(copter):
    mock = copter(**mock_with("require"))
    assert told(mock, setup_signing(bytes(32), 0)) == [True, True]
    assert mock.rejected == {"unsigned": 1}


def test_px4_knows_no_setup_signing(pilot):
    p = pilot()
    assert told(p.mock, setup_signing()) == [False]
