"""The observer over synthetic logs whose velocity is known."""

from __future__ import annotations

import json
import math

import pytest

from mavquad.analysis.shadow import adapted_kappa_rad_s, observe, shadow
from mavquad.tlog import scan


def circle(log, rate_hz, seconds, boot_offset_s=0.0, from_s=0.0):
    """A circle of 2 m radius at 0.5 rad/s that climbs at 0.3 m/s and turns its nose at 0.5 rad/s; NED."""
    for k in range(int(seconds * rate_hz)):
        t = k / rate_hz
        sin, cos = math.sin(0.5 * t), math.cos(0.5 * t)
        position, velocity = (2 * cos, 2 * sin, -0.3 * t), (-sin, cos, -0.3)
        log.local(from_s + t, position, velocity, boot_s=boot_offset_s + t)
        yaw = (0.5 * t + math.pi) % (2 * math.pi) - math.pi
        log.attitude(from_s + t, 0.0, 0.0, yaw, (0.0, 0.0, 0.5), boot_s=boot_offset_s + t)


@pytest.mark.parametrize(
    ("rate_hz", "kappa", "within_m_s"), [(100, 10.0, 0.01), (10, 10.0, 0.02), (4, 8.0, 0.02), (1, 2.0, 0.2)]
)
def test_velocity_of_a_circle_at_several_rates(log, rate_hz, kappa, within_m_s):
    circle(log, rate_hz, 40)
    result = shadow(log.contents(), (1, 1))
    assert result.kappa_rad_s == pytest.approx(kappa)
    assert result.position_rate_hz == pytest.approx(rate_hz)
    assert all(rms < within_m_s for rms in result.velocity_rms_m_s)
    assert result.yaw_rate_rms_rad_s < 0.001
    assert result.logged_speed_rms_m_s == pytest.approx(math.hypot(1.0, 0.3), abs=1e-3)


def test_each_axis_and_the_acceleration_have_their_own_sign(log):
    circle(log, 50, 20)
    [track] = shadow(log.contents(), (1, 1)).tracks
    t = track.times_s[-1]
    sin, cos = math.sin(0.5 * t), math.cos(0.5 * t)
    assert track.position_nwu_m[-1] == pytest.approx((2 * cos, -2 * sin, 0.3 * t), abs=1e-5)
    assert track.velocity_nwu_m_s[-1] == pytest.approx((-sin, -cos, 0.3), abs=0.02)
    assert track.acceleration_nwu_m_s2[-1] == pytest.approx((-0.5 * cos, 0.5 * sin, 0.0), abs=0.1)
    assert track.yaw_rad[-1] == pytest.approx(-0.5 * t, abs=1e-5)
    assert track.yaw_rate_rad_s[-1] == pytest.approx(-0.5, abs=1e-3)


def test_a_wrong_velocity_in_the_log_shows(log):
    for k in range(400):
        log.local(k / 20, (0.5 * k / 20, 0, 0), (0.8, 0.0, 0.0))
    assert shadow(log.contents(), (1, 1)).velocity_rms_m_s == pytest.approx((0.3, 0.0, 0.0), abs=1e-3)


def test_a_reboot_starts_the_observer_afresh(log):
    circle(log, 20, 20, boot_offset_s=100.0)
    circle(log, 20, 20, boot_offset_s=3.0, from_s=30.0)
    result = shadow(log.contents(), (1, 1))
    assert len(result.tracks) == 2
    assert result.tracks[1].times_s[0] == pytest.approx(30.0)
    assert result.tracks[1].velocity_nwu_m_s[0] == (0.0, 0.0, 0.0)
    assert all(rms < 0.02 for rms in result.velocity_rms_m_s)


def test_without_poses(log):
    nothing = shadow(scan(b""), (1, 1))
    assert (nothing.source, nothing.tracks, nothing.velocity_rms_m_s) == ("", (), (None, None, None))
    log.local(0, (1, 2, 3), (0, 0, 0))
    log.local(0, (1, 2, 3), (0, 0, 0))
    one = shadow(log.contents(), (1, 1))
    assert (one.kappa_rad_s, one.velocity_rms_m_s, one.skipped["repeated"]) == (None, (None, None, None), 1)


def test_json_is_json(log):
    circle(log, 20, 5)
    written = json.loads(json.dumps(shadow(log.contents(), (1, 1)).to_json(), allow_nan=False))
    assert (written["source"], written["segments"], written["poses"]) == ("LOCAL_POSITION_NED", 1, 100)


def test_gain_follows_the_rate_up_to_its_cap():
    assert adapted_kappa_rad_s(None) is None
    assert adapted_kappa_rad_s(0.5) == pytest.approx(4.0)
    assert adapted_kappa_rad_s(0.001) == 10.0


def test_the_observer_at_rest_stays_at_rest():
    estimates = observe(5.0, 0, [0, 100_000, 250_000], [1.5, 1.5, 1.5])
    assert estimates == [(1.5, 0.0, 0.0)] * 3
    assert observe(5.0, 0, [], []) == []
