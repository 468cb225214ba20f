"""Changing parameters: read first, set what differs, read back; the two encodings, loss, refusals, and putting back."""

from __future__ import annotations

import random
import struct
from collections import deque
from dataclasses import dataclass, field

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Encoder, decode, mavlink
from mavquad.protocol.param_change import MAX_TRIES, RETRY_US, ParamChange, restoring
from mavquad.protocol.param_value import Encoding, encoding_of

TARGET = (1, 1)
CODES = {
    mavlink.MAV_PARAM_TYPE_INT8: "<b",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
    mavlink.MAV_PARAM_TYPE_REAL32: "<f",
}
INT8, INT32, REAL32 = CODES
ARDUPILOT = {"GUID_OPTIONS": (INT32, 0), "GUID_TIMEOUT": (REAL32, 3.0), "ATC_ANGLE_BOOST": (INT8, 1)}
PX4 = {"COM_RCL_EXCEPT": (INT32, 0), "COM_OF_LOSS_T": (REAL32, 1.0)}


@dataclass
class Vehicle:
    """Answers after `delay_us`; `limits` clamp a value, `stubborn` ones are not changed, `twice` tells a change again;
    `curt`, it answers no PARAM_SET; `forgets` so many changes after it has told them.

    Its wire is written here once more, with struct alone.
    """

    parameters: dict
    bytewise: bool
    delay_us: int = 100_000
    loss: float = 0.0
    seed: int = 0
    limits: dict = field(default_factory=dict)
    stubborn: tuple = ()
    twice: bool = False
    curt: bool = False
    forgets: int = 0
    heard: list = field(default_factory=list)
    under_way: deque = field(default_factory=deque)

    def __post_init__(self):
        self.values = {name: value for name, (_, value) in self.parameters.items()}
        self.random = random.Random(self.seed)

    def hear(self, message, now_us):
        message = decode(Encoder(245, 190).encode(message))
        self.heard.append(message)
        if self.random.random() < self.loss or message.param_id not in self.values:
            return
        name, changes = message.param_id, message.get_type() == "PARAM_SET"
        before = self.values[name]
        if changes and name not in self.stubborn:
            self.set(name, message)
        if changes and self.curt:
            return
        for delay_us in (self.delay_us, self.delay_us + 8_000)[: 1 + (changes and self.twice)]:
            if self.random.random() >= self.loss:
                self.under_way.append((now_us + delay_us, self.value(name)))
        if changes and self.forgets:
            self.forgets, self.values[name] = self.forgets - 1, before

    def set(self, name, message):
        kind, value = self.parameters[name][0], message.param_value
        assert message.param_type == kind
        if self.bytewise and kind != REAL32:
            value = struct.unpack_from(CODES[kind], struct.pack("<f", value))[0]
        low, high = self.limits.get(name, (-1e9, 1e9))
        self.values[name] = min(max(value, low), high)

    def value(self, name):
        kind, value = self.parameters[name][0], self.values[name]
        if self.bytewise and kind != REAL32:
            value = struct.unpack("<f", struct.pack(CODES[kind], value).ljust(4, b"\0"))[0]
        message = mavlink.MAVLink_param_value_message(name.encode(), float(value), kind, 700, 5)
        return decode(Encoder(1, 1).encode(message))

    def sets(self):
        return [m for m in self.heard if m.get_type() == "PARAM_SET"]


