"""[mission]: what is flown while the law is in control."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from mavquad.control.reference import ReferenceParams
from mavquad.flight.trajectory_rows import COLUMNS, row_fault
from mavquad.frames import nwu_from_ned
from mavquad.schema import Section
from mavquad.types import Vec3

MissionName = Literal["box", "hover", "goto", "circle", "figure_eight", "waypoints", "file"]

Offset = Annotated[float, Field(ge=-10_000.0, le=10_000.0)]

NEVER_REPEATED = ("hover", "goto")
WAYPOINTS_MAX = 1000
"""Repeats included: they become one spline."""


class MissionParams(Section):
    """What is flown while the law is in control."""

    name: MissionName = "box"
    """"hover": stay. "box": hover, then a square, north and east first, with a turn at its far corner. "goto": to one place.
    "circle", "figure_eight": laps that begin and end where the law took over. "waypoints": a smooth curve through places.
    "file": a trajectory of your own."""
    duration_s: float = Field(default=0.0, ge=0.0, le=3600.0)
    """How long the law is in control: 0 for the mission's own length; longer holds the last pose, shorter cuts it."""
    hover_s: float = Field(default=6.0, ge=0.0, le=3600.0)
    """Hover at the start."""
    dwell_s: float = Field(default=0.5, ge=0.0, le=60.0)
    """Rest at each stop, and at the end."""
    repeat: int = Field(default=1, ge=1, le=100)
    """How many times: laps of circle and figure_eight without a rest between, rounds of box and waypoints, runs of a file."""
    yaw: Literal["fixed", "path"] = "fixed"
    """"fixed": as it was at the start, but for the turns of box, goto and file. "path": look where the path leads, and turn
    towards it before it begins; vertical ways keep the yaw. A curve that reverses or stands still is refused then."""
    side_m: float = Field(default=2.0, gt=0.0, le=100.0)
    """Side of the box."""
    turn_deg: float = Field(default=90.0, ge=-180.0, le=180.0)
    """Turn of the box, clockwise seen from above; not used with yaw = "path"."""
    offset_ned_m: tuple[Offset, Offset, Offset] = (2.0, 0.0, 0.0)
    """Where goto goes: north, east, down from the place where the law took over."""
    offset_turn_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    """Turn of goto on its way, clockwise seen from above; not used with yaw = "path"."""
    radius_m: float = Field(default=1.5, gt=0.0, le=1000.0)
    """Of the circle. It passes through the start, northwards; its centre is this far east (clockwise) or west of it."""
    direction: Literal["clockwise", "counterclockwise"] = "clockwise"
    """Of the circle, seen from above."""
    along_m: float = Field(default=1.25, gt=0.0, le=1000.0)
    """Half the length of the figure of eight: along_m sin(2 pi t / period_s) to the north."""
    across_m: float = Field(default=0.75, gt=0.0, le=1000.0)
    """Half its width: across_m sin(4 pi t / period_s)."""
    plane: Literal["vertical", "horizontal"] = "vertical"
    """Whether its width is upwards or to the east."""
    period_s: float = Field(default=12.0, gt=0.5, le=3600.0)
    """One lap of the circle or the figure of eight at full pace."""
    ramp_s: float = Field(default=4.0, ge=0.1, le=60.0)
    """In this time circle, figure_eight and file come smoothly from rest to their full pace, and likewise to rest. The clock
    of a file runs late by half of it."""
    waypoints_ned_m: tuple[tuple[Offset, Offset, Offset], ...] = ()
    """Places for waypoints: [north, east, down] from the start. They are passed without a stop, as briskly as
    mission.reference allows; the first way begins at the start."""
    file: str = ""
    """A CSV file with the columns t_s, north_m, east_m, down_m and, if wanted, yaw_deg (clockwise), relative to where the law
    took over. In a TOML file its path is relative to that file, in an option to the current directory. It is read with the
    configuration: its rows become `points`, and this is empty again."""
    points: tuple[tuple[float, ...], ...] = ()
    """The rows of that file."""
    knot_s: float = Field(default=0.5, ge=0.0, le=10.0)
    """Rows closer in time than this are smoothed, others are met exactly: four derivatives of rounded numbers are noise."""
    reference: ReferenceParams = ReferenceParams()
    """How briskly it is flown."""

    @model_validator(mode="after")
    def _check(self) -> MissionParams:
        for broken, words in self._contradictions():
            if broken:
                raise ValueError(words)
        return self

    def _contradictions(self) -> tuple[tuple[bool, str], ...]:
        """What cannot be planned at all; `mission_check` tells what must not be flown."""
        fault = row_fault(self.points, self.reference) if self.points else None
        count = len(self.waypoints_ned_m) * self.repeat
        return (
            (fault is not None, f"points, row {fault[0] + 1}: {fault[1]}" if fault else ""),
            (self.name == "file" and not self.points, 'name = "file" needs a file'),
            (
                self.name == "waypoints" and not any(any(place) for place in self.waypoints_ned_m),
                'name = "waypoints" needs waypoints_ned_m, with one that is not the start',
            ),
            (
                self.name == "waypoints" and count > WAYPOINTS_MAX,
                f"{count} waypoints, repeat included; {WAYPOINTS_MAX} can be flown",
            ),
            (self.repeat > 1 and self.name in NEVER_REPEATED, f'repeat has no meaning for name = "{self.name}"'),
            (
                self.name == "file" and self.yaw == "path" and len(self.points[:1] and self.points[0]) > len(COLUMNS),
                'yaw = "path", but the file has a yaw of its own',
            ),
        )


def waypoints_nwu_m(params: MissionParams) -> list[Vec3]:
    """All the places of a "waypoints" mission in order, repeats included, the start first; none twice in a row."""
    places: list[Vec3] = [(0.0, 0.0, 0.0)]
    for waypoint_ned_m in params.waypoints_ned_m * params.repeat:
        place = nwu_from_ned(waypoint_ned_m)
        if place != places[-1]:
            places.append(place)
    return places
