"""A pilot of the ArduCopter personality, in virtual time."""

from __future__ import annotations

import copy
from functools import cache

import pytest

from mavquad.protocol.codec import mavlink

STABILIZE, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE, GUIDED_NOGPS = 0, 3, 4, 5, 6, 9, 17, 20
POSITION, VELOCITY, ACCELERATION = 0xDF8, 0xDC7, 0xC3F
_HOVERING = {}


@cache
def _copter_class(pilot):
    class Copter(pilot):
        """Sends commands as to an ArduCopter."""

        def __init__(self, seed=1, **config):
            super().__init__(seed, autopilot="ardupilot", **config)

        def mode(self, number):
            return self.command(176, 1, number)

        def set(self, name, value):
            return self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, 9))

        def local(self, mask, place=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), acceleration=(0.0, 0.0, 0.0), **given):
            yaw, yaw_rate = given.get("yaw", 0.0), given.get("yaw_rate", 0.0)
            return self.send(
                mavlink.MAVLink_set_position_target_local_ned_message(
                    0, 1, 1, given.get("frame", 1), mask, *place, *velocity, *acceleration, yaw, yaw_rate
                )
            )

        def arm(self):
            """From boot to armed in GUIDED."""
            self.run(1.1).heartbeat()
            assert self.mode(GUIDED) == [0]
            assert self.command(400, 1) == [0]
            self.forget()
            return self

        def hover(self, height_m=10.0):
            """From boot to a hover in GUIDED; flown once for each configuration, then copied."""
            key = (self.seed, self.config.model_dump_json(), height_m)
            if key not in _HOVERING:
                _HOVERING[key] = copy.deepcopy(self).fly_up(height_m)
            self.__dict__ = copy.deepcopy(_HOVERING[key]).__dict__
            return self

        def fly_up(self, height_m):
            assert self.arm().command(22, 0, 0, 0, 0, 0, 0, height_m) == [0]
            for _ in range(15):
                self.run(1.0).heartbeat()
            assert abs(self.truth.position_ned_m[2] + height_m) < 0.5
            self.forget()
            return self

    return Copter


@pytest.fixture
def copter(pilot):
    """Makes pilots of an ArduCopter: `copter(seed=3, ready_s=42.5)`."""
    return _copter_class(pilot)