@dataclass
class Exchange:
    """A change and its vehicle, in virtual time."""

    change: ParamChange
    vehicle: Vehicle
    now_us: int = 1000

    def send(self, messages):
        for message in messages:
            self.vehicle.hear(message, self.now_us)
        self.vehicle.under_way = deque(sorted(self.vehicle.under_way, key=lambda each: each[0]))

    def start(self):
        self.send(self.change.start(TARGET, self.now_us))
        return self

    def run(self, until):
        """Until the condition holds, at most 60 s."""
        while not until():
            assert self.now_us < 60_000_000
            answer_us = self.vehicle.under_way[0][0] if self.vehicle.under_way else NEVER_US
            self.now_us = min(answer_us, self.change.next_deadline_us())
            assert self.now_us < NEVER_US, "both wait for ever"
            if self.now_us == answer_us:
                self.send(self.change.on_value(self.vehicle.under_way.popleft()[1], TARGET, self.now_us))
            else:
                self.send(self.change.on_deadline(TARGET, self.now_us))
        return self

    def run_all(self):
        self.start().run(lambda: self.change.read)
        self.send(self.change.change(TARGET, self.now_us))
        return self.run(lambda: self.change.done)


def ardupilot(wanted, **vehicle):
    return Exchange(ParamChange(wanted, Encoding.CAST), Vehicle(ARDUPILOT, bytewise=False, **vehicle))


def px4(wanted, **vehicle):
    return Exchange(ParamChange(wanted, Encoding.BYTEWISE), Vehicle(PX4, bytewise=True, **vehicle))


def as_tuples(records):
    return [(each.name, each.type, each.original, each.changed) for each in records]


