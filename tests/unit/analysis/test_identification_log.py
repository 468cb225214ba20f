"""Whole logs with a known plant: what is taken from them, when the vehicle was following, and what is printed."""

import json
import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.identification import AxisFit, Refused
from mavquad.analysis.identification_figure import identification_figure, liveliest
from mavquad.analysis.identification_log import flight_data, intersection, without_entry
from mavquad.analysis.identification_model import LaggedCommand
from mavquad.analysis.identification_report import Identification, identify_log, toml_lines

GCS = (255, 190)
OFFBOARD, LOITER = 6 << 16, 4 << 16 | 3 << 24
UP_S, DOWN_S, AGE_S = 0.012, 0.012, 0.004
DEAD_S, LAG_S = 0.03, 0.06
BOOT_S = 300.0
IGNORE_ATTITUDE, IGNORE_RATES = 0x80, 0x07


def rates_setpoint(rates):
    return dialect.MAVLink_set_attitude_target_message(0, 1, 1, IGNORE_ATTITUDE, [1.0, 0.0, 0.0, 0.0], *rates, 0.5)


def attitude_setpoint(angles):
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in angles)
    q = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
    return dialect.MAVLink_set_attitude_target_message(0, 1, 1, IGNORE_RATES, q, 0, 0, 0, 0.5)


def torque_setpoint(controls):
    return dialect.MAVLink_set_actuator_control_target_message(0, 0, 1, 1, [*controls, 0.5, 0, 0, 0, 0])


SETPOINTS = {"rate": rates_setpoint, "attitude": attitude_setpoint, "torque": torque_setpoint}
SPREAD = {"rate": 0.3, "attitude": 0.15, "torque": 0.03}


def vehicle_state(log, t_s, mode=OFFBOARD, armed=True):
    status = 128 * armed
    log.add(t_s, dialect.MAVLink_heartbeat_message(2, 12, status, mode, 4, 3))
    log.add(t_s, dialect.MAVLink_extended_sys_state_message(0, 2 if armed else 1))


def fill(log, depth="rate", seconds=20, timesync=True, drift=0.0, gain=1.0, following=lambda t_s: True, sent=True):
    """A log of a flight: setpoints as the log's writer sent them, ATTITUDE as it arrived."""
    rng = np.random.default_rng(4)
    sent_s = np.arange(0.0, seconds, 0.01)
    values = np.repeat(rng.normal(0.0, SPREAD[depth], (seconds * 5, 3)), 20, axis=0)
    plants = [LaggedCommand(sent_s + UP_S + DEAD_S, values[:, axis], LAG_S) for axis in range(3)]
    events = []
    for t_s, value in zip(sent_s.tolist(), values, strict=True):
        if sent:
            events.append((t_s, lambda t, v=value: log.add(t, SETPOINTS[depth](v), GCS)))
    stamps_s = 0.0037 + np.arange(seconds * 100) * 0.01
    true = np.transpose([gain * (p.integral if depth == "torque" else p.at)(stamps_s) for p in plants])
    for taken_s, answers in zip(stamps_s.tolist(), true.tolist(), strict=True):
        answers = [a + rng.normal(0.0, 0.01) if following(taken_s) else rng.normal(0.0, 0.3) for a in answers]
        angles, rates = (answers, (0, 0, 0)) if depth == "attitude" else ((0, 0, 0), answers)
        boot_s = (taken_s + BOOT_S) * (1.0 + drift)
        arrival_s = taken_s + AGE_S + DOWN_S + rng.uniform(0.0, 0.003)
        events.append((arrival_s, lambda t, a=angles, r=rates, b=boot_s: log.attitude(t, *a, rates=r, boot_s=b)))
    for t_s in np.arange(0.05, seconds, 0.1) if timesync else ():
        asked_ns, vehicle_ns = round(t_s * 1e9), round((t_s + UP_S + BOOT_S) * (1.0 + drift) * 1e9)
        question = dialect.MAVLink_timesync_message(0, asked_ns)
        answer = dialect.MAVLink_timesync_message(vehicle_ns, asked_ns)
        events.append((t_s, lambda t, m=question: log.add(t, m, GCS)))
        events.append((t_s + UP_S + DOWN_S, lambda t, m=answer: log.add(t, m)))
    for t_s in range(seconds + 1):
        mode = OFFBOARD if following(t_s) else LOITER
        events.append((float(t_s), lambda t, m=mode: vehicle_state(log, t, m)))
    for t_s, write in sorted(events, key=lambda event: event[0]):
        write(t_s)


def identified(log, own=False) -> Identification:
    found = identify_log(log.contents(), own)
    assert isinstance(found, Identification), found
    return found


