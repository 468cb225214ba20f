"""The mission protocol from a client's side, and missions flown; as PX4 1.13.3 was seen to do it."""

import math

import pytest

from mavquad.protocol.codec import Encoder, mavlink
from sitl_mock.personality.px4.sites import ORIGINS

NAN = math.nan
ACCEPTED, DENIED, TEMPORARILY_REJECTED = 0, 2, 1
RELATIVE = 6
WAYPOINT, LOITER_TIME, RETURN, LAND, TAKEOFF, DELAY, JUMP, SPEED = 16, 19, 20, 21, 22, 93, 177, 178


def place(firmware, n, e):
    latitude, longitude, _ = ORIGINS[firmware].geographic((n, e, 0.0))
    return round(latitude * 1e7), round(longitude * 1e7)


def item(p, command, n=0.0, e=0.0, height_m=0.0, params=(0.0, 0.0, 0.0, NAN)):
    """(frame, command, params, x, y, z) of an item that has a place."""
    x, y = place(p.config.px4_release, n, e)
    return (RELATIVE, command, params, x, y, height_m)


def doing(command, *params):
    return (2, command, (*params, *[0.0] * (4 - len(params))), 0, 0, 0.0)


def item_message(index, frame, command, params, x, y, z, mission_type=0):
    return mavlink.MAVLink_mission_item_int_message(1, 1, index, frame, command, 0, 1, *params, x, y, z, mission_type)


def ask(p, message, encoder=None):
    """Send a message; the mission messages that come back at once."""
    return [
        a for a in p.send(message, encoder) if a.get_type().startswith("MISSION_") and a.get_type() != "MISSION_CURRENT"
    ]


def upload(p, items, mission_type=0):
    """Send a plan as the vehicle asks for it; the result of its ACK."""
    answers = ask(p, mavlink.MAVLink_mission_count_message(1, 1, len(items), mission_type))
    for _ in range(len(items) + 1):
        (answer,) = answers
        if answer.get_type() == "MISSION_ACK":
            assert answer.mission_type == mission_type
            return answer.type
        answers = ask(p, item_message(answer.seq, *items[answer.seq], mission_type))
    raise AssertionError("no ACK")


def download(p, mission_type=0):
    [count] = ask(p, mavlink.MAVLink_mission_request_list_message(1, 1, mission_type))
    items = []
    for index in range(count.count):
        [got] = ask(p, mavlink.MAVLink_mission_request_int_message(1, 1, index, mission_type))
        params = (got.param1, got.param2, got.param3, got.param4)
        items.append((got.frame, got.command, params, got.x, got.y, got.z))
        assert got.seq == index
    ask(p, mavlink.MAVLink_mission_ack_message(1, 1, 0, mission_type))
    return items


def names(answers):
    return [a.get_type() for a in answers]


# --- the protocol -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mission_type", "command"), [(0, WAYPOINT), (1, 5003), (2, 5100)], ids=["mission", "fence", "rally"]
)
def test_a_plan_is_kept_and_given_back(pilot, mission_type, command):
    p = pilot()
    items = [item(p, command, n, -n, 5.0 + n, (1.0, 2.0, 3.0, 4.0)) for n in range(4)]
    assert upload(p, items, mission_type) == 0
    assert download(p, mission_type) == items
    [ack] = ask(p, mavlink.MAVLink_mission_clear_all_message(1, 1, mission_type))
    assert (ack.type, ack.mission_type) == (0, mission_type)
    assert download(p, mission_type) == []


