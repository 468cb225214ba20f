"""Each scripted fault, seen from the far side."""

import itertools
import math

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.errors import ConfigError

ACCEPTED, TEMPORARILY_REJECTED, DENIED = 0, 1, 2


def test_refuse_so_many_times(pilot):
    p = pilot(faults=[{"kind": "refuse", "command": 400, "result": 1, "times": 2, "text": "No"}]).run(1.1).heartbeat()
    assert [p.command(400, 1)[0] for _ in range(3)] == [TEMPORARILY_REJECTED, TEMPORARILY_REJECTED, ACCEPTED]
    assert p.texts().count("No") == 2
    assert p.mock.armed


def test_acknowledge_without_acting(pilot):
    p = pilot(faults=[{"kind": "ack_without_acting", "command": 176}]).hover()
    p.torque()
    assert p.offboard() == [ACCEPTED]
    p.stream(lambda q: q.torque(), 1.0)
    assert p.mock.mode == "AUTO.LOITER"


def test_silent_for_a_while(pilot):
    p = pilot(faults=[{"kind": "silent", "from_s": 1.0, "for_s": 0.5}]).run(1.2)
    assert p.command(511, 30, 10000) == []
    p.run(1.0)
    stamps = p.stamps_us("ATTITUDE")
    gaps = [b - a for a, b in itertools.pairwise(stamps)]
    assert max(gaps) == pytest.approx(500_000, abs=20_000)


def test_one_stream_stops(pilot):
    p = pilot(faults=[{"kind": "stream_stops", "message": "LOCAL_POSITION_NED", "from_s": 1.0, "for_s": 1.0}]).run(3.0)
    assert not any(1e6 <= stamp < 2e6 for stamp in p.stamps_us("LOCAL_POSITION_NED"))
    assert len(p.messages("LOCAL_POSITION_NED")) == pytest.approx(60, abs=2)
    assert len(p.messages("ATTITUDE")) == pytest.approx(300, abs=2)


def test_nan_pose(pilot):
    p = pilot(faults=[{"kind": "nan_pose", "from_s": 1.0, "for_s": 0.5}]).run(2.0)
    for stamp, message in zip(p.stamps_us("LOCAL_POSITION_NED"), p.messages("LOCAL_POSITION_NED"), strict=True):
        assert math.isnan(message.x) == (1e6 <= stamp < 1.5e6)
    assert all(math.isfinite(message.roll) for message in p.messages("ATTITUDE"))


def test_dies_for_ever(pilot):
    p = pilot(faults=[{"kind": "die", "at_s": 1.0}]).run(3.0)
    assert max(stamp for stamp in p.stamps_us("ATTITUDE")) <= 1_000_000
    assert p.command(511, 30, 0) == []
    assert p.mock.next_deadline_us() == NEVER_US


def test_the_pilot_takes_over(pilot):
    p = pilot(faults=[{"kind": "mode_change", "at_s": 0.5, "mode": "POSCTL", "since": "offboard"}]).hover()
    p.torque()
    p.offboard()
    p.stream(lambda q: q.torque(), 0.4)
    assert p.mock.mode == "OFFBOARD"
    p.stream(lambda q: q.torque(), 0.2)
    assert p.mock.mode == "POSCTL"
    p.offboard()
    p.stream(lambda q: q.torque(), 0.6)
    assert p.mock.mode == "OFFBOARD"  # once only


def test_since_offboard_does_not_start_before(pilot):
    p = pilot(faults=[{"kind": "silent", "from_s": 0.0, "for_s": 9.0, "since": "offboard"}]).hover()
    assert len(p.run(1.0).messages("ATTITUDE")) == 100
    p.torque()
    p.offboard()
    p.forget()
    assert p.run(0.5).frames == []


@pytest.mark.parametrize(
    ("fault", "key"),
    [
        ({"kind": "refuse"}, "faults.0.refuse.command"),
        ({"kind": "explode"}, "faults.0"),
        ({"kind": "stream_stops", "message": "NOPE", "from_s": 0, "for_s": 1}, "faults.0.stream_stops.message"),
        ({"kind": "silent", "from_s": -1.0, "for_s": 1.0}, "faults.0.silent.from_s"),
    ],
)
def test_bad_faults_are_refused(pilot, fault, key):
    with pytest.raises(ConfigError) as caught:
        pilot(faults=[fault])
    assert caught.value.key == key