@pytest.mark.parametrize(("depth", "gain"), [("rate", 1.0), ("attitude", 0.95), ("torque", 113.0)])
def test_each_depth_with_timesync(log, depth, gain):
    fill(log, depth, gain=gain)
    found = identified(log)
    [report] = found.depths
    assert (report.depth, report.own, list(report.fits)) == (depth, False, ["roll", "pitch", "yaw"])
    for fit in report.fits.values():
        assert fit.dead_s.value == pytest.approx(UP_S + DEAD_S, abs=0.003)
        assert fit.lag_s.value == pytest.approx(LAG_S, rel=0.05)
        assert fit.gain.value == pytest.approx(gain, rel=0.03)
    assert found.age_s == pytest.approx(AGE_S + DOWN_S + 0.0015, abs=0.001)
    assert found.round_trip_s == pytest.approx(UP_S + DOWN_S, abs=1e-4)
    settings = found.settings(report)
    assert settings["law.delay_s"] == pytest.approx(AGE_S + DOWN_S + UP_S + 0.0015, abs=0.001)
    assert settings["law.dead_time_s"] == pytest.approx(DEAD_S, abs=0.003)
    assert [settings["law.lag_s"], settings["law.yaw_lag_s"]] == pytest.approx([LAG_S, LAG_S], rel=0.05)
    assert settings["law.yaw_dead_time_s"] == pytest.approx(DEAD_S, abs=0.003)
    assert ("airframe.torque_scale_frd_rad_s2" in settings) == (depth == "torque")


@pytest.mark.parametrize("drift", [0.0, -0.013])
def test_without_timesync_the_sum_of_age_and_dead_time_is_the_same(log, drift):
    fill(log, timesync=False, drift=drift)
    found = identified(log)
    settings = found.settings(found.depths[0])
    assert found.round_trip_s is None
    assert found.age_s == pytest.approx(0.0015, abs=0.001)
    total_s = settings["law.delay_s"] + settings["law.dead_time_s"]
    assert total_s == pytest.approx(AGE_S + DOWN_S + UP_S + DEAD_S + 0.0015, abs=0.003)
    assert settings["law.lag_s"] == pytest.approx(LAG_S, rel=0.05)


def test_only_what_it_followed_counts(log):
    """In the middle third the vehicle is in LOITER, where it does something else."""
    fill(log, seconds=30, following=lambda t_s: not 9.5 < t_s < 20.5)
    [report] = identified(log).depths
    assert [(round(from_s, 1), round(to_s, 1)) for from_s, to_s in report.spans] == [(0.5, 9.0), (21.5, 30.0)]
    for fit in report.fits.values():
        assert fit.explained > 0.95
        assert not np.any((fit.times_s > 9.0) & (fit.times_s < 21.5))
        assert fit.lag_s.value == pytest.approx(LAG_S, rel=0.05)


@pytest.mark.parametrize("spoil", ["disarmed", "on the ground", "loiter"])
def test_nothing_counts_while_it_does_not_follow(log, spoil):
    for t_s in range(20):
        status = 0 if spoil == "disarmed" else 128
        mode = LOITER if spoil == "loiter" else OFFBOARD
        log.add(t_s, dialect.MAVLink_heartbeat_message(2, 12, status, mode, 4, 3))
        log.add(t_s, dialect.MAVLink_extended_sys_state_message(0, 1 if spoil == "on the ground" else 2))
    assert flight_data(log.contents()).offboard == []


def test_a_throttle_on_the_ground_is_not_a_flight(log):
    """EXTENDED_SYS_STATE says that it is in the air; its height does not."""
    for tenth in range(200):
        t_s = tenth / 10
        if tenth % 10 == 0:
            vehicle_state(log, t_s, armed=t_s >= 5.0)
        log.local(t_s, (0.0, 0.0, 2.0 if t_s < 12.0 else 1.0), (0, 0, 0))
    [(from_s, to_s)] = flight_data(log.contents()).offboard
    assert from_s == pytest.approx(12.0, abs=0.11)
    assert to_s == pytest.approx(19.0)


def test_a_guided_copter_follows_and_one_in_loiter_does_not(log):
    for t_s in range(20):
        log.add(t_s, dialect.MAVLink_heartbeat_message(2, 3, 128, 4 if t_s < 10 else 5, 4, 3))
    assert flight_data(log.contents()).offboard == [(0.0, 9.0)]


def test_the_autopilots_own_commands(log):
    fill(log, sent=False)
    rng = np.random.default_rng(4)
    values = np.repeat(rng.normal(0.0, SPREAD["rate"], (100, 3)), 20, axis=0)
    for k, value in enumerate(values[::2]):
        boot_ms = round((k * 0.02 + BOOT_S + UP_S) * 1e3)
        target = dialect.MAVLink_attitude_target_message(boot_ms, 0, [1.0, 0.0, 0.0, 0.0], *value, 0.5)
        log.add(k * 0.02 + UP_S + DOWN_S, target)
    [report] = identified(log).depths
    assert (report.depth, report.own, report.commands) == ("rate", True, 1000)
    assert report.command_rate_hz == pytest.approx(50.0, rel=0.01)
    assert set(report.fits) == {"roll", "pitch", "yaw"}
    for fit in report.fits.values():  # a command that stands for 10 ms before and after its stamp begins 10 ms earlier
        assert fit.dead_s.value == pytest.approx(DEAD_S + 0.01, abs=0.004)
        assert fit.lag_s.value == pytest.approx(LAG_S, rel=0.08)


