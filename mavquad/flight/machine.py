"""The flight as a transition table: what affects a transition lives in it.

    CONNECTING -> IDENTIFYING -> PREPARING -> WAITING -> ARMING -> TAKING_OFF -> ENGAGING -> FLYING -> HANDING_BACK
               -> LANDING -> RESTORING -> DONE

and, where it must be seen first whether the vehicle takes torques, WAITING -> PROBING -> WITHDRAWING -> WAITING.

A pair (phase, event) that stands in the table moves to the phase beside it; every other pair stays where it is.
What the agent does on entering a phase is its own business; the table knows neither time nor messages.
"""

from __future__ import annotations

from enum import Enum


class Phase(Enum):
    """Where the flight is."""

    CONNECTING = "connecting"
    IDENTIFYING = "identifying"
    PREPARING = "preparing"
    WAITING = "waiting"
    PROBING = "probing"
    WITHDRAWING = "withdrawing"
    ARMING = "arming"
    TAKING_OFF = "taking off"
    ENGAGING = "engaging"
    FLYING = "flying"
    HANDING_BACK = "handing back"
    LANDING = "landing"
    DISARMING = "disarming"
    RESTORING = "restoring"
    DONE = "done"


class Event(Enum):
    """What happened."""

    FOUND = "vehicle found"
    IDENTIFIED = "version, parameters and streams are known"
    PREPARED = "its parameters are as wanted"
    READY = "ready to arm"
    UNPROVEN = "ready to arm, but for whether it takes torques"
    PROVEN = "it takes torques"
    ARMED = "armed"
    AIRBORNE = "hovering at the takeoff altitude"
    ENGAGED = "HEARTBEAT shows the offboard mode"
    MISSION_OVER = "the mission is over"
    RELEASED = "HEARTBEAT shows a mode of the autopilot's own"
    LEFT = "HEARTBEAT shows the mode that it is left in"
    LANDED = "on the ground, still armed"
    DISARMED = "disarmed"
    REFUSED = "the vehicle refused"
    TIMEOUT = "no answer, or not in time"
    GUARD = "a guard tripped"
    TAKEN_OVER = "a mode that we did not ask for"
    LOST = "the vehicle is silent"
    RESTORED = "its parameters are as they were"
    STOP = "the operator stops"


# Taken over, lost: nothing is sent any more, in whatever phase.
_ALWAYS = {Event.TAKEN_OVER: Phase.DONE, Event.LOST: Phase.DONE}
_BEFORE_ARMING = {**_ALWAYS, Event.REFUSED: Phase.DONE, Event.TIMEOUT: Phase.DONE, Event.STOP: Phase.DONE}
# From here on there may be parameters to put back.
_ON_GROUND = {
    **_ALWAYS,
    Event.REFUSED: Phase.RESTORING,
    Event.TIMEOUT: Phase.RESTORING,
    Event.STOP: Phase.RESTORING,
}

TRANSITIONS: dict[Phase, dict[Event, Phase]] = {
    Phase.CONNECTING: {**_BEFORE_ARMING, Event.FOUND: Phase.IDENTIFYING},
    Phase.IDENTIFYING: {**_BEFORE_ARMING, Event.IDENTIFIED: Phase.PREPARING},
    Phase.PREPARING: {**_ON_GROUND, Event.PREPARED: Phase.WAITING},
    Phase.WAITING: {**_ON_GROUND, Event.READY: Phase.ARMING, Event.UNPROVEN: Phase.PROBING},
    Phase.PROBING: {
        **_ALWAYS,
        # Refused, time after time, it was never in the offboard mode; after anything else it may be.
        Event.REFUSED: Phase.RESTORING,
        Event.PROVEN: Phase.WITHDRAWING,
        Event.TIMEOUT: Phase.WITHDRAWING,
        Event.STOP: Phase.WITHDRAWING,
    },
    Phase.WITHDRAWING: {
        **_ALWAYS,
        Event.RELEASED: Phase.WAITING,
        Event.LEFT: Phase.RESTORING,
        Event.TIMEOUT: Phase.RESTORING,
    },
    Phase.ARMING: {
        **_ALWAYS,
        Event.ARMED: Phase.TAKING_OFF,
        Event.REFUSED: Phase.RESTORING,
        # It may have armed without our hearing of it.
        Event.TIMEOUT: Phase.DISARMING,
        Event.STOP: Phase.DISARMING,
    },
    Phase.TAKING_OFF: {
        **_ALWAYS,
        Event.AIRBORNE: Phase.ENGAGING,
        Event.REFUSED: Phase.DISARMING,
        Event.TIMEOUT: Phase.LANDING,
        Event.STOP: Phase.LANDING,
        Event.DISARMED: Phase.RESTORING,
    },
    Phase.ENGAGING: {
        **_ALWAYS,
        Event.ENGAGED: Phase.FLYING,
        # The vehicle may be in the offboard mode all the same, so these leave it by the front door.
        Event.REFUSED: Phase.HANDING_BACK,
        Event.TIMEOUT: Phase.HANDING_BACK,
        Event.GUARD: Phase.HANDING_BACK,
        Event.STOP: Phase.HANDING_BACK,
        Event.DISARMED: Phase.RESTORING,
    },
    Phase.FLYING: {
        **_ALWAYS,
        Event.MISSION_OVER: Phase.HANDING_BACK,
        Event.GUARD: Phase.HANDING_BACK,
        Event.STOP: Phase.HANDING_BACK,
        Event.DISARMED: Phase.RESTORING,
    },
    Phase.HANDING_BACK: {
        **_ALWAYS,
        Event.RELEASED: Phase.LANDING,
        Event.LEFT: Phase.DONE,
        # No answer to the hold mode: try to land from where it is.
        Event.REFUSED: Phase.LANDING,
        Event.TIMEOUT: Phase.LANDING,
        Event.DISARMED: Phase.RESTORING,
    },
    Phase.LANDING: {
        **_ALWAYS,
        # A refusal to land is asked again, until the limit.
        Event.DISARMED: Phase.RESTORING,
        Event.LANDED: Phase.DISARMING,
        Event.TIMEOUT: Phase.DONE,
    },
    Phase.DISARMING: {
        **_ALWAYS,
        Event.DISARMED: Phase.RESTORING,
        Event.REFUSED: Phase.RESTORING,
        Event.TIMEOUT: Phase.RESTORING,
    },
    Phase.RESTORING: {**_ALWAYS, Event.RESTORED: Phase.DONE, Event.TIMEOUT: Phase.DONE},
    Phase.DONE: {},
}

ON_GROUND = frozenset(
    (Phase.CONNECTING, Phase.IDENTIFYING, Phase.PREPARING, Phase.WAITING, Phase.PROBING, Phase.WITHDRAWING)
)
"""Phases in which the vehicle is disarmed."""

IN_FLIGHT = frozenset((Phase.TAKING_OFF, Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK, Phase.LANDING))
"""Phases in which the vehicle may be in the air."""


def next_phase(phase: Phase, event: Event) -> Phase:
    """Where `event` leads from `phase`; the same phase where the table has no row."""
    return TRANSITIONS[phase].get(event, phase)
