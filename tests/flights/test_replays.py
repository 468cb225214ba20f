"""Whole flights run again from their record: with orders of the operator, with faults, ended by a guard."""

import pytest

from mavquad.agent import Agent
from mavquad.analysis.what_if import what_if
from mavquad.drivers.flown import Witness
from mavquad.drivers.lockstep import START_US
from mavquad.drivers.replay import OperatorEvent, replay
from tests.support import LockstepFlight, prepare, run

HOVER = {"mission.name": '"hover"', "mission.duration_s": 60}


def with_orders() -> LockstepFlight:
    """goto with and without a heading, and land, while it flies."""
    flight = prepare({**HOVER, "mock.wind_ned_m_s": [2.0, 1.0, 0.0], "mock.link.loss": 0.02})
    run(flight, until="flying")
    for name, args, for_s in (
        ("goto", (1.5, -0.5, -0.5, 40.0), 4.0),
        ("goto", (0.0, 1.0, 0.25), 4.0),
        ("land", (), 0.0),
    ):
        flight.lockstep.command(name, getattr(flight.agent, name), *args)
        assert flight.agent.order_fault == ""
        end_us = flight.lockstep.now_us + for_s * 1e6
        while flight.lockstep.now_us < end_us:
            flight.lockstep.step()
    run(flight)
    return flight


@pytest.fixture(scope="module")
def ordered() -> LockstepFlight:
    flight = with_orders()
    assert flight.agent.done
    assert flight.exit_code == 0
    return flight


def test_orders_are_flown_and_replay_bit_for_bit(ordered):
    names = [
        (event.name, event.args) for event in ordered.recording.events if event.name not in ("start", "kept", "end")
    ]
    assert names == [("goto", (1.5, -0.5, -0.5, 40.0)), ("goto", (0.0, 1.0, 0.25)), ("land", ())]
    norths = [row.reference[2] - ordered.rows[0].reference[2] for row in ordered.rows]
    assert max(norths) > 1.0
    assert ordered.replayed().equal


@pytest.mark.parametrize("changed", [("goto", (1.5, -0.5, -0.5, 40.1)), ("goto", (1.5, -0.5, -0.5)), None])
def test_another_order_is_another_flight(ordered, changed):
    events = list(ordered.recording.events)
    place = next(i for i, event in enumerate(events) if event.name == "goto")
    events[place : place + 1] = [OperatorEvent(events[place].stamp_us, *changed)] if changed else []
    found = replay(Agent(ordered.config, START_US), START_US, ordered.recording.records, events)
    assert not found.equal


def test_the_law_beside_itself_follows_the_orders_too(ordered):
    agent = Agent(ordered.config, START_US)
    witness = Witness(agent, ordered.config)
    assert replay(agent, START_US, ordered.recording.records, ordered.recording.events, witness).equal
    found = what_if(witness.flown, ordered.config.law, ordered.rows[0].depth)
    assert [answer.other for answer in found.answers] == ordered.rows
