"""The law in the shadow of a synthetic flight: a circle in a steady wind, whose attitude and thrust are those it takes."""

from __future__ import annotations

import json
import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.law_shadow import law_shadow, setpoint_names
from mavquad.analysis.law_shadow_figure import law_shadow_figure
from mavquad.control.params import LawParams
from mavquad.flight.guards import GuardParams

G = 9.81
OMEGA, RADIUS = 0.6, 2.0
WIND_NED = (0.9, -0.5, 0.0)  # m/s^2 that is not the thrust's
HOVER_NORM = 0.4
ME = (1, 1)
IN_AIR, ON_GROUND = 2, 1


def place(t):
    angle = OMEGA * t
    sin, cos = math.sin(angle), math.cos(angle)
    return (
        (RADIUS * cos, RADIUS * sin, -5.0),
        (-OMEGA * RADIUS * sin, OMEGA * RADIUS * cos, 0.0),
        (-OMEGA * OMEGA * RADIUS * cos, -OMEGA * OMEGA * RADIUS * sin, 0.0),
    )


def attitude(t):
    """Roll and pitch (FRD to NED) at yaw zero, and thrust, that give the acceleration of the circle in this wind."""
    _, _, acceleration = place(t)
    north, east, down = (a - w for a, w in zip(acceleration, WIND_NED, strict=True))
    lift = G - down
    thrust = math.sqrt(north * north + east * east + lift * lift)
    return math.asin(east / thrust), math.atan2(-north, lift), thrust


def flight(log, rate_hz=50.0, seconds=30.0, targets=True, commands=True, mode=4 << 16 | 3 << 24, from_s=2.0, pause=()):
    for second in range(int(seconds + from_s) + 3):
        armed = from_s - 1.0 <= second <= from_s + seconds
        log.add(second, dialect.MAVLink_heartbeat_message(2, 12, armed * 128, mode, 4, 3))
        state = IN_AIR if from_s <= second < from_s + seconds else ON_GROUND
        log.add(second, dialect.MAVLink_extended_sys_state_message(0, state))
    for k in range(int(seconds * rate_hz)):
        t = from_s + k / rate_hz
        if pause and pause[0] < t < pause[1]:
            continue
        position, velocity, _ = place(t)
        roll, pitch, thrust = attitude(t)
        step = 0.01
        rates = tuple((b - a) / step for a, b in zip(attitude(t)[:2], attitude(t + step)[:2], strict=True))
        log.attitude(t, roll, pitch, 0.0, (*rates, 0.0))
        log.local(t, position, velocity)
        stamp_ms = round(t * 1000)
        if commands:
            q = [math.cos(roll / 2) * math.cos(pitch / 2), math.sin(roll / 2) * math.cos(pitch / 2),
                 math.cos(roll / 2) * math.sin(pitch / 2), -math.sin(roll / 2) * math.sin(pitch / 2)]  # fmt: skip
            norm = HOVER_NORM * thrust / G
            log.add(t, dialect.MAVLink_attitude_target_message(stamp_ms, 0, q, *rates, 0.0, norm))
        if targets:
            place_and_speed = (*position, *velocity, 0, 0, 0, 0.0, 0.0)
            log.add(t, dialect.MAVLink_position_target_local_ned_message(stamp_ms, 1, 0, *place_and_speed))


def shadowed(log, **law):
    return law_shadow(log.contents(), ME, LawParams(**law), GuardParams())


