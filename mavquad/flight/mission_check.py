"""What must not be flown: a mission is looked at, moment by moment, before anything is armed.

It must keep to its own section [mission.reference], to what the law may ask of the vehicle, and to the volume of the guards.
The vehicle's tilt along a reference is that of the acceleration that its thrust must make: g upwards, the reference's own,
and what the air takes, as far as the law knows it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.reference import Pose
from mavquad.control.trajectories.along import Along
from mavquad.control.trajectories.heading import NoHeading
from mavquad.control.trajectories.spline import NoCurve, misses_m
from mavquad.flight.guards import GuardParams
from mavquad.flight.mission import Mission
from mavquad.flight.mission_params import MissionParams
from mavquad.flight.mission_plan import plan_mission
from mavquad.flight.trajectory_rows import samples
from mavquad.types import ReferencePoint

Points = tuple[tuple[float, ReferencePoint], ...]
"""Moments, s since the start of the mission, and the reference there."""

LOOK_S = 0.02
LOOKS_MIN = 100
LOOKS_MAX = 20_000
"""In all, over a mission."""
SLACK = 1e-6
"""Of a limit, for rounding: legs reach theirs exactly."""
MISS_MAX_M = 0.05
"""A smoothed file passes its rows no further off than this."""

_CULPRITS = {
    "box": ("mission.side_m", "a corner"),
    "goto": ("mission.offset_ned_m", "the goal"),
    "circle": ("mission.radius_m", "the path"),
    "figure_eight": ("mission.along_m or mission.across_m", "the path"),
    "waypoints": ("mission.waypoints_ned_m", "the path"),
    "file": ("mission.file", "the path"),
    "hover": ("mission.hover_s", "the path"),
}


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something that has a limit."""

    name: str
    unit: str
    key: str
    order: int
    """Of the derivative; 0 for what is none."""
    limit: float
    of: Callable[[ReferencePoint], float]


@dataclass(frozen=True, slots=True)
class Extent:
    """How far a mission leads from the place where the law takes over, m."""

    radius_m: float
    radius_at_s: float
    rise_m: float
    sink_m: float


def mission_fault(mission: MissionParams, guards: GuardParams, law: LawParams) -> str | None:
    """Why a mission must not be flown: the quantity, the moment, the value, the excess; None when it may."""
    try:
        plan_mission(mission)
    except NoHeading as error:
        return (
            f'mission.yaw = "path": the path of mission.name = "{mission.name}" stands still or reverses'
            f' {error.at_s:.2f} s after its beginning, and has no direction there; use mission.yaw = "fixed"'
        )
    except NoCurve:
        return f"{_CULPRITS[mission.name][0]}: no smooth path goes there; its times or places are too uneven"
    points = _points(mission)
    return _miss(mission) or _outside(mission, guards, points) or _too_much(mission, law, points)


def height_fault(mission: MissionParams, guards: GuardParams, height_m: float) -> str | None:
    """Why a mission must not be flown from here: known in flight only.

    Args:
        mission: what is flown.
        guards: the volume.
        height_m: of the place where the law takes over, above the arming point.
    """
    extent = mission_extent(mission)
    if height_m + extent.rise_m > guards.ceiling_m:
        highest = height_m + extent.rise_m
        return f"the mission leads {highest - guards.ceiling_m:.1f} m above guards.ceiling_m ({guards.ceiling_m:g} m)"
    if height_m - extent.sink_m < guards.floor_m:
        lowest = height_m - extent.sink_m
        return f"the mission leads {guards.floor_m - lowest:.1f} m below guards.floor_m ({guards.floor_m:g} m)"
    return None


def mission_extent(mission: MissionParams) -> Extent:
    """How far a mission leads."""
    return _extent(_points(mission))


@lru_cache(maxsize=2)
def _points(mission: MissionParams) -> Points:
    """What was looked at before the flight; kept for the hand-over, where nothing may take long."""
    return tuple(_looks(mission))


