"""PX4's modes, and torque and thrust on the wire: signs axis by axis, scale, clipping."""

from __future__ import annotations

import pytest

from mavquad.protocol.firmware import px4
from mavquad.types import TorqueCommand

SCALE = (100.0, 50.0, 10.0)
G = 9.81


def controls(p=0.0, q=0.0, r=0.0, thrust=G, hover=0.5):
    return px4.torque_controls(TorqueCommand((p, q, r), thrust), SCALE, hover, G)


@pytest.mark.parametrize(
    ("mode", "custom_mode", "name"),
    [
        (px4.OFFBOARD, 0x00060000, "OFFBOARD"),
        (px4.LOITER, 0x03040000, "AUTO.LOITER"),
        (px4.TAKEOFF, 0x02040000, "AUTO.TAKEOFF"),
        (px4.LAND, 0x06040000, "AUTO.LAND"),
        (px4.Mode(4, 5), 0x05040000, "AUTO.RTL"),
        (px4.Mode(3), 0x00030000, "POSCTL"),
        (px4.Mode(1), 0x00010000, "MANUAL"),
        (px4.Mode(4, 77), 0x4D040000, "AUTO.77"),
        (px4.Mode(99), 0x00630000, "mode 99"),
    ],
)
def test_modes(mode, custom_mode, name):
    assert mode.custom_mode == custom_mode
    assert px4.mode_from_custom(custom_mode) == mode
    assert mode.name == name


def test_the_reserved_bits_of_custom_mode_do_not_matter():
    assert px4.mode_from_custom(0x0004FFFF | 3 << 24) == px4.LOITER


@pytest.mark.parametrize(
    ("version", "takes"),
    [
        ((1, 11, 0), True),
        ((1, 13, 0), True),
        ((1, 13, 99), True),
        ((1, 14, 0), False),
        ((1, 16, 2), False),
        ((2, 0, 0), False),
    ],
)
def test_the_last_release_that_takes_torque(version, takes):
    assert px4.takes_torque(version) is takes


@pytest.mark.parametrize(
    ("command", "axis", "sign"), [({"p": 1.0}, 0, 1), ({"q": 1.0}, 1, -1), ({"r": 1.0}, 2, -1)], ids=str
)
def test_the_sign_of_each_axis_from_flu_to_frd(command, axis, sign):
    torque = controls(**command)[:3]
    assert torque[axis] * sign > 0.0
    assert [value for i, value in enumerate(torque) if i != axis] == [0.0, 0.0]


def test_the_scale_of_each_axis():
    assert controls(p=1.0, q=2.0, r=3.0)[:3] == pytest.approx((1 / 100, -2 / 50, -3 / 10))


def test_no_rotation_and_hover():
    assert controls() == (0.0, 0.0, 0.0, 0.5)


@pytest.mark.parametrize(
    ("thrust", "control"), [(G / 2, 0.25), (1.5 * G, 0.75), (2 * G, 1.0), (9 * G, 1.0), (0, 0), (-5, 0)]
)
def test_thrust_is_in_units_of_the_hover_and_clipped(thrust, control):
    assert controls(thrust=thrust)[3] == pytest.approx(control)


def test_torque_is_clipped_on_both_sides():
    assert controls(p=1e4, q=1e4, r=-1e4)[:3] == (1.0, -1.0, 1.0)
    assert controls(p=-1e4, q=-1e4, r=1e4)[:3] == (-1.0, 1.0, -1.0)


def test_the_setpoint_on_the_wire():
    message = px4.torque_setpoint(123_456, (0.1, -0.2, 0.3, 0.4), 7, 9)
    assert message.get_type() == "SET_ACTUATOR_CONTROL_TARGET"
    assert (message.time_usec, message.group_mlx, message.target_system, message.target_component) == (123_456, 0, 7, 9)
    assert list(message.controls) == [0.1, -0.2, 0.3, 0.4, 0.0, 0.0, 0.0, 0.0]
