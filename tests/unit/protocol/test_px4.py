"""PX4's modes, and the law's commands on the wire at each depth: signs axis by axis, scale, clipping, masks."""

from __future__ import annotations

import math

import pytest

from mavquad.protocol.codec import Encoder, decode
from mavquad.protocol.firmware import px4, setpoints
from mavquad.types import AttitudeCommand, RateCommand, TorqueCommand

SCALE = (100.0, 50.0, 10.0)
G = 9.81


def controls(p=0.0, q=0.0, r=0.0, thrust=G, hover=0.5):
    return setpoints.controls(TorqueCommand((p, q, r), thrust), SCALE, hover, G)


def rate_controls(p=0.0, q=0.0, r=0.0, thrust=G, hover=0.5):
    return setpoints.controls(RateCommand((p, q, r), thrust), SCALE, hover, G)


def attitude_controls(roll=0.0, pitch=0.0, yaw=0.0, thrust=G, hover=0.5):
    return setpoints.controls(AttitudeCommand(roll, pitch, yaw, thrust), SCALE, hover, G)


def on_the_wire(depth, controls, stamp_us=1_577_836_800_123_456):
    """The setpoint after its way through the codec, with the wire's 32-bit floats."""
    return decode(Encoder(255, 190).encode(setpoints.setpoint(stamp_us, depth, controls, 7, 9)))


def rotated(quaternion, x, y, z):
    """R(q) (x, y, z), the rotation matrix written out."""
    w, a, b, c = quaternion
    return (
        (1 - 2 * (b * b + c * c)) * x + 2 * (a * b - w * c) * y + 2 * (a * c + w * b) * z,
        2 * (a * b + w * c) * x + (1 - 2 * (a * a + c * c)) * y + 2 * (b * c - w * a) * z,
        2 * (a * c - w * b) * x + 2 * (b * c + w * a) * y + (1 - 2 * (a * a + b * b)) * z,
    )


@pytest.mark.parametrize(
    ("mode", "custom_mode", "name"),
    [
        (px4.OFFBOARD, 0x00060000, "OFFBOARD"),
        (px4.LOITER, 0x03040000, "AUTO.LOITER"),
        (px4.TAKEOFF, 0x02040000, "AUTO.TAKEOFF"),
        (px4.LAND, 0x06040000, "AUTO.LAND"),
        (px4.mode(4, 5), 0x05040000, "AUTO.RTL"),
        (px4.mode(3), 0x00030000, "POSCTL"),
        (px4.mode(1), 0x00010000, "MANUAL"),
        (px4.mode(4, 77), 0x4D040000, "AUTO.77"),
        (px4.mode(99), 0x00630000, "mode 99"),
    ],
)
def test_modes(mode, custom_mode, name):
    assert mode.custom_mode == custom_mode
    assert px4.mode_from_custom(custom_mode) == mode
    assert mode.name == name


def test_the_reserved_bits_of_custom_mode_do_not_matter():
    assert px4.mode_from_custom(0x0004FFFF | 3 << 24) == px4.LOITER


@pytest.mark.parametrize(
    ("version", "depths"),
    [
        ((1, 11, 0), ("torque", "rate", "attitude")),
        ((1, 13, 0), ("torque", "rate", "attitude")),
        ((1, 13, 99), ("torque", "rate", "attitude")),
        ((1, 14, 0), ("rate", "attitude")),
        ((1, 16, 2), ("rate", "attitude")),
        ((2, 0, 0), ("rate", "attitude")),
    ],
)
def test_what_a_release_takes_the_deepest_first(version, depths):
    assert px4.depths(version) == depths


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
    message = setpoints.torque_setpoint(123_456, (0.1, -0.2, 0.3, 0.4), 7, 9)
    assert message.get_type() == "SET_ACTUATOR_CONTROL_TARGET"
    assert (message.time_usec, message.group_mlx, message.target_system, message.target_component) == (123_456, 0, 7, 9)
    assert list(message.controls) == [0.1, -0.2, 0.3, 0.4, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("command", "axis", "sign"), [({"p": 1.5}, 0, 1), ({"q": 1.5}, 1, -1), ({"r": 1.5}, 2, -1)], ids=str
)
def test_rates_keep_their_size_and_turn_their_signs(command, axis, sign):
    assert rate_controls(**command) == (*(sign * 1.5 if i == axis else 0.0 for i in range(3)), 0.5)


