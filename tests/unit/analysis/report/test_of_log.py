"""What the report says of logs of others: states, texts, lines, paths, and honest words where something is missing."""

import math

import numpy as np
import pytest

from mavquad.analysis.law_shadow import law_shadow
from mavquad.analysis.modes import mode_name
from mavquad.analysis.report.of_log import read_log, report_of_log
from mavquad.config import default_path, load
from mavquad.protocol.codec import mavlink
from mavquad.tlog import Selection
from tests.unit.analysis.report.logs import PX4_LOITER, PX4_OFFBOARD, START_US, LogFile, circling


@pytest.fixture
def made(tmp_path):
    """The report of a log."""
    return lambda log: report_of_log(read_log(log.write(tmp_path / "some.tlog")))


def panels(report):
    return {panel.key: {line.name: line for line in panel.lines} for panel in report.panels}


def spans(report, name):
    [lane] = [lane for lane in report.lanes if lane.name == name]
    return [(span.from_s, span.to_s, span.name) for span in lane.spans]


def test_modes_and_arming_are_spans(made):
    report = made(circling())
    assert spans(report, "mode") == [(0, 2, "AUTO.LOITER"), (2, 8, "OFFBOARD"), (8, 9, "AUTO.LOITER")]
    assert spans(report, "armed") == [(1, 9, "armed")]


def test_the_page_opens_with_the_flight(made):
    log = circling(20.0)
    log.at(100.0).heartbeat(PX4_LOITER, armed=False)
    report = made(log)
    assert report.duration_s == 100.0
    assert report.view_s == (0.0, 12.0)


@pytest.mark.parametrize(
    ("autopilot", "vehicle_type", "custom_mode", "name"),
    [
        (12, 2, PX4_OFFBOARD, "OFFBOARD"),
        (12, 2, PX4_LOITER, "AUTO.LOITER"),
        (3, 2, 4, "GUIDED"),
        (3, 13, 9, "LAND"),
        (3, 1, 10, "AUTO"),
        (3, 10, 15, "GUIDED"),
        (3, 2, 199, "mode 199"),
        (8, 2, 7, "mode 7"),
    ],
)
def test_names_of_modes(autopilot, vehicle_type, custom_mode, name):
    assert mode_name(autopilot, vehicle_type, custom_mode) == name


def test_forged_heartbeats_do_not_change_the_mode(made):
    log = circling()
    for second in range(9):
        log.at(second + 0.5).heartbeat(0, armed=False, autopilot=mavlink.MAV_AUTOPILOT_INVALID, vehicle_type=6)
    assert [name for *_, name in spans(made(log), "mode")] == ["AUTO.LOITER", "OFFBOARD", "AUTO.LOITER"]


def test_texts_have_their_severity_commands_their_answers(made):
    log = circling()
    command = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
    log.at(3.0).add(command, outbound=True)
    to_another = mavlink.MAVLink_command_long_message(7, 1, mavlink.MAV_CMD_NAV_LAND, 0, 0, 0, 0, 0, 0, 0, 0)
    log.add(to_another, outbound=True)
    log.at(3.1).add(mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1))
    marks = made(log).marks
    assert [m.severity for m in marks if m.kind == "vehicle"] == list(range(8))
    assert [m.text for m in marks if m.kind == "command"] == ["COMPONENT_ARM_DISARM 1"]
    [answer] = [m for m in marks if m.kind == "answer"]
    assert (answer.text, answer.severity) == ("COMPONENT_ARM_DISARM: temporarily rejected", 4)
    assert answer.time_s == pytest.approx(3.1, abs=1e-5)


def test_the_path_is_north_east_up(made):
    log = LogFile()
    for second in range(5):
        log.at(second).position(1.0 * second, 2.0 * second, -3.0 * second, (1.0, 2.0, -3.0))
    report = made(log)
    [track] = report.tracks
    np.testing.assert_allclose(track.points_m[-1], [4, 8, 12])
    velocity = panels(report)["velocity"]
    assert velocity["north, autopilot"].values[0] == 1.0
    assert velocity["west, autopilot"].values[0] == -2.0
    assert velocity["up, autopilot"].values[0] == 3.0
    assert panels(report)["altitude"]["flown"].values[-1] == 12.0


