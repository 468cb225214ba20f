"""Each fault of the link: what it does to frames, to which, when; and that faults leave each other's draws alone."""

import itertools

import pytest

from mavquad.endpoint import advance, deliver
from mavquad.protocol.codec import Encoder, Framer, decode, is_known, mavlink, message_id
from sitl_mock.config.link import LinkConfig
from sitl_mock.faults import ImpairedLink
from tests.unit.sitl_mock.echo import STEP_US, Echo, exchange, fault, number

INBOUND = {"direction": "to_vehicle"}
ATTITUDE = mavlink.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def arrivals(*faults, frames=200, seed=1, **link):
    """What arrives at the vehicle, as (delay in us, number)."""
    echo, _ = exchange(frames, seed, faults, **link)
    return [(stamp - number(data) * STEP_US, number(data)) for stamp, data in echo.inputs]


def numbers(*faults, **link):
    return [k for _, k in arrivals(*faults, **link)]


def through(messages, *faults, seed=1):
    """Send real frames through a faulty link without latency; what arrives at the vehicle and what comes back."""
    echo, encoder = Echo(*faults), Encoder(255, 190)
    link, back = ImpairedLink(echo, LinkConfig(latency_ms=0.0), seed), []
    for k, message in enumerate(messages, 1):
        back += deliver(link, encoder.encode(message), k * STEP_US)
    back += advance(link, len(messages) * STEP_US + 2_000_000)
    return [data for _, data in echo.inputs], [data for _, data in back]


def test_drop_takes_its_share_of_one_direction():
    echo, back = exchange(4000, faults=[fault("drop", probability=0.25, **INBOUND)], latency_ms=1.0)
    assert len(echo.inputs) / 4000 == pytest.approx(0.75, abs=0.02)
    assert len(back) == len(echo.inputs)
    echo, back = exchange(100, faults=[fault("drop", direction="from_vehicle")], latency_ms=1.0)
    assert (len(echo.inputs), back) == (100, [])


def test_both_directions_by_default_each_with_its_own_draws():
    echo, back = exchange(4000, faults=[fault("drop", probability=0.5)], latency_ms=1.0)
    assert len(echo.inputs) / 4000 == pytest.approx(0.5, abs=0.03)
    assert len(back) / 4000 == pytest.approx(0.25, abs=0.03)


def test_only_within_its_window():
    dropped = set(range(1, 201)) - set(numbers(fault("drop", from_s=0.5, for_s=0.3), latency_ms=3.0))
    assert dropped == set(range(50, 80))


def test_a_fault_that_waits_for_a_moment_does_nothing_before():
    late = fault("drop", since="takeoff")
    echo = Echo(late)
    link = ImpairedLink(echo, LinkConfig(latency_ms=0.0), 1)
    assert [data for _, data in deliver(link, b"\1", 10_000)] == [b"\1"]
    echo.script.now_us = 12_000
    echo.script.observe("AUTO.TAKEOFF", armed=True, landed=False)
    assert list(deliver(link, b"\2", 20_000)) == []


def test_delay_keeps_the_order():
    got = arrivals(fault("delay", delay_ms=35.0, probability=0.1, **INBOUND), frames=1000, latency_ms=5.0)
    order = [k for _, k in got]
    assert order == sorted(order)
    delays_us = [delay_us for delay_us, _ in got]
    assert min(delays_us) == 5_000
    assert max(delays_us) == pytest.approx(40_000, abs=50)
    assert 70 < sum(delay_us >= 40_000 - 4 for delay_us in delays_us) < 130
    # those that were sent within 35 ms after a late one wait behind it
    assert any(9_000 < delay_us < 39_000 for delay_us in delays_us)


def test_jitter_is_random_and_lets_frames_overtake():
    got = arrivals(fault("jitter", jitter_ms=40.0, **INBOUND), frames=2000, latency_ms=5.0)
    delays_us = [delay_us for delay_us, _ in got]
    assert min(delays_us) >= 5_000 - 4
    assert max(delays_us) <= 45_100
    assert sum(delays_us) / len(delays_us) == pytest.approx(25_000, abs=800)
    order = [k for _, k in got]
    assert order != sorted(order)
    assert sorted(order) == list(range(1, 2001))


def test_duplicate_arrives_again_later():
    got = arrivals(fault("duplicate", copies=2, later_ms=3.0, **INBOUND), frames=3, latency_ms=1.0)
    assert got == [(1000 + 3000 * copy, k) for k in (1, 2, 3) for copy in (0, 1, 2)]