def _looks(mission: MissionParams) -> Iterator[tuple[float, ReferencePoint]]:
    """Moments (s since the start) and the reference there, as often as can be looked at; laps that are alike once."""
    alike = mission.name != "waypoints"
    seen = mission.model_copy(update={"repeat": min(mission.repeat, 2)}) if alike else mission
    flown = Mission(seen, Pose((0.0, 0.0, 0.0), plan_mission(seen).first_heading_rad or 0.0), 0)
    yield 0.0, flown.reference(0)
    spans = flown.spans()
    for start_s, end_s, curved in spans:
        # Legs have the shape of their kind and keep to their limits.
        wanted = max(LOOKS_MIN, math.ceil((end_s - start_s) / LOOK_S)) if curved else LOOKS_MIN
        looks = max(LOOKS_MIN // 10, min(wanted, LOOKS_MAX // len(spans)))
        for look in range(looks + 1):
            t_s = start_s + (end_s - start_s) * look / looks
            if t_s <= flown.duration_s:
                yield t_s, flown.reference(round(t_s * 1e6))


def _extent(points: Points) -> Extent:
    radius_m, at_s = max((math.hypot(point.x_m[0], point.y_m[0]), t_s) for t_s, point in points)
    heights = [point.z_m[0] for _, point in points]
    return Extent(radius_m, at_s, max(0.0, *heights), max(0.0, -min(heights)))


def _outside(mission: MissionParams, guards: GuardParams, points: Points) -> str | None:
    extent = _extent(points)
    key, what = _CULPRITS[mission.name]
    if extent.radius_m >= guards.radius_m:
        return (
            f"{key} puts {what} {extent.radius_m:.1f} m away, beyond guards.radius_m ({guards.radius_m:g} m)"
            f" by {extent.radius_m - guards.radius_m:.1f} m, {extent.radius_at_s:.1f} s into the mission"
        )
    span_m, room_m = extent.rise_m + extent.sink_m, guards.ceiling_m - guards.floor_m
    if span_m >= room_m:
        return (
            f"{key} leads {extent.rise_m:.1f} m up and {extent.sink_m:.1f} m down, {span_m - room_m:.1f} m more than"
            " there is between guards.floor_m and guards.ceiling_m"
        )
    return None


def _miss(mission: MissionParams) -> str | None:
    """Where a file's curve is too far from its rows."""
    if mission.name != "file":
        return None
    rows = samples(mission.points)
    curve = next(motion.curve for motion in plan_mission(mission).motions if isinstance(motion, Along))
    miss_m, index = max((miss, index) for index, miss in enumerate(misses_m(curve, rows)))
    if miss_m <= MISS_MAX_M:
        return None
    return (
        f"mission.file, row at t_s = {rows[index][0]:g}: a path smooth enough to fly passes it {miss_m:.2f} m off,"
        f" {miss_m - MISS_MAX_M:.2f} m more than allowed; round off its corners, or use a smaller mission.knot_s"
    )


def _too_much(mission: MissionParams, law: LawParams, points: Points) -> str | None:
    """The first quantity that is beyond its limit, where it is worst."""
    own = _own_limits(mission)
    peaks = [max((quantity.of(point), t_s) for t_s, point in points) for quantity in own]
    for quantity, (value, t_s) in zip(own, peaks, strict=True):
        if value > quantity.limit * (1.0 + SLACK):
            return _words(mission, quantity, value, t_s) + _remedy(mission, own, [peak for peak, _ in peaks])
    for quantity in _law_limits(law):
        value, t_s = max((quantity.of(point), t_s) for t_s, point in points)
        if value > quantity.limit * (1.0 + SLACK):
            return _words(mission, quantity, value, t_s)
    return None


def _words(mission: MissionParams, quantity: Quantity, value: float, t_s: float) -> str:
    what = "the path of mission.file" if mission.name == "file" else f'mission.name = "{mission.name}"'
    return (
        f"{what} asks for {value:.4g} {quantity.unit} of {quantity.name}, {t_s:.2f} s"
        f" into the mission: {value - quantity.limit:.3g} {quantity.unit} above {quantity.key}"
    )


def _remedy(mission: MissionParams, own: list[Quantity], peaks: list[float]) -> str:
    """The same flown more slowly: stretching its time by c divides a k-th derivative by c^k."""
    keys = {
        "circle": "mission.period_s and mission.ramp_s",
        "figure_eight": "mission.period_s and mission.ramp_s",
        "file": "all its times and mission.ramp_s",
    }
    if mission.name not in keys:
        return ""
    shares = zip(own, peaks, strict=True)
    factor = max((peak / quantity.limit) ** (1.0 / quantity.order) for quantity, peak in shares)
    return f"; {keys[mission.name]} {math.ceil(factor * 100.0) / 100.0:g} times as long would do"


_DERIVATIVES = (("speed", "rate"), ("acceleration",) * 2, ("jerk",) * 2, ("snap",) * 2)


def _own_limits(mission: MissionParams) -> list[Quantity]:
    """Those of [mission.reference]: of the position, then of the yaw."""
    way, turn = mission.reference.way_bounds(), mission.reference.turn_bounds()
    ways = (way.first, way.second, way.third, way.fourth)
    turns = (turn.first, turn.second, turn.third, turn.fourth)
    found = []
    for order, ((name, _), limit) in enumerate(zip(_DERIVATIVES, ways, strict=True), 1):
        found.append(_own(name, "m", order, limit, _way(order)))
    for order, ((_, name), limit) in enumerate(zip(_DERIVATIVES, turns, strict=True), 1):
        found.append(_own(f"yaw {name}", "deg", order, math.degrees(limit), _turn(order)))
    return found


def _own(name: str, unit: str, order: int, limit: float, of: Callable[[ReferencePoint], float]) -> Quantity:
    power = "" if order == 1 else str(order)
    key = f"mission.reference.{name.replace(' ', '_')}_max_{unit}_s{power}"
    return Quantity(name, f"{unit}/s^{power}" if power else f"{unit}/s", key, order, limit, of)


def _law_limits(law: LawParams) -> list[Quantity]:
    limits = law.limits
    a, b = law.frictions()

    def thrust(point: ReferencePoint) -> tuple[float, float]:
        """Horizontal and vertical part of the thrust per mass, m/s^2."""
        x, y, z = (channel[2] + a * channel[1] for channel in (point.x_m, point.y_m, point.z_m))
        return math.hypot(x, y), GRAVITY_M_S2 + z

    def tilt_deg(point: ReferencePoint) -> float:
        return math.degrees(math.atan2(*thrust(point)))

    def share(point: ReferencePoint) -> float:
        return math.hypot(*thrust(point)) / GRAVITY_M_S2

    def yaw_input_deg_s2(point: ReferencePoint) -> float:
        return abs(math.degrees(point.yaw_rad[2] + b * point.yaw_rad[1]))

    found = [
        Quantity("tilt", "deg", "law.limits.tilt_max_deg", 0, limits.tilt_max_deg, tilt_deg),
        Quantity("thrust", "g", "law.limits.thrust_max_g", 0, limits.thrust_max_g, share),
        Quantity(
            "loss of thrust", "g", "1 - law.limits.thrust_min_g", 0, 1.0 - limits.thrust_min_g, lambda p: 1.0 - share(p)
        ),
    ]
    if law.depth in ("auto", "torque"):
        key, limit = "law.limits.yaw_acceleration_max_deg_s2", limits.yaw_acceleration_max_deg_s2
        found.append(Quantity("yaw acceleration (friction included)", "deg/s^2", key, 0, limit, yaw_input_deg_s2))
    return found


def _way(order: int) -> Callable[[ReferencePoint], float]:
    return lambda point: math.hypot(point.x_m[order], point.y_m[order], point.z_m[order])


def _turn(order: int) -> Callable[[ReferencePoint], float]:
    return lambda point: abs(math.degrees(point.yaw_rad[order]))
