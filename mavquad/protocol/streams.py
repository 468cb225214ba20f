"""Which message streams are asked for, and what really arrives: an ACK does not say what one gets."""

from __future__ import annotations

from collections import Counter, deque

from pydantic import Field

from mavquad.endpoint import NEVER_US, grid_us
from mavquad.protocol.codec import mavlink
from mavquad.protocol.command import Command, set_interval
from mavquad.protocol.firmware import Firmware
from mavquad.schema import Section

WINDOW_US = 1_000_000
LEAST_WINDOW_S = 1.5
TIMES_AGAIN = 5
GAP_PERIODS, LEAST_GAP_US = 4, 40_000
"""In flight a pose stream that is silent so long is asked for again, and so on while the silence lasts."""


class StreamParams(Section):
    """Rates asked of the vehicle, and what is enough to fly on."""

    position_hz: float = Field(default=100.0, ge=10.0, le=500.0)
    """LOCAL_POSITION_NED. The law is stepped by it."""
    attitude_hz: float = Field(default=100.0, ge=10.0, le=500.0)
    """ATTITUDE."""
    least_share: float = Field(default=0.6, gt=0.0, le=1.0)
    """The share of the rate asked for that must really arrive before we fly."""


def wanted(params: StreamParams, firmware: Firmware) -> tuple[tuple[str, int, float], ...]:
    """(name, message id, rate in Hz) of every stream that the agent sets; 0 Hz switches one off."""
    return (
        ("ATTITUDE", mavlink.MAVLINK_MSG_ID_ATTITUDE, params.attitude_hz),
        ("LOCAL_POSITION_NED", mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, params.position_hz),
        ("ATTITUDE_TARGET", mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET, 10.0),
        ("SYS_STATUS", mavlink.MAVLINK_MSG_ID_SYS_STATUS, 2.0),
        ("EXTENDED_SYS_STATE", mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 5.0),
        ("BATTERY_STATUS", mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, 1.0),
        (*firmware.estimator, 5.0),
        ("ATTITUDE_QUATERNION", mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 0.0),
        ("GLOBAL_POSITION_INT", mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 0.0),
        ("HIGHRES_IMU", mavlink.MAVLINK_MSG_ID_HIGHRES_IMU, 0.0),
        ("ODOMETRY", mavlink.MAVLINK_MSG_ID_ODOMETRY, 0.0),
    )


def requests(params: StreamParams, firmware: Firmware) -> list[Command]:
    """The commands that ask for the wanted streams."""
    return [set_interval(name, message_id, rate_hz) for name, message_id, rate_hz in wanted(params, firmware)]


_POSE = (mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED)


def _gap_us(rate_hz: float) -> int:
    return max(grid_us(GAP_PERIODS / rate_hz), LEAST_GAP_US)


class StreamKeeper:
    """Asks again for streams that do not come as they were asked for.

    The ACK of SET_MESSAGE_INTERVAL does not say which message it is for, so on a lossy link the answer to a request that was
    repeated may be taken for that to the next one; an autopilot acknowledges what it then does not send; and somebody else on
    the same link may ask for another rate: MAVProxy sets ArduPilot's streams to 4 Hz every 15 s.
    """

    def __init__(self, params: StreamParams, firmware: Firmware) -> None:
        self._params = params
        self._counts: Counter[int] = Counter()
        self.restart(firmware)

    def restart(self, firmware: Firmware) -> None:
        """Streams are asked for from now on; what came before does not count."""
        self._asked = {number: (name, rate_hz) for name, number, rate_hz in wanted(self._params, firmware) if rate_hz}
        self._left = dict.fromkeys(self._asked, TIMES_AGAIN)
        self._since_us: int | None = None
        self._counts.clear()
        # Every pose message asks for it: worked out once.
        self._gap_us = {number: _gap_us(self._asked[number][1]) for number in _POSE}
        self._due_us = dict.fromkeys(_POSE, NEVER_US)

    def on_message(self, number: int, now_us: int) -> None:
        """A message of this id arrived."""
        self._counts[number] += 1
        if number in self._due_us:
            self._due_us[number] = now_us + self._gap_us[number]

    def gap_deadline_us(self) -> int:
        """When the first pose stream has been silent for too long."""
        return min(self._due_us.values())

    def after_gap(self, now_us: int) -> list[Command]:
        """What to ask for once more since it is silent; at once, before a guard counts it as lost."""
        silent = [number for number, due_us in self._due_us.items() if now_us >= due_us]
        for number in silent:
            self._due_us[number] = now_us + self._gap_us[number]
        return [self._request(number) for number in silent]

    def _request(self, number: int) -> Command:
        name, rate_hz = self._asked[number]
        return set_interval(name, number, rate_hz)

    def again(self, now_us: int) -> list[Command]:
        """To be called now and then: what to ask for once more, each a few times."""
        since_us, window_s = self._since_us, 0.0 if self._since_us is None else (now_us - self._since_us) * 1e-6
        if since_us is not None and window_s < LEAST_WINDOW_S:
            return []
        short = [number for number in self._asked if since_us is not None and self._is_short(number, window_s)]
        self._since_us = now_us
        self._counts.clear()
        for number in short:
            self._left[number] -= 1
        return [self._request(number) for number in short]

    def _is_short(self, number: int, window_s: float) -> bool:
        least = self._params.least_share * self._asked[number][1] * window_s
        return self._left[number] > 0 and self._counts[number] + 1 < least


class StreamMonitor:
    """Counts arrivals of one message over the last second."""

    def __init__(self) -> None:
        self._arrivals_us: deque[int] = deque()

    def on_message(self, now_us: int) -> None:
        """One arrived."""
        self._arrivals_us.append(now_us)
        while self._arrivals_us[0] <= now_us - WINDOW_US:
            self._arrivals_us.popleft()

    def rate_hz(self, now_us: int) -> float:
        """Arrivals in the second that ends now."""
        return float(sum(1 for arrival_us in self._arrivals_us if arrival_us > now_us - WINDOW_US))


def shortfalls(params: StreamParams, monitors: dict[str, StreamMonitor], now_us: int) -> list[str]:
    """The pose streams that do not reach their least rate, in words; empty when all is well."""
    asked = {"ATTITUDE": params.attitude_hz, "LOCAL_POSITION_NED": params.position_hz}
    return [
        f"{name} arrives at {monitors[name].rate_hz(now_us):.0f} Hz, {rate_hz:g} Hz asked"
        for name, rate_hz in asked.items()
        if monitors[name].rate_hz(now_us) < params.least_share * rate_hz
    ]
