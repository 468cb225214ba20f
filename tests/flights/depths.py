"""The law's depths as configurations of a flight: a firmware that takes it, and the depth where it is not the firmware's."""

from mavquad.types import Depth
from tests.support import LockstepFlight

AT_DEPTH: dict[Depth, dict[str, object]] = {
    "torque": {"mock.firmware": '"1.13"'},
    "rate": {"mock.firmware": '"1.16"'},
    "attitude": {"mock.firmware": '"1.16"', "law.depth": '"attitude"'},
}


def landed_safely(flight: LockstepFlight) -> bool:
    truth = flight.mock.truth()
    return truth.landed and not truth.armed and not truth.crashed


def completed(flight: LockstepFlight) -> bool:
    """The mission is complete, and the law was in control all along."""
    assert flight.agent.error is None
    assert flight.agent.done
    assert flight.agent.status().safe_setpoints == 0
    return landed_safely(flight)


def replays(flight: LockstepFlight) -> bool:
    """The record replays bit for bit."""
    result = flight.replayed()
    assert result.first_mismatch is None
    return result.matched == result.recorded > 1500


def rms_m(flight: LockstepFlight) -> float:
    """Position error of the estimate."""
    found = flight.metrics().position_rms_m
    assert found is not None
    return found


def yaw_rms_rad(flight: LockstepFlight) -> float:
    found = flight.metrics().yaw_rms_rad
    assert found is not None
    return found