def single(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def test_ardupilots_are_read_then_set_then_read_back():
    exchange = ardupilot({"GUID_OPTIONS": 8, "GUID_TIMEOUT": 0.3, "ATC_ANGLE_BOOST": 0}).run_all()
    assert exchange.change.failed == ""
    assert exchange.vehicle.values == {"GUID_OPTIONS": 8, "GUID_TIMEOUT": single(0.3), "ATC_ANGLE_BOOST": 0}
    kinds = [message.get_type() for message in exchange.vehicle.heard]
    assert kinds == ["PARAM_REQUEST_READ"] * 3 + ["PARAM_SET"] * 3 + ["PARAM_REQUEST_READ"] * 3
    assert as_tuples(exchange.change.originals) == [
        ("GUID_OPTIONS", "INT32", 0, 8),
        ("GUID_TIMEOUT", "REAL32", 3.0, single(0.3)),
        ("ATC_ANGLE_BOOST", "INT8", 1, 0),
    ]


def test_px4s_integers_are_set_by_their_bytes_and_told_twice():
    exchange = px4({"COM_RCL_EXCEPT": 4, "COM_OF_LOSS_T": 0.5}, twice=True).run_all()
    assert exchange.change.failed == ""
    assert exchange.vehicle.values == {"COM_RCL_EXCEPT": 4, "COM_OF_LOSS_T": 0.5}
    wire = exchange.vehicle.sets()[0].param_value
    assert struct.pack("<f", wire) == bytes([4, 0, 0, 0])


def test_nothing_is_set_before_all_are_read_and_change_is_called():
    exchange = px4({"COM_RCL_EXCEPT": 4, "COM_OF_LOSS_T": 0.5}).start()
    exchange.run(lambda: exchange.change.read)
    change = exchange.change
    assert change.next_deadline_us() == NEVER_US
    assert exchange.vehicle.sets() == []
    assert not change.done
    assert as_tuples(change.originals) == [("COM_RCL_EXCEPT", "INT32", 0, 4), ("COM_OF_LOSS_T", "REAL32", 1.0, 0.5)]
    assert change.found == {"COM_RCL_EXCEPT": 0, "COM_OF_LOSS_T": 1.0}


def test_what_has_its_value_already_is_not_set():
    exchange = ardupilot({"GUID_OPTIONS": 0, "GUID_TIMEOUT": 3.0}).run_all()
    assert exchange.vehicle.sets() == []
    assert exchange.change.originals == []
    assert exchange.change.failed == ""


def test_no_parameters_at_all():
    change = ParamChange({}, Encoding.CAST)
    assert change.start(TARGET, 0) == []
    assert change.read
    assert change.done
    assert change.next_deadline_us() == NEVER_US


def test_an_unknown_name_is_given_up_by_its_name_with_nothing_set():
    exchange = px4({"COM_OF_LOSS_T": 0.5, "GUID_TIMEOUT": 0.3}).start()
    exchange.run(lambda: exchange.change.read)
    asked = [m.param_id for m in exchange.vehicle.heard]
    assert asked.count("GUID_TIMEOUT") == MAX_TRIES
    assert asked.count("COM_OF_LOSS_T") == 1
    assert exchange.change.failed.startswith("GUID_TIMEOUT: not answered in 6 s")
    assert exchange.vehicle.values == {"COM_RCL_EXCEPT": 0, "COM_OF_LOSS_T": 1.0}
    assert exchange.vehicle.sets() == []


def test_it_is_repeated_at_its_time():
    change = ParamChange({"X": 1.0}, Encoding.CAST)
    change.start(TARGET, 1000)
    assert change.next_deadline_us() == 1000 + RETRY_US
    assert change.on_deadline(TARGET, 1000 + RETRY_US - 4) == []
    assert [m.param_id for m in change.on_deadline(TARGET, 1000 + RETRY_US)] == ["X"]


@pytest.mark.parametrize("seed", range(50))
@pytest.mark.parametrize("bytewise", [True, False])
def test_a_fifth_lost_each_way(seed, bytewise):
    make = px4 if bytewise else ardupilot
    wanted = {"COM_RCL_EXCEPT": 4, "COM_OF_LOSS_T": 0.5} if bytewise else {"GUID_OPTIONS": 8, "GUID_TIMEOUT": 0.5}
    exchange = make(wanted, loss=0.2, seed=seed, twice=bytewise).run_all()
    assert exchange.change.failed == ""
    assert {name: exchange.vehicle.values[name] for name in wanted} == wanted


def test_answers_slower_than_our_patience_mean_no_refusal():
    """Old answers to repeated questions arrive after the set, and show the value before it."""
    exchange = ardupilot({"GUID_TIMEOUT": 0.5}, delay_us=800_000).run_all()
    assert exchange.change.failed == ""
    assert exchange.vehicle.values["GUID_TIMEOUT"] == 0.5


def test_a_clamped_value_is_told_with_what_the_vehicle_keeps():
    exchange = ardupilot({"GUID_TIMEOUT": 0.25}, limits={"GUID_TIMEOUT": (0.5, 5.0)}).run_all()
    assert exchange.change.failed == "GUID_TIMEOUT: the vehicle keeps it at 0.5, 0.25 was asked for"
    assert as_tuples(exchange.change.originals) == [
        ("GUID_TIMEOUT", "REAL32", 3.0, 0.25)
    ]  # to be put back all the same


def test_an_ignored_set_is_told_and_the_others_are_changed():
    exchange = ardupilot({"GUID_OPTIONS": 8, "GUID_TIMEOUT": 0.5}, stubborn=("GUID_OPTIONS",)).run_all()
    assert exchange.change.failed == "GUID_OPTIONS: the vehicle keeps it at 0, 8 was asked for"
    assert exchange.vehicle.values["GUID_TIMEOUT"] == 0.5


@pytest.mark.parametrize("stubborn", [(), ("GUID_TIMEOUT",)])
def test_a_vehicle_that_answers_no_set_is_asked_what_came_of_it(stubborn):
    exchange = ardupilot({"GUID_TIMEOUT": 0.5}, curt=True, stubborn=stubborn).run_all()
    assert exchange.vehicle.values["GUID_TIMEOUT"] == (3.0 if stubborn else 0.5)
    assert ("the vehicle keeps it at 3, 0.5 was asked for" in exchange.change.failed) == bool(stubborn)


def test_what_is_told_but_not_kept_is_set_again():
    exchange = ardupilot({"GUID_TIMEOUT": 0.5}, forgets=2).run_all()
    assert exchange.change.failed == ""
    assert exchange.vehicle.values["GUID_TIMEOUT"] == 0.5
    assert len(exchange.vehicle.sets()) == 3


def test_who_packs_its_integers_how():
    assert encoding_of(mavlink.MAV_AUTOPILOT_PX4) is Encoding.BYTEWISE
    assert encoding_of(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA) is Encoding.CAST


def test_a_vehicle_that_falls_silent_after_the_reading():
    exchange = ardupilot({"GUID_TIMEOUT": 0.5}).start()
    exchange.run(lambda: exchange.change.read)
    exchange.vehicle.loss = 1.0
    exchange.send(exchange.change.change(TARGET, exchange.now_us))
    exchange.run(lambda: exchange.change.done)
    assert exchange.change.failed == "GUID_TIMEOUT: set to 0.5, but no answer in 6 s shows it"
    assert len(exchange.vehicle.sets()) == MAX_TRIES


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"GUID_OPTIONS": 8.5}, "GUID_OPTIONS: is of type INT32: 8.5 is not whole"),
        ({"ATC_ANGLE_BOOST": 200}, "ATC_ANGLE_BOOST: 200 does not fit into INT8"),
        ({"GUID_OPTIONS": 2**24 + 2}, "GUID_OPTIONS: 16777218 is rounded on its way over MAVLink"),
        ({"GUID_TIMEOUT": 1e40}, "GUID_TIMEOUT: 1e+40 does not fit into REAL32"),
        ({"GUID_TIMEOUT": float("nan")}, "GUID_TIMEOUT: nan is not a number"),
    ],
)
def test_a_value_that_the_type_cannot_hold_is_refused_unsent(wanted, words):
    exchange = ardupilot(wanted).start()
    exchange.run(lambda: exchange.change.read)
    assert exchange.change.failed == words
    assert exchange.vehicle.sets() == []


