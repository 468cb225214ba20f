"""Parameters of the vehicle: kept before they are changed, verified, put back; and when they are not."""

from __future__ import annotations

import pytest

from mavquad.errors import VehicleRefused
from mavquad.flight.machine import Phase
from mavquad.flight.parameters import VehicleParameters
from mavquad.protocol.codec import mavlink
from tests.dialogues.peer import PARAMS, POSCTL, Dialogue, ScriptedVehicle

REAL = mavlink.MAV_PARAM_TYPE_REAL32
CHANGING = PARAMS.model_copy(
    update={"parameters": VehicleParameters(px4={"COM_OF_LOSS_T": 0.5, "COM_RCL_EXCEPT": "+4"})}
)


def of(dialogue, name="COM_OF_LOSS_T"):
    return dialogue.vehicle.parameters[name][1]


def test_nothing_is_changed_before_what_it_was_is_kept():
    dialogue = Dialogue(params=CHANGING)
    dialogue.keeps = False
    dialogue.run(lambda: dialogue.agent.awaits_record).run_for(3.0)
    assert dialogue.agent.phase is Phase.PREPARING
    assert not dialogue.of("PARAM_SET")
    [record] = dialogue.agent.changed_parameters.parameters
    assert (record.name, record.original, record.changed) == ("COM_OF_LOSS_T", 1.0, 0.5)
    dialogue.keeps = True
    dialogue.run(Phase.FLYING)
    assert [sent.message.param_id for sent in dialogue.of("PARAM_SET")] == ["COM_OF_LOSS_T"]
    assert of(dialogue) == 0.5


def test_a_record_that_is_never_kept_ends_the_flight_on_the_ground():
    dialogue = Dialogue(params=CHANGING)
    dialogue.keeps = False
    dialogue.run()
    assert "the record of what the parameters were" in dialogue.agent.error.message
    assert not dialogue.of("PARAM_SET")
    assert not dialogue.of("arm")


def test_what_was_changed_is_put_back_after_the_landing():
    dialogue = Dialogue(params=CHANGING).run()
    assert dialogue.phases[-3:] == ["landing", "restoring", "done"]
    assert dialogue.agent.error is None
    assert dialogue.agent.changed_parameters.restored
    assert [sent.message.param_value for sent in dialogue.of("PARAM_SET")] == [0.5, 1.0]
    assert of(dialogue) == 1.0


@pytest.mark.parametrize("phase", [Phase.WAITING, Phase.FLYING])
def test_stopped_by_the_operator_they_are_put_back_as_well(phase):
    dialogue = Dialogue(params=CHANGING).run(phase)
    assert of(dialogue) == 0.5
    dialogue.stop()
    dialogue.run()
    assert of(dialogue) == 1.0
    assert dialogue.agent.changed_parameters.restored


def test_the_pilot_who_takes_over_gets_no_parameters_set_in_the_air():
    dialogue = Dialogue(params=CHANGING).run(Phase.FLYING)
    dialogue.vehicle.mode = POSCTL
    dialogue.run()
    assert of(dialogue) == 0.5
    assert not dialogue.agent.changed_parameters.restored
    assert "not put back: COM_OF_LOSS_T" in [note.text for note in dialogue.notes]


def test_a_vehicle_that_keeps_its_value_is_refused_and_named():
    class Stubborn(ScriptedVehicle):
        def hear(self, message, name):
            if message.get_type() == "PARAM_SET":
                self.say(mavlink.MAVLink_param_value_message(b"COM_OF_LOSS_T", 1.0, REAL, 700, 1))
            else:
                super().hear(message, name)

    dialogue = Dialogue(Stubborn(), CHANGING).run()
    assert isinstance(dialogue.agent.error, VehicleRefused)
    assert "COM_OF_LOSS_T: the vehicle keeps it at 1" in dialogue.agent.error.message
    assert not dialogue.of("arm")


def test_bits_are_set_besides_those_that_are():
    dialogue = Dialogue(params=CHANGING)
    dialogue.vehicle.parameters["COM_RCL_EXCEPT"] = (mavlink.MAV_PARAM_TYPE_INT32, 1e-45)  # the bytes of 1
    dialogue.run(lambda: dialogue.agent.awaits_record)
    records = {record.name: record for record in dialogue.agent.changed_parameters.parameters}
    assert (records["COM_RCL_EXCEPT"].original, records["COM_RCL_EXCEPT"].changed) == (1, 5)


def test_a_transmitter_that_is_heard_keeps_its_failsafe():
    dialogue = Dialogue(params=CHANGING)
    dialogue.vehicle.parameters["COM_RCL_EXCEPT"] = (mavlink.MAV_PARAM_TYPE_INT32, 0.0)
    dialogue.vehicle.transmitter = True
    dialogue.run(lambda: dialogue.agent.awaits_record)
    assert [record.name for record in dialogue.agent.changed_parameters.parameters] == ["COM_OF_LOSS_T"]


def test_a_name_that_the_vehicle_does_not_know_is_left_out():
    params = PARAMS.model_copy(update={"parameters": VehicleParameters(px4={"NO_SUCH_THING": 1.0})})
    dialogue = Dialogue(params=params).run(Phase.FLYING)
    assert dialogue.agent.changed_parameters is None
    assert not dialogue.of("PARAM_SET")
