"""The stream of telemetry: rates, order, stamps, and the numbers PX4 was recorded to send."""

import math

import pytest

from mavquad.endpoint import GRID_US
from mavquad.protocol.codec import frame_source, message_id


def test_default_rates(pilot):
    p = pilot().run(2.0)
    p.forget()
    p.run(10.0)
    rates = {
        "HEARTBEAT": 1,
        "ATTITUDE": 100,
        "ATTITUDE_QUATERNION": 50,
        "LOCAL_POSITION_NED": 30,
        "GLOBAL_POSITION_INT": 50,
        "ATTITUDE_TARGET": 10,
        "SERVO_OUTPUT_RAW": 10,
        "SYS_STATUS": 5,
        "EXTENDED_SYS_STATE": 5,
        "HOME_POSITION": 0.5,
    }
    assert {name: len(p.messages(name)) / 10 for name in rates} == pytest.approx(rates, abs=0.11)


def test_delivered_rate_is_capped(pilot):
    p = pilot(streams={"max_position_hz": 89.0})
    p.command(511, 32, 4000)
    p.run(1.0).forget()
    p.run(10.0)
    assert len(p.messages("LOCAL_POSITION_NED")) == pytest.approx(890, abs=2)


def test_position_before_attitude_with_the_same_stamp(pilot):
    # px4-v1.16.2-a: LOCAL_POSITION_NED comes right before ATTITUDE 3115 times, never the other way round
    p = pilot(streams={"max_position_hz": 100, "max_attitude_hz": 250})
    p.run(0.0034)
    p.command(511, 32, 10000)  # asked at different times, still in step
    p.run(0.5).forget()
    p.run(1.0)
    pose = [message_id(frame) for _, frame in p.frames if message_id(frame) in (30, 32)]
    assert pose == [32, 30] * 100
    attitudes, positions = p.messages("ATTITUDE"), p.messages("LOCAL_POSITION_NED")
    assert [a.time_boot_ms for a in attitudes] == [q.time_boot_ms for q in positions]
    assert p.stamps_us("ATTITUDE") == p.stamps_us("LOCAL_POSITION_NED")


def test_stamp_is_the_sample_time(pilot):
    p = pilot().run(1.0)
    ages_ms = [
        stamp // 1000 - message.time_boot_ms
        for stamp, message in zip(p.stamps_us("ATTITUDE"), p.messages("ATTITUDE"), strict=True)
    ]
    assert set(ages_ms[1:]) == {5}


def test_everything_is_on_the_grid_and_from_us(pilot):
    p = pilot(system_id=7).run(1.0)
    assert all(stamp % GRID_US == 0 for stamp, _ in p.frames)
    assert {frame_source(frame) for _, frame in p.frames} == {(7, 1)}


def test_heartbeat_as_recorded(pilot):
    p = pilot().run(1.1)
    beat = p.messages("HEARTBEAT")[-1]
    assert (beat.type, beat.autopilot, beat.base_mode, beat.custom_mode) == (2, 12, 29, 0x03040000)
    assert beat.system_status == 3
    p.command(400, 1)
    p.run(1.0)
    beat = p.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.system_status) == (157, 4)


def test_thrust_at_rest_as_recorded(pilot):
    # px4-v1.13.3-a: float32(0.001) disarmed, and armed until the takeoff begins
    p = pilot().run(1.1)
    p.command(400, 1)
    p.run(1.0)
    thrust = [m.thrust for m in p.messages("ATTITUDE_TARGET")]
    assert thrust == pytest.approx([0.001] * len(thrust), abs=1e-8)
    assert len(thrust) > 15


@pytest.mark.parametrize(
    ("firmware", "ready", "waiting_health"),
    [
        ("1.13", (0x9020802C, 0x9020800C, 0x9020802F), 0x8020802F),
        ("1.16", (0x0300402F, 0x0301402F, 0x1320C83F), 0x0320C83F),
    ],
)
def test_sys_status_as_recorded(pilot, firmware, ready, waiting_health):
    def sensors(m):
        return (m.onboard_control_sensors_present, m.onboard_control_sensors_enabled, m.onboard_control_sensors_health)

    p = pilot(firmware=firmware, ready_s=1.0).run(2.0)
    seen = [sensors(m) for m in p.messages("SYS_STATUS")]
    assert seen == [(*ready[:2], waiting_health)] * 5 + [ready] * (len(seen) - 5)
    assert len(seen) > 8


def test_quaternion_and_euler_angles_are_one_attitude(pilot):
    p = pilot(vehicle={"heading_deg": 30.0}).hover()
    p.run(0.1).forget()
    p.run(1.0)
    euler = {m.time_boot_ms: m for m in p.messages("ATTITUDE")}
    both = [(m, euler[m.time_boot_ms]) for m in p.messages("ATTITUDE_QUATERNION") if m.time_boot_ms in euler]
    assert len(both) >= 45
    for quaternion, angles in both:
        w, x, y, z = quaternion.q1, quaternion.q2, quaternion.q3, quaternion.q4
        assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(angles.yaw, abs=1e-5)
        assert math.asin(2 * (w * y - z * x)) == pytest.approx(angles.pitch, abs=1e-5)
        assert math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(angles.roll, abs=1e-5)
        assert math.degrees(angles.yaw) == pytest.approx(30.0, abs=1.5)


def test_global_position_goes_with_the_local_one(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    p.position()
    p.offboard()
    p.stream(lambda q: q.position(10.0, 20.0, -5.0), 12.0, hz=10)
    p.run(0.1)
    seen = p.messages("GLOBAL_POSITION_INT")[-1]
    n, e, d = p.truth.position_ned_m
    metres_per_degree = math.pi * 6371000.0 / 180.0
    assert (seen.lat * 1e-7 - 45.4671182) * metres_per_degree == pytest.approx(n, abs=0.3)
    east_m = (seen.lon * 1e-7 + 73.7578241) * metres_per_degree * math.cos(math.radians(45.4671182))
    assert east_m == pytest.approx(e, abs=0.3)
    assert seen.relative_alt / 1000 == pytest.approx(-d, abs=0.1)
    assert seen.alt / 1000 == pytest.approx(32.5 - d, abs=0.1)
