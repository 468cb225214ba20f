"""Reading parameters: PX4's bytewise integers, retries of what is missing, names that nobody knows."""

from __future__ import annotations

import struct

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Encoder, decode, mavlink
from mavquad.protocol.param_value import Encoding, decode_value
from mavquad.protocol.params import MAX_TRIES, RETRY_US, ParamReader

TARGET = (1, 1)
NAMES = ("COM_RCL_EXCEPT", "MPC_THR_HOVER")


def value(name, number, kind=mavlink.MAV_PARAM_TYPE_REAL32):
    """PARAM_VALUE over the wire; an integer's bytes stand in the float field, as PX4 sends it."""
    codes = {
        mavlink.MAV_PARAM_TYPE_REAL32: "<f",
        mavlink.MAV_PARAM_TYPE_INT32: "<i",
        mavlink.MAV_PARAM_TYPE_UINT8: "<B",
    }
    raw = struct.pack(codes[kind], number).ljust(4, b"\0")
    message = mavlink.MAVLink_param_value_message(name.encode(), struct.unpack("<f", raw)[0], kind, 700, 5)
    return decode(Encoder(1, 1).encode(message))


def bytewise(message):
    return decode_value(message, Encoding.BYTEWISE)


def asked(messages):
    return [message.param_id for message in messages]


def reading():
    reader = ParamReader()
    return reader, reader.request(NAMES, TARGET, 1000)


def test_com_rcl_except_as_px4_sends_it():
    message = value("COM_RCL_EXCEPT", 4, mavlink.MAV_PARAM_TYPE_INT32)
    assert 0.0 < message.param_value < 1e-44  # the bytes 04 00 00 00 as a float are a denormal
    assert bytewise(message) == 4.0


@pytest.mark.parametrize("number", [0, 1, -1, -2, 7, 1000, -100_000, 2**30])
def test_integers(number):
    assert bytewise(value("X", number, mavlink.MAV_PARAM_TYPE_INT32)) == float(number)


def test_small_integers_and_floats():
    assert bytewise(value("X", 250, mavlink.MAV_PARAM_TYPE_UINT8)) == 250.0
    assert bytewise(value("X", 0.45)) == pytest.approx(0.45, abs=1e-7)


def test_all_are_asked_for_at_once_by_name():
    _, messages = reading()
    assert asked(messages) == list(NAMES)
    assert {(m.target_system, m.target_component, m.param_index) for m in messages} == {(1, 1, -1)}


def test_it_is_done_when_all_have_come():
    reader, _ = reading()
    assert not reader.done
    for name in NAMES:
        reader.on_value(value(name, 0.25))
    assert reader.done
    assert reader.values == dict.fromkeys(NAMES, 0.25)
    assert reader.next_deadline_us() == NEVER_US


def test_the_missing_ones_alone_are_asked_for_again():
    reader, _ = reading()
    reader.on_value(value("MPC_THR_HOVER", 0.25))
    assert reader.on_deadline(TARGET, 1000 + RETRY_US - 4) == []
    assert reader.next_deadline_us() == 1000 + RETRY_US
    assert asked(reader.on_deadline(TARGET, 1000 + RETRY_US)) == ["COM_RCL_EXCEPT"]


def test_an_unknown_name_is_given_up_and_not_made_up():
    reader, _ = reading()
    reader.on_value(value("MPC_THR_HOVER", 0.25))
    tries = 1
    while messages := reader.on_deadline(TARGET, reader.next_deadline_us()):
        assert asked(messages) == ["COM_RCL_EXCEPT"]
        tries += 1
    assert tries == MAX_TRIES == 12
    assert reader.done
    assert reader.values == {"MPC_THR_HOVER": 0.25}


def test_values_that_nobody_asked_for_are_not_kept():
    reader, _ = reading()
    reader.on_value(value("SYS_AUTOSTART", 1.0))
    assert reader.values == {}
    assert not reader.done


def test_the_number_of_an_integer_of_ardupilots_stands_as_it_is():
    reader = ParamReader(Encoding.CAST)
    reader.request(("WPNAV_SPEED",), TARGET, 1000)
    message = mavlink.MAVLink_param_value_message(b"WPNAV_SPEED", 1000.0, mavlink.MAV_PARAM_TYPE_INT16, 700, 5)
    reader.on_value(decode(Encoder(1, 1).encode(message)))
    assert reader.values == {"WPNAV_SPEED": 1000.0}
