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
PHASE = "lasts less than the second between two HEARTBEATs, and whether one falls into it is chance"
LANDINGS = "recorded landings from 5 m took 11 to 17 s each, the mock's take 11"
CRASH = "the mock tells of a crash, which PX4 does not notice"
LOG_FILE = "the mock writes no log file"

REASONS: tuple[Reason, ...] = (
    Reason("px4", r"no text '\[logger\]", LOG_FILE),
    Reason("px4-v1.13.3-d", r"no text 'Failsafe mode deactivated'.* DO_SET_MODE", BEFORE, excused=True),
    Reason("px4-v1.13.3-(a|c)", r"text of the mock alone 'Connection to ground station lost'", BEFORE),
    Reason(r"px4-v1\.1\d\.\d-a$", r"'(Landing detected|Disarmed by landing)'", LANDINGS),
    Reason("px4-v1.13.3-d", r"4\d\.\d s: text of the mock alone '(Crash detected|Disarmed by crash)", CRASH),
    Reason("px4-v1.13.3-d", r"4\d\.\d s: no text|states 0x6040000/157/5", f"{DRIFT}; {CRASH}"),
    Reason("px4-v1.16.2-b", r"states none, mock 0x60000/1/", DRIFT),
    Reason("arducopter-4.7-b", r"'(SIM Hit ground|Disarming motors)|states .*(0x9|0x4/89)", DRIFT),
    Reason("arducopter-4.7-c", r"states .*0x./(81|217)/3", PHASE),
)


def reason_of(recording: str, difference: str) -> Reason | None:
    """The reason that is known for a difference, if any."""
    for reason in REASONS:
        if re.match(reason.recording, recording) and re.search(reason.pattern, difference):
            return reason
    return None
