"""The lock on one autopilot."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from mavquad.protocol.codec import Encoder, decode, is_signed, mavlink
from mavquad.protocol.link import Link, LinkParams, heartbeat
from mavquad.protocol.signing import Signing, key_of_passphrase

PX4 = mavlink.MAV_AUTOPILOT_PX4
INVALID = mavlink.MAV_AUTOPILOT_INVALID
QUAD = mavlink.MAV_TYPE_QUADROTOR


def beat(system=1, component=1, autopilot=PX4, kind=QUAD, sequence=0):
    return framed(mavlink.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 0, 3), system, component, sequence)


def attitude(system=1, component=1, sequence=0):
    return framed(mavlink.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0), system, component, sequence)


def framed(message, system, component, sequence):
    encoder = Encoder(system, component)
    encoder.sequence = sequence
    return encoder.encode(message)


def locked(sequence=0):
    link = Link(LinkParams())
    link.accept(beat(sequence=sequence), 1000)
    return link


def test_the_first_autopilot_is_taken():
    link = Link(LinkParams())
    assert link.accept(beat(7, 3), 1000)
    assert link.vehicle == (7, 3)
    assert link.last_heard_us == 1000


@pytest.mark.parametrize(
    ("autopilot", "kind"),
    [
        (INVALID, mavlink.MAV_TYPE_GCS),
        (INVALID, QUAD),
        (PX4, mavlink.MAV_TYPE_GCS),
        (PX4, mavlink.MAV_TYPE_ONBOARD_CONTROLLER),
        (PX4, mavlink.MAV_TYPE_GIMBAL),
        (PX4, mavlink.MAV_TYPE_CAMERA),
    ],
)
def test_what_is_no_vehicle_is_not_taken(autopilot, kind):
    link = Link(LinkParams())
    assert not link.accept(beat(autopilot=autopilot, kind=kind), 1000)
    assert link.vehicle is None
    assert link.foreign == 0


def test_nothing_but_a_heartbeat_locks():
    link = Link(LinkParams())
    assert not link.accept(attitude(), 1000)
    assert link.vehicle is None


def test_the_wanted_system_alone_is_taken():
    link = Link(LinkParams(target_system=7))
    assert not link.accept(beat(1), 1000)
    assert link.accept(beat(7), 2000)
    assert link.vehicle == (7, 1)
    assert link.foreign == 0  # who spoke before the vehicle was found is nobody's business


@pytest.mark.parametrize("sender", [(2, 1), (1, 2), (2, 2)])
def test_once_locked_others_are_counted_and_ignored(sender):
    link = locked()
    assert not link.accept(beat(*sender), 2000)
    assert not link.accept(attitude(*sender, sequence=99), 3000)
    assert (link.vehicle, link.foreign, link.last_heard_us) == ((1, 1), 2, 1000)


def test_the_vehicles_frames_pass():
    link = locked()
    assert link.accept(attitude(sequence=1), 5000)
    assert link.last_heard_us == 5000


def test_mavlink_1_is_forged_once_the_vehicle_has_spoken_mavlink_2():
    old, new = Encoder(1, 1, version=1), Encoder(1, 1)
    new.sequence = 2  # one count for both versions
    link = Link(LinkParams())
    standby = mavlink.MAVLink_heartbeat_message(QUAD, PX4, 0, 0, 0, 3)
    assert link.accept(old.encode(standby), 1000)
    assert link.accept(old.encode(standby), 2000)  # PX4 1.13 begins with it
    assert link.accept(new.encode(standby), 3000)
    assert not link.accept(old.encode(standby), 4000)
    assert not link.accept(old.encode(mavlink.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0)), 4000)
    assert (link.forged, link.foreign, link.last_heard_us) == (2, 0, 3000)


def test_what_comes_twice_or_late_is_counted_and_not_taken():
    link = locked()
    assert link.accept(attitude(sequence=3), 2000)
    assert link.accept(beat(sequence=4), 3000)
    assert not link.accept(attitude(sequence=3), 4000)
    assert not link.accept(beat(sequence=2), 5000)
    assert (dict(link.out_of_order), link.forged, link.last_heard_us) == ({"doubled": 1, "late": 1}, 0, 3000)


@pytest.mark.parametrize(("autopilot", "kind"), [(INVALID, QUAD), (PX4, 0), (3, QUAD)])
def test_a_heartbeat_of_something_else_under_the_vehicles_name_is_forged(autopilot, kind):
    link = locked()
    assert not link.accept(beat(autopilot=autopilot, kind=kind, sequence=1), 2000)
    assert link.accept(beat(sequence=1), 3000)
    assert (link.forged, link.last_heard_us) == (1, 3000)


NOW_US = 1_700_000_000_000_000
KEY = key_of_passphrase("a secret")


def signed(signing, message, now_us, encoder):
    return signing.sign(encoder.encode(message, signed=True), now_us)


def test_with_a_key_what_is_not_rightly_signed_is_not_taken():
    link = Link(LinkParams(), KEY)
    good, bad, encoder = Signing(KEY, 0), Signing(key_of_passphrase("another"), 0), Encoder(1, 1)
    standby = mavlink.MAVLink_heartbeat_message(QUAD, PX4, 0, 0, 0, 3)
    assert not link.accept(beat(), NOW_US)
    assert not link.accept(signed(bad, standby, NOW_US, encoder), NOW_US)
    assert link.vehicle is None
    frame = signed(good, standby, NOW_US, encoder)
    assert link.accept(frame, NOW_US)
    assert not link.accept(frame, NOW_US + 100)  # said again by somebody who had heard it
    assert not link.accept(attitude(sequence=2), NOW_US + 200)
    assert link.rejected == {"unsigned": 2, "wrong signature": 1, "old timestamp": 1}
    assert link.last_heard_us == NOW_US


def test_with_a_key_what_is_sent_is_signed_with_our_link_id_and_rising_timestamps():
    link = Link(LinkParams(signing_link_id=7), KEY)
    frames = [link.encode(heartbeat(), NOW_US) for _ in range(3)]
    assert {frame[-13] for frame in frames} == {7}
    other = Signing(KEY, 0)
    assert [other.check(frame, NOW_US) for frame in frames] == [None, None, None]
    assert [decode(frame).get_seq() for frame in frames] == [0, 1, 2]


def test_without_a_key_nothing_is_signed():
    assert not is_signed(Link(LinkParams()).encode(heartbeat(), NOW_US))


def test_we_are_a_ground_station_on_the_link():
    message = heartbeat()
    assert (message.type, message.autopilot) == (mavlink.MAV_TYPE_GCS, INVALID)


@pytest.mark.parametrize(
    ("url", "first"), [("mock", True), ("udpout:h:1", True), ("udpin:h:1", False), ("udp:h:1", False)]
)
def test_who_speaks_first(url, first):
    assert LinkParams(url=url).speaks_first is first


def test_a_bad_url_is_refused_with_examples():
    with pytest.raises(ValidationError, match="examples: udpin"):
        LinkParams(url="tcpp:1.2.3.4:5760")
