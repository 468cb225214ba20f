"""Whole flights in lockstep at depth torque: what completes, how well; the same seed gives the same bytes."""

import pytest

from mavquad.flight.machine import Phase
from tests.flights.depths import completed, replays, rms_m
from tests.support import fly, prepare, run


@pytest.mark.parametrize(
    ("overrides", "bound_m"),
    [
        ({"mock.wind_ned_m_s": [3.0, 0.0, 0.0]}, 0.041),
        ({"mock.wind_ned_m_s": [0.0, -3.0, 0.0]}, 0.041),
        ({"mock.vehicle.mass_kg": 1.15}, 0.041),
        ({"mock.vehicle.mass_kg": 0.85}, 0.041),
        ({"mock.vehicle.heading_deg": 135.0}, 0.04),
        ({"mock.vehicle.heading_deg": -179.0}, 0.04),
        ({"mock.vehicle.model": '"paper"'}, 0.04),
        ({"law.polynomial": '"butterworth"'}, 0.047),
        ({"law.measurements": '"position_yaw"'}, 0.045),
        ({"law.measurements": '"position_attitude"'}, 0.045),
    ],
    ids=str,
)
def test_box_completes_all_the_same(overrides: dict[str, object], bound_m: float) -> None:
    """Each bound is about 1.5 times the worst of seeds 1 to 3."""
    flight = fly(overrides)
    assert completed(flight)
    assert rms_m(flight) < bound_m
    if any(key.startswith("law.") for key in overrides):
        assert replays(flight)


def test_duration_cuts_a_mission() -> None:
    flight = fly({"mission.name": '"hover"', "mission.duration_s": 6.0})
    assert flight.agent.error is None
    flying = [row for row in flight.rows if row.phase == "flying"]
    assert (flying[-1].vehicle_stamp_us - flying[0].vehicle_stamp_us) * 1e-6 == pytest.approx(6.0, abs=0.05)


def test_same_seed_same_bytes_and_another_seed_others() -> None:
    short = {"mission.name": '"hover"', "mission.duration_s": 3.0, "mock.link.loss": 0.03, "mock.link.jitter_ms": 15.0}
    one, other, third = fly(short), fly(short), fly({**short, "seed": 2})
    assert one.recording.records == other.recording.records
    assert one.recording.records != third.recording.records


@pytest.mark.parametrize("phase", [Phase.WAITING, Phase.TAKING_OFF, Phase.ENGAGING, Phase.FLYING])
def test_stop_lands_from_every_phase_and_replays(phase: Phase) -> None:
    flight = prepare()
    run(flight, until=phase.value)
    flight.lockstep.command("stop", flight.agent.stop)
    run(flight)
    assert flight.agent.done
    assert flight.agent.interrupted
    assert flight.agent.error is None
    assert not flight.mock.truth().armed
    assert not flight.mock.truth().crashed
    assert flight.replayed().equal
