"""Which modes can be selected, on the ground and in the air; results and HEARTBEATs as seen on PX4 1.13.3."""

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.px4.modes import Mode, mode_of_base

ACCEPTED, TEMPORARILY_REJECTED = 0, 1


def heartbeat(p):
    p.forget()
    p.run(1.0)
    beat = p.messages("HEARTBEAT")[-1]
    return beat.base_mode, beat.custom_mode, beat.system_status


# main, sub, result, (base_mode, custom_mode) of the HEARTBEAT after it; None: it stays in AUTO.LOITER
SEEN_ON_THE_GROUND = [
    (1, 0, 0, (81, 0x10000)),
    (2, 0, 0, (81, 0x20000)),
    (3, 0, 0, (81, 0x30000)),
    (5, 0, 0, (65, 0x50000)),
    (7, 0, 0, (81, 0x70000)),
    (8, 0, 0, None),
    (10, 0, 0, None),
    (9, 0, 0, None),
    (4, 0, 1, None),
    (4, 1, 1, None),
    (4, 2, 0, (29, 0x2040000)),
    (4, 3, 0, (29, 0x3040000)),
    (4, 4, 1, None),
    (4, 5, 0, (29, 0x5040000)),
    (4, 6, 0, (29, 0x6040000)),
    (4, 7, 1, None),
    (4, 8, 0, (29, 0x8040000)),
    (4, 9, 0, (29, 0x9040000)),
    (4, 10, 0, (29, 0xA040000)),
    (3, 1, 0, (81, 0x30000)),
    (6, 0, 1, None),
]


@pytest.mark.parametrize(("main", "sub", "result", "shown"), SEEN_ON_THE_GROUND)
def test_modes_of_113_on_the_ground(pilot, main, sub, result, shown):
    p = pilot().run(1.1)
    assert p.command(176, 1, main, sub) == [result]
    assert heartbeat(p) == (*(shown or (29, 0x3040000)), 3)


def test_an_unknown_auto_mode_is_named(pilot):
    p = pilot().heartbeat().run(1.1)
    p.command(176, 1, 4, 1)
    assert "Unsupported auto mode" in p.texts()


@pytest.mark.parametrize("main", [1, 2, 3, 5, 7])
def test_a_pilots_mode_in_the_air_without_a_pilot(pilot, main):
    p = pilot().hover()
    assert p.command(176, 1, main) == [ACCEPTED]
    p.fly(2.0)
    assert p.mock.mode == "AUTO.LOITER"
    assert "Failsafe enabled: No manual control stick input" in p.texts()
    assert heartbeat(p)[2] == mavlink.MAV_STATE_CRITICAL
    p.command(176, 1, 4, 3)
    assert heartbeat(p)[2] == mavlink.MAV_STATE_ACTIVE
    p = pilot(firmware="1.15").hover().heartbeat()
    assert p.command(176, 1, main) == [TEMPORARILY_REJECTED]
    spoken = {1: "Manual", 2: "Altitude", 3: "Position", 5: "Acro", 7: "Stabilized"}[main]
    assert p.texts() == [f"Switching to {spoken} is currently not available"]
    assert p.mock.mode == "AUTO.LOITER"


@pytest.mark.parametrize("firmware", ["1.15", "1.16"])
def test_later_releases_wait_on_the_ground_and_do_not_arm(pilot, firmware):
    p = pilot(firmware=firmware).heartbeat().run(1.1)
    for main, sub, mode in ((4, 4, "AUTO.MISSION"), (3, 0, "POSCTL"), (4, 5, "AUTO.RTL"), (4, 8, "AUTO.FOLLOW_TARGET")):
        assert p.command(176, 1, main, sub)[-1] == ACCEPTED
        assert p.mock.mode == mode
        assert p.command(400, 1) == [TEMPORARILY_REJECTED]
    assert heartbeat(p)[2] == mavlink.MAV_STATE_UNINIT
    assert p.command(176, 1, 3, 2)[-1] == ACCEPTED
    assert heartbeat(p)[1] == 0x2030000  # Position Slow


def test_after_a_flight_the_last_mode_that_can_be_armed_in_comes_back(pilot):
    # px4-v1.16.2-c-stop: OFFBOARD in the air, its failsafe lands; after disarming OFFBOARD again, and status 0
    p = pilot(firmware="1.16").hover()
    p.rates()
    p.offboard()
    p.fly(18.0)
    assert not p.mock.armed
    assert heartbeat(p) == (1, 0x60000, mavlink.MAV_STATE_UNINIT)


@pytest.mark.parametrize(
    ("base", "mode"),
    [(4, Mode.MISSION), (64, Mode.MANUAL), (64 | 16, Mode.STABILIZED), (64 | 8, Mode.POSCTL), (16, None)],
)
def test_modes_by_flags_alone(base, mode):
    assert mode_of_base(base) is mode


def test_every_mode_has_its_number_and_its_name():
    numbers = [mode.custom_mode for mode in Mode]
    assert len(set(numbers)) == len(numbers)
    assert all(mode.spoken for mode in Mode)


def test_px4_1_13_is_not_armed_in_a_mode_of_the_pilot_without_one(pilot):
    """As the real 1.13.3, also with COM_RCL_EXCEPT 4."""
    p = pilot().run(1.2)
    p.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    p.command(176, 1, 3, 0)
    assert p.command(400, 1) == [1]
    assert not p.mock.truth().armed
