"""mavquad in a program of one's own, live on a mock: the README's ten lines, refusals, and what becomes of a failure."""

from __future__ import annotations

import asyncio
import json
import re
from pathlib import Path

import pytest

import mavquad
from mavquad.errors import InputError

CALM = {"mock__firmware": "1.16", "guards__stale_attitude_s": 0.8, "guards__stale_position_s": 0.8}


def test_orders_are_flown_and_recorded(tmp_path: Path) -> None:
    async def fly() -> None:
        async with mavquad.connect("mock", run_dir=tmp_path / "run", **CALM) as vehicle:
            with pytest.raises(InputError, match="phase identifying"):
                await vehicle.goto(1.0, 0.0, 0.0)
            await vehicle.takeoff(3.0)
            with pytest.raises(InputError, match="radius_m"):
                await vehicle.goto(200.0, 0.0, 0.0)
            await vehicle.goto(1.0, -0.5, -0.5)
            assert vehicle.position_ned_m == pytest.approx((1.0, -0.5, -0.5), abs=0.4)
            await vehicle.land()
            assert not vehicle.status.armed

    asyncio.run(fly())
    events = [json.loads(line) for line in (tmp_path / "run" / "events.jsonl").read_text().splitlines()]
    assert [event["name"] for event in events if event["name"] != "late"] == [
        "start", "goto", "takeoff", "kept", "goto", "goto", "land", "end",
    ]  # fmt: skip
    parameters = json.loads((tmp_path / "run" / "parameters.json").read_text())
    assert parameters["restored"]
    assert "MIS_TAKEOFF_ALT" in [record["name"] for record in parameters["parameters"]]


def test_the_ten_lines_of_the_readme_fly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    [code] = [block for block in re.findall(r"```python\n(.*?)```", readme, re.DOTALL) if "mavquad.connect" in block]
    address = '"udpin:127.0.0.1:14540"'
    assert address in code
    monkeypatch.chdir(tmp_path)
    exec(compile(code.replace(address, '"mock", **CALM'), "README.md", "exec"), {"CALM": CALM, "__name__": "readme"})
    [events] = Path("runs").glob("*/events.jsonl")
    orders = [json.loads(line)["name"] for line in events.read_text(encoding="utf-8").splitlines()]
    assert [name for name in orders if name != "late"] == [
        "start", "takeoff", "kept", "fly", "goto", "land", "end",
    ]  # fmt: skip


def test_a_program_that_fails_in_flight_leaves_a_landed_vehicle(tmp_path: Path) -> None:
    async def fly() -> None:
        async with mavquad.connect("mock", run_dir=tmp_path / "run", **CALM) as vehicle:
            await vehicle.takeoff()
            raise KeyError("the program's own mistake")

    with pytest.raises(KeyError):
        asyncio.run(fly())
    notes = [json.loads(line)["text"] for line in (tmp_path / "run" / "notes.jsonl").read_text().splitlines()]
    assert "landing" in notes
    assert notes[-1] == "done"