def test_what_could_not_be_put_back_is_not_changed():
    vehicle = Vehicle({"GUID_TIMEOUT": (REAL32, float("nan")), "GUID_OPTIONS": (INT32, 2**30)}, bytewise=False)
    exchange = Exchange(ParamChange({"GUID_TIMEOUT": 0.5, "GUID_OPTIONS": 8}, Encoding.CAST), vehicle).start()
    exchange.run(lambda: exchange.change.read)
    assert "GUID_TIMEOUT: could not be put back: nan is not a number" in exchange.change.failed
    assert "GUID_OPTIONS: could not be put back: 1073741824 is rounded" in exchange.change.failed
    assert exchange.change.originals == []


@pytest.mark.parametrize("make", [ardupilot, px4])
def test_restoring_puts_the_originals_back(make):
    wanted = {"GUID_OPTIONS": 8, "GUID_TIMEOUT": 0.3} if make is ardupilot else {"COM_RCL_EXCEPT": -4}
    exchange = make(wanted).run_all()
    before, encoding = exchange.change, Encoding.CAST if make is ardupilot else Encoding.BYTEWISE
    exchange.change = restoring(before.originals, encoding)
    exchange.start().run(lambda: exchange.change.done)
    table = exchange.vehicle.parameters
    assert exchange.change.failed == ""
    assert exchange.vehicle.values == {name: value for name, (_, value) in table.items()}


def test_restoring_goes_on_without_one_that_the_vehicle_no_longer_knows():
    exchange = ardupilot({"GUID_OPTIONS": 8, "GUID_TIMEOUT": 0.5}).run_all()
    records = exchange.change.originals
    del exchange.vehicle.values["GUID_OPTIONS"]
    exchange.change = restoring(records, Encoding.CAST)
    exchange.start().run(lambda: exchange.change.done)
    assert exchange.change.failed.startswith("GUID_OPTIONS: not answered")
    assert exchange.vehicle.values["GUID_TIMEOUT"] == 3.0


def test_other_parameters_are_none_of_its_business():
    vehicle = Vehicle(PX4, bytewise=True)
    change = ParamChange({"COM_RCL_EXCEPT": 4}, Encoding.BYTEWISE)
    change.start(TARGET, 0)
    assert change.on_value(vehicle.value("COM_OF_LOSS_T"), TARGET, 4) == []
    assert not change.read
    assert change.found == {}
