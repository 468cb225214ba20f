"""Small logs, written message by message."""

import math
from pathlib import Path

from mavquad.protocol.codec import Encoder, mavlink
from mavquad.tlog import pack_record

START_US = 1_700_000_000_000_000
PX4_OFFBOARD = 6 << 16
PX4_LOITER = 4 << 16 | 3 << 24


class LogFile:
    """Frames of one vehicle, 1/1, and a ground station, 255/190; `at(s)` sets the time of what follows."""

    def __init__(self, with_stamps: bool = True) -> None:
        self.data = bytearray()
        self._vehicle = Encoder(1, 1)
        self._station = Encoder(255, 190)
        self._with_stamps = with_stamps
        self.now_s = 0.0

    def at(self, seconds: float) -> "LogFile":
        self.now_s = seconds
        return self

    def _boot_ms(self) -> int:
        return round(self.now_s * 1000) % 2**32

    def add(self, message: object, outbound: bool = False) -> None:
        frame = (self._station if outbound else self._vehicle).encode(message)
        stamp_us = START_US + round(self.now_s * 1e6) // 4 * 4
        self.data += pack_record(stamp_us, frame, outbound) if self._with_stamps else frame

    def heartbeat(self, custom_mode: int, armed: bool, autopilot: int = 12, vehicle_type: int = 2) -> None:
        flags = 128 if armed else 0
        self.add(mavlink.MAVLink_heartbeat_message(vehicle_type, autopilot, flags, custom_mode, 4, 3))

    def text(self, text: str, severity: int = 6) -> None:
        self.add(mavlink.MAVLink_statustext_message(severity, text.encode()))

    def attitude(self, roll: float, pitch: float, yaw: float, rates: tuple[float, float, float] = (0, 0, 0)) -> None:
        self.add(mavlink.MAVLink_attitude_message(self._boot_ms(), roll, pitch, yaw, *rates))

    def position(self, x: float, y: float, z: float, velocity: tuple[float, float, float] = (0, 0, 0)) -> None:
        self.add(mavlink.MAVLink_local_position_ned_message(self._boot_ms(), x, y, z, *velocity))

    def fix(self, lat: int, lon: int, alt: int) -> None:
        self.add(mavlink.MAVLink_global_position_int_message(self._boot_ms(), lat, lon, alt, 0, 100, 200, 300, 0))

    def write(self, path: Path) -> Path:
        path.write_bytes(self.data)
        return path


def circling(seconds: float = 10.0, rate_hz: float = 20.0) -> LogFile:
    """A vehicle that arms, circles at 5 m and 3 m radius once in 10 s, and disarms; one text of each severity."""
    log = LogFile()
    for step in range(round(seconds * rate_hz)):
        log.at(step / rate_hz)
        angle = 2 * math.pi * log.now_s / 10.0
        if step % round(rate_hz) == 0:
            log.heartbeat(PX4_OFFBOARD if 2.0 <= log.now_s < 8.0 else PX4_LOITER, armed=1.0 <= log.now_s < 9.0)
        log.attitude(0.1 * math.sin(angle), 0.1 * math.cos(angle), math.remainder(angle, 2 * math.pi))
        speed = 3.0 * 2 * math.pi / 10.0
        log.position(
            3 * math.cos(angle), 3 * math.sin(angle), -5.0, (-speed * math.sin(angle), speed * math.cos(angle), 0.0)
        )
    for severity in range(8):
        log.at(1.0 + severity).text(f"text of severity {severity}", severity)
    return log
