"""Parameters: PX4's bytewise INT32 in a float, and the parameter messages."""

import struct

import pytest

from mavquad.protocol.codec import decode, mavlink
from sitl_mock.personality.params import from_wire, to_wire


def ask(pilot, name="", index=-1):
    return pilot.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index))


def test_bytewise_as_recorded():
    # px4-v1.13.3-a: COM_RCL_EXCEPT = 4 travels as 5.605193857299268e-45
    assert to_wire(4) == 5.605193857299268e-45
    assert from_wire(5.605193857299268e-45, like=0) == 4
    assert to_wire(2.5) == 2.5
    assert from_wire(2.5, like=1.0) == 2.5


def test_int32_and_float_read_back(pilot):
    (answer,) = ask(pilot(), "COM_RCL_EXCEPT")
    assert answer.param_type == mavlink.MAV_PARAM_TYPE_INT32
    assert struct.pack("<f", answer.param_value) == struct.pack("<i", 4)
    (answer,) = ask(pilot(), "MIS_TAKEOFF_ALT")
    assert (answer.param_type, answer.param_value) == (mavlink.MAV_PARAM_TYPE_REAL32, 2.5)


def test_read_by_index_gives_the_same_parameter(pilot):
    (by_name,) = ask(pilot(), "MPC_THR_HOVER")
    (by_index,) = ask(pilot(), index=by_name.param_index)
    assert by_index.param_id == "MPC_THR_HOVER"


def test_unknown_names_get_no_answer(pilot):
    assert ask(pilot(), "NO_SUCH") == []
    assert ask(pilot(), index=9999) == []
    wrong = mavlink.MAVLink_param_set_message(1, 1, b"NO_SUCH", 1.0, mavlink.MAV_PARAM_TYPE_REAL32)
    assert pilot().send(wrong) == []


def test_set_is_echoed_and_kept(pilot):
    p = pilot()
    (echo,) = p.send(
        mavlink.MAVLink_param_set_message(1, 1, b"COM_RCL_EXCEPT", to_wire(7), mavlink.MAV_PARAM_TYPE_INT32)
    )
    assert from_wire(echo.param_value, like=0) == 7
    (answer,) = ask(p, "COM_RCL_EXCEPT")
    assert from_wire(answer.param_value, like=0) == 7


def test_whole_list_comes_once_each(pilot):
    p = pilot()
    p.send(mavlink.MAVLink_param_request_list_message(1, 1))
    p.run(1.0)
    values = p.messages("PARAM_VALUE")[1:]
    assert [v.param_index for v in values] == list(range(values[0].param_count))
    assert {"COM_OF_LOSS_T", "COM_OBL_RC_ACT", "MAV_SYS_ID", "SYS_AUTOSTART", "MPC_LAND_SPEED"} <= {
        v.param_id for v in values
    }


def test_for_another_system_nothing_comes(pilot):
    assert pilot().send(mavlink.MAVLink_param_request_read_message(2, 1, b"MAV_SYS_ID", -1)) == []


def test_parameters_act(pilot):
    p = pilot()
    p.send(mavlink.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 4.0, mavlink.MAV_PARAM_TYPE_REAL32))
    p.fly_to_hover()
    assert p.truth.position_ned_m[2] == pytest.approx(-4.0, abs=0.3)


def test_frames_decode_whole(pilot):
    p = pilot().run(2.1)
    assert all(decode(frame) for _, frame in p.frames)