def test_fixes_are_metres_from_the_first(made):
    log = LogFile()
    log.fix(0, 0, 0)  # no fix yet
    for second in range(1, 5):
        log.at(second).fix(
            470000000 + 1000 * (second - 1), 80000000 + 1000 * (second - 1), 500000 + 1000 * (second - 1)
        )
    points_m = made(log).tracks[0].points_m
    assert np.isnan(points_m[0]).all()
    degree_m = math.radians(1.0) * 6378137.0
    np.testing.assert_allclose(
        points_m[-1], [3e-4 * degree_m, 3e-4 * degree_m * math.cos(math.radians(47)), 3.0], rtol=1e-6
    )


def test_the_error_is_against_the_target_that_is_believed(made):
    log = LogFile()

    def target(mask, x, y, z):
        log.add(mavlink.MAVLink_position_target_local_ned_message(0, 1, mask, x, y, z, 0, 0, 0, 0, 0, 0, 0, 0))

    for tenth in range(100):
        log.at(tenth / 10).position(1.0, 2.0, -3.0)
        if tenth in (0, 50):
            target(0, 0.9, 2.5, -2.0)
        if tenth == 70:
            target(7, 0.0, 0.0, 0.0)
    error = panels(made(log))["error"]
    assert error["north"].values[10] == pytest.approx(10.0, abs=1e-4)
    assert error["east"].values[10] == pytest.approx(-50.0, abs=1e-4)
    assert error["up"].values[10] == pytest.approx(100.0, abs=1e-4)
    assert np.isnan(error["up"].values[[30, 75]]).all()  # older than 2 s; none is wanted
    assert np.isfinite(error["up"].values[60])


def test_what_was_asked_is_dashed_and_masked(made):
    log = circling()
    half = math.radians(20.0) / 2
    for tenth in range(50):
        log.at(tenth / 10)
        mask = 0b10000000 if tenth < 25 else 0b00000111  # first rates alone, then the attitude alone
        q = [math.cos(half), math.sin(half), 0.0, 0.0]
        log.add(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, q, 0.1, -0.2, 0.3, 0.6), outbound=True)
    found = panels(made(log))
    roll, rate = found["attitude"]["roll, wanted"], found["rates"]["pitch, wanted"]
    assert roll.dashed and rate.dashed
    assert np.isnan(roll.values[:25]).all() and np.isnan(rate.values[25:]).all()
    np.testing.assert_allclose(roll.values[25:], 20.0, rtol=1e-5)
    np.testing.assert_allclose(rate.values[:25], math.degrees(-0.2), rtol=1e-5)
    np.testing.assert_allclose(found["thrust"]["wanted"].values, 0.6, rtol=1e-6)


def test_torques_are_shown_where_they_were_sent(made):
    log = circling()
    controls = [0.1, -0.2, 0.3, 0.5, 0, 0, 0, 0]
    log.add(mavlink.MAVLink_set_actuator_control_target_message(0, 0, 1, 1, controls), outbound=True)
    found = panels(made(log))
    assert [line.values[0] for line in found["commands"].values()] == pytest.approx([0.1, -0.2, 0.3])
    assert found["thrust"]["commanded"].values[0] == pytest.approx(0.5)


def test_a_heading_that_wraps_draws_no_stroke(made):
    yaw = panels(made(circling()))["yaw"]["yaw"].values
    assert np.isnan(yaw).sum() == 1
    steps = np.abs(np.diff(yaw))
    assert np.nanmax(steps) < 5.0


def test_the_observer_is_beside_the_autopilot(made):
    found = panels(made(circling()))
    assert set(found["velocity"]) >= {"north", "west", "up", "north, autopilot"}
    north, own = found["velocity"]["north"], found["velocity"]["north, autopilot"]
    settled = north.times_s > 3.0
    assert np.max(np.abs(north.values[settled] - own.values[settled])) < 0.4
    assert "sigma" in found


def test_nothing_but_texts(made):
    log = LogFile()
    log.at(1.0).text("hello")
    report = made(log)
    assert report.panels == () and report.tracks == ()
    assert "The log has no usable position." in report.remarks
    assert "The log has no attitude." in report.remarks
    assert report.duration_s > 0


def test_a_single_position_is_no_path(made):
    log = LogFile()
    log.position(0, 0, 0)
    assert made(log).tracks == ()


def test_positions_that_are_no_numbers(made):
    log = circling(2.0)
    for tenth in range(20):
        log.at(2.0 + tenth / 10).position(math.nan, math.inf, 0.0, (math.nan, 0.0, 0.0))
    report = made(log)
    assert dict(report.facts)["climbed"] == "0.0 m"


