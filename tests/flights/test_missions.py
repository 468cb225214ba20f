"""Whole flights in lockstep: what completes, how well, and that the same seed gives the same bytes."""

import pytest

from mavquad.flight.machine import Phase
from tests.support import fly, prepare, run


def test_box_completes_and_is_tracked() -> None:
    flight = fly()
    assert flight.agent.error is None
    assert flight.agent.done
    metrics = flight.metrics()
    assert metrics.position_rms_m is not None
    assert metrics.position_rms_m < 0.04
    assert metrics.yaw_rms_rad is not None
    assert metrics.yaw_rms_rad < 0.021
    truth = flight.mock.truth()
    assert truth.landed
    assert not truth.armed
    assert not truth.crashed
    assert flight.agent.status().safe_setpoints == 0


def test_box_goes_where_it_says() -> None:
    flight = fly()
    flying = [row for row in flight.rows if row.phase == "flying"]
    start, measured = flying[0].measured, [row.measured for row in flying]
    north = [m[2] - start[2] for m in measured]
    east = [-(m[3] - start[3]) for m in measured]
    assert max(north) == pytest.approx(2.0, abs=0.045)
    assert max(east) == pytest.approx(2.0, abs=0.03)
    assert min(north) > -0.05
    assert min(east) > -0.09
    # Clockwise by 90 degrees is minus pi / 2 with z up.
    assert measured[-1][1] - start[1] == pytest.approx(-1.5708, abs=0.025)


@pytest.mark.parametrize(
    ("overrides", "bound_m"),
    [
        ({"mock.wind_ned_m_s": [3.0, 0.0, 0.0]}, 0.2),
        ({"mock.wind_ned_m_s": [0.0, -3.0, 0.0]}, 0.235),
        ({"mock.vehicle.mass_kg": 1.15}, 0.042),
        ({"mock.vehicle.mass_kg": 0.85}, 0.06),
        ({"mock.vehicle.heading_deg": 135.0}, 0.042),
        ({"mock.vehicle.heading_deg": -179.0}, 0.041),
        ({"mock.link.loss": 0.05, "mock.link.jitter_ms": 10.0}, 0.36),
        ({"mock.vehicle.model": '"paper"'}, 0.053),
        ({"law.polynomial": '"butterworth"'}, 0.07),
    ],
    ids=str,
)
def test_box_completes_all_the_same(overrides: dict[str, object], bound_m: float) -> None:
    """Each bound is about 1.5 times what was measured with seed 1."""
    flight = fly(overrides)
    assert flight.agent.error is None
    assert flight.agent.done
    rms_m = flight.metrics().position_rms_m
    assert rms_m is not None
    assert rms_m < bound_m


def test_state_feedback_flies_the_box_too() -> None:
    flight = fly({"law.form": '"state_feedback"'})
    assert flight.agent.error is None
    rms_m = flight.metrics().position_rms_m
    assert rms_m is not None
    assert rms_m < 0.046


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
