"""What goes wrong in the campaign of `tests.bench.safety`: for each kind of fault, how a seed draws its moment and size.

Survivable is what the autopilot itself survives: after it the autopilot still flies, hears us again at some time (or has a
failsafe for that it does not), and knows where it is. The others are in `HOPELESS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from mavquad.cli.mock_options import mock_options
from mavquad.types import Depth

Fault = dict[str, object]
Keys = dict[str, object]
Draw = Callable[[Random, "Craft"], list[Fault]]


@dataclass(frozen=True)
class Craft:
    """A personality of the mock.

    Attributes:
        name: for the tables.
        keys: of the configuration.
        pilots: modes that a pilot selects.
    """

    name: str
    keys: Keys
    pilots: tuple[str, ...]


PX4_1_16 = Craft("PX4 1.16", {"mock.firmware": '"1.16"'}, ("POSCTL", "AUTO.LOITER", "AUTO.LAND", "AUTO.RTL", "ALTCTL"))
PX4_1_13 = Craft("PX4 1.13", {"mock.firmware": '"1.13"'}, PX4_1_16.pilots)
ARDUCOPTER = Craft(
    "ArduCopter 4.7",
    mock_options("ardupilot", None, None)["--autopilot"],
    ("LOITER", "BRAKE", "LAND", "RTL", "ALT_HOLD"),
)
CRAFT = (PX4_1_16, ARDUCOPTER)
DEPTHS: tuple[Depth, ...] = ("rate", "attitude")

HOVER: Keys = {"mission.name": '"hover"', "mission.duration_s": 3.0, "flight.settle_s": 0.5}
"""In lockstep about 25 s from the boot: in control from 6 to 10 s after the takeoff, landed 8 to 11 s later."""

COMMANDS = ("COMPONENT_ARM_DISARM", "NAV_TAKEOFF", "DO_SET_MODE", "NAV_LAND", "SET_MESSAGE_INTERVAL", "REQUEST_MESSAGE")
STREAMS = (
    "ATTITUDE",
    "LOCAL_POSITION_NED",
    "HEARTBEAT",
    "SYS_STATUS",
    "EXTENDED_SYS_STATE",
    "ATTITUDE_TARGET",
    "TIMESYNC",
)


@dataclass(frozen=True)
class Scenario:
    """One kind of fault: how it is drawn, and what of the configuration goes with it."""

    name: str
    draw: Draw
    keys: Keys


def _scenario(name: str, draw: Draw, **keys: object) -> Scenario:
    return Scenario(name, draw, {key.replace("__", "."): value for key, value in keys.items()})


def _moment(random: Random) -> Fault:
    """At any moment of the flight, from the takeoff until after the landing has begun."""
    return {"since": "takeoff", "at_s": round(random.uniform(0.2, 13.0), 3)}


def _window(random: Random, least_s: float, most_s: float) -> Fault:
    start_s = round(random.uniform(0.0, 12.0), 3)
    return {"since": "takeoff", "from_s": start_s, "for_s": round(random.uniform(least_s, most_s), 3)}


def _anywhere(random: Random, least_s: float, most_s: float) -> Fault:
    """In the air, or before it, one of three."""
    if random.random() < 0.67:
        return _window(random, least_s, most_s)
    return {"from_s": round(random.uniform(0.0, 3.0), 3), "for_s": round(random.uniform(least_s, most_s), 3)}


def lossy(random: Random, craft: Craft) -> list[Fault]:
    """Duplicates and frames out of order, all the time; loss and jitter are the link's own (`LOSSY`)."""
    return [
        {"kind": "duplicate", "probability": 0.05, "copies": 1, "later_ms": round(random.uniform(0.0, 40.0), 1)},
        {"kind": "reorder", "probability": 0.05, "behind": random.randint(1, 3)},
    ]


LOSSY: Keys = {"mock.link.loss": 0.2, "mock.link.jitter_ms": 50.0}
"""20 % of the frames lost each way, each up to 50 ms later than the 10 ms that all take."""


def _drop(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "drop", "probability": round(random.uniform(0.05, 0.5), 2), **_anywhere(random, 0.5, 30.0)}]


def _drop_one_way(random: Random, craft: Craft) -> list[Fault]:
    way = random.choice(("to_vehicle", "from_vehicle"))
    return [{"kind": "drop", "direction": way, "probability": 0.9, **_anywhere(random, 0.1, 5.0)}]


def _delay(random: Random, craft: Craft) -> list[Fault]:
    way = random.choice(("both", "to_vehicle", "from_vehicle"))
    return [{"kind": "delay", "direction": way, "delay_ms": random.randint(5, 150), **_window(random, 0.2, 5.0)}]


def _jitter(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "jitter", "jitter_ms": random.randint(5, 80), **_anywhere(random, 0.5, 30.0)}]


def _duplicate(random: Random, craft: Craft) -> list[Fault]:
    return [
        {
            "kind": "duplicate",
            "copies": random.randint(1, 3),
            "later_ms": random.randint(0, 1500),
            "probability": 0.3,
            **_anywhere(random, 1.0, 30.0),
        }
    ]


def _reorder(random: Random, craft: Craft) -> list[Fault]:
    return [
        {
            "kind": "reorder",
            "behind": random.randint(1, 60),
            "probability": round(random.uniform(0.05, 0.3), 2),
            **_anywhere(random, 1.0, 30.0),
        }
    ]


def _corrupt(random: Random, craft: Craft) -> list[Fault]:
    return [
        {
            "kind": "corrupt",
            "bits": random.randint(1, 30),
            "probability": round(random.uniform(0.05, 0.4), 2),
            **_anywhere(random, 0.5, 30.0),
        }
    ]


