"""STATUSTEXTs: whole (their chunks joined), without what differs from run to run, and matched between two sides."""

from __future__ import annotations

import re
from dataclasses import dataclass

from tests.conformance.recording import Recording

MATCH_US = 500_000
_VARYING = ((re.compile(r"\./log/\S+"), "./log/*"), (re.compile(r"(Hit ground at) [\d.]+"), r"\1 *"))


@dataclass(frozen=True, slots=True)
class Text:
    """One STATUSTEXT."""

    at_us: int
    severity: int
    text: str

    @property
    def key(self) -> tuple[int, str]:
        """What must agree; the name of a log file and the speed of a touch-down are left out."""
        text = self.text
        for pattern, instead in _VARYING:
            text = pattern.sub(instead, text)
        return (self.severity, text)

    def __str__(self) -> str:
        return f"{self.text.strip()!r} ({self.severity})"


def texts_of(recording: Recording) -> list[Text]:
    """Every STATUSTEXT of the vehicle."""
    found: list[Text] = []
    for at_us, message in recording.vehicle:
        if message.get_type() != "STATUSTEXT":
            continue
        if message.chunk_seq and found:
            last = found.pop()
            found.append(Text(last.at_us, last.severity, last.text + message.text))
        else:
            found.append(Text(at_us, message.severity, message.text))
    return found


def unmatched(real: list[Text], mock: list[Text], within_us: int = MATCH_US) -> tuple[list[Text], list[Text]]:
    """What only the real one said, and what only the mock said; each text matches one of the other side at most."""
    left = list(mock)
    missing = []
    for text in real:
        near = [other for other in left if other.key == text.key and abs(other.at_us - text.at_us) <= within_us]
        if near:
            left.remove(min(near, key=lambda other: abs(other.at_us - text.at_us)))
        else:
            missing.append(text)
    return missing, left
