"""Parameters: PX4's bytewise INT32 in a float, and the parameter messages."""

import math
import struct

import pytest

from mavquad.protocol.codec import Encoder, decode, mavlink
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.personality.parameter_table import load_parameters
from sitl_mock.personality.params import from_wire, hash_of, to_wire
from tests.unit.sitl_mock.conftest import START_US


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


def request_list(p):
    p.send(mavlink.MAVLink_param_request_list_message(1, 1))


def set_parameter(p, name, value, wire_type=mavlink.MAV_PARAM_TYPE_REAL32):
    p.forget()
    p.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, wire_type))
    p.run(0.1)
    return [(m.param_id, m.param_value) for m in p.messages("PARAM_VALUE")]


@pytest.mark.parametrize(("release", "recorded"), [("1.13", 0x90DB807), ("1.16", 0xC06115FB)])
def test_the_hash_as_recorded(release, recorded):
    # px4-v1.13.3-a, px4-v1.16.2-a: _HASH_CHECK before the values of those recordings
    rows = load_parameters("sitl_mock.personality.px4", f"parameters_{release}.csv")
    assert hash_of((row.name, row.value) for row in rows) == recorded


def test_the_hash_tells_a_change_but_not_of_what_px4_changes_itself():
    def hash_with(**values):
        return hash_of(({"MPC_XY_P": 0.95, "LND_FLIGHT_T_LO": 7} | values).items())

    assert hash_with(LND_FLIGHT_T_LO=8) == hash_with() != hash_with(MPC_XY_P=1.0)


@pytest.mark.parametrize(("firmware", "count", "seconds"), [("1.13", 722, 0.37), ("1.16", 893, 0.88)])
def test_a_list_as_recorded(pilot, firmware, count, seconds):
    p = pilot(firmware=firmware).run(1.0)
    p.forget()
    request_list(p)
    p.run(2.0)
    values, stamps_us = p.messages("PARAM_VALUE"), p.stamps_us("PARAM_VALUE")
    first = values.pop(0)
    assert (first.param_id, first.param_type, first.param_index, first.param_count) == ("_HASH_CHECK", 5, 65535, count)
    assert [v.param_index for v in values] == list(range(count))
    assert [v.param_id for v in values] == sorted(v.param_id for v in values)
    assert (stamps_us[-1] - stamps_us[0]) / 1e6 == pytest.approx(seconds, abs=0.03)


def test_the_hash_alone(pilot):
    p = pilot()
    (before,) = ask(p, "_HASH_CHECK")
    assert (before.param_type, before.param_index) == (5, 65535)
    assert ask(p, "_HASH_CHECK")[0].param_value == before.param_value
    set_parameter(p, "MPC_XY_P", 1.1)
    assert ask(p, "_HASH_CHECK")[0].param_value != before.param_value


def test_a_list_asked_for_again_begins_anew_without_its_hash(pilot):
    p = pilot().run(1.0)
    request_list(p)
    p.run(0.1).forget()
    request_list(p)
    p.run(2.0)
    values = p.messages("PARAM_VALUE")
    assert [v.param_index for v in values] == list(range(722))


def test_a_ground_station_that_knows_the_hash_stops_the_list(pilot):
    p = pilot().run(1.0)
    request_list(p)
    p.run(0.1)
    assert set_parameter(p, "_HASH_CHECK", 0.0, 5) == []


def test_a_change_is_answered_and_told_once_more(pilot):
    # px4-v1.16.2-a and a live 1.13.3: twice for a new value, once for the one that it has already
    p = pilot().run(1.0)
    assert set_parameter(p, "MIS_TAKEOFF_ALT", 3.0) == [("MIS_TAKEOFF_ALT", 3.0)] * 2
    assert set_parameter(p, "MIS_TAKEOFF_ALT", 3.0) == [("MIS_TAKEOFF_ALT", 3.0)]


def test_a_change_is_told_on_every_link():
    mock = MockAutopilot(MockConfig(), 1, START_US, ("onboard", "gcs"))
    change = mavlink.MAVLink_param_set_message(1, 1, b"MPC_XY_P", 1.25, mavlink.MAV_PARAM_TYPE_REAL32)
    mock.receive(Encoder(255, 190).encode(change), START_US + 400, 1)
    told = {0: [], 1: []}
    for tick in range(1, 30):
        mock.on_deadline(START_US + 4000 * tick)
        for port, seen in told.items():
            messages = [decode(frame) for frame in mock.datagrams_to_send(port)]
            seen += [m.param_value for m in messages if m.get_type() == "PARAM_VALUE"]
    assert told == {0: [1.25], 1: [1.25, 1.25]}


def test_lists_on_two_links_at_once():
    mock = MockAutopilot(MockConfig(), 1, START_US, ("onboard", "gcs"))
    for port in (0, 1):
        mock.receive(Encoder(255, 190).encode(mavlink.MAVLink_param_request_list_message(1, 1)), START_US + 400, port)
    counts = [0, 0]
    for tick in range(1, 125):
        mock.on_deadline(START_US + 4000 * tick)
        for port in (0, 1):
            counts[port] += sum(decode(f).get_type() == "PARAM_VALUE" for f in mock.datagrams_to_send(port))
    assert counts == [723, 723]


@pytest.mark.parametrize(
    ("name", "value", "wire_type"),
    [("MIS_TAKEOFF_ALT", 4.0, mavlink.MAV_PARAM_TYPE_INT32), ("COM_RCL_EXCEPT", 4.0, mavlink.MAV_PARAM_TYPE_REAL32)],
)
def test_a_wrong_type_is_neither_taken_nor_answered(pilot, name, value, wire_type):
    p = pilot().run(1.0)
    (before,) = ask(p, name)
    assert set_parameter(p, name, value, wire_type) == []
    assert ask(p, name)[0].param_value == before.param_value


def test_values_out_of_range_are_taken_and_nan_is_not(pilot):
    # live 1.13.3: MIS_TAKEOFF_ALT -1000 is taken; NaN is answered with the value that it keeps
    p = pilot().run(1.0)
    assert set_parameter(p, "MIS_TAKEOFF_ALT", -1000.0) == [("MIS_TAKEOFF_ALT", -1000.0)] * 2
    assert set_parameter(p, "MIS_TAKEOFF_ALT", math.nan) == [("MIS_TAKEOFF_ALT", -1000.0)]
    assert (
        set_parameter(p, "COM_RCL_EXCEPT", to_wire(1_000_000), mavlink.MAV_PARAM_TYPE_INT32)
        == [("COM_RCL_EXCEPT", to_wire(1_000_000))] * 2
    )


@pytest.mark.parametrize(("index", "found"), [(0, True), (721, True), (722, False), (32767, False)])
def test_reads_by_index_end_with_the_list(pilot, index, found):
    assert bool(ask(pilot(), index=index)) is found
