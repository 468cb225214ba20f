"""Guard of the battery: what is left of it, and its voltage (BATTERY_STATUS, SYS_STATUS)."""

from __future__ import annotations

from pydantic import Field

from mavquad.endpoint import grid_us
from mavquad.flight.guard_types import GuardSection, Lasting, Tripped
from mavquad.protocol.codec import Message

_NO_VOLTAGE_MV = 65535


class BatteryParams(GuardSection):
    """[guards.battery]"""

    remaining_percent: float = Field(default=15.0, ge=0.0, le=100.0)
    """Charge that must be left, percent; of several batteries, in each; 0: off."""
    voltage_v: float = Field(default=0.0, ge=0.0, le=1000.0)
    """Voltage that must be left, V, under load; 0: off."""
    for_s: float = Field(default=3.0, ge=0.0, le=600.0)
    """How long either must be below, s: the voltage sags for a moment in a climb."""


class BatteryMonitor:
    """The batteries as last heard.

    Attributes:
        low: of each battery, why it is not enough, in words; -1 is SYS_STATUS's.
    """

    def __init__(self, params: BatteryParams) -> None:
        self._params = params
        self._lasting: dict[int, Lasting] = {}
        self.low: dict[int, str] = {}

    def take_battery(self, message: Message, now_us: int) -> Tripped | None:
        """The next BATTERY_STATUS; a value that the autopilot does not know says nothing."""
        cells_mv = [each for each in (*message.voltages, *message.voltages_ext) if 0 < each < _NO_VOLTAGE_MV]
        return self._take(message.id, message.battery_remaining, sum(cells_mv) * 1e-3, now_us)

    def take_sys_status(self, message: Message, now_us: int) -> Tripped | None:
        """The next SYS_STATUS, which tells of the first battery, or of all of them."""
        known = message.voltage_battery != _NO_VOLTAGE_MV
        return self._take(-1, message.battery_remaining, message.voltage_battery * 1e-3 if known else 0.0, now_us)

    def _take(self, which: int, remaining: int, voltage_v: float, now_us: int) -> Tripped | None:
        words = self._low(remaining, voltage_v)
        self.low.pop(which, None)
        if words:
            self.low[which] = words
        lasting = self._lasting.setdefault(which, Lasting(grid_us(self._params.for_s)))
        return Tripped("battery", words, self._params.reaction) if lasting.holds(bool(words), now_us) else None

    def _low(self, remaining: int, voltage_v: float) -> str:
        params = self._params
        if 0 <= remaining < params.remaining_percent:
            return f"{remaining} % of the battery left, {params.remaining_percent:g} % needed"
        if 0.0 < voltage_v < params.voltage_v:
            return f"the battery gives {voltage_v:.1f} V, {params.voltage_v:g} V needed"
        return ""
