"""What the README shows is what the code has."""

import re
from pathlib import Path

from mavquad.cli.outcome import EXIT_CODES
from mavquad.flight.machine import TRANSITIONS, Phase

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def diagram() -> str:
    """The state machine as README shows it; the transitions that every phase has are said in words beside it."""
    always = {Phase.DONE}
    lines = ["stateDiagram-v2", "    [*] --> CONNECTING"]
    for phase, row in TRANSITIONS.items():
        for target in dict.fromkeys(row.values()):
            events = ", ".join(event.name for event, goal in row.items() if goal is target)
            lines.append(f"    {phase.name} --> {target.name}: {events}")
    lines += [f"    {phase.name} --> [*]" for phase in always]
    return "\n".join(lines)


def test_state_machine_is_the_table() -> None:
    assert diagram() in README


def test_exit_codes_are_all_there() -> None:
    for line in EXIT_CODES.splitlines()[1:]:
        code, meaning = line.split(maxsplit=1)
        assert f"| {code} | {meaning} |" in README


def test_every_file_and_test_named_exists() -> None:
    for path in re.findall(r"`((?:mavquad|sitl_mock|tests|configs)/[\w./-]+\.\w+)`", README):
        assert (ROOT / path).exists(), path
    tests = "".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    for name in re.findall(r"`(test_\w+)`", README):
        assert f"def {name}(" in tests, name


def test_every_picture_exists() -> None:
    for path in re.findall(r"!\[[^]]*\]\(([^)]+)\)", README):
        assert (ROOT / path).exists(), path


def test_the_example_for_other_software_is_one_that_runs() -> None:
    [block] = re.findall(r"```python\n(import math.*?)```", README, flags=re.DOTALL)
    assert block.strip() in (ROOT / "tests" / "interop" / "test_example_pymavlink.py").read_text()