def test_clear_all_types_at_once(pilot):
    p = pilot()
    upload(p, [item(p, WAYPOINT)])
    upload(p, [item(p, 5100)], 2)
    ask(p, mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert (download(p), download(p, 2)) == ([], [])


def test_the_first_request_is_of_the_old_kind_until_the_client_speaks_the_new_one(pilot):
    p = pilot()
    answers = ask(p, mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    assert names(answers) == ["MISSION_REQUEST"]
    assert names(ask(p, item_message(0, *item(p, WAYPOINT)))) == ["MISSION_REQUEST_INT"]


def test_items_of_the_old_kind(pilot):
    p = pilot()
    ask(p, mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    old = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, WAYPOINT, 0, 1, 0, 0, 0, NAN, 45.5, -73.75, 7.0, 0)
    [ack] = ask(p, old)
    assert ack.type == 0
    ask(p, mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    [got] = ask(p, mavlink.MAVLink_mission_request_message(1, 1, 0, 0))
    assert got.get_type() == "MISSION_ITEM"
    assert (got.x, got.y, got.z) == pytest.approx((45.5, -73.75, 7.0), abs=1e-5)


def test_lost_items_are_asked_for_again_and_then_given_up(pilot):
    p = pilot().heartbeat()
    ask(p, mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    ask(p, item_message(0, *item(p, WAYPOINT)))
    p.forget()
    p.fly(3.0)
    asked = p.messages("MISSION_REQUEST_INT")
    assert {m.seq for m in asked} == {1}
    assert len(asked) == pytest.approx(3.0 / 0.252, abs=2)
    p.fly(3.0)
    assert "Operation timeout" in p.texts()
    p.forget()
    p.fly(1.0)
    assert p.messages("MISSION_REQUEST_INT") == []
    assert download(p) == []  # the old plan, which was none
    assert upload(p, [item(p, WAYPOINT)]) == 0


def test_an_item_sent_again_is_not_taken_twice(pilot):
    p = pilot()
    ask(p, mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    ask(p, item_message(0, *item(p, WAYPOINT)))
    assert names(ask(p, item_message(0, *item(p, WAYPOINT)))) == []
    [ack] = ask(p, item_message(1, *item(p, WAYPOINT)))
    assert ack.type == 0
    [again] = ask(p, item_message(1, *item(p, WAYPOINT)))  # our ACK was lost
    assert again.type == 0
    assert len(download(p)) == 2


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        ((6, 9999, (0.0,) * 4, 0, 0, 5.0), 3),
        ((1, WAYPOINT, (0.0,) * 4, 0, 0, 5.0), 2),
        ((2, WAYPOINT, (0.0,) * 4, 0, 0, 5.0), 3),
        ((6, WAYPOINT, (0.0,) * 4, 0, 0, NAN), 3),
        ((6, 5100, (0.0,) * 4, 0, 0, 5.0), 3),
    ],
    ids=["unknown command", "local frame", "no place", "no height", "rally point"],
)
def test_an_item_that_cannot_be_taken_ends_the_upload(pilot, bad, result):
    p = pilot().heartbeat()
    before = [item(p, WAYPOINT, 1.0, params=(0.0,) * 4)]
    upload(p, before)
    assert upload(p, [item(p, WAYPOINT), bad]) == result
    assert "IGN MISSION_ITEM: Invalid item" in p.texts()
    assert download(p) == before


def test_too_many_items_and_unknown_types(pilot):
    p = pilot()
    assert [a.type for a in ask(p, mavlink.MAVLink_mission_count_message(1, 1, 501, 0))] == [4]
    assert [a.type for a in ask(p, mavlink.MAVLink_mission_count_message(1, 1, 1, 7))] == [3]
    assert [a.type for a in ask(p, mavlink.MAVLink_mission_count_message(1, 1, 0, 0))] == [0]
    assert ask(p, mavlink.MAVLink_mission_count_message(2, 1, 1, 0)) == []
    assert ask(p, mavlink.MAVLink_mission_request_int_message(1, 1, 0, 0)) == []


def test_a_wrong_request_ends_the_download(pilot):
    p = pilot()
    upload(p, [item(p, WAYPOINT)] * 3)
    ask(p, mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    [ack] = ask(p, mavlink.MAVLink_mission_request_int_message(1, 1, 2, 0))
    assert ack.type == 1
    ask(p, mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    ask(p, mavlink.MAVLink_mission_request_int_message(1, 1, 0, 0))
    [same] = ask(p, mavlink.MAVLink_mission_request_int_message(1, 1, 0, 0))  # the first was lost
    assert same.seq == 0
    assert ask(p, mavlink.MAVLink_mission_request_int_message(1, 1, 1, 0), Encoder(9, 9)) == []


# --- missions that are not flown -----------------------------------------------------------------------------------------


def test_without_a_mission(pilot):
    p = pilot().run(1.1).heartbeat()
    assert p.command(300, 0, 0) == [DENIED]
    assert p.command(176, 1, 4, 4) == [TEMPORARILY_REJECTED]
    assert p.texts() == ["Mission start denied! No valid mission"]


@pytest.mark.parametrize(
    ("commands", "reason"),
    [((LAND,), "starts with landing"), ((WAYPOINT, TAKEOFF), "takeoff not first waypoint item")],
)
def test_a_mission_that_cannot_be_flown_is_taken_and_rejected(pilot, commands, reason):
    p = pilot().run(1.1).heartbeat()
    assert upload(p, [item(p, command, height_m=5.0) for command in commands]) == 0
    p.run(0.1)
    assert p.texts() == [f"Mission rejected: {reason}"]
    assert p.command(300, 0, 0) == [DENIED]


def test_set_current(pilot):
    p = pilot().run(1.1).heartbeat()
    upload(p, [item(p, TAKEOFF, height_m=5.0), item(p, WAYPOINT, 5.0, height_m=5.0)])
    ask(p, mavlink.MAVLink_mission_set_current_message(1, 1, 1))
    p.run(0.1)
    assert p.messages("MISSION_CURRENT")[-1].seq == 1
    ask(p, mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    p.run(0.1)
    assert "WPM: WP CURR CMD: Not in list" in p.texts()
    assert p.command(300, 7, 0) == [DENIED]


# --- missions flown -----------------------------------------------------------------------------------------------------


def reached(p):
    seen = []
    for message in p.messages("MISSION_ITEM_REACHED"):
        if not seen or seen[-1] != message.seq:
            seen.append(message.seq)
    return seen


def fly_until(p, is_done, limit_s):
    path = []
    for _ in range(limit_s * 5):
        if is_done():
            return path
        p.heartbeat().run(0.2)
        path.append(p.truth.position_ned_m)
    raise AssertionError(f"not done after {limit_s} s in {p.mock.mode}: {p.texts()[-4:]}")


@pytest.mark.parametrize("firmware", ["1.13", "1.14", "1.15", "1.16", "1.17"])
def test_a_whole_mission(pilot, quiet, firmware):
    p = pilot(sensors=quiet, firmware=firmware).run(1.1).heartbeat()
    plan = [
        item(p, TAKEOFF, height_m=5.0),
        doing(SPEED, 1.0, 2.0, -1.0),
        item(p, WAYPOINT, 10.0, 0.0, 5.0, (2.0, 1.0, 0.0, NAN)),
        doing(DELAY, 3.0, -1.0, -1.0, -1.0),
        item(p, LOITER_TIME, 10.0, 10.0, 7.0, (2.0, 0.0, 0.0, NAN)),
        doing(2500),  # a camera: passed over
        item(p, LAND, 0.0, 10.0, 0.0),
    ]
    assert upload(p, plan) == 0
    assert p.command(300, 0, 0) == [ACCEPTED]
    assert (p.mock.armed, p.mock.mode) == (True, "AUTO.MISSION")
    path = fly_until(p, lambda: not p.mock.armed, 80)
    assert reached(p) == [0, 1, 2, 3, 4, 5, 6]
    for n, e, d in ((0.0, 0.0, -5.0), (10.0, 0.0, -5.0), (10.0, 10.0, -7.0), (0.0, 10.0, -7.0)):
        assert min(math.dist(at, (n, e, d)) for at in path) < 1.3
    at_the_waypoint = [at for at in path if math.dist(at, (10.0, 0.0, -5.0)) < 1.2]
    assert len(at_the_waypoint) / 5 == pytest.approx(2.0 + 3.0, abs=2.5)
    assert p.truth.position_ned_m == pytest.approx((0.0, 10.0, 0.0), abs=0.4)
    texts = p.texts()
    assert "Armed by mission start" in texts
    assert "Executing Mission" in texts
    assert "Takeoff to 5.0 meters above home" in texts
    assert texts[-1] == "Disarmed by landing"


def test_a_mission_ends_in_a_hover_and_its_speed_is_obeyed(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    upload(p, [doing(SPEED, 1.0, 1.0, -1.0), item(p, WAYPOINT, 8.0, 0.0, 4.0)])
    assert p.command(176, 1, 4, 4) == [ACCEPTED]
    p.fly(4.0)
    assert p.truth.velocity_ned_m_s[0] == pytest.approx(1.0, abs=0.15)
    fly_until(p, lambda: "Mission finished, loitering" in p.texts(), 20)
    p.fly(5.0)
    assert p.mock.mode == "AUTO.MISSION"
    # PX4's integrators hold 1 N of drag when it stops: it comes back in some seconds
    assert p.truth.position_ned_m == pytest.approx((8.0, 0.0, -4.0), abs=0.4)
    assert p.messages("MISSION_CURRENT")[-1].seq == 1


def test_a_yaw_is_waited_for(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    upload(p, [item(p, WAYPOINT, 0.0, 0.0, 2.5, (0.0, 0.0, 0.0, 180.0)), item(p, WAYPOINT, 3.0, 0.0, 2.5)])
    p.command(176, 1, 4, 4)
    fly_until(p, lambda: reached(p), 20)
    assert abs(p.truth.euler_rad[2]) > math.radians(180.0 - 14.0)


def test_jumps(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    plan = [item(p, WAYPOINT, 4.0, 0.0, 3.0), item(p, WAYPOINT, 0.0, 0.0, 3.0), doing(JUMP, 0.0, 2.0)]
    upload(p, plan)
    p.command(176, 1, 4, 4)
    fly_until(p, lambda: "Mission finished, loitering" in p.texts(), 60)
    assert reached(p) == [0, 1, 0, 1, 0, 1, 2]
    assert "DO JUMP repetitions completed." in p.texts()


def test_jumps_that_go_nowhere_do_not_hang_it(pilot):
    p = pilot().hover()
    upload(p, [doing(SPEED, 1.0, 3.0, -1.0), doing(JUMP, 0.0, -1.0)])
    p.command(176, 1, 4, 4)
    p.fly(1.0)
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.4)


def test_pause_and_continue_with_the_item_that_was_next(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    upload(p, [item(p, WAYPOINT, 6.0, 0.0, 3.0), item(p, WAYPOINT, 6.0, 20.0, 3.0)])
    p.command(176, 1, 4, 4)
    fly_until(p, lambda: p.truth.position_ned_m[1] > 5.0, 30)
    p.command(176, 1, 4, 3)
    p.fly(4.0)
    assert p.mock.mode == "AUTO.LOITER"
    assert math.hypot(*p.truth.velocity_ned_m_s) < 0.2
    assert p.truth.position_ned_m[1] < 15.0
    p.command(176, 1, 4, 4)
    fly_until(p, lambda: reached(p) == [0, 1], 20)
    assert p.truth.position_ned_m[:2] == pytest.approx((6.0, 20.0), abs=2.2)


def test_a_mission_that_says_return_is_left_for_it(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    upload(p, [item(p, WAYPOINT, 4.0, 0.0, 3.0), doing(RETURN)])
    p.command(176, 1, 4, 4)
    fly_until(p, lambda: p.mock.mode == "AUTO.RTL", 20)
    assert p.mock.armed


def test_a_new_mission_in_flight_begins_at_its_first_item(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    upload(p, [item(p, WAYPOINT, 30.0, 0.0, 3.0)])
    p.command(176, 1, 4, 4)
    p.fly(3.0)
    upload(p, [item(p, WAYPOINT, 0.0, 5.0, 3.0)])
    fly_until(p, lambda: reached(p) == [0], 20)
    assert p.truth.position_ned_m[:2] == pytest.approx((0.0, 5.0), abs=2.2)
    ask(p, mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    p.fly(2.0)
    assert p.truth.position_ned_m[2] == pytest.approx(-3.0, abs=0.5)
