"""All guards together: each input reaches its guard, none is skipped because another tripped."""

from __future__ import annotations

import math

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.errors import ConfigError
from mavquad.flight.guard_set import GuardSections, GuardSet
from mavquad.flight_record import TraceRow
from mavquad.protocol.codec import mavlink
from mavquad.schema import parse_section
from mavquad.types import Attitude, Position

STILL = (0.0, 0.0, 0.0)
ZERO4 = (0.0, 0.0, 0.0, 0.0)


def guards(**tables):
    return GuardSet(parse_section(GuardSections, tables, "test.toml", "guards"))


def position(at_s=0.0, north_m=0.0, speed_m_s=0.0):
    return Position(round(at_s * 1e6), (north_m, 0.0, 0.0), (speed_m_s, 0.0, 0.0))


def row(**changes):
    values = dict.fromkeys(TraceRow._fields, ZERO4)
    values |= {"stamp_us": 0, "zeta_hat": ((0.0,) * 3,) * 4, "wind": STILL, "limits": (), **changes}
    return TraceRow(**values)


def test_the_defaults_let_a_quiet_flight_be():
    flight = guards()
    flight.begin(100.0, 100.0, 0)
    sys_status = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16000, 0, 90, 0, 0, 0, 0, 0, 0)
    for step in range(500):
        now_us = 10_000 * step
        assert flight.on_position(position(0.01 * step), now_us) is None
        assert flight.on_attitude(Attitude(now_us, 0.0, 0.0, 0.0, STILL), now_us) is None
        assert flight.on_row(row(stamp_us=now_us)) is None
        assert flight.on_frame(step % 256, now_us) is None
        assert flight.on_message(sys_status, now_us) is None
    assert flight.on_round_trip(40_000) is None
    assert flight.not_ready() == ""
    assert flight.next_deadline_us() == NEVER_US


def test_speed_and_jump_and_both_at_once():
    flight = guards(speed={"limit_m_s": 5.0})
    assert flight.on_position(position(0.0, speed_m_s=5.5), 0).name == "speed"
    assert flight.on_position(position(0.01, north_m=9.0, speed_m_s=4.5), 10_000).name == "jump"  # it saw the first one


def test_a_yaw_that_jumps():
    flight = guards()
    flight.on_attitude(Attitude(0, 0.0, 0.0, 0.0, STILL), 0)
    assert flight.on_attitude(Attitude(10_000, 0.0, 0.0, 1.0, STILL), 10_000).name == "jump"


@pytest.mark.parametrize("stream", ["on_position", "on_attitude"])
def test_a_slow_stream(stream):
    flight = guards()
    flight.begin(100.0, 100.0, 0)
    sample = position() if stream == "on_position" else Attitude(0, 0.0, 0.0, 0.0, STILL)
    said = [getattr(flight, stream)(sample._replace(stamp_us=k * 100_000), k * 100_000) for k in range(1, 30)]
    assert {each.name for each in said if each} == {"rate"}


def test_the_row_of_the_law():
    assert guards().on_row(row(controls=(0.0, math.nan, 0.0, 0.0))).name == "NaN"
    short = {"for_s": 0.0}
    assert guards(sigma={"wind_m_s2": 3.0, **short}).on_row(row(wind=(4.0, 0.0, 0.0))).name == "sigma"
    assert (
        guards(innovation={"position_m": 0.1, **short}).on_row(row(measured=(0.0, 0.0, 0.2, 0.0))).name == "innovation"
    )


def test_messages():
    flight = guards(battery={"for_s": 0.0}, estimator={"for_s": 0.001})
    low = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16000, 0, 3, 0, 0, 0, 0, 0, 0)
    assert flight.on_message(low, 0).name == "battery"
    assert flight.not_ready() == "3 % of the battery left, 15 % needed"
    of_one = mavlink.MAVLink_battery_status_message(0, 0, 1, 0, [16000] + [65535] * 9, 0, 0, 0, 4)
    assert flight.on_message(of_one, 0).words.startswith("4 %")
    lost = mavlink.MAVLink_estimator_status_message(0, 0, *[0.0] * 8)
    assert [flight.on_message(lost, stamp_us) for stamp_us in (0, 1000)][1].name == "estimator"
    report = mavlink.MAVLink_ekf_status_report_message(0, *[0.0] * 5)
    assert flight.on_message(report, 2000).name == "estimator"


def test_link_and_lateness_and_ground_station():
    flight = guards(gcs_loss={"silent_s": 2.0}, lateness={"count": 1})
    assert "link loss" in {each.name for k in range(3000) if (each := flight.on_frame(4 * k % 256, 2000 * k))}
    assert [flight.on_round_trip(700_000) for _ in range(3)][-1].name == "link loss"
    assert flight.on_late(200_000, 0).name == "lateness"
    assert flight.not_ready() == "no HEARTBEAT of a ground station (guards.gcs_loss)"
    flight.gcs.heard(0)
    flight.begin(100.0, 100.0, 1_000_000)
    assert flight.not_ready() == ""
    assert flight.on_deadline(flight.next_deadline_us()).name == "GCS loss"


@pytest.mark.parametrize("name", GuardSections.model_fields)
def test_every_guard_has_a_reaction_and_a_wrong_one_is_told(name):
    assert getattr(parse_section(GuardSections, {name: {"reaction": "pilot"}}, "t"), name).reaction == "pilot"
    with pytest.raises(ConfigError, match="'hold', 'land', 'return' or 'pilot'"):
        parse_section(GuardSections, {name: {"reaction": "fall"}}, "test.toml", "guards")
