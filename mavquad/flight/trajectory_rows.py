"""Rows of a given trajectory: time, offset from the hand-over point in NED, and, if they have it, a turn.

    t_s, north_m, east_m, down_m [, yaw_deg]

Time in s, from any start; yaw in degrees clockwise from the heading at the hand-over, wrapped or not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from mavquad.control.reference import ReferenceParams
from mavquad.control.trajectories.spline import Sample
from mavquad.frames import nwu_from_ned, unwrap_near

COLUMNS = ("t_s", "north_m", "east_m", "down_m")
YAW_COLUMN = "yaw_deg"

Rows = Sequence[Sequence[float]]

ROWS_MIN = 2
ROWS_MAX = 20_000
TIME_MAX_S = 4 * 3600.0
OFFSET_MAX_M = 10_000.0
STEP_S_MIN = 1e-4
ROUNDING_M = 0.01
"""What rounding may add to a step."""
ROUNDING_DEG = 1.0


def row_fault(rows: Rows, reference: ReferenceParams) -> tuple[int, str] | None:
    """The first row that cannot be flown, by its index, and the words for it; None when there is none."""
    if not ROWS_MIN <= len(rows) <= ROWS_MAX:
        return len(rows) - 1, f"{len(rows)} rows; {ROWS_MIN} to {ROWS_MAX} can be flown"
    for index, row in enumerate(rows):
        words = _alone(row, len(rows[0]))
        if words:
            return index, words
    for index, (before, row) in enumerate(pairwise(rows), 1):
        words = _step(before, row, reference)
        if words:
            return index, words
    return None


def samples(rows: Rows) -> list[Sample]:
    """The rows as times with positions in NWU (m) and a continuous yaw (rad, 0 where none is given)."""
    found: list[Sample] = []
    for t_s, north, east, down, *turn in rows:
        x, y, z = nwu_from_ned((north, east, down))
        yaw = -math.radians(turn[0]) if turn else 0.0
        found.append((t_s, x, y, z, unwrap_near(yaw, found[-1][4] if found else 0.0)))
    return found


def _alone(row: Sequence[float], width: int) -> str:
    if len(row) != width or width not in (len(COLUMNS), len(COLUMNS) + 1):
        return f"{len(row)} values; {len(COLUMNS)} are wanted, or {len(COLUMNS) + 1} with {YAW_COLUMN}, in all rows"
    names = (*COLUMNS, YAW_COLUMN)
    for name, value in zip(names, row, strict=False):
        if not math.isfinite(value):
            return f"{name} is {value}, not a finite number"
        limit = TIME_MAX_S if name == "t_s" else OFFSET_MAX_M
        if abs(value) > limit:
            return f"{name} is {value:g}, more than {limit:g}"
    return ""


def _step(before: Sequence[float], row: Sequence[float], reference: ReferenceParams) -> str:
    dt_s = row[0] - before[0]
    if dt_s < STEP_S_MIN:
        return f"t_s is {row[0]:g} after {before[0]:g}; time must grow from row to row"
    way_m = math.dist(row[1:4], before[1:4])
    limit = reference.speed_max_m_s
    if way_m > limit * dt_s + ROUNDING_M:
        return (
            f"a jump of {way_m:.2f} m in {dt_s:.3f} s is {way_m / dt_s:.2f} m/s,"
            f" {way_m / dt_s - limit:.2f} m/s above mission.reference.speed_max_m_s"
        )
    turn_deg = abs(math.degrees(unwrap_near(math.radians(row[4] - before[4]), 0.0))) if len(row) > len(COLUMNS) else 0.0
    limit = reference.yaw_rate_max_deg_s
    if turn_deg > limit * dt_s + ROUNDING_DEG:
        return (
            f"a turn of {turn_deg:.1f} deg in {dt_s:.3f} s is {turn_deg / dt_s:.1f} deg/s,"
            f" {turn_deg / dt_s - limit:.1f} deg/s above mission.reference.yaw_rate_max_deg_s"
        )
    return ""
