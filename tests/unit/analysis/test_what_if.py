"""Another law beside a lockstep flight, and the flown law itself."""

from __future__ import annotations

import json

import pytest

from mavquad.agent import Agent
from mavquad.analysis.what_if import Flown, what_if
from mavquad.analysis.what_if_figure import what_if_figure
from mavquad.drivers.flown import Witness
from mavquad.drivers.lockstep import START_US
from mavquad.drivers.replay import replay
from mavquad.protocol.codec import Encoder, decode, mavlink, message_id
from mavquad.tlog import Record
from mavquad.types import Position
from tests.support import fly

SHORT = {
    "mission.name": '"hover"',
    "mission.duration_s": 2,
    "mock.wind_ned_m_s": [3.0, -2.0, 0.0],
    "mock.link.loss": 0.03,
}


def flown(overrides):
    flight = fly(overrides)
    agent = Agent(flight.config, START_US)
    witness = Witness(agent, flight.config)
    assert replay(agent, START_US, flight.recording.records, flight.recording.events, witness).equal
    return flight, witness.flown


@pytest.fixture(scope="module")
def torque():
    return flown(SHORT)


def test_the_flown_law_beside_itself_is_equal_to_the_bit(torque):
    flight, seen = torque
    found = what_if(seen, flight.config.law, "torque")
    assert len(found.answers) == len(flight.rows) > 200
    assert [answer.other for answer in found.answers] == [answer.flown for answer in found.answers] == flight.rows
    assert found.differences().rms == (0.0,) * 4
    assert found.same_inputs


@pytest.mark.parametrize(
    "options",
    [
        {"law.depth": '"rate"'},
        {"law.form": '"state_feedback"', "law.depth": '"attitude"'},
        # On prediction now and then, with less of the tilt that the wind takes.
        {
            "guards.late_position_s": 0.03,
            "guards.stale_position_s": 0.12,
            "mock.link.loss": 0.3,
            "law.limits.tilt_max_deg": 22,
        },
    ],
)
def test_so_it_is_at_other_depths_with_state_feedback_and_late_positions(options):
    flight, seen = flown({**SHORT, **options})
    found = what_if(seen, flight.config.law, flight.rows[0].depth)
    assert [answer.other for answer in found.answers] == flight.rows


def test_forged_poses_do_not_enter(torque):
    """MAVLink 1 frames with the vehicle's own name, between its own of MAVLink 2: the agent does not take them."""
    flight, _ = torque
    forger = Encoder(1, 1, version=1)
    records = []
    for record in flight.recording.records:
        records.append(record)
        if not record.outbound and message_id(record.frame) == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            stamp_ms = decode(record.frame).time_boot_ms + 1
            lie = forger.encode(mavlink.MAVLink_local_position_ned_message(stamp_ms, 90.0, 90.0, 90.0, 0.0, 0.0, 0.0))
            records.append(Record(record.stamp_us + 4, 0, lie))
    agent = Agent(flight.config, START_US)
    witness = Witness(agent, flight.config)
    replay(agent, START_US, records, flight.recording.events, witness)
    assert agent.link.forged > 1000
    places = [
        i.measured.position_nwu_m for i in witness.flown.inputs if isinstance(getattr(i, "measured", None), Position)
    ]
    assert len(places) > 500
    assert max(abs(x) for x, _, _ in places) < 50.0


def test_a_slower_law_asks_for_less(torque):
    flight, seen = torque
    slow = flight.config.law.model_copy(update={"omega0_rad_s": 1.0, "kappa_rad_s": 4.0})
    found = what_if(seen, slow, "torque")
    size = [
        sum(abs(row.input[2]) + abs(row.input[3]) for row in rows)
        for rows in (flight.rows, [a.other for a in found.answers])
    ]
    assert size[1] < 0.6 * size[0]
    assert found.differences().rms[1] == 0.0  # yaw has gains of its own


def test_another_depth_stays_near_the_motion_that_was_measured(torque):
    flight, seen = torque
    found = what_if(seen, flight.config.law, "attitude")
    thrust, yaw, roll, pitch = found.differences().rms
    assert not found.same_inputs
    assert 0.0 < max(roll, pitch) < 0.06
    assert max(abs(answer.acted[3]) for answer in found.counted) > 0.15  # it leans into the wind
    assert 0.0 < thrust < 0.6
    assert 0.0 < yaw < 0.05


def test_limits_are_told_apart(torque):
    flight, seen = torque
    limits = flight.config.law.limits.model_copy(update={"tilt_max_deg": 5.0})
    as_flown, other = what_if(seen, flight.config.law.model_copy(update={"limits": limits}), "torque").limits()
    assert "tilt" not in as_flown
    assert other["tilt"] > 0.9


def test_the_time_before_and_after_its_flying_does_not_count(torque):
    flight, seen = torque
    found = what_if(seen, flight.config.law, "torque")
    assert 150 < len(found.counted) < len(found.answers)
    assert {answer.flown.phase for answer in found.counted} == {"flying"}


def test_a_flight_without_the_law(torque):
    flight, _ = torque
    found = what_if(Flown(flight.config.airframe), flight.config.law, "rate")
    assert (found.answers, found.differences().rms) == ((), (None,) * 4)
    assert found.limits() == ({}, {})


def test_json_and_figure(torque, tmp_path):
    flight, seen = torque
    found = what_if(seen, flight.config.law, "rate")
    written = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert (written["flown_depth"], written["depth"], written["acted"]) == ("torque", "rate", "the measured motion")
    assert written["input_units"]["roll"] == "rad/s"
    what_if_figure(found, tmp_path / "beside.png", "title", "words")
    assert (tmp_path / "beside.png").stat().st_size > 30_000
