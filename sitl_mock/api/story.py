"""What a vehicle did, for the report of a test that failed."""

from __future__ import annotations

import math
from collections.abc import Iterable

from mavquad.protocol.codec import decode, is_valid, mavlink, message_id
from sitl_mock.autopilot import MockAutopilot, Truth

_LINES_MAX = 500


class Story:
    """Collects changes of mode, arming and landing, and the STATUSTEXTs that came.

    Attributes:
        texts: the STATUSTEXTs, in order.
    """

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._lines: list[str] = []
        self._last = ("", False, True, False)

    def see(self, time_s: float, vehicle: MockAutopilot) -> None:
        """Take notice of what the vehicle is doing."""
        now = (vehicle.mode, vehicle.armed, vehicle.landed, vehicle.crashed)
        if now == self._last:
            return
        (mode, armed, landed, crashed), self._last = self._last, now
        words = [f"mode {vehicle.mode}"] * (vehicle.mode != mode)
        words += ["armed" if vehicle.armed else "disarmed"] * (vehicle.armed != armed)
        words += ["on the ground" if vehicle.landed else "in the air"] * (vehicle.landed != landed)
        words += ["crashed"] * (vehicle.crashed and not crashed)
        if words:
            self.tell(time_s, ", ".join(words))

    def hear(self, time_s: float, frames: Iterable[bytes]) -> None:
        """Take notice of frames that reached a client; a long text comes in pieces."""
        for frame in frames:
            if len(frame) > 12 and message_id(frame) == mavlink.MAVLINK_MSG_ID_STATUSTEXT and is_valid(frame):
                message = decode(frame)
                text = message.text.rstrip("\t ")
                if message.chunk_seq and self.texts:
                    self.texts[-1] += text
                else:
                    self.texts.append(text)
                self.tell(time_s, f'says "{text}"')

    def tell(self, time_s: float, line: str) -> None:
        """Add a line."""
        self._lines.append(f"{time_s:9.3f} s  {line}")
        del self._lines[:-_LINES_MAX]

    def report(self, truth: Truth) -> str:
        """All of it, and the last state."""
        return "\n".join([*self._lines, *_state(truth)])


def _state(truth: Truth) -> list[str]:
    north, east, down = truth.position_ned_m
    speed = math.hypot(*truth.velocity_ned_m_s)
    roll, pitch, yaw = (math.degrees(angle) for angle in truth.euler_rad)
    armed, where = "armed" if truth.armed else "disarmed", "on the ground" if truth.landed else "in the air"
    return [
        f"{truth.time_s:9.3f} s  last state: {truth.mode}, {armed}, {where}{', crashed' if truth.crashed else ''}",
        f"             north {north:.2f} m, east {east:.2f} m, height {-down:.2f} m, speed {speed:.2f} m/s",
        f"             roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} degrees, battery {truth.battery.remaining:.0%}",
    ]
