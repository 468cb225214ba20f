"""Which modes are ours to expect in a phase; a change to any other one is the pilot's or a failsafe's."""

from __future__ import annotations

from functools import lru_cache

from mavquad.flight.guards import PILOT, RETURN, Reaction
from mavquad.flight.machine import Phase
from mavquad.protocol.firmware import Firmware, Mode


@lru_cache(maxsize=128)
def own_modes(firmware: Firmware, phase: Phase, reaction: Reaction) -> frozenset[Mode] | None:
    """The modes that may be entered in a phase without anybody having taken over; None where any may."""
    fw = firmware
    # Landing may begin right behind the takeoff command, before HEARTBEAT shows what that did.
    before_landing = () if reaction == RETURN else (fw.takeoff, fw.hover, fw.hold)
    return {
        Phase.PROBING: frozenset((fw.offboard,)),
        Phase.WITHDRAWING: frozenset((fw.offboard, fw.hold)),
        Phase.ARMING: frozenset[Mode](),
        Phase.TAKING_OFF: frozenset((fw.takeoff, fw.hover)),
        Phase.ENGAGING: frozenset((fw.takeoff, fw.hover, fw.offboard)),
        Phase.FLYING: frozenset((fw.offboard,)),
        Phase.HANDING_BACK: frozenset((fw.offboard, way_back(fw, reaction))),
        Phase.LANDING: frozenset((fw.offboard, _down(fw, reaction), *before_landing)),
    }.get(phase)


def way_back(firmware: Firmware, reaction: Reaction) -> Mode:
    """The mode that the vehicle is handed back to."""
    return {RETURN: firmware.home, PILOT: firmware.pilot}.get(reaction, firmware.hold)


def asked_for(firmware: Firmware, phase: Phase, reaction: Reaction) -> Mode | None:
    """What a phase asks for; once HEARTBEAT has shown it, leaving it is no longer a matter of course."""
    if phase is Phase.TAKING_OFF:
        return firmware.takeoff
    if phase is Phase.LANDING:
        return _down(firmware, reaction)
    if phase is Phase.HANDING_BACK:
        return way_back(firmware, reaction)
    return None


def _down(firmware: Firmware, reaction: Reaction) -> Mode:
    return firmware.home if reaction == RETURN else firmware.land
