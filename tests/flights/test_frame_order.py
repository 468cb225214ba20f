"""Flights on a link that repeats what it carried a second ago, and mixes it up."""

from __future__ import annotations

from random import Random

import pytest

from mavquad.protocol.codec import decode, mavlink, message_id
from tests.bench.safety_flight import sent_after_take_over
from tests.bench.scenarios import ARDUCOPTER, HOVER, PX4_1_16
from tests.flights.depths import landed_safely
from tests.support import LockstepFlight, fly


def mixed_up(seed: int) -> list[dict[str, object]]:
    random = Random(seed)
    way = {"direction": "from_vehicle"}
    return [
        {"kind": "duplicate", "probability": 0.3, "copies": random.randint(1, 3), "later_ms": random.randint(0, 1500)}
        | way,
        {"kind": "reorder", "probability": 0.2, "behind": random.randint(1, 60)} | way,
    ]


@pytest.mark.parametrize(
    ("craft", "depth", "seed"),
    [
        (PX4_1_16, "rate", 2),
        (PX4_1_16, "attitude", 7),
        (ARDUCOPTER, "rate", 11),
        (ARDUCOPTER, "attitude", 5),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_old_heartbeats_are_no_take_over(craft, depth, seed) -> None:
    flight = fly({**HOVER, **craft.keys, "law.depth": f'"{depth}"', "seed": seed}, mixed_up(seed))
    assert flight.agent.error is None
    assert landed_safely(flight)
    assert flight.agent.link.out_of_order["doubled"] > 500


def first_shown_us(flight: LockstepFlight, mode: int) -> int:
    """When the first HEARTBEAT of this mode arrived."""
    return next(
        record.stamp_us
        for record in flight.recording.records
        if not record.outbound
        and message_id(record.frame) == mavlink.MAVLINK_MSG_ID_HEARTBEAT
        and decode(record.frame).custom_mode == mode
    )


@pytest.mark.parametrize(
    ("craft", "mode", "number"),
    [(PX4_1_16, "POSCTL", 3 << 16), (ARDUCOPTER, "ALT_HOLD", 2)],
    ids=lambda value: getattr(value, "name", value),
)
@pytest.mark.parametrize("seed", [3, 4])
def test_a_take_over_is_seen_at_its_first_heartbeat_all_the_same(craft, mode, number, seed) -> None:
    pilot = {"kind": "mode_change", "mode": mode, "since": "takeoff", "at_s": 7.0 + 0.17 * seed}
    flight = fly({**HOVER, **craft.keys, "mission.duration_s": 8.0, "seed": seed}, [pilot, *mixed_up(seed)])
    assert f"mode {mode}" in str(flight.agent.error)
    assert flight.notes[-1].stamp_us == first_shown_us(flight, number)
    assert sent_after_take_over(flight) is None
