"""What the autopilot of a log aimed at."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.pose_messages import Geodetic
from mavquad.analysis.targets import FRESH_US, hover_thrust, reference_point, targets, thrusts
from mavquad.types import Attitude, Position

ME = (1, 1)
NAN = math.nan


def local_target(log, t_s, place, yaw=0.5, mask=0, frame=1):
    rest = (9.0, 9.0, 9.0, 9.0, 9.0, 9.0)  # what its loops made of the error
    log.add(
        t_s, dialect.MAVLink_position_target_local_ned_message(round(t_s * 1000), frame, mask, *place, *rest, yaw, 0)
    )


def of(log, geodetic=None):
    return targets(log.contents(), ME, geodetic)


def test_a_place_and_how_it_moves(log):
    for tenth in range(20):
        t = tenth / 10
        local_target(log, t, (t * t, 2 * t, -3.0))
    found = of(log)
    target = found.position_at(1_000_000)
    assert found.source == "POSITION_TARGET_LOCAL_NED"
    assert target.position_nwu_m == pytest.approx((1.0, -2.0, 3.0))
    assert target.velocity_nwu_m_s == pytest.approx((1.9, -2.0, 0.0), abs=1e-4)
    assert target.acceleration_nwu_m_s2 == pytest.approx((2.0, 0.0, 0.0), abs=1e-3)
    point = reference_point(target, 1_500_000, yaw_rad=9.0)
    assert point.x_m[:3] == pytest.approx((1.0 + 0.5 * 1.9 + 0.25, 1.9 + 0.5 * 2.0, 2.0), abs=1e-3)
    assert point.y_m[:2] == pytest.approx((-3.0, -2.0), abs=1e-4)
    assert point.yaw_rad == (-0.5, 0.0, 0.0, 0.0, 0.0)


def test_a_step_stays_a_step(log):
    for tenth in range(20):
        local_target(log, tenth / 10, (0 if tenth < 10 else 5, 0, 0))
    assert {target.velocity_nwu_m_s for target in of(log).positions} == {(0.0, 0.0, 0.0)}


def test_what_goes_to_and_fro_does_not_move(log):
    for tenth in range(20):
        local_target(log, tenth / 10, (tenth % 2, 0, 0))
    assert {target.velocity_nwu_m_s for target in of(log).positions} == {(0.0, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("place", "mask", "frame"), [((NAN, 0, 0), 0, 1), ((1, 2, 3), 0x1, 1), ((1, 2, 3), 0x4, 1), ((1, 2, 3), 0, 8)]
)
def test_what_is_no_place_is_no_target(log, place, mask, frame):
    local_target(log, 1.0, place, mask=mask, frame=frame)
    assert of(log).positions == ()


@pytest.mark.parametrize(("yaw", "mask"), [(NAN, 0), (0.5, 0x400)])
def test_without_a_yaw_it_looks_as_it_does(log, yaw, mask):
    local_target(log, 1.0, (1, 2, 3), yaw, mask)
    [target] = of(log).positions
    assert target.yaw_rad is None
    assert reference_point(target, 1_000_000, yaw_rad=0.7).yaw_rad[0] == 0.7


def test_a_target_counts_for_a_while(log):
    local_target(log, 1.0, (1, 2, 3))
    found = of(log)
    assert found.position_at(999_999) is None
    assert found.position_at(1_000_000 + FRESH_US) is not None
    assert found.position_at(1_000_001 + FRESH_US) is None


def global_target(log, t_s, alt_m, frame=0):
    message = dialect.MAVLink_position_target_global_int_message
    log.add(t_s, message(round(t_s * 1000), frame, 0xFDF8, 600010000, 100000000, alt_m, *[0.0] * 8))


def test_global_targets_where_it_is_known_where_zero_is(log):
    global_target(log, 1.0, 120.0)
    assert of(log).source == ""
    found = of(log, Geodetic((600000000, 100000000, 100000)))
    assert found.source == "POSITION_TARGET_GLOBAL_INT"
    assert found.positions[0].position_nwu_m == pytest.approx((111.3195, 0.0, 20.0), abs=1e-3)
    assert found.positions[0].yaw_rad is None


def test_heights_above_something_else_are_not_taken_for_those_above_the_sea(log):
    global_target(log, 1.0, 20.0, frame=6)
    assert of(log, Geodetic((600000000, 100000000, 100000))).positions == ()


def test_local_targets_go_before_global_ones(log):
    global_target(log, 1.0, 120.0)
    local_target(log, 2.0, (1, 2, 3))
    assert [target.stamp_us for target in of(log, Geodetic((600000000, 100000000, 100000))).positions] == [2_000_000]


def attitude_target(log, t_s, q, thrust, rates=(0.1, 0.2, 0.3)):
    log.add(t_s, dialect.MAVLink_attitude_target_message(round(t_s * 1000), 0, q, *rates, thrust))


def test_attitude_targets_in_our_axes(log):
    attitude_target(log, 1.0, [math.cos(0.1), 0, math.sin(0.1), 0], 0.4)
    attitude_target(log, 2.0, [0, 0, 0, 0], 0.4)
    attitude_target(log, 3.0, [1, 0, 0, 0], NAN)
    [target] = of(log).attitudes
    assert target.euler_rad == pytest.approx((0.0, -0.2, 0.0), abs=1e-6)
    assert target.rates_flu_rad_s == pytest.approx((0.1, -0.2, -0.3))
    assert of(log).attitude_at(1_500_000) is target or of(log).attitude_at(1_500_000) == target


def test_the_hover_thrust_is_that_of_level_flight_and_slow_climbs(log):
    poses, attitudes = [], []
    for k in range(100):
        t = k / 10
        climbing = 20 <= k < 40
        poses.append(Position(round(t * 1e6), (0, 0, 0), (0, 0, 2.0 if climbing else 0.1)))
        attitudes.append(Attitude(round(t * 1e6), math.pi / 3 if k >= 70 else 0.0, 0.0, 0.0, (0, 0, 0)))
        attitude_target(log, t, [1, 0, 0, 0], 0.7 if climbing else 0.8 if k >= 70 else 0.0 if k < 5 else 0.4)
    commands = of(log).attitudes
    assert hover_thrust(commands, poses, attitudes) == pytest.approx(0.4)
    assert hover_thrust(commands[5:9], poses, attitudes) is None
    assert thrusts(commands, 0.4)[6] == (600_000, pytest.approx(9.81))
    assert thrusts(commands, None) == []
