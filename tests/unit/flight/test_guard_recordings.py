"""The guards over recordings of real autopilots, with their defaults: quiet flights trip nothing, and what went wrong does.

The recordings are not part of the project; MAVQUAD_TLOGS says where they are.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from mavquad.flight.guard_set import GuardSections, GuardSet
from mavquad.protocol.codec import decode, frame_sequence, frame_source, is_known, mavlink, message_id
from mavquad.protocol.messages import attitude_from, position_from
from mavquad.tlog import read_records

LOGS = Path(os.environ.get("MAVQUAD_TLOGS") or Path(__file__).resolve().parents[4] / "shared" / "tlogs")
IN_THE_AIR_M = 1.0


class Flown:
    """Feeds a recording to the guards, each newer pose once; `tripped` has the first words of each guard in the air."""

    def __init__(self, prefix):
        paths = sorted(LOGS.glob(f"{prefix}*.tlog"))
        if not paths:
            pytest.skip(f"no recording {prefix} in {LOGS}")
        self.guards = GuardSet(GuardSections())
        self.tripped = {}
        self.height_m = 0.0
        self._newest = {}
        for record in read_records(paths[0]):
            if is_known(record.frame) and frame_source(record.frame) == (1, 1):
                self._take(record.frame, record.stamp_us)

    def _take(self, frame, now_us):
        self._keep(self.guards.on_frame(frame_sequence(frame), now_us))
        number = message_id(frame)
        if number in GuardSet.MESSAGES:
            self._keep(self.guards.on_message(decode(frame), now_us))
        elif number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            position = position_from(decode(frame))
            self.height_m = position.position_nwu_m[2]
            self._pose(number, position, self.guards.on_position, now_us)
        elif number == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            self._pose(number, attitude_from(decode(frame)), self.guards.on_attitude, now_us)

    def _pose(self, number, sample, take, now_us):
        if sample.stamp_us > self._newest.get(number, -1):
            self._newest[number] = sample.stamp_us
            self._keep(take(sample, now_us))

    def _keep(self, tripped):
        if tripped is not None and self.height_m > IN_THE_AIR_M:
            self.tripped.setdefault(tripped.name, tripped.words)


@pytest.mark.parametrize("prefix", ["px4-v1.13.3-a", "px4-v1.16.2-b", "arducopter-4.7-a", "arducopter-4.7-b"])
def test_quiet_flights(prefix):
    assert Flown(prefix).tripped == {}


def test_arducopter_that_runs_away_with_its_last_setpoint():
    """20 deg/s of roll held for 3 s: 18 m/s at the end."""
    assert Flown("arducopter-4.7-c2").tripped == {"speed": "10.0 m/s, 10 allowed"}


def test_frames_forged_with_the_vehicles_own_id_break_its_sequence():
    assert "link loss" in Flown("ac_wlichon_hbspoof").tripped
