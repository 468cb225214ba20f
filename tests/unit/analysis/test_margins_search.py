"""The fastest gains, the check before a flight, and the map."""

import re

import numpy as np
import pytest

from mavquad.analysis.gain_search import (
    PLACE,
    TURN,
    Gains,
    Limits,
    approach_share,
    fastest_gains,
    gains_of,
    input_level,
    noise_share,
)
from mavquad.analysis.loop_spec import loop_spec
from mavquad.analysis.margin_check import GREATEST_PEAK, LEAST_DELAY_S, check_margins
from mavquad.analysis.margin_map import margin_map
from mavquad.analysis.margins import margins
from mavquad.control.params import LawParams
from mavquad.errors import ConfigError
from mavquad.protocol.streams import StreamParams

USUAL = StreamParams()


def kept(law: LawParams, depth: str, kinds: tuple, limits: Limits, gains: Gains) -> bool:
    changed = gains.put_into(law, kinds)
    specs = [loop_spec(changed, depth, kind, USUAL) for kind in kinds]
    found = [margins(spec) for spec in specs]
    return (
        all(m.stable and m.phase_deg >= limits.phase_deg and m.peak <= limits.peak for m in found)
        and all(m.delay_s >= 0.98 * limits.delay_s and abs(m.echo) <= limits.echo for m in found)
        and all(noise_share(changed, depth, spec) <= limits.noise_share for spec in specs)
        and all(approach_share(changed, depth, spec) <= limits.approach_share for spec in specs)
    )


@pytest.mark.parametrize(
    ("depth", "kinds"), [("torque", PLACE), ("torque", TURN), ("rate", PLACE), ("attitude", PLACE)]
)
@pytest.mark.parametrize("limits", [Limits(), Limits(phase_deg=15.0, delay_s=0.03, peak=3.5)])
def test_the_fastest_gains_keep_the_margins_and_faster_ones_do_not(depth: str, kinds: tuple, limits: Limits) -> None:
    law = LawParams()
    found = fastest_gains(law, depth, USUAL, kinds, limits)
    assert found is not None
    assert kept(law, depth, kinds, limits, found)
    faster = 1.12 * found.omega0_rad_s
    assert not any(kept(law, depth, kinds, limits, Gains(faster, faster * ratio)) for ratio in (2.0, 4.0, 8.0, 16.0))


def test_tighter_margins_are_slower_gains() -> None:
    found = [fastest_gains(LawParams(), "rate", USUAL, PLACE, Limits(peak=peak)) for peak in (2.0, 2.5, 3.0)]
    speeds = [gains.omega0_rad_s for gains in found if gains is not None]
    assert len(speeds) == 3
    assert speeds == sorted(speeds)


def test_margins_that_nothing_keeps() -> None:
    assert fastest_gains(LawParams(), "torque", USUAL, PLACE, Limits(phase_deg=80.0)) is None


def test_commands_that_alternate_are_seen() -> None:
    """Yaw at depth rate, a lag of 0.5 s bridged: each command answers the one before it -gamma c times, and c is 0.18 s."""
    for omega0, stable in ((4.0, True), (7.0, False)):
        law = LawParams(yaw_omega0_rad_s=omega0, yaw_kappa_rad_s=20.0, yaw_lag_s=0.5, yaw_dead_time_s=0.0)
        found = margins(loop_spec(law, "rate", "yaw", USUAL))
        assert found.stable == stable
        assert -found.echo == pytest.approx(omega0 * 0.5 * np.exp(-1.0), rel=0.05)


def test_shares_by_hand() -> None:
    law = LawParams(omega0_rad_s=2.0, yaw_omega0_rad_s=2.0)
    x, yaw = (loop_spec(law, "torque", kind, USUAL) for kind in ("horizontal", "yaw"))
    assert input_level(law, "torque", "horizontal") == law.saturation.roll_pitch_rad_s2
    assert approach_share(law, "torque", x) == pytest.approx(2.0 * 4.0 * 2.0**3 / 9.81 / 25.0, rel=1e-3)
    assert approach_share(law, "torque", yaw) == pytest.approx(np.radians(60.0) * 4.0 / np.radians(170.0))
    assert gains_of(x).omega0_rad_s == pytest.approx(2.0)


@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
@pytest.mark.parametrize("measured", ["position_yaw", "position_attitude", "full"])
def test_the_usual_gains_pass_the_check(depth: str, measured: str) -> None:
    found = check_margins(LawParams(measurements=measured), USUAL, depth)
    assert all(m.delay_s >= LEAST_DELAY_S and m.peak <= GREATEST_PEAK for m in found.values())


BAD = [
    ("rate", {"omega0_rad_s": 9.0, "kappa_rad_s": 18.0}, "", "Ms"),
    ("torque", {"omega0_rad_s": 14.0, "kappa_rad_s": 40.0}, "", "is unstable"),
    ("rate", {"yaw_omega0_rad_s": 12.0, "yaw_kappa_rad_s": 40.0}, "yaw_", "yaw is unstable"),
    ("torque", {"delay_s": 0.15, "omega0_rad_s": 5.0}, "", "delay_s = 0.15 and 100 Hz"),
]


@pytest.mark.parametrize(("depth", "given", "prefix", "words"), BAD)
def test_gains_without_margin_are_refused_and_what_is_advised_is_not(
    depth: str, given: dict, prefix: str, words: str
) -> None:
    law = LawParams(depth=depth, **given)
    with pytest.raises(ConfigError) as refused:
        check_margins(law, USUAL, depth, "mine.toml")
    error = refused.value
    assert error.exit_code == 2
    assert error.message.startswith(f"mine.toml: law.{prefix}omega0_rad_s: no margin at depth {depth}: the loop of")
    assert words in error.message
    assert "--force" in error.hint
    advised = re.search(r"omega0_rad_s = ([\d.]+) and \w*kappa_rad_s = ([\d.]+) would do", error.hint)
    assert advised is not None
    gains = Gains(float(advised[1]), float(advised[2]))
    check_margins(gains.put_into(law, TURN if prefix else PLACE), USUAL, depth)


def test_where_no_gains_would_do_none_are_advised() -> None:
    """Poles that are hardly damped have no margin at any speed."""
    poles = ((-0.05, 5.0), (-0.05, -5.0), (-0.05, 3.0), (-0.05, -3.0))
    law = LawParams(measurements="position_yaw", depth="torque", polynomial="poles", poles=poles)
    with pytest.raises(ConfigError) as refused:
        check_margins(law, USUAL, "torque")
    assert "no gains would do" in refused.value.hint


def test_the_map_says_what_the_margins_say() -> None:
    law = LawParams()
    here = Gains(2.0, 6.0)
    found = margin_map(law, "rate", USUAL, TURN, [here])
    assert found.omega0_rad_s[0] < 2.0 < found.omega0_rad_s[-1]
    assert found.ratio[0] < 3.0 < found.ratio[-1]
    row, column = 7, 11
    omega0 = float(found.omega0_rad_s[column])
    there = Gains(omega0, omega0 * float(found.ratio[row]))
    expected = margins(loop_spec(there.put_into(law, TURN), "rate", "yaw", USUAL))
    assert found.peak[row, column] == pytest.approx(expected.peak)
    assert found.delay_s[row, column] == pytest.approx(expected.delay_s, rel=0.02)
    assert np.array_equal(np.isinf(found.peak), np.isinf(found.noise_share))
