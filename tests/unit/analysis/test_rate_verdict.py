"""Whether a rate of data would do."""

from __future__ import annotations

import pytest

from mavquad.analysis.gain_search import gains_of
from mavquad.analysis.loop_spec import KINDS, loop_spec
from mavquad.analysis.margin_check import check_margins, is_short
from mavquad.analysis.margins import margins
from mavquad.analysis.rate_verdict import Judge, _slowed, spacing
from mavquad.control.params import LawParams
from mavquad.errors import ConfigError
from mavquad.flight.guards import GuardParams
from mavquad.protocol.streams import StreamParams

LAW = LawParams(autopilot="px4")


def regular(rate_hz, count=100):
    return [round(k * 1e6 / rate_hz) for k in range(count)]


def verdicts(position_hz, attitude_hz=None, law=LAW, guards=GuardParams()):  # noqa: B008 - frozen
    streams = spacing(regular(position_hz)), spacing(regular(attitude_hz or position_hz))
    return {verdict.depth: verdict for verdict in Judge(law, guards).verdicts(*streams)}


def test_spacing_leaves_gaps_out_of_the_rate():
    stamps_us = [*regular(50, 51), *(1_700_000 + stamp_us for stamp_us in regular(50, 51))]
    found = spacing(stamps_us)
    assert (found.count, found.gaps_s[0], found.late(0.5), found.late(0.7)) == (102, pytest.approx(0.7), 1, 0)
    assert found.rate_hz == pytest.approx(50.0)
    assert spacing([]).rate_hz is spacing([5]).rate_hz is None
    assert spacing([5]).gaps_s == ()


def test_a_hundred_hertz_do_for_every_depth():
    found = verdicts(100)
    assert [verdict.words for verdict in found.values()] == ["yes", "yes", "yes"]
    assert found.keys() == {"torque", "rate", "attitude"}


@pytest.mark.parametrize("rate_hz", [250, 30, 20, 12])
@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
def test_verdicts_are_those_of_the_check_before_a_flight(depth, rate_hz):
    try:
        check_margins(LAW, StreamParams(position_hz=rate_hz, attitude_hz=rate_hz), depth)
        flies = True
    except ConfigError:
        flies = False
    assert verdicts(rate_hz)[depth].margins is flies


def test_the_slower_the_data_the_less_they_do_for():
    would = {rate_hz: [verdict.margins for verdict in verdicts(rate_hz).values()] for rate_hz in (100, 10, 1)}
    assert [sum(found) for found in would.values()] == [3, 1, 0]
    assert would[10] == [False, False, True]


def test_what_slower_gains_would_do_does():
    verdict = verdicts(10)["rate"]
    share = verdict.omega0_rad_s / LAW.own("rate").omega0_rad_s
    streams = StreamParams(position_hz=10, attitude_hz=10)
    slower = _slowed(LAW, "rate", share)
    specs = [loop_spec(slower, "rate", kind, streams) for kind in KINDS]
    assert not any(is_short(margins(spec)) for spec in specs)
    assert gains_of(specs[0]).omega0_rad_s == pytest.approx(verdict.omega0_rad_s)
    assert 0.1 < share < 1.0
    assert verdict.words == f"no: omega0 {verdict.omega0_rad_s:.2g} at most"


def test_slowing_by_nothing_changes_nothing():
    streams = StreamParams()
    for depth in ("torque", "rate", "attitude"):
        for kind in KINDS:
            assert margins(loop_spec(_slowed(LAW, depth, 1.0), depth, kind, streams)).peak == pytest.approx(
                margins(loop_spec(LAW, depth, kind, streams)).peak
            )


def test_late_poses_are_the_guards_by_depth():
    guards = GuardParams(stale_attitude_s=0.2, stale_attitude_at_torque_s=0.05, stale_position_s=0.5)
    attitudes = [*regular(100), *(1_080_000 + stamp_us for stamp_us in regular(100))]  # 0.09 s once
    judge = Judge(LAW, guards)
    found = {v.depth: v for v in judge.verdicts(spacing(regular(100)), spacing(attitudes))}
    assert [found[depth].late for depth in ("torque", "rate", "attitude")] == [1, 0, 0]
    assert [found[depth].words for depth in ("torque", "rate")] == ["no: 1 late", "yes"]
    slow = {v.depth: v for v in judge.verdicts(spacing([*regular(100), 2_000_000]), spacing(regular(100)))}
    assert slow["attitude"].late == 1


def test_without_a_stream_there_is_no_verdict():
    assert Judge(LAW, GuardParams()).verdicts(spacing(regular(50)), spacing([])) == ()


def test_poles_that_are_given_are_judged_at_their_depth():
    poles = ((-1.0, 0.0), (-1.0, 0.5), (-1.0, -0.5))
    law = LawParams(depth="rate", polynomial="poles", poles=poles, autopilot="px4")
    assert verdicts(100, law=law).keys() == {"rate"}
