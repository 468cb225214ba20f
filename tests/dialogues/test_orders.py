"""What the operator orders: the takeoff, another place, another mission, the landing."""

from __future__ import annotations

import json
import math

import pytest

from mavquad.flight.machine import Phase
from tests.dialogues.peer import PARAMS, Dialogue

WAITING = PARAMS.model_copy(
    update={"flight": PARAMS.flight.model_copy(update={"waits_for_takeoff": True, "at_end": "hold"})}
)


def order(dialogue, name, *args):
    dialogue._runner.command(name, getattr(dialogue.agent, name), dialogue.now_us, args)


def reference(dialogue):
    point = dialogue.agent.law.reference(dialogue.agent.law._controller.trace.stamp_us)
    return (point.x_m[0], point.y_m[0], point.z_m[0], point.yaw_rad[0])


@pytest.fixture
def flying():
    dialogue = Dialogue(params=WAITING).run(Phase.IDENTIFYING).run_for(1.0)
    order(dialogue, "takeoff")
    return dialogue.run(Phase.FLYING).run_for(0.2)


def test_nothing_is_armed_or_changed_before_the_takeoff_is_ordered():
    dialogue = Dialogue(params=WAITING).run(Phase.IDENTIFYING).run_for(60.0)
    assert dialogue.agent.phase is Phase.IDENTIFYING
    assert not dialogue.of("arm")
    assert not dialogue.of("PARAM_SET")
    order(dialogue, "takeoff")
    dialogue.run(Phase.FLYING)


def test_the_height_of_the_takeoff_is_its_parameter_on_px4():
    dialogue = Dialogue(params=WAITING).run(Phase.IDENTIFYING).run_for(1.0)
    order(dialogue, "takeoff", 4.0)
    dialogue.run(Phase.TAKING_OFF)
    [record] = dialogue.agent.changed_parameters.parameters
    assert (record.name, record.original, record.changed) == ("MIS_TAKEOFF_ALT", 2.5, 4.0)


def test_the_law_holds_on_until_the_landing_is_ordered(flying):
    flying.run_for(20.0)
    assert flying.agent.phase is Phase.FLYING
    order(flying, "land")
    flying.run()
    assert flying.agent.error is None
    assert not flying.agent.interrupted
    assert flying.phases[-4:] == ["handing back", "landing", "restoring", "done"]


def test_goto_leads_to_the_place_and_stays_there(flying):
    before = reference(flying)
    order(flying, "goto", 2.0, -1.0, -0.5, 90.0)
    assert flying.agent.order_fault == ""
    flying.run_for(15.0)
    x, y, z, yaw = reference(flying)
    # North is x, west is y, up is z; a heading of 90 degrees is a yaw of -90.
    assert (x - before[0], y - before[1], z - before[2]) == pytest.approx((2.0, 1.0, 0.5))
    assert math.cos(yaw + math.pi / 2) == pytest.approx(1.0)
    order(flying, "goto", 0.0, 0.0, 0.0)
    flying.run_for(15.0)
    assert reference(flying)[:3] == pytest.approx(before[:3])
    assert reference(flying)[3] == pytest.approx(yaw)


def test_the_reference_never_jumps_when_an_order_comes_in_the_middle_of_another(flying):
    order(flying, "goto", 3.0, 0.0, 0.0)
    flying.run_for(1.5)
    before = reference(flying)
    order(flying, "goto", 0.0, 3.0, 0.0)
    flying.run_for(0.02)
    assert math.dist(before[:3], reference(flying)[:3]) < 0.05


@pytest.mark.parametrize(
    ("name", "args", "words"),
    [
        ("goto", (0.0, 0.0, 2.3), "guards.floor_m"),
        ("goto", (0.0, 0.0, -30.0), "guards.ceiling_m"),
        ("goto", (99.0, 0.0, 0.0), "guards.radius_m"),
        ("fly", (json.dumps({"name": "circle", "radius_m": 300.0}),), "guards.radius_m"),
        ("fly", (json.dumps({"name": "looping"}),), "name"),
        ("fly", ("{",), "not JSON"),
        ("fly", ("[]",), "no table"),
    ],
)
def test_an_order_out_of_the_volume_is_not_flown(flying, name, args, words):
    before = reference(flying)
    order(flying, name, *args)
    assert words in flying.agent.order_fault
    flying.run_for(2.0)
    assert reference(flying) == before
    assert flying.agent.phase is Phase.FLYING


def test_a_mission_is_flown_and_its_end_held(flying):
    before = reference(flying)
    order(flying, "fly", json.dumps({"name": "box", "side_m": 1.0}))
    assert flying.agent.order_fault == ""
    flying.run_for(2.0)
    assert reference(flying) != before
    flying.run_for(40.0)
    assert reference(flying)[:3] == pytest.approx(before[:3], abs=1e-9)
    assert flying.agent.phase is Phase.FLYING


def test_an_order_before_the_law_flies_is_refused():
    dialogue = Dialogue().run(Phase.TAKING_OFF)
    order(dialogue, "goto", 1.0, 0.0, 0.0)
    assert "phase taking off" in dialogue.agent.order_fault
