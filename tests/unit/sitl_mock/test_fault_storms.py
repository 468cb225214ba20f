"""Any faults together, in a flight: nothing breaks, and the same storm gives the same bytes."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_mock import VirtualVehicle

SECONDS = st.floats(0.0, 6.0)
WINDOW = {
    "since": st.sampled_from(["boot", "armed", "takeoff", "AUTO.TAKEOFF"]),
    "from_s": SECONDS,
    "for_s": st.floats(0.1, 4.0),
}
MOMENT = {"since": WINDOW["since"], "at_s": SECONDS}
LINK = {
    **WINDOW,
    "direction": st.sampled_from(["to_vehicle", "from_vehicle", "both"]),
    "message": st.sampled_from(["", "ATTITUDE", "COMMAND_LONG"]),
    "probability": st.floats(0.0, 1.0),
}
METRES = st.floats(-20.0, 20.0)
TRIPLE = st.tuples(METRES, METRES, METRES)
KEYS = {
    "drop": LINK,
    "delay": {**LINK, "delay_ms": st.floats(0.0, 3000.0)},
    "jitter": {**LINK, "jitter_ms": st.floats(0.0, 3000.0)},
    "duplicate": {**LINK, "copies": st.integers(1, 5), "later_ms": st.floats(0.0, 500.0)},
    "reorder": {**LINK, "behind": st.integers(1, 50)},
    "corrupt": {**LINK, "bits": st.integers(1, 2000)},
    "refuse": {
        **WINDOW,
        "command": st.sampled_from([22, 400, 511]),
        "times": st.integers(1, 3),
        "text": st.text("ab "),
    },
    "ack_without_acting": {**WINDOW, "command": st.sampled_from([22, 400, 511])},
    "late_answer": {**WINDOW, "command": st.sampled_from([22, 400, 511]), "late_s": st.floats(0.01, 5.0)},
    "silent": WINDOW,
    "deaf": WINDOW,
    "stream_stops": {**WINDOW, "message": st.sampled_from(["HEARTBEAT", "ATTITUDE", "COMMAND_ACK"])},
    "nan_pose": WINDOW,
    "clock_jump": {**MOMENT, "jump_s": st.floats(-1e6, 1e6)},
    "second_vehicle": {**WINDOW, "looks": st.sampled_from(["twin", "forged"]), "mavlink": st.sampled_from([1, 2])},
    "mode_change": {**MOMENT, "mode": st.sampled_from(["POSCTL", "AUTO.LAND", "OFFBOARD"])},
    "geofence_breach": MOMENT,
    "estimator_reset": {**MOMENT, "offset_ned_m": TRIPLE},
    "low_battery": {**MOMENT, "remaining": st.floats(0.0, 1.0)},
    "payload_drop": MOMENT,
    "weak_rotor": {**MOMENT, "rotor": st.integers(1, 4), "share": st.floats(0.0, 1.0)},
    "wind_step": {**MOMENT, "change_ned_m_s": TRIPLE},
    "reboot": {**MOMENT, "down_s": st.floats(0.001, 3.0)},
    "die": MOMENT,
}
STORMS = st.lists(
    st.one_of([st.fixed_dictionaries({"kind": st.just(kind), **keys}) for kind, keys in KEYS.items()]), max_size=5
)


def flown(faults, seed, autopilot="px4"):
    """What came in 6 s in which a client tries to take off, and the end of it."""
    vehicle = VirtualVehicle(autopilot, faults=faults, seed=seed, vehicle={"payload_kg": 0.1}, link={"latency_ms": 5.0})
    outlet, connection = vehicle.outlet(), vehicle.connect()
    vehicle.run(1.5)
    connection.mav.heartbeat_send(6, 8, 0, 0, 0)
    for command, last in ((511, 0.0), (400, 0.0), (22, math.nan)):
        connection.mav.command_long_send(1, 1, command, 0, 1, 1e5, 0, 0, last, last, last)
        vehicle.run(0.5)
    vehicle.run(3.0)
    return list(outlet.inbox), vehicle.truth


@settings(max_examples=12)
@given(STORMS, st.integers(0, 5))
def test_a_storm_breaks_nothing_and_comes_again(faults, seed):
    frames, truth = flown(faults, seed)
    assert all(map(math.isfinite, (*truth.position_ned_m, *truth.velocity_ned_m_s, *truth.quaternion)))
    assert (frames, truth) == flown(faults, seed)


def test_every_kind_is_in_the_storm():
    from sitl_mock.config.faults import _FaultFile

    kinds = _FaultFile.model_json_schema()["properties"]["fault"]["items"]["discriminator"]["mapping"]
    assert set(kinds) == set(KEYS)


@pytest.mark.parametrize("kind", ["silent", "reboot", "die", "weak_rotor", "low_battery", "estimator_reset"])
def test_arducopter_bears_them_too(kind):
    extra = {"weak_rotor": {"rotor": 2}, "estimator_reset": {"offset_ned_m": (1.0, 2.0, -3.0)}}.get(kind, {})
    fault = {"kind": kind, "since": "boot", "from_s" if kind == "silent" else "at_s": 2.0, **extra}
    assert flown([fault], 1, "ardupilot") == flown([fault], 1, "ardupilot")
