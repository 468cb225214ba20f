"""A few flights of the campaign on what goes wrong (`python -m tests.bench.safety`)."""

from __future__ import annotations

import pytest

from tests.bench.safety import LOSS, SURVIVABLE
from tests.bench.safety_flight import fly_scenario
from tests.bench.scenarios import ARDUCOPTER, CRAFT, PX4_1_16

SCENARIOS = {scenario.name: scenario for scenario in SURVIVABLE}


@pytest.mark.parametrize("craft", CRAFT, ids=lambda craft: craft.name)
def test_with_a_fifth_lost_each_way_and_frames_late_twice_and_out_of_order_it_completes(craft) -> None:
    assert fly_scenario(LOSS, craft, "rate", 8).end == "completed"


@pytest.mark.parametrize(
    ("name", "craft", "depth", "seed", "end"),
    [
        ("delay", ARDUCOPTER, "rate", 29, "landed"),
        ("mode_change, bad link", ARDUCOPTER, "rate", 44, "pilot"),
        ("deaf", PX4_1_16, "attitude", 64, "pilot"),
        ("silent", ARDUCOPTER, "attitude", 89, "holds"),
    ],
)
def test_it_ends_safe(name, craft, depth, seed, end) -> None:
    tight = {"guards.link_loss.slower_s": 0.08}  # what the law's margin of delay asks for
    assert fly_scenario(SCENARIOS[name], craft, depth, seed, tight).end == end