@pytest.mark.parametrize("behind", [1, 3])
def test_reorder_lets_so_many_overtake(behind):
    swapped = fault("reorder", behind=behind, from_s=0.1, for_s=0.005, **INBOUND)  # frame 10 alone
    order = numbers(swapped, frames=20)
    others = [k for k in range(1, 21) if k != 10]
    assert order == [*others[: 9 + behind], 10, *others[9 + behind :]]


def test_reordered_with_nobody_behind_it_arrives_a_second_late():
    assert arrivals(fault("reorder", from_s=0.05, **INBOUND), frames=5, latency_ms=2.0)[-1] == (1_002_000, 5)


def test_reorder_at_random_loses_nothing():
    order = numbers(fault("reorder", behind=2, probability=0.3, **INBOUND), latency_ms=5.0)
    assert order != sorted(order)
    assert sorted(order) == list(range(1, 201))


def test_corrupt_frames_reach_the_far_side_and_not_the_vehicle():
    flips = fault("corrupt", bits=3)
    arrived, _ = through([ATTITUDE] * 50, flips)
    assert arrived == []
    sent, came = through([ATTITUDE] * 50, fault("corrupt", bits=3, direction="from_vehicle"))
    assert len(came) == 50
    for before, after in zip(sent, came, strict=True):
        assert sum((a ^ b).bit_count() for a, b in zip(before, after, strict=True)) == 3
    framer = Framer()
    # what passes for a frame has an id of no known message, whose CRC cannot be checked
    assert [frame for data in came for frame in framer.push(data) if is_known(frame)] == []
    assert framer.bad_bytes > 0


def test_only_frames_of_one_message():
    arrived, _ = through([ATTITUDE, HEARTBEAT] * 10, fault("drop", message="ATTITUDE", **INBOUND))
    assert [message_id(data) for data in arrived] == [0] * 10
    assert decode(arrived[0]).type == HEARTBEAT.type


KINDS = [
    fault("drop", probability=0.2),
    fault("delay", delay_ms=30.0, probability=0.1),
    fault("jitter", jitter_ms=30.0, probability=0.5),
    fault("duplicate", probability=0.2, later_ms=4.0),
    fault("reorder", probability=0.2),
    fault("corrupt", probability=0.2, direction="from_vehicle"),
]


@pytest.mark.parametrize("one", KINDS, ids=lambda one: one.kind)
def test_same_seed_same_fate(one):
    def came(seed):
        return exchange(300, seed, [one], latency_ms=5.0)[1]

    assert came(1) == came(1)
    assert came(1) != came(2)


@pytest.mark.parametrize("other", KINDS, ids=lambda other: other.kind)
def test_one_fault_more_leaves_the_others_draws_alone(other):
    drop = fault("drop", probability=0.3, **INBOUND)
    alone = set(numbers(drop))
    behind_it = set(numbers(drop, other))
    assert behind_it <= alone
    if other.kind != "drop":
        assert behind_it == alone


def test_each_direction_draws_for_itself():
    one_way, other_way = (
        {number(data) for _, data in exchange(200, faults=[fault("drop", probability=0.5, direction=direction)])[1]}
        for direction in ("to_vehicle", "from_vehicle")
    )
    assert one_way != other_way


def test_the_seed_of_a_port_is_its_own():
    echo = Echo(fault("drop", probability=0.5, **INBOUND))
    link = ImpairedLink(echo, LinkConfig(latency_ms=0.0), 1, ports=2)
    arrived = [[], []]
    for k, port in itertools.product(range(1, 200), (0, 1)):
        before = len(echo.inputs)
        link.receive(bytes([k]), k * STEP_US + 4 * port, port)
        arrived[port].append(len(echo.inputs) > before)
    assert arrived[0] != arrived[1]


def test_a_fault_added_in_mid_run_acts_on_an_ideal_link():
    echo = Echo()
    link = ImpairedLink(echo, LinkConfig(latency_ms=0.0), 1)
    assert [data for _, data in deliver(link, b"\1", 10_000)] == [b"\1"]
    echo.script.add(fault("drop", for_s=0.015), 12_000)
    assert list(deliver(link, b"\2", 20_000)) == []
    assert [data for _, data in deliver(link, b"\3", 30_000)] == [b"\3"]