@pytest.mark.parametrize(("rate_hz", "within"), [(50.0, 0.06), (10.0, 0.06), (4.0, 0.1)])
def test_velocity_and_disturbance_are_found_at_several_rates(log, rate_hz, within):
    flight(log, rate_hz)
    found = shadowed(log)
    [phase] = found.phases
    assert (found.source, found.attitude_source, phase.phase.mode) == ("LOCAL_POSITION_NED", "ATTITUDE", "AUTO.LOITER")
    assert found.hover_thrust_norm == pytest.approx(HOVER_NORM, abs=0.005)
    assert phase.positions.rate_hz == pytest.approx(rate_hz, rel=0.01)
    assert max(phase.velocity_rms_m_s) < within
    north, east, down = WIND_NED
    assert phase.disturbance_mean_m_s2 == pytest.approx((north, -east, -down), abs=0.1)
    assert max(phase.disturbance_rms_m_s2) < 3 * within


def test_what_follows_the_autopilots_own_target_asks_for_what_it_does(log):
    flight(log)
    [phase] = shadowed(log).phases
    assert phase.reference == "POSITION_TARGET_LOCAL_NED"
    assert phase.away_m < 0.05
    roll, pitch, yaw, thrust = phase.own_rms
    assert max(roll, pitch) < math.radians(2.0)
    assert yaw < math.radians(0.5)
    assert thrust < 0.2
    assert max(abs(sent[0]) for sent in phase.track.setpoints) > math.radians(4.0)  # there is something to ask for
    assert phase.moved_rms[0] < math.radians(2.0)
    assert phase.limits == {}


def test_without_a_target_it_holds_where_the_phase_began(log):
    flight(log, targets=False)
    [phase] = shadowed(log).phases
    assert phase.reference == "hold where the phase begins"
    assert phase.away_m == pytest.approx(2 * RADIUS, abs=0.1)
    assert phase.own_rms[1] > math.radians(5.0)
    [first, *_] = phase.track.reference_nwu_m
    assert set(phase.track.reference_nwu_m) == {first}


def test_where_targets_lapse_it_holds_there_each_time(log):
    flight(log, rate_hz=10.0, targets=False)
    for from_s in (5, 20):
        for tenth in range(30):
            t = from_s + tenth / 10
            position, *_ = place(t)
            log.add(t, dialect.MAVLink_position_target_local_ned_message(round(t * 1000), 1, 0, *position, *[0.0] * 8))
    [phase] = shadowed(log).phases
    at = dict(zip([round(t, 1) for t in phase.track.times_s], phase.track.reference_nwu_m, strict=True))
    flown = dict(zip([round(t, 1) for t in phase.track.times_s], phase.track.position_nwu_m, strict=True))
    assert at[4.0] == at[2.0] == pytest.approx(flown[2.0], abs=1e-6)
    assert at[6.0] == pytest.approx(flown[6.0], abs=0.02)
    assert at[19.0] == at[10.0] == pytest.approx(flown[9.5], abs=0.2)
    assert at[31.0] == at[25.0] == pytest.approx(flown[24.5], abs=0.2)
    assert phase.reference == "POSITION_TARGET_LOCAL_NED (30%), else hold"


@pytest.mark.parametrize(("offset_ned", "number", "sign"), [((1, 0, 0), 1, 1), ((0, 1, 0), 0, 1), ((0, 0, -1), 3, 1)])
def test_the_setpoint_leads_to_the_target(log, offset_ned, number, sign):
    """FLU: pitch is nose down, northwards; roll leans to the right, eastwards."""
    for tenth in range(100):
        t = tenth / 10
        if tenth % 10 == 0:
            log.heartbeat(t, armed=True)
        log.attitude(t, 0.0, 0.0, 0.0)
        log.local(t, (0, 0, -5), (0, 0, 0))
        target = [here + there for here, there in zip((0, 0, -5), offset_ned, strict=True)]
        log.add(t, dialect.MAVLink_position_target_local_ned_message(round(t * 1000), 1, 0, *target, *[0.0] * 8))
    [phase] = shadowed(log).phases
    asked = [a - b for a, b in zip(phase.track.setpoints[-1], phase.track.moved[-1], strict=True)]
    assert asked[number] * sign > 0.05
    assert all(abs(value) < 0.02 for k, value in enumerate(asked) if k not in (number, 3))


