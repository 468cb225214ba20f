"""Signed flights in lockstep, and flights under a forger's fire."""

from __future__ import annotations

from pathlib import Path

import pytest

from mavquad.agent import Agent
from mavquad.drivers.lockstep import START_US
from mavquad.drivers.replay import replay
from mavquad.protocol.codec import Encoder, is_signed, mavlink
from mavquad.protocol.signing import key_of_passphrase
from tests.support import LockstepFlight, prepare, run

KEY = key_of_passphrase("a secret")
HOVER = {"mission.name": "hover", "mission.duration_s": "3.0"}


def signed_flight(mode: str, key: bytes | None, tmp_path: Path) -> LockstepFlight:
    file = tmp_path / "vehicle.key"
    file.write_text(KEY.hex())
    return prepare({**HOVER, "mock.signing.mode": f'"{mode}"', "mock.signing.key_file": f'"{file}"'}, key=key)


def test_a_signed_flight_replays_bit_for_bit_with_its_key_and_not_without(tmp_path: Path) -> None:
    flight = signed_flight("require", KEY, tmp_path)
    run(flight)
    assert flight.exit_code == 0
    assert flight.agent.link.rejected.total() == 0
    assert all(is_signed(record.frame) for record in flight.recording.records)
    recorded = (START_US, flight.recording.records, flight.recording.events)
    assert replay(Agent(flight.config, START_US, KEY), *recorded).equal
    assert not replay(Agent(flight.config, START_US), *recorded).equal
    assert not replay(Agent(flight.config, START_US, key_of_passphrase("another")), *recorded).equal


@pytest.mark.parametrize("key", [None, key_of_passphrase("another")])
def test_without_the_right_key_nothing_flies(key: bytes | None, tmp_path: Path) -> None:
    flight = signed_flight("require", key, tmp_path)
    run(flight)
    assert flight.exit_code == 3
    assert flight.agent.status().setpoints_sent == 0


def test_with_a_key_a_vehicle_that_does_not_sign_is_not_taken() -> None:
    flight = prepare(HOVER, key=KEY)
    run(flight)
    assert flight.exit_code == 3
    assert flight.agent.link.vehicle is None
    assert flight.agent.link.rejected["unsigned"] > 5


def test_a_flood_of_forged_heartbeats_does_not_end_the_flight() -> None:
    """As an attack on an ArduCopter was recorded: every 6 ms for 20 s one of MAVLink 1, disarmed, from the vehicle's ids."""
    flight = prepare(HOVER)
    run(flight, until="flying")
    forger = Encoder(1, 1, version=1)
    at_us = flight.lockstep.now_us
    sent = 0
    while not flight.agent.done and flight.lockstep.now_us < at_us + 20_000_000:
        flight.lockstep.step()
        if flight.lockstep.now_us >= at_us + 6_000 * sent:
            sent += 1
            disarmed = mavlink.MAVLink_heartbeat_message(0, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
            flight.lockstep.near.datagram(forger.encode(disarmed), flight.lockstep.now_us)
    run(flight)
    assert sent > 500
    assert flight.exit_code == 0
    assert flight.agent.link.forged == sent
    assert flight.replayed().equal