@pytest.mark.parametrize(
    ("command", "axis", "sign"), [({"roll": 0.3}, 0, 1), ({"pitch": 0.3}, 1, -1), ({"yaw": 0.3}, 2, -1)], ids=str
)
def test_angles_keep_their_size_and_turn_their_signs(command, axis, sign):
    expected = (*(sign * 0.3 if i == axis else 0.0 for i in range(3)), 0.5)
    assert attitude_controls(**command) == pytest.approx(expected)


@pytest.mark.parametrize("turns", [-3, -1, 1, 3])
def test_the_yaw_of_an_attitude_is_wrapped(turns):
    assert attitude_controls(yaw=0.3 + turns * math.tau)[2] == pytest.approx(-0.3)


@pytest.mark.parametrize("make", [rate_controls, attitude_controls])
@pytest.mark.parametrize(("thrust", "control"), [(G / 2, 0.25), (2.5 * G, 1.0), (-5, 0.0)])
def test_thrust_is_the_same_at_every_depth(make, thrust, control):
    assert make(thrust=thrust)[3] == pytest.approx(control)


def test_the_rate_setpoint_on_the_wire():
    message = on_the_wire("rate", (0.5, -0.25, 0.125, 0.75))
    assert message.get_type() == "SET_ATTITUDE_TARGET"
    assert (message.type_mask, message.target_system, message.target_component) == (0x80, 7, 9)
    assert (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate) == (0.5, -0.25, 0.125)
    assert message.thrust == 0.75
    assert list(message.q) == [1.0, 0.0, 0.0, 0.0]
    assert message.time_boot_ms == 1_577_836_800_123 % 2**32


def test_the_attitude_setpoint_on_the_wire():
    message = on_the_wire("attitude", (0.1, 0.2, 0.3, 0.75))
    assert (message.type_mask, message.target_system, message.target_component) == (0x07, 7, 9)
    assert (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate) == (0.0, 0.0, 0.0)
    assert message.thrust == 0.75
    assert sum(part * part for part in message.q) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("angles", "body", "world"),
    [
        ((0.0, 0.0, math.pi / 2), (1, 0, 0), (0, 1, 0)),  # heading east: the nose points east
        ((0.0, math.pi / 2, 0.0), (1, 0, 0), (0, 0, -1)),  # nose up
        ((math.pi / 2, 0.0, 0.0), (0, 1, 0), (0, 0, 1)),  # right side down
        ((math.pi / 2, math.pi / 2, 0.0), (0, 1, 0), (1, 0, 0)),  # first the roll, about the body's own axis
        ((0.0, math.pi / 2, math.pi / 2), (0, 0, 1), (0, 1, 0)),
    ],
)
def test_the_attitude_quaternion_turns_frd_into_ned(angles, body, world):
    message = on_the_wire("attitude", (*angles, 0.5))
    assert rotated(message.q, *body) == pytest.approx(world, abs=1e-6)


def test_the_torque_setpoint_by_its_depth():
    controls = (0.5, -0.25, 0.125, 0.75)
    message = on_the_wire("torque", controls)
    assert message.get_type() == "SET_ACTUATOR_CONTROL_TARGET"
    assert list(message.controls) == [*controls, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("depth", ["torque", "rate"])
def test_safe_is_no_rotation_and_hover_thrust(depth):
    assert setpoints.safe_controls(depth, 0.4, 1.0) == (0.0, 0.0, 0.0, 0.4)


def test_a_safe_attitude_is_level_at_the_present_heading():
    assert setpoints.safe_controls("attitude", 0.4, 1.0 - math.tau) == pytest.approx((0.0, 0.0, 1.0, 0.4))
