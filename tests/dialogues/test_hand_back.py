"""A hand-back is over when HEARTBEAT shows the mode that was asked for; any other one is the pilot's, or a failsafe's."""

from __future__ import annotations

import pytest

from mavquad.flight.guard_motion import JumpParams
from mavquad.flight.machine import Phase
from mavquad.protocol.firmware import ardupilot, px4
from tests.dialogues.copter import ScriptedCopter
from tests.dialogues.peer import PARAMS, POSCTL, REJECTED, Dialogue, ScriptedVehicle, answer, silent
from tests.dialogues.test_arducopter import sends_nothing_more

RETURNS = PARAMS.model_copy(
    update={"guards": PARAMS.guards.model_copy(update={"jump": JumpParams(position_m=0.5, reaction="return")})}
)
COPTER, QUAD = ScriptedCopter, ScriptedVehicle


def tripped(craft, params=RETURNS, **keys):
    """In flight, and a guard has just tripped."""
    dialogue = Dialogue(craft(**keys), params).run(Phase.FLYING).run_for(0.5)
    dialogue.vehicle.east_m += 2.0
    return dialogue.run(Phase.HANDING_BACK)


@pytest.mark.parametrize(
    ("craft", "home", "mode"),
    [
        (QUAD, "home", px4.LOITER),
        (QUAD, "home", px4.LAND),
        (QUAD, "home", POSCTL),
        (COPTER, "RTL", ardupilot.BRAKE),
        (COPTER, "RTL", ardupilot.LAND),
        (COPTER, "RTL", ardupilot.LOITER),
    ],
)
def test_another_mode_than_that_to_return_in_is_a_take_over(craft, home, mode) -> None:
    dialogue = tripped(craft, answers={home: silent})
    dialogue.vehicle.mode = mode
    dialogue.run(Phase.DONE, 1.5)
    assert sends_nothing_more(dialogue)
    assert "landing" not in dialogue.phases
    assert f"took over: mode {mode.name} while handing back" in dialogue.agent.error.message


@pytest.mark.parametrize(("craft", "mode"), [(QUAD, px4.LAND), (COPTER, ardupilot.LAND)])
def test_a_landing_that_was_not_asked_for_yet_is_a_take_over(craft, mode) -> None:
    params = PARAMS.model_copy(
        update={"guards": PARAMS.guards.model_copy(update={"jump": JumpParams(position_m=0.5, reaction="land")})}
    )
    dialogue = tripped(craft, params, answers={"loiter": silent, "BRAKE": silent})
    dialogue.vehicle.mode = mode
    dialogue.run(Phase.DONE, 1.5)
    assert f"took over: mode {mode.name} while handing back" in dialogue.agent.error.message


@pytest.mark.parametrize(
    ("craft", "modes"),
    [(QUAD, (px4.LOITER, px4.LAND, POSCTL)), (COPTER, (ardupilot.BRAKE, ardupilot.LAND, ardupilot.LOITER))],
)
def test_who_takes_it_over_on_the_way_home_keeps_it(craft, modes) -> None:
    for mode in modes:
        dialogue = tripped(craft).run(Phase.LANDING).run_for(0.2)
        dialogue.vehicle.mode = mode
        dialogue.run(Phase.DONE, 1.5)
        assert sends_nothing_more(dialogue)
        assert f"took over: mode {mode.name} while landing" in dialogue.agent.error.message


@pytest.mark.parametrize(("craft", "home", "land"), [(QUAD, "home", px4.LAND), (COPTER, "RTL", ardupilot.LAND)])
def test_where_it_refuses_to_return_it_lands(craft, home, land) -> None:
    dialogue = tripped(craft, answers={home: answer(REJECTED)})
    dialogue.run()
    assert dialogue.phases[-4:] == ["handing back", "landing", "restoring", "done"]
    assert dialogue.vehicle.mode == land
    assert not dialogue.vehicle.armed
    assert dialogue.agent.error.message.startswith("guard 'jump'")
    assert "RTL (TEMPORARILY_REJECTED)" in dialogue.agent.error.message
    assert "took over" not in dialogue.agent.error.message


@pytest.mark.parametrize(("craft", "home"), [(QUAD, px4.RTL), (COPTER, ardupilot.RTL)])
def test_it_returns(craft, home) -> None:
    dialogue = tripped(craft)
    dialogue.run(Phase.LANDING, 1.5)
    assert dialogue.vehicle.mode == home
    dialogue.run()
    assert dialogue.phases[-4:] == ["handing back", "landing", "restoring", "done"]
    assert "took over" not in dialogue.agent.error.message
