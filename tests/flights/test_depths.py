"""Whole flights at each depth of the law: the box, in calm and in a storm, from either form, with every replay equal.

Each bound is about 1.5 times the worst of seeds 1 to 3. Most of it is the wander of the mock's position, 5 cm per axis.
"""

import math
from functools import cache
from pathlib import Path

import pytest

from mavquad.analysis.trace import read_trace, write_trace
from mavquad.control.defaults import DEPTHS
from mavquad.protocol.codec import decode
from mavquad.types import Depth
from tests.flights.depths import AT_DEPTH, completed, landed_safely, replays, rms_m, yaw_rms_rad
from tests.support import LockstepFlight, fly

SETPOINT_IDS = (82, 139)
NO_WANDER = {"mock.sensors.position_wander_m": 0.0}


@cache
def box(depth: Depth) -> LockstepFlight:
    return fly(AT_DEPTH[depth])


@pytest.mark.parametrize(
    ("depth", "bound_m", "yaw_deg"), [("torque", 0.04, 0.17), ("rate", 0.036, 1.1), ("attitude", 0.033, 2.4)]
)
def test_box_completes_and_is_tracked(depth: Depth, bound_m: float, yaw_deg: float) -> None:
    flight = box(depth)
    assert completed(flight)
    assert replays(flight)
    assert flight.agent.status().depth == depth
    assert rms_m(flight) < bound_m
    assert math.degrees(yaw_rms_rad(flight)) < yaw_deg


@pytest.mark.parametrize("depth", DEPTHS)
def test_box_goes_where_it_says(depth: Depth) -> None:
    flying = [row for row in box(depth).rows if row.phase == "flying"]
    start, measured = flying[0].measured, [row.measured for row in flying]
    north = [m[2] - start[2] for m in measured]
    east = [-(m[3] - start[3]) for m in measured]
    assert max(north) == pytest.approx(2.0, abs=0.09)
    assert max(east) == pytest.approx(2.0, abs=0.09)
    assert min(north) > -0.1
    assert min(east) > -0.1
    # Clockwise by 90 degrees is minus pi / 2 with z up.
    assert measured[-1][1] - start[1] == pytest.approx(-math.pi / 2, abs=0.025)


@pytest.mark.parametrize(("depth", "number"), [("torque", 139), ("rate", 82), ("attitude", 82)])
def test_one_kind_of_setpoint_goes_out(depth: Depth, number: int) -> None:
    sent = [decode(record.frame) for record in box(depth).recording.records if record.outbound]
    # Those that find out on the ground whether it takes torques are all zero.
    setpoints = [m for m in sent if m.get_msgId() in SETPOINT_IDS and any(getattr(m, "controls", [1.0]))]
    assert {message.get_msgId() for message in setpoints} == {number}
    assert len(setpoints) == box(depth).agent.status().setpoints_sent
    masks = {message.type_mask for message in setpoints if message.get_msgId() == 82}
    assert masks == {"torque": set(), "rate": {0x80}, "attitude": {0x07}}[depth]


@pytest.mark.parametrize("depth", DEPTHS)
def test_the_trace_of_a_flight_reads_back_to_the_last_bit(depth: Depth, tmp_path: Path) -> None:
    rows = box(depth).rows[::10]
    with (tmp_path / "trace.csv").open("w", newline="", encoding="utf-8") as stream:
        write_trace(stream, rows)
    assert read_trace(tmp_path / "trace.csv") == rows
    assert {row.depth for row in rows} == {depth}


@pytest.mark.parametrize(("depth", "bound_m"), [("torque", 0.0135), ("rate", 0.0105), ("attitude", 0.0095)])
def test_box_is_followed_closely_where_the_position_does_not_wander(depth: Depth, bound_m: float) -> None:
    flight = fly({**AT_DEPTH[depth], **NO_WANDER})
    assert completed(flight)
    assert rms_m(flight) < bound_m


@pytest.mark.parametrize(("depth", "bound_m"), [("torque", 0.045), ("rate", 0.038), ("attitude", 0.035)])
def test_state_feedback_flies_the_box_too(depth: Depth, bound_m: float) -> None:
    flight = fly({**AT_DEPTH[depth], "law.form": '"state_feedback"'})
    assert completed(flight)
    assert replays(flight)
    assert rms_m(flight) < bound_m


@pytest.mark.parametrize(("depth", "yaw_deg"), [("torque", 0.18), ("rate", 1.15), ("attitude", 2.4)])
def test_box_heading_east(depth: Depth, yaw_deg: float) -> None:
    flight = fly({**AT_DEPTH[depth], "mock.vehicle.heading_deg": 90.0})
    assert completed(flight)
    assert rms_m(flight) < 0.04
    assert math.degrees(yaw_rms_rad(flight)) < yaw_deg
    assert flight.rows[0].measured[1] == pytest.approx(-math.pi / 2, abs=0.02)


@pytest.mark.parametrize(
    ("depth", "mass_kg", "bound_m"),
    [
        ("torque", 1.0, 0.042),
        ("torque", 1.3, 0.042),
        ("rate", 1.0, 0.039),
        ("rate", 1.3, 0.038),
        ("attitude", 1.0, 0.071),
        ("attitude", 1.3, 0.052),
        # It leans by 44 degrees; PX4's own takeoff leans by no more than 45 (MPC_TILTMAX_AIR).
        ("torque", 0.85, 0.042),
        ("rate", 0.85, 0.039),
        ("attitude", 0.85, 0.071),
    ],
)
def test_box_in_a_storm_of_8_m_s(depth: Depth, mass_kg: float, bound_m: float) -> None:
    flight = fly({**AT_DEPTH[depth], "mock.wind_ned_m_s": [8.0, 0.0, 0.0], "mock.vehicle.mass_kg": mass_kg})
    assert completed(flight)
    assert rms_m(flight) < bound_m


@pytest.mark.parametrize("depth", DEPTHS)
def test_box_on_streams_of_different_rates(depth: Depth) -> None:
    flight = fly({**AT_DEPTH[depth], "streams.attitude_hz": 250.0, "streams.position_hz": 50.0})
    assert completed(flight)
    assert replays(flight)
    assert rms_m(flight) < 0.04
    seconds = (flight.rows[-1].stamp_us - flight.rows[0].stamp_us) * 1e-6
    # At depth rate it is PX4 1.16, which delivers ATTITUDE at 208 Hz for 250 asked; 1.13 does at 248 Hz.
    rate_hz = {"attitude": 50.0, "rate": 208.0, "torque": 248.0}[depth]
    assert len(flight.rows) / seconds == pytest.approx(rate_hz, rel=0.01)


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_nan_at_each_depth_ends_on_the_ground(depth: Depth) -> None:
    flight = fly(AT_DEPTH[depth], [{"kind": "nan_pose", "for_s": 0.2, "since": "offboard", "from_s": 4.0}])
    assert flight.exit_code == 4
    assert "LOCAL_POSITION_NED holds a value that is not a number" in str(flight.agent.error)
    assert flight.agent.status().safe_setpoints >= 1
    assert landed_safely(flight)
    assert flight.replayed().equal


@pytest.mark.parametrize("depth", DEPTHS)
def test_losses_and_jitter_at_each_depth(depth: Depth) -> None:
    flight = fly({**AT_DEPTH[depth], "mock.link.loss": 0.05, "mock.link.jitter_ms": 10.0})
    assert completed(flight)
    assert replays(flight)
    assert rms_m(flight) < 0.048
