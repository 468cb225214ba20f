"""The vehicle's clock over simulated links: delay, jitter, asymmetry, loss, copies, drift, stalls, reboots."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import mavlink
from mavquad.protocol.timesync import PERIOD_US, TimeSync
from mavquad.protocol.vehicle_clock import Exchange, VehicleClock

START_US = 1_700_000_000_000_000
BOOT_US = 37_000_000


@dataclass
class Path:
    """A link and the clock behind it; delays in us, up and down, with their jitter (uniform) and loss."""

    drift: float = 0.0
    up_us: int = 200
    down_us: int = 200
    jitter_us: int = 0
    loss: float = 0.0
    seed: int = 1
    sync: TimeSync = field(default_factory=TimeSync)
    now_us: int = START_US
    stepped_us: int = 0
    errors_us: list[float] = field(default_factory=list)
    sure: bool = True

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._answers: list[tuple[int, object]] = []
        self.sync.start(self.now_us)

    def vehicle_us(self, our_us: float) -> float:
        return BOOT_US + self.stepped_us + (our_us - START_US) * (1.0 + self.drift)

    def run(self, seconds: float) -> Path:
        """Ask and answer; after each answer, how far the clock is from the truth, and whether its bound held."""
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            next_us = min([self.sync.next_deadline_us(), *(at_us for at_us, _ in self._answers)])
            self.now_us = max(next_us, self.now_us)
            question = self.sync.on_deadline(self.now_us)
            if question is not None:
                self._ask(question)
            for answer in sorted((a for a in self._answers if a[0] <= self.now_us), key=lambda a: a[0]):
                self._answers.remove(answer)
                self.sync.on_message(answer[1], self.now_us)
                self._judge(self.now_us)
                self._judge(self.now_us + PERIOD_US)
        return self

    def _judge(self, our_us: int) -> None:
        error_us = self.sync.vehicle_us(our_us) - self.vehicle_us(our_us)
        self.errors_us.append(error_us)
        self.sure &= abs(error_us) <= self.sync.uncertainty_us(our_us) + 2

    def _ask(self, question: object) -> None:
        up_us, down_us = (d + self._random.randint(0, self.jitter_us) for d in (self.up_us, self.down_us))
        shown_ns = int(self.vehicle_us(self.now_us + up_us) * 1000)
        answer = mavlink.MAVLink_timesync_message(shown_ns, question.ts1)
        copies = self._random.choice((1, 1, 2)) if self._random.random() >= self.loss else 0
        self._answers += [(self.now_us + up_us + down_us + 40 * n, answer) for n in range(copies)]

    def last_errors_us(self, count: int = 20) -> list[float]:
        return self.errors_us[-count:]


drifts = st.floats(-0.03, 0.03)


@given(
    drift=drifts, up=st.integers(0, 80_000), down=st.integers(0, 80_000), jitter=st.integers(0, 200_000),
    loss=st.floats(0.0, 0.6), seed=st.integers(0, 9999),
)  # fmt: skip
@settings(max_examples=60)
def test_with_a_constant_drift_the_bound_holds_on_any_link(drift, up, down, jitter, loss, seed):
    path = Path(drift, up, down, jitter, loss, seed).run(6.0)
    assert path.sure
    assert path.sync.clock.steps == 0
    assert path.sync.clock.reboots == 0


@given(drift=drifts, delay=st.integers(100, 20_000), jitter=st.integers(0, 50_000), seed=st.integers(0, 9999))
@settings(max_examples=40)
def test_jitter_and_outliers_hardly_move_it(drift, delay, jitter, seed):
    """The mean of offsets that err by jitter / sqrt(6) each way would be no better; the quickest exchanges are."""
    path = Path(drift, delay, delay, jitter, 0.2, seed).run(12.0)
    assert max(map(abs, path.last_errors_us())) <= 60 + 0.25 * jitter
    assert path.sync.drift == pytest.approx(drift, abs=1e-4 + 0.1 * jitter * 1e-6)


def test_answers_that_were_held_up_count_for_nothing():
    """Every fourth comes 200 ms late: the mean of all offsets would be wrong by 25 ms."""
    path = Path(drift=-0.013, jitter_us=100)
    for _ in range(20):
        path.run(0.3)
        path.down_us = 200_000
        path.run(0.1)
        path.down_us = 200
    assert max(map(abs, path.last_errors_us())) < 400
    assert path.sync.clock.steps == 0


def test_the_drift_of_a_simulator_in_lockstep_is_learned_within_a_second():
    path = Path(drift=-0.013, jitter_us=300).run(1.0)
    assert path.sync.drift == pytest.approx(-0.013, abs=1e-3)
    assert max(map(abs, path.last_errors_us(4))) < 300


def test_an_asymmetric_link_errs_by_half_of_the_difference_and_says_so():
    path = Path(up_us=1_000, down_us=41_000).run(5.0)
    assert path.last_errors_us(1)[0] == pytest.approx(-20_000, abs=10)
    assert path.sync.uncertainty_us(path.now_us) >= 20_000


def test_no_answer_for_a_while_is_less_certain():
    path = Path(drift=-0.01, jitter_us=2000).run(3.0)
    soon, late = (path.sync.uncertainty_us(path.now_us + later_us) for later_us in (0, 5_000_000))
    assert late > soon + 500


@pytest.mark.parametrize("stall_us", [20_000, 150_000, 900_000])
def test_a_simulator_that_stalls_is_noticed_at_the_next_answer(stall_us):
    """Its clock stands still meanwhile, and nobody answers."""
    path = Path(drift=-0.013, jitter_us=200).run(5.0)
    path.stepped_us = -round(stall_us * 0.987) + 1000
    path.now_us += stall_us
    path.run(0.25)
    assert path.sync.clock.steps == 1
    assert path.sync.clock.reboots == 0
    assert max(map(abs, path.last_errors_us(2))) < 300
    assert path.sync.drift == pytest.approx(-0.013, abs=2e-3)


def test_a_change_of_pace_is_followed():
    path = Path(drift=-0.01).run(5.0)
    path.stepped_us += round((path.now_us - START_US) * 0.29)
    path.drift = -0.30
    path.run(3.0)
    assert path.sync.drift == pytest.approx(-0.30, abs=0.01)
    assert max(map(abs, path.last_errors_us())) < 3_000


def test_a_reboot_starts_again():
    path = Path(drift=-0.013, jitter_us=20_000).run(5.0)
    path.stepped_us = -(5_000_000 + BOOT_US) + 2_000_000
    path.run(0.5)
    assert path.sync.clock.reboots == 1
    assert abs(path.last_errors_us(1)[0]) < 25_000


def test_a_clock_that_jumps_ahead_is_another_one():
    path = Path(drift=0.02).run(5.0)
    path.stepped_us = 3_600_000_000
    path.run(0.15)
    assert path.sync.clock.steps == 1
    assert path.sync.clock.reboots == 0
    assert path.sync.clock.line.drift_bound > 0.01  # nothing of the drift is believed


def test_answers_that_overtake_each_other_are_no_reboot():
    clock = VehicleClock()
    clock.take(Exchange(100_000, 100_400, 1_100_200))
    clock.take(Exchange(0, 300_000, 1_000_200))
    assert clock.reboots == 0
    assert clock.steps == 0
    clock.take(Exchange(100_400, 500_000, 1_100_100))
    assert clock.reboots == 1


def test_our_time_of_a_stamp_is_the_inverse():
    path = Path(drift=-0.02, up_us=3000, down_us=3000).run(5.0)
    for our_us in (path.now_us - 5_000_000, path.now_us, path.now_us + 1_000_000):
        assert path.sync.our_us(path.sync.vehicle_us(our_us)) == pytest.approx(our_us, abs=2)


def test_the_age_of_a_pose():
    path = Path(drift=-0.013, jitter_us=1000).run(8.0)
    sync, now_us = path.sync, path.now_us
    stamp_us = round(path.vehicle_us(now_us - 25_000))
    assert sync.age_us(stamp_us, now_us) == pytest.approx(25_000, abs=600)
    assert sync.age_us(round(path.vehicle_us(now_us + 300)), now_us) in range(600)
    assert sync.age_us(stamp_us - 20_000_000, now_us) is None
    assert sync.age_us(stamp_us + 20_000_000, now_us) is None


def test_nothing_is_known_before_the_first_answer():
    sync = TimeSync()
    assert sync.next_deadline_us() == NEVER_US
    assert (sync.drift, sync.our_us(1), sync.vehicle_us(1), sync.age_us(1, 2)) == (None, None, None, None)
    assert sync.clock.least_round_trip_us is None


def test_questions_are_answered_and_asked_at_their_time():
    sync = TimeSync()
    answer = sync.on_message(mavlink.MAVLink_timesync_message(0, 123_456_789), 5_000_000)
    assert (answer.tc1, answer.ts1) == (5_000_000_000, 123_456_789)
    sync.start(996)
    assert sync.on_deadline(996) is None
    question = sync.on_deadline(1000)
    assert (question.tc1, question.ts1) == (0, 1_000_000)
    assert sync.next_deadline_us() == 1000 + PERIOD_US
    sync.stop()
    assert sync.next_deadline_us() == NEVER_US


@given(st.lists(st.tuples(st.integers(-(2**63), 2**63 - 1), st.integers(-(2**63), 2**63 - 1)), max_size=20))
def test_what_was_not_asked_says_nothing(answers):
    path = Path().run(1.0)
    before = path.sync.clock.line
    for tc1, ts1 in answers:
        path.sync.on_message(mavlink.MAVLink_timesync_message(tc1, ts1), path.now_us)
    assert path.sync.clock.line == before
    assert path.sync.strays >= sum(tc1 != 0 for tc1, _ in answers)


@given(st.lists(st.integers(0, 2**63 - 1), min_size=1, max_size=20))
def test_whatever_a_vehicle_answers_the_clock_stays_a_clock(answers):
    sync = TimeSync()
    sync.start(START_US)
    for tc1 in answers:
        now_us = sync.next_deadline_us()
        question = sync.on_deadline(now_us)
        sync.on_message(mavlink.MAVLink_timesync_message(max(1, tc1), question.ts1), now_us + 300)
        assert math.isfinite(sync.drift)
        assert sync.our_us(1) is not None


def test_old_questions_are_forgotten():
    sync = TimeSync()
    sync.start(START_US)
    first = sync.on_deadline(START_US + 4)
    for _ in range(200):
        sync.on_deadline(sync.next_deadline_us())
    sync.on_message(mavlink.MAVLink_timesync_message(5, first.ts1), START_US + 21_000_000)
    assert sync.strays == 1
    assert sync.clock.line is None


def test_one_answer_that_was_held_up_is_no_slow_link():
    path = Path().run(1.0)
    path.down_us = 170_000
    path.run(0.1)
    path.down_us = 200
    while path.sync.latest_round_trip_us < 170_000:
        path.run(0.001)  # until it comes
    assert path.sync.round_trip_us == 400
    path.down_us = 170_000
    path.run(0.8)
    assert path.sync.round_trip_us == 170_200
    assert path.sync.latest_round_trip_us == 170_200
