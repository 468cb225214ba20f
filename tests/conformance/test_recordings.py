"""The mock answers the clients of recorded flights as the real autopilots did, and never less well than it once did."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from tests.conformance.compare import Comparison, compare, totals
from tests.conformance.cut import FOLDER
from tests.conformance.play import play
from tests.conformance.recording import Recording, is_recording, read
from tests.conformance.texts import Text, unmatched

# What agreed when this was last written: exchanges that count, of the same outcome, the same in texts too.
AGREED = {
    "arducopter-4.7-a": (44, 44, 44),
    "arducopter-4.7-b": (12, 12, 12),
    "arducopter-4.7-c1": (39, 39, 39),
    "arducopter-4.7-c2": (11, 11, 11),
    "arducopter-4.7-c3": (12, 12, 12),
    "px4-v1.13.3-a": (10, 10, 9),
    "px4-v1.13.3-c-reject": (11, 11, 10),
    "px4-v1.13.3-d-actuator139": (17, 17, 15),
    "px4-v1.16.2-a": (9, 9, 9),
    "px4-v1.16.2-b": (8, 8, 7),
    "px4-v1.16.2-c-reject": (10, 10, 9),
    "px4-v1.16.2-c-stop": (9, 9, 8),
}
SAMPLE = "px4-v1.16.2-c-reject"
FULL = Path(__file__).resolve().parents[3] / "shared" / "tlogs"


@cache
def recorded(name: str) -> Recording:
    return read(FOLDER / f"{name}.tlog.gz")


@cache
def played(name: str) -> Recording:
    return play(recorded(name))


def agreement(comparison: Comparison) -> tuple[int, int, int]:
    counts = totals([comparison])
    return counts["exchanges"], counts["same outcome"], counts["identical"]


@pytest.mark.parametrize("name", AGREED)
def test_what_agreed_still_agrees(name: str) -> None:
    comparison = compare(recorded(name), played(name))
    reached = agreement(comparison)
    told = "\n".join(
        str(c.real) + ": " + "; ".join(map(str, c.differences)) for c in comparison.exchanges if c.differences
    )
    assert reached[0] == AGREED[name][0]
    assert reached[1:] >= AGREED[name][1:] and reached[2] >= AGREED[name][2], told


def test_every_recording_is_held() -> None:
    assert {path.name.removesuffix(".tlog.gz") for path in FOLDER.iterdir()} == set(AGREED)


def changed(name: str, kind: str, **fields: object) -> Comparison:
    """The comparison when the real autopilot's first message of a kind in flight had said something else."""
    messages = []
    for at_us, message in recorded(name).vehicle:
        if message.get_type() == kind and at_us > 13_000_000 and fields:
            message = copy(message)
            for field, value in fields.items():
                setattr(message, field, value)
            fields = {}
        messages.append((at_us, message))
    return compare(replace(recorded(name), vehicle=messages), played(name))


@pytest.mark.parametrize(
    ("kind", "fields", "lost"),
    [
        ("COMMAND_ACK", {"result": 2}, (0, 1, 1)),
        ("COMMAND_ACK", {"target_component": 7}, (0, 1, 1)),
        ("COMMAND_ACK", {"command": 11}, (0, 1, 1)),
        ("STATUSTEXT", {"text": "Something else"}, (0, 0, 1)),
        ("STATUSTEXT", {"severity": 5}, (0, 0, 1)),
    ],
)
def test_a_single_difference_is_seen(kind: str, fields: dict[str, object], lost: tuple[int, int, int]) -> None:
    before = agreement(compare(recorded(SAMPLE), played(SAMPLE)))
    after = agreement(changed(SAMPLE, kind, **fields))
    assert tuple(b - a for b, a in zip(before, after, strict=True)) == lost


def test_another_mode_after_a_command_is_seen() -> None:
    def elsewhere(at_us: int, message: object) -> object:
        if message.get_type() == "HEARTBEAT" and 13_000_000 < at_us < 18_000_000:
            message = copy(message)
            message.custom_mode = 6 << 16
        return message

    real = recorded(SAMPLE)
    other = replace(real, vehicle=[(at_us, elsewhere(at_us, message)) for at_us, message in real.vehicle])
    before, after = (agreement(compare(recording, played(SAMPLE))) for recording in (real, other))
    assert (before[1] - after[1], before[2] - after[2]) == (1, 1)


def test_a_text_matches_one_text_only() -> None:
    said = Text(0, 6, "twice")
    assert unmatched([said, said], [said]) == ([said], [])
    assert unmatched([said], [said, said]) == ([], [said])
    assert unmatched([said], [replace(said, at_us=600_000)]) == ([said], [replace(said, at_us=600_000)])


@pytest.mark.parametrize("name", ["arducopter-4.7-c1", "px4-v1.13.3-c-reject", "px4-v1.16.2-c-reject"])
def test_kinds_and_rates_of_a_whole_recording(name: str) -> None:
    path = next((path for path in FULL.glob(f"{name}*.tlog") if is_recording(path)), None) if FULL.is_dir() else None
    if path is None:
        pytest.skip(f"needs the whole recording {name}.tlog in {FULL}")
    comparison = compare(read(path))
    assert set(comparison.missing_kinds) <= {"COMMAND_LONG"}  # PX4 1.16 commands a gimbal when it lands
    for agreeing in (comparison.rates, comparison.constants):
        assert len(agreeing) >= 7
        differing = [one for one in agreeing if not one.agrees]
        assert len(differing) <= 0.1 * len(agreeing), differing
