"""The operator: what he orders, what of it is flown, and why not where it is not."""

from __future__ import annotations

from collections.abc import Callable

from mavquad.endpoint import NEVER_US
from mavquad.flight import orders
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.guards import GuardParams
from mavquad.flight.machine import Event, Phase
from mavquad.flight.mission_params import MissionParams
from mavquad.types import Vec3


class Operator:
    """Takes the operator's orders.

    Attributes:
        interrupted: whether the operator stopped the flight.
        order_fault: why the last order is not flown; empty when it is.
        holds: whether the law stays where the mission ends, until the next order.
        may_take_off: whether the takeoff is ordered, or need not be.
        takeoff_m: the height of the takeoff; 0 is the autopilot's own.
    """

    def __init__(self, bridge: Bridge, control: Control, mission: MissionParams, guards: GuardParams) -> None:
        """`mission`: as configured, which tells how briskly to go elsewhere."""
        self._bridge = bridge
        self._control = control
        self._mission = mission
        self._guards = guards
        self.interrupted = False
        self.order_fault = ""
        self.holds = False
        self.may_take_off = True
        self.takeoff_m = 0.0

    @property
    def is_awaited(self) -> bool:
        """Whether the vehicle is known and the takeoff is waited for."""
        return self._bridge.phase is Phase.IDENTIFYING and self._bridge.limit_us == NEVER_US

    def stop(self, now_us: int) -> None:
        """Hand back and land, from wherever the flight is."""
        self._bridge.now_us = now_us
        if self._bridge.phase is Phase.DONE:
            return
        self.interrupted = True
        self._bridge.note("operator", "stop")
        self._bridge.fire(Event.STOP)

    def take_off(self, height_m: float) -> None:
        """The vehicle may take off; to this height, or, at 0, to the configured one."""
        self._bridge.note("operator", f"take off to {height_m:g} m" if height_m else "take off")
        self.takeoff_m = height_m or self.takeoff_m
        self.may_take_off = True

    def land(self, now_us: int) -> None:
        """Hand back and land, which is the flight's good end where the law flies."""
        self._bridge.now_us = now_us
        self._bridge.note("operator", "land")
        self._bridge.fire(Event.MISSION_OVER if self._bridge.phase is Phase.FLYING else Event.STOP)

    def goto(self, now_us: int, goal_ned_m: Vec3, heading_deg: float | None) -> None:
        """Another place, from where the law took over; the law stays there until the next order."""
        law, usual = self._control.law, self._mission
        north_m, east_m, down_m = goal_ned_m
        heading = "" if heading_deg is None else f", heading {heading_deg:g}"
        self._order(
            now_us,
            f"go to {north_m:g} {east_m:g} {down_m:g}{heading}",
            lambda stamp_us: orders.goto(usual, law.reference(stamp_us), law.origin_nwu_m, goal_ned_m, heading_deg),
        )

    def fly(self, now_us: int, mission_json: str) -> None:
        """Another mission (`MissionParams` in JSON), from where the reference is; the law stays at its end likewise."""
        self._order(now_us, f"fly {mission_json}", lambda _: orders.mission_of(mission_json))

    def _order(self, now_us: int, words: str, plan: Callable[[int], MissionParams]) -> None:
        self._bridge.now_us, self.order_fault = now_us, ""
        try:
            self._fly(words, plan)
        except orders.OrderRefused as refused:
            self.order_fault = str(refused)
            self._bridge.note("operator", f"{words}: not flown: {refused}")

    def _fly(self, words: str, plan: Callable[[int], MissionParams]) -> None:
        """`plan`: from the stamp of the last position to the mission."""
        law, position = self._control.law, self._control.pose.position
        if self._bridge.phase is not Phase.FLYING or position is None:
            raise orders.OrderRefused(f"the law does not fly it, phase {self._bridge.phase.value}")
        mission = plan(position.stamp_us)
        here_m = law.reference(position.stamp_us).z_m[0] - self._bridge.ground_m
        orders.check(mission, self._guards, law.params, here_m)
        self._bridge.note("operator", words)
        self.holds = True
        law.fly(mission, position.stamp_us)
