"""What the operator may order in flight: another place, another mission. It is looked at before it is flown."""

from __future__ import annotations

import json
import math

from pydantic import ValidationError

from mavquad.control.params import LawParams
from mavquad.flight.guards import GuardParams
from mavquad.flight.mission_check import height_fault, mission_fault
from mavquad.flight.mission_params import MissionParams
from mavquad.frames import nwu_from_ned, wrap_pi
from mavquad.types import ReferencePoint, Vec3


class OrderRefused(Exception):
    """The operator's order is not flown; why, in words."""


def goto(
    usual: MissionParams, here: ReferencePoint, origin_nwu_m: Vec3, goal_ned_m: Vec3, heading_deg: float | None
) -> MissionParams:
    """The mission that leads from the present reference to a place, at once.

    Args:
        usual: how briskly.
        here: the present reference.
        origin_nwu_m: where the law took over.
        goal_ned_m: north, east, down from there.
        heading_deg: to look to there, clockwise from north; None keeps the present one.

    Raises:
        OrderRefused: the place is none.
    """
    x, y, z = (o + d for o, d in zip(origin_nwu_m, nwu_from_ned(goal_ned_m), strict=True))
    way_nwu_m = (x - here.x_m[0], y - here.y_m[0], z - here.z_m[0])
    turn_deg = 0.0
    if heading_deg is not None:
        # Clockwise from north is minus the yaw of NWU.
        turn_deg = math.degrees(wrap_pi(math.radians(heading_deg) + here.yaw_rad[0]))
    fields = {"name": "goto", "offset_ned_m": nwu_from_ned(way_nwu_m), "offset_turn_deg": turn_deg}
    return mission({**fields, "reference": usual.reference.model_dump()})


def mission(fields: dict[str, object]) -> MissionParams:
    """A mission of these fields that begins at once.

    Raises:
        OrderRefused: it is none.
    """
    try:
        return MissionParams.model_validate({"hover_s": 0.0, "dwell_s": 0.0, **fields}, strict=False)
    except ValidationError as error:
        first = error.errors()[0]
        raise OrderRefused(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from None


def mission_of(text: str) -> MissionParams:
    """A mission that was written down as JSON.

    Raises:
        OrderRefused: it is none.
    """
    try:
        fields = json.loads(text)
    except ValueError:
        raise OrderRefused("the mission is not JSON") from None
    if not isinstance(fields, dict):
        raise OrderRefused("the mission is no table of keys and values")
    return mission(fields)


def check(ordered: MissionParams, guards: GuardParams, law: LawParams, height_m: float) -> None:
    """Whether an order may be flown from a place at this height above the arming point.

    Raises:
        OrderRefused: it leads out of the guards' volume, or asks for more than the law may.
    """
    fault = mission_fault(ordered, guards, law) or height_fault(ordered, guards, height_m)
    if fault is not None:
        raise OrderRefused(fault)
