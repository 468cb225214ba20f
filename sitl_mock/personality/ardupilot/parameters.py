"""ArduCopter's parameters: the whole table of 4.7's SITL, as floats on the wire, sent in bursts.

An unknown name is not answered, neither asked for nor set.
"""

from __future__ import annotations

import math
from functools import cache

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.personality.parameter_table import Parameter, load_parameters
from sitl_mock.port import Port

NO_INDEX = 65535
"""PARAM_VALUE.param_index of a value that was not asked for in a list."""
_BURST_US = 96_000
_BURST = 221
"""A list of 1348 came in seven bursts of 221, one every 96 ms."""
_READ_AFTER_US = 99_000
_RANGES: dict[int, tuple[int, int]] = {
    mavlink.MAV_PARAM_TYPE_INT8: (-128, 127),
    mavlink.MAV_PARAM_TYPE_INT16: (-32768, 32767),
    mavlink.MAV_PARAM_TYPE_INT32: (-(2**31), 2**31 - 1),
}


def _rows() -> tuple[Parameter, ...]:
    return load_parameters(__package__, "parameters.csv")


@cache
def _index() -> dict[str, int]:
    return {row.name: index for index, row in enumerate(_rows())}


class Parameters:
    """The values in force, and the answers to the parameter messages of each port.

    Attributes:
        version: grows with every change.
    """

    def __init__(self, changed: dict[str, float]) -> None:
        self._values = {row.name: float(row.value) for row in _rows()} | changed
        self.version = 0
        self._lists: dict[Port, int] = {}
        self._list_due_us: dict[Port, int] = {}
        self._reads: list[tuple[int, Port, str, int]] = []

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    @property
    def stored(self) -> dict[str, float]:
        """What the vehicle's memory holds, by name."""
        return self._values

    def set(self, name: str, value: float) -> None:
        """Change a value, kept within its type; NaN and infinity change nothing."""
        if math.isfinite(value):
            self.version += 1
            whole = _RANGES.get(_rows()[_index()[name]].wire_type)
            self._values[name] = value if whole is None else float(max(whole[0], min(whole[1], int(value))))

    def is_listing(self, port: Port) -> bool:
        """Whether a list is being sent there."""
        return port in self._lists

    def request_list(self, port: Port, boot_us: int) -> None:
        """Send everything, from now on; a second request starts anew."""
        self._lists[port], self._list_due_us[port] = 0, boot_us + _BURST_US

    def request(self, message: Message, port: Port, boot_us: int) -> None:
        """Obey PARAM_REQUEST_READ, after a while as the real one; one asked for by name comes without index, if at all."""
        name, index = _name(message.param_id), NO_INDEX
        if message.param_index >= 0:
            rows, index = _rows(), message.param_index
            name = rows[index].name if index < len(rows) else ""
        if name in self._values:
            self._reads.append((boot_us + _READ_AFTER_US, port, name, index))

    def obey_set(self, message: Message) -> str | None:
        """Obey PARAM_SET; the name that was set, None for one that is not there or a value that is no number."""
        name = _name(message.param_id)
        if name not in self._values or not math.isfinite(message.param_value):
            return None
        self.set(name, message.param_value)
        return name

    def step(self, boot_us: int) -> None:
        """Send what is due of lists and reads."""
        while self._reads and self._reads[0][0] <= boot_us:
            _, port, name, index = self._reads.pop(0)
            port.send(self.message(name, index))
        for port in list(self._lists) if self._lists else ():
            if boot_us >= self._list_due_us[port]:
                self._send_burst(port)

    def _send_burst(self, port: Port) -> None:
        first = self._lists[port]
        for index, row in enumerate(_rows()[first : first + _BURST], first):
            port.send(self.message(row.name, index))
        self._lists[port] += _BURST
        self._list_due_us[port] += _BURST_US
        if self._lists[port] >= len(_rows()):
            del self._lists[port], self._list_due_us[port]

    def message(self, name: str, index: int = NO_INDEX) -> Message:
        """PARAM_VALUE of a parameter: its number as a float, whatever its type."""
        rows = _rows()
        kind = rows[_index()[name]].wire_type
        return mavlink.MAVLink_param_value_message(name.encode(), self._values[name], kind, len(rows), index)


def _name(param_id: str | bytes) -> str:
    text = param_id if isinstance(param_id, str) else param_id.decode("ascii", "replace")
    return text.split("\0", 1)[0]
