"""A vehicle whose inner loop is not the one that the law is told of, at its default gains."""

import pytest

from mavquad.control.controller import Controller
from mavquad.control.params import LawParams
from tests.bench.vehicles import overrides
from tests.support import fly

UPSET_M = 0.3


def test_an_arducopter_with_slow_rotors_is_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    """SIH's rotors of 50 ms: the autopilot answers in 150 ms, not in 70; with the gains for 70 it is lost in 2 s."""
    retunings: list[LawParams] = []
    retune = Controller.retune
    monkeypatch.setattr(Controller, "retune", lambda self, law: (retunings.append(law), retune(self, law))[1])
    case = overrides("SIH as it is", "ArduCopter", "hover")
    flight = fly(case | {"law.depth": '"rate"', "mission.duration_s": 8.0, "mock.sensors.position_wander_m": 0.0})
    assert flight.agent.error is None
    [law] = retunings
    assert law.omega0_rad_s is not None
    assert 3.5 / 2.5 <= law.omega0_rad_s < 3.5 / 1.25
    assert flight.replayed().equal
    [found] = [note.text for note in flight.notes if "after a command" in note.text]
    assert "70 expected: gains divided by" in found
    rows = [row for row in flight.rows if row.phase == "flying"]
    assert max(abs(m - r) for row in rows for m, r in zip(row.measured, row.reference, strict=True)) < UPSET_M
