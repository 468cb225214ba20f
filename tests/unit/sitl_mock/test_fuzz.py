"""Whatever a peer sends, the mock goes on: no message that it handles raises, and the vehicle's state stays finite."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavquad.protocol.codec import Encoder, mavlink
from sitl_mock.battery import Battery
from sitl_mock.personality.px4.defaults import px4_parameters
from sitl_mock.personality.px4.picture import Home
from sitl_mock.personality.px4.telemetry import BUILDERS
from sitl_mock.plant import VehicleParams
from sitl_mock.sensors import Estimate

HANDLED = (
    "COMMAND_INT",
    "COMMAND_LONG",
    "HEARTBEAT",
    "MANUAL_CONTROL",
    "MISSION_ACK",
    "MISSION_CLEAR_ALL",
    "MISSION_COUNT",
    "MISSION_ITEM",
    "MISSION_ITEM_INT",
    "MISSION_REQUEST",
    "MISSION_REQUEST_INT",
    "MISSION_REQUEST_LIST",
    "MISSION_SET_CURRENT",
    "PARAM_REQUEST_LIST",
    "PARAM_REQUEST_READ",
    "PARAM_SET",
    "SET_ACTUATOR_CONTROL_TARGET",
    "SET_ATTITUDE_TARGET",
    "SET_MODE",
    "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_POSITION_TARGET_LOCAL_NED",
    "TIMESYNC",
)
CLASSES = {cls.msgname: cls for cls in mavlink.mavlink_map.values() if cls.msgname in HANDLED}
VALUES = {row.name: row.value for row in px4_parameters("1.13", 1, 4, VehicleParams())}
NAMES = list(VALUES)
FLOAT_MAX = 3.4028234663852886e38
ODD = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1.0, -1.0, 2.0, 3.0, 4.0, 6.0, 32.0, 1e-45, FLOAT_MAX, -FLOAT_MAX)
FLOATS = st.just(math.nan) | st.sampled_from(ODD) | st.floats(width=32)
INTEGERS = {
    "uint8_t": (0, 2**8 - 1),
    "uint16_t": (0, 2**16 - 1),
    "int16_t": (-(2**15), 2**15 - 1),
    "uint32_t": (0, 2**32 - 1),
    "int32_t": (-(2**31), 2**31 - 1),
    "int64_t": (-(2**63), 2**63 - 1),
    "uint64_t": (0, 2**64 - 1),
}
# Values that get past the first check of their handler, beside the random ones.
LIKELY = {
    "target_system": [1],
    "target_component": [1],
    "command": [16, 19, 20, 21, 22, 34, 84, 93, 176, 177, 178, 179, 185, 192, 300, 400, 510, 511, 512, 520],
    "coordinate_frame": [0, 1, 3, 5, 6, 8],
    "frame": [2, 3, 6],
    "mission_type": [0],
    "count": [1, 2],
    "seq": [0, 1],
    "target": [1],
    "group_mlx": [0],
    "custom_mode": [6 << 16, 4 << 16 | 2 << 24, 4 << 16 | 6 << 24, 3 << 16],
    "param_index": [-2, -1, 0, len(NAMES) - 1, len(NAMES)],
    "tc1": [0],
}


def one_in(count, seldom, often):
    return st.integers(1, count).flatmap(lambda number: seldom if number == count else often)


def value_of(name, kind, length):
    if kind == "char":
        return st.sampled_from(NAMES).map(str.encode) | st.binary(max_size=length)
    if kind == "float":
        one = FLOATS
    else:
        low, high = INTEGERS[kind]
        one = st.integers(low, high) | st.sampled_from([low, high])
        if name in LIKELY:
            one = one_in(8, one, st.sampled_from(LIKELY[name]))
    return st.lists(one, min_size=length, max_size=length) if length else one


def message_of(cls):
    kinds = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
    lengths = dict(zip(cls.ordered_fieldnames, cls.array_lengths, strict=True))
    fields = {name: value_of(name, kind, lengths[name]) for name, kind in kinds.items()}
    return st.fixed_dictionaries(fields).map(lambda values: cls(**values))


MESSAGES = st.sampled_from([*HANDLED, "COMMAND_LONG", "COMMAND_LONG"]).flatmap(lambda name: message_of(CLASSES[name]))


def finite(truth):
    state = (*truth.position_ned_m, *truth.velocity_ned_m_s, *truth.quaternion, *truth.rates_frd_rad_s)
    return all(map(math.isfinite, state + truth.motor_commands))


def test_every_handled_message_is_in_the_dialect():
    assert set(CLASSES) == set(HANDLED)


@pytest.mark.parametrize("firmware", ["1.13", "1.16"])
@pytest.mark.parametrize("in_flight", [False, True], ids=["on the ground", "hovering"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(messages=st.lists(MESSAGES, min_size=1, max_size=12))
def test_no_message_ends_the_mock(pilot, firmware, in_flight, messages):
    p = pilot(firmware=firmware)
    if in_flight:
        p.hover()
    else:
        p.run(1.1)
    p.heartbeat()
    for message in messages:
        p.send(message).clear()
        p.run(0.012)
    p.run(0.1)
    assert finite(p.truth)
    assert p.truth.boot_us > 1_000_000


@pytest.mark.parametrize("model", ["rigid_body", "paper"])
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    setpoints=st.lists(
        st.sampled_from(
            [
                "SET_ACTUATOR_CONTROL_TARGET",
                "SET_ATTITUDE_TARGET",
                "SET_POSITION_TARGET_GLOBAL_INT",
                "SET_POSITION_TARGET_LOCAL_NED",
            ]
        ).flatmap(lambda name: message_of(CLASSES[name])),
        min_size=1,
        max_size=10,
    )
)
def test_no_setpoint_in_offboard_makes_the_state_infinite(pilot, model, setpoints):
    p = pilot(vehicle={"model": model}).hover().heartbeat()
    p.position(0.0, 0.0, -2.5)
    assert p.offboard() == [0]
    for setpoint in setpoints:
        setpoint.target_system = setpoint.target_component = 1
        p.send(setpoint)
        p.run(0.1)
    assert finite(p.truth)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("params", "results"),
    [
        ((176, 1, 4, "odd"), [1]),  # AUTO without a sub mode is MISSION, and there is none
        ((176, 1, "odd", 0), [0]),
        ((176, "odd", 6, 0), [0]),
        ((511, "odd", 1e5), [0]),
        ((512, "odd"), [0]),
    ],
    ids=str,
)
def test_nan_in_a_whole_number_is_zero(pilot, params, results, value):
    p = pilot().run(1.1)
    assert p.command(*(value if part == "odd" else part for part in params)) == results
    assert p.mock.mode == "AUTO.LOITER"


@pytest.mark.parametrize("name", ["MPC_TKO_SPEED", "MPC_LAND_SPEED", "MIS_TAKEOFF_ALT", "COM_OF_LOSS_T"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_parameter_keeps_its_value_when_it_is_set_to_no_number(pilot, name, value):
    p = pilot().run(1.1)
    before = VALUES[name]
    answer = p.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32))
    assert [message.param_value for message in answer] == pytest.approx([before])


@pytest.mark.parametrize("firmware", ["1.13", "1.16"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_message_stays_in_its_fields(pilot, firmware, sign):
    picture = pilot(firmware=firmware).run(1.1).mock._personality._picture
    vast = (sign * 1e9, -sign * 1e9, sign * 1e9)
    battery = Battery(sign * 1e6, -sign * 1e6, sign * 7.0)
    far = Estimate(0, vast, vast, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), vast, vast, battery, 1000)
    odd = replace(picture, estimate=far, position=far, home=Home(vast, 0.0, 0), armed=True)
    assert sum(build(odd) is not None for build in BUILDERS.values()) > 25
    for build in BUILDERS.values():
        message = build(odd)
        if message is not None:
            Encoder(1, 1).encode(message)
