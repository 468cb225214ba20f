"""MAVLink's numbers as the words that its users know."""

from __future__ import annotations

from mavquad.protocol.codec import Message, mavlink

_RELEASE_TYPES = ((255, ""), (192, "-rc"), (128, "-beta"), (64, "-alpha"), (0, "-dev"))
"""FIRMWARE_VERSION_TYPE: the lowest byte of a version is at least this."""
_INFO = mavlink.MAV_SEVERITY_INFO


def enum_name(enum: str, value: int, prefix: str = "") -> str:
    """An entry's name without the prefix (the enum's own name by default); the number where it has none."""
    entry = mavlink.enums[enum].get(value)
    return str(entry.name.removeprefix(prefix or f"{enum}_")) if entry else str(value)


def bit_names(enum: str, bits: int, prefix: str = "") -> tuple[str, ...]:
    """Names of the bits that are set, in the order of the enum."""
    return tuple(
        enum_name(enum, value, prefix)
        for value in mavlink.enums[enum]
        if value > 0 and value & (value - 1) == 0 and bits & value
    )


def version_name(version: int) -> str:
    """AUTOPILOT_VERSION.flight_sw_version as 1.16.2 or 4.7.0-dev."""
    numbers = ".".join(str(version >> shift & 0xFF) for shift in (24, 16, 8))
    kind = version & 0xFF
    return numbers + next(words for least, words in _RELEASE_TYPES if kind >= least)


def git_hash(message: Message) -> str:
    """The first digits of the commit that an AUTOPILOT_VERSION tells: PX4's as bytes, ArduPilot's as text."""
    custom = bytes(message.flight_custom_version)
    text = custom.rstrip(b"\0").decode("ascii", errors="replace")
    if len(text) == 8 and all(digit in "0123456789abcdef" for digit in text):
        return text
    return custom[::-1].hex()[:8] if any(custom) else ""


class Texts:
    """STATUSTEXTs, put together: what is longer than 50 characters comes in chunks of one id."""

    def __init__(self) -> None:
        self._texts: list[tuple[int, str]] = []
        self._last: tuple[int, int] = (0, 0)

    def take(self, message: Message) -> None:
        """Take in a STATUSTEXT."""
        number, chunk = int(message.id), int(message.chunk_seq)
        if number and chunk and self._last == (number, chunk - 1) and self._texts:
            severity, before = self._texts.pop()
            self._texts.append((severity, before + str(message.text)))
        else:
            self._texts.append((int(message.severity), str(message.text)))
        self._last = (number, chunk)

    @property
    def said(self) -> tuple[str, ...]:
        """What was said, in order, each once; what is said while a flight goes well left out (debug and info)."""
        return tuple(dict.fromkeys(text.strip() for severity, text in self._texts if severity < _INFO and text.strip()))
