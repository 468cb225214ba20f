"""A PX4 1.13 built with lockstep ignores torques: that is seen on the ground, on a link that loses frames too."""

from __future__ import annotations

import pytest

from mavquad.protocol.codec import decode
from tests.flights.depths import completed, landed_safely
from tests.support import LockstepFlight, fly, prepare, run

LOCKSTEP = {"mock.lockstep_build": "true"}
LOSSY = {"mock.link.loss": 0.2, "mock.link.jitter_ms": 20.0, "guards.link_loss.share": 0.0}


def phases(flight: LockstepFlight) -> list[str]:
    return [note.text for note in flight.notes if note.kind == "phase"]


def stayed_down(flight: LockstepFlight) -> bool:
    """Nobody asked it to arm, its motors stood still, and each setpoint was zero."""
    sent = [decode(record.frame) for record in flight.recording.records if record.outbound]
    controls = [message.controls for message in sent if message.get_type() == "SET_ACTUATOR_CONTROL_TARGET"]
    commands = {message.command for message in sent if message.get_type() == "COMMAND_LONG"}
    return not any(map(any, controls)) and 400 not in commands and landed_safely(flight)


def replays(flight: LockstepFlight) -> bool:
    result = flight.replayed()
    return result.first_mismatch is None and result.matched == result.recorded


def refused(flight: LockstepFlight) -> bool:
    assert flight.exit_code == 3
    assert "this build of PX4 1.13.3 ignores torque setpoints" in str(flight.agent.error)
    assert "--depth rate" in flight.agent.error.hint
    assert flight.agent.changed_parameters.restored
    assert flight.mock.truth().mode == "AUTO.LOITER"
    return stayed_down(flight) and "withdrawing" not in phases(flight)


def test_a_build_with_lockstep_is_refused_on_the_ground() -> None:
    flight = fly(LOCKSTEP)
    assert refused(flight)
    assert replays(flight)


def test_a_build_with_lockstep_flies_at_depth_rate() -> None:
    flight = fly({**LOCKSTEP, "law.depth": '"rate"', "mission.name": '"hover"', "mission.duration_s": 2.0})
    assert completed(flight)
    assert "probing" not in phases(flight)


def test_a_build_without_flies() -> None:
    flight = fly({"mission.name": '"hover"', "mission.duration_s": 2.0})
    assert completed(flight)
    assert phases(flight)[3:8] == ["waiting", "probing", "withdrawing", "waiting", "arming"]
    assert replays(flight)


@pytest.mark.parametrize("seed", range(1, 9))
def test_neither_build_is_mistaken_on_a_link_that_loses_a_fifth_of_all_frames(seed: int) -> None:
    assert refused(fly({**LOCKSTEP, **LOSSY, "seed": seed}))
    flight = prepare({**LOSSY, "seed": seed})
    run(flight, until="arming")
    assert flight.agent.error is None
    assert stayed_down_until_armed(flight)
    assert replays(flight)


def stayed_down_until_armed(flight: LockstepFlight) -> bool:
    truth = flight.mock.truth()
    assert truth.mode == "AUTO.LOITER"
    return not truth.armed and truth.landed and flight.agent.status().setpoints_sent == 0


@pytest.mark.parametrize("lockstep_build", ["true", "false"])
def test_a_pilot_who_changes_the_mode_meanwhile_wins(lockstep_build: str) -> None:
    # It is ready at 1 s and probed from then on; HEARTBEAT comes with each full second.
    pilot = {"kind": "mode_change", "mode": "POSCTL", "at_s": 1.7}
    flight = fly({"mock.lockstep_build": lockstep_build}, [pilot], limit_s=20.0)
    assert flight.exit_code == 4
    assert "took over: mode POSCTL while" in str(flight.agent.error)
    assert flight.mock.truth().mode == "POSCTL"
    assert stayed_down(flight)
    assert not flight.agent.changed_parameters.restored
    assert replays(flight)
