"""Why differences remain. A difference counts as one whether its reason is known or not, but for the excused ones.

Excused is only what the mock cannot know or share: what follows from the recorded vehicle's life before the recording,
and what follows from setpoints replayed open loop, under which any two vehicles drift apart.
"""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Reason:
    """Why differences whose description matches `pattern` in recordings that match `recording` remain."""

    recording: str
    pattern: str
    why: str
    excused: bool = False


DRIFT = "setpoints replayed open loop: the vehicles have drifted apart"
BEFORE = "follows from what happened before the recording"
HASH = "PX4's hash leaves out the parameters that it changes by itself; which they all are is not known"

REASONS: tuple[Reason, ...] = (
    Reason("px4", r"list of (\d+) parameters, mock \1, 1 of another value \(_HASH_CHECK\)", HASH),
    Reason("px4-v1.13.3-d", r"no text 'Failsafe mode deactivated'.* DO_SET_MODE", BEFORE, excused=True),
    Reason("px4-v1.13.3-a", r"no text 'Data link regained'", BEFORE, excused=True),
    Reason("px4-v1.13.3-c-reject", r"no text 'Data link regained'", BEFORE, excused=True),
)


def reason_of(recording: str, difference: str) -> Reason | None:
    """The reason that is known for a difference, if any."""
    for reason in REASONS:
        if re.match(reason.recording, recording) and re.search(reason.pattern, difference):
            return reason
    return None