@pytest.mark.parametrize(("depth", "within"), [("rate", 0.15), ("torque", 1.0)])
def test_other_depths(log, depth, within):
    flight(log, rate_hz=100.0, seconds=10.0)
    [phase] = shadowed(log, depth=depth).phases
    assert [name for name, _ in setpoint_names(depth)] == [
        f"{axis} {'rate' if depth == 'rate' else 'acceleration'}" for axis in ("roll", "pitch", "yaw")
    ]
    assert max(phase.moved_rms) < within
    assert (phase.own_rms[0] is None) == (depth == "torque")
    assert max(phase.velocity_rms_m_s) < 0.06


def test_without_thrust_commands_the_thrust_holds_the_hover(log):
    flight(log, commands=False)
    found = shadowed(log)
    assert found.hover_thrust_norm is None
    [phase] = found.phases
    assert phase.own_rms == (None,) * 4
    assert phase.disturbance_mean_m_s2[0] == pytest.approx(WIND_NED[0], abs=0.1)
    assert phase.verdicts[0].would_do


def test_gaps_do_not_stop_it_but_are_told(log):
    flight(log, seconds=20.0, pause=(10.0, 12.0))
    [phase] = shadowed(log).phases
    assert len(phase.track.times_s) == pytest.approx(900, abs=2)
    assert max(phase.velocity_rms_m_s) < 0.1
    assert all(math.isfinite(value) for row in phase.track.setpoints for value in row)
    assert [verdict.late for verdict in phase.verdicts] == [2, 2, 2]


def test_other_measurements_and_laws_are_taken(log):
    flight(log, seconds=8.0)
    plain, full, state = (
        shadowed(log).phases[0],
        shadowed(log, measurements="full").phases[0],
        shadowed(log, form="state_feedback", depth="attitude").phases[0],
    )
    assert plain.track.velocity_nwu_m_s != full.track.velocity_nwu_m_s
    assert state.velocity_rms_m_s == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_poses_without_attitudes_are_judged_no_further(log):
    log.heartbeat(0, armed=True)
    for k in range(100):
        log.local(k / 10, (0, 0, -3), (0, 0, 0))
    log.heartbeat(10, armed=True)
    [phase] = shadowed(log).phases
    assert (phase.verdicts, phase.track.times_s, phase.reference, phase.away_m) == ((), [], "", None)


def test_a_log_without_flights(log):
    for k in range(20):
        log.heartbeat(k)
        log.attitude(k, 0, 0, 0)
    found = shadowed(log)
    assert found.phases == ()
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["phases"] == []


@pytest.mark.parametrize(
    ("release", "autopilot", "takes"),
    [((1, 13), "px4", 3), ((1, 16), "px4", 2), (None, "px4", 3), ((4, 7), "arducopter", 2)],
)
def test_what_the_autopilot_takes_is_said_beside_the_verdicts(log, release, autopilot, takes):
    log.heartbeat(0)
    if release:
        number = release[0] << 24 | release[1] << 16
        log.add(1, dialect.MAVLink_autopilot_version_message(0, number, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0))
    assert len(shadowed(log, autopilot=autopilot).takes) == takes


def test_json_and_figure(log, tmp_path):
    flight(log, rate_hz=20.0, seconds=12.0)
    found = shadowed(log)
    [written] = json.loads(json.dumps(found.to_json(), allow_nan=False))["phases"]
    assert written["verdicts"].keys() == {"torque", "rate", "attitude"}
    assert written["setpoint_minus_own_rms"].keys() == {"roll (rad)", "pitch (rad)", "yaw (rad)", "thrust (m/s²)"}
    assert (written["mode"], written["reference"]) == ("AUTO.LOITER", "POSITION_TARGET_LOCAL_NED")
    law_shadow_figure(found, tmp_path / "shadow.png", "title")
    assert (tmp_path / "shadow.png").stat().st_size > 30_000
