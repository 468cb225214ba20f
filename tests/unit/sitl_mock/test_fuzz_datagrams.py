"""Datagrams as bytes into both autopilots: damaged ones change nothing and are counted, valid ones end nothing.

The million of `tests/bench/fuzz.py`, in small, with shrinking.
"""

from __future__ import annotations

import copy
from functools import cache

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mavquad.protocol.codec import Encoder, Framer, is_known, mavlink
from tests.bench.fuzz import CLASSES, HANDLED, PERSONALITIES, Side, is_finite, sealed
from tests.unit.sitl_mock.test_fuzz import message_of

PEER = Encoder(255, 190)
NAMES = sorted(set(HANDLED))
FRAMES = st.sampled_from(NAMES).flatmap(lambda name: message_of(CLASSES[name])).map(PEER.encode)
PLACES = [(name, where) for name in PERSONALITIES for where in ("ground", "hover")]


@cache
def started(name: str, where: str) -> Side:
    side = Side(*PERSONALITIES[name])
    if where == "hover":
        side.hover(PERSONALITIES[name][0])
    else:
        side.run(2_000_000)
    return side


def fresh(name: str, where: str) -> Side:
    return copy.deepcopy(started(name, where))


def flipped(frame: bytes, bit: int) -> bytes:
    data = bytearray(frame)
    data[bit // 8 % len(data)] ^= 1 << bit % 8
    return bytes(data)


def holds_a_frame(datagram: bytes) -> bool:
    return any(is_known(frame) for frame in Framer().push(datagram))


BITS = st.integers(0, 2400)
DAMAGED = (
    st.binary(min_size=1, max_size=100)
    | st.builds(flipped, FRAMES, BITS)
    | st.builds(lambda frame, cut: frame[: max(1, cut % len(frame))], FRAMES, BITS)
    | st.builds(lambda frame, other: frame[:-2] + other[-1:] + frame[-1:], FRAMES, FRAMES)
)


@pytest.mark.parametrize(("name", "where"), PLACES)
@settings(max_examples=25, deadline=None)
@given(datagrams=st.lists(DAMAGED, min_size=1, max_size=8))
def test_damaged_datagrams_change_nothing_and_are_counted(name: str, where: str, datagrams: list[bytes]) -> None:
    assume(not any(map(holds_a_frame, datagrams)))
    side, twin = fresh(name, where), fresh(name, where)
    for datagram in datagrams:
        side.push(datagram)
        side.framer.forget_rest()
    twin.run(1000 * len(datagrams))
    assert side.frames == 0
    assert side.framer.bad_bytes + side.framer.unknown > 0
    for one in (side, twin):
        one.run(40_000)
    assert side.state() == twin.state()


@pytest.mark.parametrize(("name", "where"), PLACES)
@settings(max_examples=25, deadline=None)
@given(
    datagrams=st.lists(st.lists(FRAMES, min_size=1, max_size=3).map(b"".join), min_size=1, max_size=10),
    payloads=st.lists(st.tuples(BITS, st.integers(0, 255)), max_size=6),
)
def test_no_valid_datagram_ends_the_mock(
    name: str, where: str, datagrams: list[bytes], payloads: list[tuple[int, int]]
) -> None:
    side = fresh(name, where)
    for datagram in datagrams:
        side.push(datagram)
    frames = Framer().push(datagrams[0])
    for at, value in payloads:
        frame = bytearray(frames[0])
        frame[10 + at % frame[1]] = value
        side.push(sealed(frame))
    side.run(40_000)
    assert side.frames >= len(datagrams) + len(payloads)
    assert is_finite(side)


def test_the_twins_would_differ_if_something_changed() -> None:
    for name in PERSONALITIES:
        side, twin = fresh(name, "ground"), fresh(name, "ground")
        told = "MIS_TAKEOFF_ALT" if name != "ardupilot" else "WPNAV_SPEED_UP"
        change = mavlink.MAVLink_param_set_message(1, 1, told.encode(), 7.0, mavlink.MAV_PARAM_TYPE_REAL32)
        side.push(PEER.encode(change))
        twin.run(1000)
        assert side.state() == twin.state()
        assert side.parameters() != twin.parameters()