def _refuse(random: Random, craft: Craft) -> list[Fault]:
    result = random.choice(("TEMPORARILY_REJECTED", "DENIED", "UNSUPPORTED", "FAILED"))
    times = random.choice((1, 1, 2, 5))
    return [{"kind": "refuse", "command": random.choice(COMMANDS), "result": result, "times": times}]


def _ack_only(random: Random, craft: Craft) -> list[Fault]:
    times = random.choice((1, 1, 2, 3))
    return [{"kind": "ack_without_acting", "command": random.choice(COMMANDS), "times": times}]


def _late_answer(random: Random, craft: Craft) -> list[Fault]:
    late_s = round(random.uniform(0.05, 4.0), 2)
    return [
        {"kind": "late_answer", "command": random.choice(COMMANDS), "late_s": late_s, "times": random.randint(1, 3)}
    ]


def _silent(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "silent", **_anywhere(random, 0.05, 6.0)}]


def _deaf(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "deaf", **_anywhere(random, 0.05, 6.0)}]


def _stream_stops(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "stream_stops", "message": random.choice(STREAMS), **_anywhere(random, 0.05, 10.0)}]


def _nan(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "nan_pose", **_anywhere(random, 0.01, 3.0)}]


def _clock_jump(random: Random, craft: Craft) -> list[Fault]:
    jump_s = random.choice((-1.0, 1.0)) * 10.0 ** random.uniform(-2.0, 3.0)
    return [{"kind": "clock_jump", "jump_s": round(jump_s, 3), **_moment(random)}]


def _second_vehicle(random: Random, craft: Craft) -> list[Fault]:
    twin = random.random() < 0.5
    stranger: Fault = {"looks": "forged", "mavlink": random.choice((1, 2)), "heartbeat_hz": random.choice((1, 170))}
    return [{"kind": "second_vehicle", **({"mavlink": 1} if twin else stranger), **_window(random, 0.5, 10.0)}]


def _pilot(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "mode_change", "mode": random.choice(craft.pilots), **_moment(random)}]


def _pilot_on_a_bad_link(random: Random, craft: Craft) -> list[Fault]:
    return [*_pilot(random, craft), *lossy(random, craft)]


def _geofence(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "geofence_breach", **_moment(random)}]


def _estimator_reset(random: Random, craft: Craft) -> list[Fault]:
    offset = [round(random.uniform(-1.5, 1.5), 2) for _ in range(3)]
    return [{"kind": "estimator_reset", "offset_ned_m": offset, **_moment(random)}]


def _battery(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "low_battery", "remaining": round(random.uniform(0.02, 0.2), 2), **_moment(random)}]


def _payload(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "payload_drop", **_moment(random)}]


def _weak_rotor(random: Random, craft: Craft) -> list[Fault]:
    share = round(random.uniform(0.85, 0.99), 2)
    return [{"kind": "weak_rotor", "rotor": random.randint(1, 4), "share": share, **_moment(random)}]


def _wind(random: Random, craft: Craft) -> list[Fault]:
    change = [round(random.uniform(-5.0, 5.0), 1), round(random.uniform(-5.0, 5.0), 1), 0.0]
    return [{"kind": "wind_step", "change_ned_m_s": change, **_moment(random)}]


def _ground(kind: str, **keys: object) -> Draw:
    return lambda random, craft: [{"kind": kind, "at_s": round(random.uniform(0.05, 1.5), 3), **keys}]


SURVIVABLE = (
    _scenario("drop", _drop),
    _scenario("drop, 90 % one way", _drop_one_way),
    _scenario("delay", _delay),
    _scenario("jitter", _jitter),
    _scenario("duplicate", _duplicate),
    _scenario("reorder", _reorder),
    _scenario("corrupt", _corrupt),
    _scenario("refuse", _refuse),
    _scenario("ack_without_acting", _ack_only),
    _scenario("late_answer", _late_answer),
    _scenario("silent", _silent),
    _scenario("deaf", _deaf),
    _scenario("stream_stops", _stream_stops),
    _scenario("nan_pose", _nan),
    _scenario("clock_jump", _clock_jump),
    _scenario("second_vehicle", _second_vehicle),
    _scenario("mode_change", _pilot),
    _scenario("mode_change, bad link", _pilot_on_a_bad_link, mock__link__loss=0.2, mock__link__jitter_ms=50.0),
    _scenario("geofence_breach", _geofence),
    _scenario("estimator_reset", _estimator_reset),
    _scenario("low_battery", _battery),
    _scenario("payload_drop", _payload, mock__vehicle__payload_kg=0.3),
    _scenario("weak_rotor, 85 % or more", _weak_rotor),
    _scenario("wind_step", _wind),
    _scenario("reboot on the ground", _ground("reboot", down_s=1.0)),
    _scenario("die on the ground", _ground("die")),
)


def _in_control(random: Random) -> float:
    """A moment at which the law flies, from the takeoff on."""
    return round(random.uniform(7.3, 8.3), 3)


def _while_flying(kind: str, **keys: object) -> Draw:
    return lambda random, craft: [{"kind": kind, "since": "takeoff", "at_s": _in_control(random), **keys}]


def _deaf_for_ever(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "deaf", "since": "takeoff", "from_s": _in_control(random)}]


def _nearly_deaf(random: Random, craft: Craft) -> list[Fault]:
    return [{"kind": "deaf", "since": "takeoff", "from_s": _in_control(random), "for_s": 0.5}]


HOPELESS = (
    _scenario("reboot in the air", _while_flying("reboot", down_s=2.0)),
    _scenario("die in the air", _while_flying("die")),
    _scenario("a rotor stands still", _while_flying("weak_rotor", rotor=1, share=0.0)),
    _scenario("uplink silent for 0.5 s", _nearly_deaf),
    _scenario("uplink silent for ever", _deaf_for_ever),
)
