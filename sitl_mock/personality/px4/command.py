"""A command as its handlers get it, and the results they may give."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from mavquad.protocol.codec import mavlink
from sitl_mock.personality import Sender
from sitl_mock.port import Port

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED: int = mavlink.MAV_RESULT_DENIED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
FAILED: int = mavlink.MAV_RESULT_FAILED
INFO: int = mavlink.MAV_SEVERITY_INFO
CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL

Params = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Command:
    """The seven parameters (latitude and longitude of COMMAND_INT in degrees), who sent it, and where and when."""

    params: Params
    sender: Sender
    port: Port
    boot_us: int

    def whole(self, number: int) -> int:
        """A parameter, counted from 1, as a whole number; NaN, which clients send for "not used", and infinity are 0."""
        value = self.params[number - 1]
        return int(value) if math.isfinite(value) else 0


Handler = Callable[[Command], list[int]]
"""Obeys a command; the results to acknowledge it with."""
