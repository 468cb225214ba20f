"""The guards beside a flying mock of either personality: quiet while all is well, and the right one when it is not."""

from __future__ import annotations

import pytest

from mavquad.flight.guard_set import GuardSections, GuardSet
from mavquad.protocol.codec import Encoder, decode, frame_sequence, mavlink, message_id
from mavquad.protocol.command import Command, arm, set_interval
from mavquad.protocol.link import heartbeat
from mavquad.protocol.messages import attitude_from, position_from
from mavquad.schema import parse_section
from sitl_mock import VirtualVehicle

NAN = float("nan")
RATE_HZ = 100.0
STREAMS = {
    "ATTITUDE": mavlink.MAVLINK_MSG_ID_ATTITUDE,
    "LOCAL_POSITION_NED": mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
}
TAKEOFF_M = 5.0
TAKEOFFS = {
    "px4": [Command("take off", 22, (NAN, 0.0, 0.0, NAN, NAN, NAN, NAN))],
    "ardupilot": [Command("take off", 22, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, TAKEOFF_M))],
}
FIRMWARES = {"px4": "1.16", "ardupilot": "4.7"}
GUIDED = Command("GUIDED", 176, (1.0, 4.0))


class Watched:
    """A vehicle in the air, by its autopilot's own control, and the guards that hear all that it sends."""

    def __init__(self, autopilot: str, **guards: object) -> None:
        self.vehicle = VirtualVehicle(autopilot, FIRMWARES[autopilot])
        self.guards = GuardSet(parse_section(GuardSections, guards, "test", "guards"))
        self.tripped: list[str] = []
        self._encoder = Encoder(245, 190)
        self._outlet = self.vehicle.outlet()
        self.vehicle.every(1.0, lambda: self._send(heartbeat()))
        self.vehicle.every(0.1, self._ask_time)
        self._climb(autopilot)
        self.tripped.clear()
        self.guards.begin(RATE_HZ, RATE_HZ, self.vehicle.now_us)

    def _send(self, message: object) -> None:
        self._outlet.write(self._encoder.encode(message))

    def _ask_time(self) -> None:
        self._send(mavlink.MAVLink_timesync_message(0, self.vehicle.now_us * 1000))

    def _climb(self, autopilot: str) -> None:
        streams = [set_interval(name, number, RATE_HZ) for name, number in STREAMS.items()]
        streams.append(set_interval("SYS_STATUS", mavlink.MAVLINK_MSG_ID_SYS_STATUS, 5.0))
        mode = [GUIDED] if autopilot == "ardupilot" else []
        self.run(3.0)
        for command in [*streams, *mode, arm(), *TAKEOFFS[autopilot]]:
            self._send(command.message((1, 1), 0))
            self.run(0.5)
        self.run(8.0)
        assert -self.vehicle.truth.position_ned_m[2] > 2.0, self.vehicle.report()

    def run(self, seconds: float) -> list[str]:
        """Let time pass; the names of the guards that tripped in it, each once, in order."""
        self.vehicle.run(seconds)
        while self._outlet.inbox:
            stamp_us, frame = self._outlet.inbox.popleft()
            self._take(frame, stamp_us)
        return list(dict.fromkeys(self.tripped))

    def _take(self, frame: bytes, now_us: int) -> None:
        number, message = message_id(frame), decode(frame)
        said = [self.guards.on_frame(frame_sequence(frame), now_us)]
        if number in GuardSet.MESSAGES:
            said.append(self.guards.on_message(message, now_us))
        elif number == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            said.append(self.guards.on_attitude(attitude_from(message), now_us))
        elif number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            said.append(self.guards.on_position(position_from(message), now_us))
        elif number == mavlink.MAVLINK_MSG_ID_TIMESYNC and message.tc1 != 0:
            said.append(self.guards.on_round_trip(now_us - message.ts1 // 1000))
        self.tripped += [tripped.name for tripped in said if tripped is not None]


AT_ONCE = {"at_s": 0.0}
FROM_NOW = {"from_s": 0.0, "for_s": 60.0}
FAULTS = {
    "jump": ("estimator_reset", {"offset_ned_m": [0.0, 1.0, 0.0], **AT_ONCE}),
    "battery": ("low_battery", {"remaining": 0.1, **AT_ONCE}),
    "rate": ("drop", {"direction": "from_vehicle", "message": "ATTITUDE", "probability": 0.8, **FROM_NOW}),
    "link loss": ("drop", {"direction": "from_vehicle", "probability": 0.8, **FROM_NOW}),
    "round trip": ("delay", {"delay_ms": 300.0, **FROM_NOW}),
}


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def autopilot(request):
    return request.param


@pytest.mark.parametrize("fault", FAULTS)
def test_each_in_the_air(autopilot, fault):
    watched = Watched(autopilot, rate={"share": 0.5 if fault == "rate" else 0.0})
    assert watched.run(3.0) == []
    kind, keys = FAULTS[fault]
    watched.vehicle.fail(kind, **keys)
    assert watched.run(4.0) == ["link loss" if fault == "round trip" else fault]


def test_speed(autopilot):
    watched = Watched(autopilot, speed={"limit_m_s": 0.01})
    assert watched.run(1.0) == ["speed"]


def test_a_ground_station_that_was_never_there(autopilot):
    watched = Watched(autopilot, gcs_loss={"silent_s": 3.0})
    deadline_us = watched.guards.next_deadline_us()
    assert watched.guards.not_ready() == "no HEARTBEAT of a ground station (guards.gcs_loss)"
    assert watched.guards.on_deadline(deadline_us).name == "GCS loss"
