"""The law's shadow over logs of real autopilots and simulators; skipped where they are not at hand."""

from __future__ import annotations

import math

import pytest

from mavquad.analysis.law_shadow import law_shadow
from mavquad.control.params import LawParams
from mavquad.flight.guards import GuardParams
from mavquad.tlog import read_records
from tests.tlog_reference import LOGS

PX4, ARDUPILOT = LawParams(autopilot="px4"), LawParams(autopilot="arducopter")


def shadowed(name, law):
    path = LOGS / f"{name}.tlog"
    if not path.exists():
        pytest.skip(f"{path} is not at hand")
    return law_shadow(read_records(path), (1, 1), law, GuardParams())


def test_px4_at_a_hundred_hertz():
    found = shadowed("px4-v1.13.3-c-reject", PX4)
    assert [phase.phase.mode for phase in found.phases] == ["AUTO.TAKEOFF", "AUTO.LOITER", "AUTO.LAND"]
    assert all(verdict.would_do for phase in found.phases for verdict in phase.verdicts)
    assert found.hover_thrust_norm == pytest.approx(0.4885, abs=0.01)
    loiter = found.phases[1]
    assert loiter.reference == "POSITION_TARGET_LOCAL_NED"
    assert max(loiter.velocity_rms_m_s) < 0.25
    assert max(map(abs, loiter.disturbance_mean_m_s2)) < 0.5  # still air
    assert loiter.own_rms[3] < 1.0


def test_arducopter_at_four_hertz_with_a_forged_heartbeat():
    found = shadowed("ac_wlichon_hbspoof_v1v2", ARDUPILOT)
    assert [phase.phase.mode for phase in found.phases] == ["GUIDED", "AUTO"]
    auto = found.phases[1]
    assert auto.positions.rate_hz == pytest.approx(4.0, abs=0.1)
    assert not any(verdict.would_do for verdict in auto.verdicts)
    assert auto.reference == "POSITION_TARGET_GLOBAL_INT"
    assert auto.away_m < 1.5
    assert max(auto.velocity_rms_m_s) < 0.06


def test_a_log_with_damage_gaps_and_backward_stamps():
    found = shadowed("ac_lucagemma_corrupt_v1v2", ARDUPILOT)
    assert [phase.phase.mode for phase in found.phases][-1] == "RTL"
    for phase in found.phases:
        assert not any(verdict.would_do for verdict in phase.verdicts)
        assert all(math.isfinite(value) for row in phase.track.setpoints for value in row)


@pytest.mark.parametrize("name", ["px4_semvdh_hexa_46hz_v2", "ac_gridlines_kresge01_v1_trunc"])
def test_without_flights_or_without_a_fix(name):
    found = shadowed(name, PX4)
    assert not any(phase.track.times_s for phase in found.phases)
