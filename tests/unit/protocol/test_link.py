"""The lock on one autopilot."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from mavquad.protocol.codec import Encoder, mavlink
from mavquad.protocol.link import Link, LinkParams, heartbeat

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
