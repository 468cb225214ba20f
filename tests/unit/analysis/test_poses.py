"""The pose stream of a log: axes, units, segments, and what is skipped."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.poses import pose_stream

STILL = (0.0, 0.0, 0.0)


def fix(log, t_s, lat_deg, lon_deg, alt_m, velocity_cm_s=(0, 0, 0)):
    lat, lon, alt = round(lat_deg * 1e7), round(lon_deg * 1e7), round(alt_m * 1000)
    log.add(t_s, dialect.MAVLink_global_position_int_message(round(t_s * 1000), lat, lon, alt, 0, *velocity_cm_s, 0))


def test_ned_becomes_nwu(log):
    log.local(0, (1, 2, 3), (4, 5, 6))
    log.local(1, (1, 2, 3), (4, 5, 6))
    stream = pose_stream(log.contents(), (1, 1))
    pose = stream.segments[0].poses[1]
    assert stream.source == "LOCAL_POSITION_NED"
    assert (pose.position_nwu_m, pose.velocity_nwu_m_s, pose.stamp_us) == ((1, -2, -3), (4, -5, -6), 1_000_000)


def test_a_degree_north_and_east_and_a_climb_in_metres_from_the_first_fix(log):
    fix(log, 0, 60.0, 10.0, 100.0)
    fix(log, 1, 60.001, 10.001, 130.0, velocity_cm_s=(100, 200, -300))
    stream = pose_stream(log.contents(), (1, 1))
    first, second = stream.segments[0].poses
    assert stream.source == "GLOBAL_POSITION_INT"
    assert first.position_nwu_m == (0, 0, 0)
    # One degree of a circle with the Earth's equatorial radius is 111 319.5 m; half of it for longitude at 60 degrees.
    assert second.position_nwu_m == pytest.approx((111.3195, -55.6597, 30.0), abs=1e-3)
    assert second.velocity_nwu_m_s == pytest.approx((1.0, -2.0, 3.0))


def test_local_positions_go_before_global_ones(log):
    fix(log, 0, 60.0, 10.0, 100.0)
    for t_s in (1, 2):
        log.local(t_s, (1, 2, 3), STILL)
    stream = pose_stream(log.contents(), (1, 1))
    assert stream.source == "LOCAL_POSITION_NED"
    assert len(stream.segments[0].poses) == 2


def test_fixes_at_zero_and_nan_are_not_used(log):
    fix(log, 0, 0.0, 0.0, 100.0)
    assert pose_stream(log.contents(), (1, 1)).source == ""
    log.local(1, (math.nan, 0, 0), STILL)
    log.local(2, (0, 0, 0), (0, math.inf, 0))
    log.attitude(2, 0.0, math.nan, 0.0)
    stream = pose_stream(log.contents(), (1, 1))
    assert (stream.source, stream.attitude_source, stream.segments, stream.invalid) == ("", "", (), 3)


def test_a_nose_that_points_up_has_no_heading(log):
    log.attitude(1, 0.0, math.pi / 2, 0.0)
    log.attitude(2, 0.0, math.pi / 2 - 0.1, 0.3)
    [segment] = pose_stream(log.contents(), (1, 1)).segments
    assert len(segment.attitudes) == 2
    assert [heading.yaw_rad for heading in segment.headings] == pytest.approx([-0.3])


@pytest.mark.parametrize(
    ("roll", "rates", "yaw_rate"),
    [(0.0, (9, 9, 1), 1.0), (math.pi / 2, (9, 1, 9), 1.0), (math.pi / 2, (9, -1, 9), -1.0)],
)
def test_heading_turns_the_other_way_in_nwu(log, roll, rates, yaw_rate):
    """At 90 degrees of roll (right side down, FRD) nose-up pitching turns the heading; seen from NWU with minus signs."""
    log.attitude(1, roll, 0.0, 0.7, rates)
    [heading] = pose_stream(log.contents(), (1, 1)).segments[0].headings
    assert heading.yaw_rad == pytest.approx(-0.7)
    assert heading.yaw_rate_rad_s == pytest.approx(-yaw_rate)


def odometry(log, t_s, place, q, velocity, rates=STILL, frames=(1, 12), time_us=None):
    covariance = [math.nan] * 21
    stamp_us = round(t_s * 1e6) if time_us is None else time_us
    message = dialect.MAVLink_odometry_message(stamp_us, *frames, *place, q, *velocity, *rates, covariance, covariance)
    log.add(t_s, message)


TURNED = (math.cos(0.25), 0.0, 0.0, math.sin(0.25))  # 0.5 rad of yaw


def test_odometry_alone_tells_the_whole_pose(log):
    for t_s in (1, 2):
        odometry(log, t_s, (1, 2, 3), TURNED, (1, 0, -1), (0.1, 0.2, 0.3))
    stream = pose_stream(log.contents(), (1, 1))
    assert (stream.source, stream.attitude_source) == ("ODOMETRY", "ODOMETRY")
    position, attitude = stream.segments[0].poses[1], stream.segments[0].attitudes[1]
    assert position.position_nwu_m == pytest.approx((1, -2, -3))
    assert position.velocity_nwu_m_s == pytest.approx((math.cos(0.5), -math.sin(0.5), 1.0))  # the body's
    assert attitude.yaw_rad == pytest.approx(-0.5)
    assert attitude.rates_flu_rad_s == pytest.approx((0.1, -0.2, -0.3))


@pytest.mark.parametrize(
    ("frames", "position", "velocity"), [((1, 1), (1, -2, -3), (1, 0, 1)), ((21, 21), (1, 2, 3), (1, 0, -1))]
)
def test_frames_of_odometry(log, frames, position, velocity):
    for t_s in (1, 2):
        odometry(log, t_s, (1, 2, 3), TURNED, (1, 0, -1), frames=frames)
    pose = pose_stream(log.contents(), (1, 1)).segments[0].poses[0]
    assert (pose.position_nwu_m, pose.velocity_nwu_m_s) == (position, velocity)


def test_odometry_by_another_clock_joins_the_others(log):
    for tenth in range(30):
        log.attitude(tenth / 10, 0, 0, 0)
        odometry(log, tenth / 10, (tenth, 0, 0), TURNED, STILL, time_us=1_700_000_000_000_000 + tenth * 100_000)
    [segment] = pose_stream(log.contents(), (1, 1)).segments
    assert (len(segment.poses), len(segment.attitudes)) == (30, 30)
    assert segment.poses[10].stamp_us == 1_000_000


def test_quaternions_where_there_are_no_angles(log):
    for t_s, q in ((1, TURNED), (2, (math.cos(0.1), math.sin(0.1), 0, 0)), (3, (math.cos(0.1), 0, math.sin(0.1), 0))):
        log.add(t_s, dialect.MAVLink_attitude_quaternion_message(t_s * 1000, *q, 0.1, 0.2, 0.3))
    log.add(4, dialect.MAVLink_attitude_quaternion_message(4000, 0, 0, 0, 0, 0, 0, 0))
    stream = pose_stream(log.contents(), (1, 1))
    angles = [attitude[1:4] for attitude in stream.segments[0].attitudes]
    assert (stream.attitude_source, stream.invalid) == ("ATTITUDE_QUATERNION", 1)
    for seen, wanted in zip(angles, [(0, 0, -0.5), (0.2, 0, 0), (0, -0.2, 0)], strict=True):
        assert seen == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("origin", ["GPS_GLOBAL_ORIGIN", "HOME_POSITION"])
def test_global_positions_count_from_the_origin_wherever_it_is_told(log, origin):
    fix(log, 1, 60.001, 10.0, 130.0)
    fix(log, 2, 60.001, 10.0, 130.0)
    if origin == "GPS_GLOBAL_ORIGIN":
        log.add(3, dialect.MAVLink_gps_global_origin_message(600000000, 100000000, 100000))
        log.add(3, dialect.MAVLink_home_position_message(0, 0, 0, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    else:
        log.add(3, dialect.MAVLink_home_position_message(600000000, 100000000, 100000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    pose = pose_stream(log.contents(), (1, 1)).segments[0].poses[0]
    assert pose.position_nwu_m == pytest.approx((111.3195, 0.0, 30.0), abs=1e-3)


def test_a_stray_local_position_does_not_hide_the_global_ones(log):
    for tenth in range(100):
        fix(log, tenth / 10, 60.0, 10.0, 100.0)
    for t_s in (20, 21):
        log.local(t_s, (1, 2, 3), STILL)
    assert pose_stream(log.contents(), (1, 1)).source == "GLOBAL_POSITION_INT"


def test_other_senders_do_not_enter(log):
    for t_s in (1, 2):
        log.local(t_s, (1, 0, 0), STILL)
        log.local(t_s + 0.5, (99, 0, 0), STILL, sender=(2, 1))
    stream = pose_stream(log.contents(), (1, 1))
    assert [pose.position_nwu_m[0] for pose in stream.segments[0].poses] == [1, 1]


def test_repeated_and_slightly_old_stamps_are_skipped(log):
    for t_s, boot_s in ((0, 10.0), (0.1, 10.0), (0.2, 9.9), (0.3, 10.1)):
        log.local(t_s, (t_s, 0, 0), STILL, boot_s)
    stream = pose_stream(log.contents(), (1, 1))
    assert (stream.repeated, stream.backward, len(stream.segments)) == (1, 1, 1)
    assert [pose.stamp_us for pose in stream.segments[0].poses] == [10_000_000, 10_100_000]


def test_a_reboot_and_a_gap_begin_new_segments_on_the_logs_time(log):
    for t_s, boot_s in ((0, 50.0), (1, 51.0), (2, 0.5), (3, 1.5), (13, 11.5)):
        log.local(t_s, (0, 0, 0), STILL, boot_s)
    segments = pose_stream(log.contents(), (1, 1)).segments
    assert [len(segment.poses) for segment in segments] == [2, 2, 1]
    assert [segment.log_start_s for segment in segments] == [0.0, 2.0, 13.0]
    assert segments[1].log_time_s(1_500_000) == pytest.approx(3.0)


def test_a_gap_of_one_message_alone_begins_a_new_segment(log):
    for tenth in range(200):
        log.attitude(tenth / 10, 0, 0, 0)
        if not 50 <= tenth < 150:
            log.local(tenth / 10, (0, 0, 0), STILL)
    assert [len(segment.poses) for segment in pose_stream(log.contents(), (1, 1)).segments] == [50, 50]


def test_times_of_a_slow_clock_go_by_the_log(log):
    """98 % of the log's pace, and every fifth message is held up for 0.2 s."""
    for k in range(1000):
        boot_s = k / 20
        held_s = 0.2 if k % 5 == 3 else 0.0
        log.attitude(boot_s / 0.98 + held_s, 0, 0, 0, boot_s=boot_s)
    [segment] = pose_stream(log.contents(), (1, 1)).segments
    for boot_us in (0, 7_777_000, 31_000_000, 48_900_000):
        assert segment.log_time_s(boot_us) == pytest.approx(boot_us * 1e-6 / 0.98, abs=0.002)
    assert segment.log_time_s(52_000_000) == pytest.approx(52.0 + 50 / 0.98 - 50, abs=0.05)
    assert segment.log_time_s(-1_000_000) == pytest.approx(-1.0, abs=0.05)