def test_a_reboot_in_the_middle_is_bridged(log):
    fill(log, seconds=15)
    first = log.contents()
    assert flight_data(first).boots == 1
    log.attitude(16.0, 0, 0, 0, boot_s=2.0)
    log.attitude(16.01, 0, 0, 0, boot_s=2.01)
    data = flight_data(log.contents())
    assert data.boots == 2
    assert data.answers.times_s[-1] == pytest.approx(16.01, abs=0.002)
    assert np.all(np.diff(data.answers.times_s) > 0.0)


def test_stamps_that_repeat_and_values_that_are_not_numbers_are_left_out(log):
    for k in range(10):
        log.attitude(k * 0.01, 0, 0, 0, boot_s=k // 2 * 0.02)
    log.attitude(0.2, math.nan, 0, 0, boot_s=0.2)
    log.add(0.3, rates_setpoint((math.nan, 0.0, 0.0)), GCS)
    log.add(0.3, rates_setpoint((1.0, 2.0, 3.0)), GCS)
    log.add(0.4, dialect.MAVLink_set_attitude_target_message(0, 7, 1, 0x80, [1.0, 0, 0, 0], 0, 0, 0, 0.5), GCS)
    log.add(0.5, dialect.MAVLink_set_attitude_target_message(0, 1, 1, 0x80 | 4, [1.0, 0, 0, 0], 0, 0, 0, 0.5), GCS)
    log.add(0.6, attitude_setpoint((0.1, -0.2, 3.0)), GCS)
    log.add(0.7, attitude_setpoint((0.1, -0.2, -3.0)), GCS)
    data = flight_data(log.contents())
    assert len(data.answers.times_s) == 5
    assert data.sent["rate"].values.tolist() == [[1.0, 2.0, 3.0]]
    assert data.sent["attitude"].values == pytest.approx(np.array([[0.1, -0.2, 3.0], [0.1, -0.2, math.tau - 3.0]]))


def test_spans():
    assert intersection([(0.0, 5.0), (6.0, 9.0)], [(1.0, 7.0), (8.0, 20.0)]) == [(1.0, 5.0), (6.0, 7.0), (8.0, 9.0)]
    assert without_entry([(0.0, 0.4), (1.0, 3.0)]) == [(1.5, 3.0)]


def test_a_log_without_commands_says_so(log):
    vehicle_state(log, 0.0)
    for k in range(50):
        log.attitude(k * 0.01, 0, 0, 0)
    refused = identify_log(log.contents())
    assert isinstance(refused, Refused)
    assert "no attitude, rate or torque setpoints" in refused.reason


def test_a_log_without_attitudes_says_so(log):
    vehicle_state(log, 0.0)
    refused = identify_log(log.contents())
    assert isinstance(refused, Refused)
    assert "no ATTITUDE" in refused.reason


def test_json_is_json_and_refusals_are_in_it(log):
    fill(log, seconds=20)
    found = identified(log)
    written = json.loads(json.dumps(found.to_json(), allow_nan=False))
    [report] = written["depths"]
    assert (written["clock"], report["depth"], report["commands_of"]) == ("timesync", "rate", "offboard")
    assert report["axes"]["roll"]["dead_s"]["value"] == found.depths[0].fits["roll"].dead_s.value
    assert report["settings"]["law.lag_s"] == found.settings(found.depths[0])["law.lag_s"]


def test_lines_of_a_configuration():
    lines = toml_lines(
        {"law.delay_s": 0.025, "law.lag_s": 0.05, "airframe.torque_scale_frd_rad_s2": [113.0, 113.0, 13.3]}
    )
    assert lines == [
        "[law]",
        "delay_s = 0.025",
        "lag_s = 0.05",
        "",
        "[airframe]",
        "torque_scale_frd_rad_s2 = [113.0, 113.0, 13.3]",
    ]


@pytest.mark.parametrize("depth", ["rate", "torque"])
def test_the_figure_shows_every_axis(log, tmp_path, depth):
    fill(log, depth, gain=20.0 if depth == "torque" else 1.0)
    found = identified(log)
    identification_figure(found, found.depths[0], tmp_path / "fits.png", "a flight")
    assert (tmp_path / "fits.png").read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in tmp_path.iterdir()] == ["fits.png"]
    assert all(isinstance(fit, AxisFit) for fit in found.depths[0].axes)


def test_the_liveliest_stretch():
    times_s = np.arange(0.0, 60.0, 0.01)
    values = np.where((times_s > 31.0) & (times_s < 35.0), 1.0, 0.1)
    from_s, to_s = liveliest(times_s, values)
    assert from_s <= 31.0
    assert to_s >= 35.0
    assert to_s - from_s == pytest.approx(6.0)
    assert liveliest(times_s[:100], values[:100]) == (0.0, pytest.approx(0.99))
