"""The transition table against one written out by hand, and what can be reached from where."""

from __future__ import annotations

import pytest

from mavquad.flight.machine import IN_FLIGHT, TRANSITIONS, Event, Phase, next_phase

# One row a phase, one column an event; "." stays.
COLUMNS = (
    "FOUND IDENTIFIED PREPARED UNPROVEN PROVEN READY ARMED AIRBORNE ENGAGED MISSION_OVER RELEASED LEFT LANDED DISARMED "
    "RESTORED REFUSED TIMEOUT GUARD TAKEN_OVER LOST STOP"
)
SHORT = {"REST": "RESTORING", "BACK": "HANDING_BACK"}
TABLE = """
CONNECTING   IDENTIFYING . . . . . . . . . . . . . . DONE DONE . DONE DONE DONE
IDENTIFYING  . PREPARING . . . . . . . . . . . . . DONE DONE . DONE DONE DONE
PREPARING    . . WAITING . . . . . . . . . . . . REST REST . DONE DONE REST
WAITING      . . . PROBING . ARMING . . . . . . . . . REST REST . DONE DONE REST
PROBING      . . . . WITHDRAWING . . . . . . . . . . REST WITHDRAWING . DONE DONE WITHDRAWING
WITHDRAWING  . . . . . . . . . . WAITING REST . . . . REST . DONE DONE .
ARMING       . . . . . . TAKING_OFF . . . . . . . . REST DISARMING . DONE DONE DISARMING
TAKING_OFF   . . . . . . . ENGAGING . . . . . REST . DISARMING LANDING . DONE DONE LANDING
ENGAGING     . . . . . . . . FLYING . . . . REST . BACK BACK BACK DONE DONE BACK
FLYING       . . . . . . . . . BACK . . . REST . . . BACK DONE DONE BACK
HANDING_BACK . . . . . . . . . . LANDING DONE . REST . LANDING LANDING . DONE DONE .
LANDING      . . . . . . . . . . . . DISARMING REST . . DONE . DONE DONE .
DISARMING    . . . . . . . . . . . . . REST . REST REST . DONE DONE .
RESTORING    . . . . . . . . . . . . . . DONE . DONE . DONE DONE .
DONE         . . . . . . . . . . . . . . . . . . . . .
"""


def rows(line):
    phase, *cells = line.split()
    for event, cell in zip(COLUMNS.split(), cells, strict=True):
        yield Phase[phase], Event[event], Phase[phase if cell == "." else SHORT.get(cell, cell)]


EXPECTED = [row for line in TABLE.strip().splitlines() for row in rows(line)]


@pytest.mark.parametrize(("phase", "event", "then"), EXPECTED)
def test_the_table(phase, event, then):
    assert next_phase(phase, event) is then


def test_the_hand_written_table_has_every_pair():
    assert {(phase, event) for phase, event, _ in EXPECTED} == {(phase, event) for phase in Phase for event in Event}


def reachable(start):
    seen, todo = {start}, [start]
    while todo:
        for phase in TRANSITIONS[todo.pop()].values():
            if phase not in seen:
                seen.add(phase)
                todo.append(phase)
    return seen


def test_every_phase_is_reached_from_connecting():
    assert reachable(Phase.CONNECTING) == set(Phase)


@pytest.mark.parametrize("phase", list(Phase))
def test_done_is_reached_from_every_phase(phase):
    assert Phase.DONE in reachable(phase)


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.CONNECTING])
def test_there_is_no_way_back(phase):
    assert Phase.CONNECTING not in reachable(phase)
    assert Phase.FLYING not in reachable(phase) or phase not in (Phase.HANDING_BACK, Phase.LANDING, Phase.DISARMING)


def test_an_operators_stop_lands_whatever_may_be_in_the_air():
    assert {phase for phase in IN_FLIGHT if next_phase(phase, Event.STOP) is Phase.DONE} == set()


def test_the_phases_in_flight():
    assert {phase.name for phase in IN_FLIGHT} == {"TAKING_OFF", "ENGAGING", "FLYING", "HANDING_BACK", "LANDING"}