def test_stamps_that_run_backwards_are_sorted_and_said(made):
    log = LogFile()
    for step in range(50):
        log.at(50.0 - step).position(float(step), 0.0, 0.0)
        log.attitude(0.0, 0.0, 0.0)
    report = made(log)
    track = report.tracks[0]
    assert np.all(np.diff(track.times_s) > 0)
    assert track.points_m[0, 0] == 49.0
    assert report.start_us == START_US + 1_000_000
    assert any("step back 49 times" in remark for remark in report.remarks)


def test_a_jump_of_a_year_is_not_what_the_page_opens_with(made):
    log = LogFile()
    for second in (*range(10), 3600 * 24 * 365):
        log.at(second).position(0, 0, 0)
    report = made(log)
    assert report.duration_s == pytest.approx(3600 * 24 * 365.0)
    assert report.view_s == (0.0, 12.0)


def test_a_log_without_stamps_goes_by_the_vehicles_clock(tmp_path):
    log = LogFile(with_stamps=False)
    for step in range(100):
        log.at(30.0 + step / 10).attitude(0.0, 0.0, 0.0)
        if step % 10 == 0:
            log.heartbeat(PX4_OFFBOARD, armed=step >= 50)
    report = report_of_log(read_log(log.write(tmp_path / "some.raw")))
    assert report.duration_s == pytest.approx(9.9)
    assert spans(report, "armed")[0][0] == pytest.approx(5.0, abs=0.11)
    assert any("no stamps" in remark for remark in report.remarks)


def test_damage_is_said(made):
    log = circling()
    log.data[1000:1100] = b"?" * 100
    report = made(log)
    assert any("damaged" in remark for remark in report.remarks)
    assert dict(report.facts)["bad bytes"] != "0"


def test_the_law_is_beside_what_is_short_enough(tmp_path, monkeypatch):
    asked = []

    def read(most):
        monkeypatch.setattr("mavquad.analysis.report.of_log.LAW_POSITIONS", most)
        return read_log(path, lawyer=lambda contents, vehicle: asked.append((len(contents), vehicle.sender)))

    path = circling().write(tmp_path / "some.tlog")
    assert read(200).positions == 200
    assert asked == [(418, (1, 1))]
    assert any("too long for our law" in remark for remark in report_of_log(read(199)).remarks)
    assert len(asked) == 1


def test_what_is_too_long_has_neither_observer_nor_law(tmp_path, monkeypatch):
    monkeypatch.setattr("mavquad.analysis.report.of_log.OBSERVER_POSITIONS", 199)
    monkeypatch.setattr("mavquad.analysis.report.of_log.read_records", None)
    report = report_of_log(read_log(circling().write(tmp_path / "some.tlog")))
    assert set(panels(report)["velocity"]) == {"north, autopilot", "west, autopilot", "up, autopilot"}


def test_what_the_law_would_have_made_of_it(tmp_path):
    log = circling(30.0)

    def lawyer(contents, vehicle):
        config = load(default_path())
        return law_shadow(contents, vehicle.sender, config.law.of("px4"), config.guards)

    report = report_of_log(read_log(log.write(tmp_path / "some.tlog"), lawyer=lawyer))
    found = panels(report)
    assert {"law_error", "law_setpoints", "sigma"} <= set(found)
    flown = found["law_setpoints"]["roll, flown"]
    attitude = found["attitude"]["roll"]
    beside = np.interp(flown.times_s, attitude.times_s, attitude.values)
    assert np.max(np.abs(flown.values - beside)) < 1.5  # of 5.7 degrees, FRD as the panel of what was measured
    pitch, measured = found["law_setpoints"]["pitch, flown"], found["attitude"]["pitch"]
    assert np.max(np.abs(pitch.values - np.interp(pitch.times_s, measured.times_s, measured.values))) < 1.5
    lanes = {lane.name: lane for lane in report.lanes}
    assert lanes["law at attitude"].spans[0].name.startswith("would do: ")
    assert report.summary["law"]["phases"]


def test_a_part_of_a_log(tmp_path):
    log = circling()
    command = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_LAND, 0, 0, 0, 0, 0, 0, 0, 0)
    log.at(5.0).add(command, outbound=True)
    path = log.write(tmp_path / "some.tlog")
    part = Selection(system=1, from_us=START_US + 4_000_000, to_us=START_US + 6_000_000)
    report = report_of_log(read_log(path, part))
    times_s = panels(report)["altitude"]["flown"].times_s
    assert (times_s[0], times_s[-1]) == pytest.approx((4.0, 6.0), abs=1e-5)
    assert [mark.text for mark in report.marks if mark.kind == "command"] == ["NAV_LAND"]
