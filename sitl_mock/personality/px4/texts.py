"""STATUSTEXT: goes out only where a ground station is heard, long texts in chunks of 50 characters.

PX4 ends the texts that it also sends as events with a tab, and so do all of these but two.
"""

from __future__ import annotations

from collections.abc import Sequence

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.port import Port

_GROUND_STATION_LOST_US = 5_000_000
_BACKLOG = 16
_CHUNK = 50
_WITHOUT_TAB = ("Mode not suitable for takeoff", "Arming denied! manual control lost")


def statustexts(severity: int, text: str, number: int) -> list[Message]:
    """The messages of one text; one that fills its last chunk is ended by an empty one."""
    data = (text if text in _WITHOUT_TAB else f"{text}\t").encode()[: _CHUNK * 255]
    chunks = [data[start : start + _CHUNK] for start in range(0, len(data), _CHUNK)]
    if len(data) > _CHUNK and len(chunks[-1]) == _CHUNK:
        chunks.append(b"")
    return [mavlink.MAVLink_statustext_message(severity, chunk, number, i) for i, chunk in enumerate(chunks)]


class Texts:
    """Sends the texts; while no ground station is heard the latest ones wait. `recent` may be filled at any time."""

    def __init__(self, ports: Sequence[Port], recent: list[tuple[int, str]]) -> None:
        self._ports = ports
        self._recent = recent
        self._number = 0

    def send(self, boot_us: int) -> None:
        """Send what there is."""
        if not self._recent:
            return
        ports = [port for port in self._ports if _hears_ground_station(port, boot_us)]
        if not ports:
            del self._recent[:-_BACKLOG]
            return
        for severity, text in self._recent:
            for message in statustexts(severity, text, self._number):
                for port in ports:
                    port.send(message)
            self._number = (self._number + 1) & 0xFFFF
        self._recent.clear()


def _hears_ground_station(port: Port, boot_us: int) -> bool:
    return port.ground_station_us is not None and boot_us - port.ground_station_us <= _GROUND_STATION_LOST_US
