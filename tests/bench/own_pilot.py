"""A pilot that leaves the flying to the autopilot: its own position control, told place, velocity and acceleration.

One end of a link, like the agent: it takes frames and the passing of time, so it flies live and in lockstep. It arms,
takes off, hovers, flies the mission of the configuration by SET_POSITION_TARGET_LOCAL_NED (PX4: OFFBOARD; ArduCopter:
GUIDED), and lands.
Every command is repeated until the vehicle shows that it did it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from mavquad.config import Config
from mavquad.control.reference import Pose
from mavquad.endpoint import NEVER_US, floor_to_grid_us
from mavquad.flight.mission import Mission, MissionParams
from mavquad.frames import ned_from_nwu, nwu_from_ned
from mavquad.protocol.codec import Encoder, Message, decode, frame_source, mavlink
from mavquad.types import Vec3

TICK_US = 20_000
"""Setpoints go out at 50 Hz."""
TRY_US, LIMIT_US = 1_200_000, 120_000_000
"""Between two tries of a command (HEARTBEAT may show it a second late), and until it is given up."""
PREARM_OK = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK
IGNORE_YAW_RATE = 0x800
LOCAL_NED = 1
STEADY_M_S, STEADY_US = 0.3, 2_000_000
NEAR_SHARE = 0.8
HEIGHT_M = 3.0
"""ArduCopter's takeoff; PX4 has its own, MIS_TAKEOFF_ALT."""
NAN = math.nan

PX4_MODES = {"own": (6, 0), "hold": (4, 3), "takeoff": (4, 2)}
"""Main and sub mode: OFFBOARD, AUTO.LOITER, AUTO.TAKEOFF."""
GUIDED, LAND = 4, 9


class GaveUp(Exception):
    """The vehicle did not do it; the message says what, and what it said last."""


class OwnPilot:
    """Flies one mission by the autopilot's own position control.

    Attributes:
        done: landed and disarmed.
        places: (vehicle's stamp in us, position NED in m) of every LOCAL_POSITION_NED while the mission flew.
        mission: once it has begun.
    """

    def __init__(self, config: Config, start_us: int, delay_s: float) -> None:
        self.done = False
        self.places: list[tuple[int, Vec3]] = []
        self.mission: Mission | None = None
        self._config, self._delay_us = config, round(delay_s * 1e6)
        self._encoder = Encoder(config.link.system_id, config.link.component_id)
        self._out: list[bytes] = []
        self._now_us = start_us
        self._next_us = floor_to_grid_us(start_us + TICK_US)
        self._seen: dict[str, tuple[int, Message]] = {}
        self._target: tuple[int, int] | None = None
        self._flown: Mission | None = None
        self._text = ""
        self._script = self._fly()

    # ------------------------------------------------------------------ an endpoint

    def receive(self, data: bytes, now_us: int) -> None:
        """Keep the last message of each kind."""
        self._now_us = now_us
        message = decode(data)
        kind = message.get_type()
        if self._target is None and kind == "HEARTBEAT" and message.autopilot in (3, 12):
            self._target = frame_source(data)
        if frame_source(data) != self._target:
            return
        self._seen[kind] = (now_us, message)
        if kind == "STATUSTEXT":
            self._text = str(message.text).strip()
        if kind == "LOCAL_POSITION_NED" and self.mission is not None:
            self.places.append((message.time_boot_ms * 1000, (message.x, message.y, message.z)))

    def next_deadline_us(self) -> int:
        """Every tick until it is over."""
        return NEVER_US if self.done else self._next_us

    def on_deadline(self, now_us: int) -> None:
        """Go on with the script; HEARTBEAT once a second."""
        self._now_us = now_us
        self._next_us = floor_to_grid_us(now_us + TICK_US)
        if now_us // 1_000_000 != (now_us - TICK_US) // 1_000_000:
            self._send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
        if next(self._script, "over") == "over":
            self.done = True

    def datagrams_to_send(self) -> list[bytes]:
        """What the last call made ready."""
        out, self._out = self._out, []
        return out

    # ------------------------------------------------------------------ what the vehicle shows

    def _last(self, kind: str) -> Message | None:
        return self._seen[kind][1] if kind in self._seen else None

    @property
    def _is_px4(self) -> bool:
        return self._seen["HEARTBEAT"][1].autopilot == mavlink.MAV_AUTOPILOT_PX4

    def _is_armed(self) -> bool:
        return bool(self._seen["HEARTBEAT"][1].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)

    def _mode(self) -> tuple[int, int]:
        """PX4: main and sub mode; ArduCopter: its number and 0."""
        custom = self._seen["HEARTBEAT"][1].custom_mode
        return (custom >> 16 & 0xFF, custom >> 24 & 0xFF) if self._is_px4 else (custom, 0)

    def _may_arm(self) -> bool:
        status = self._last("SYS_STATUS")
        healthy = status is not None and status.onboard_control_sensors_health & PREARM_OK
        return bool(healthy) and "LOCAL_POSITION_NED" in self._seen and "ATTITUDE" in self._seen

    def _vehicle_us(self) -> int:
        """The vehicle's clock, as late as its last position made it look."""
        arrived_us, position = self._seen["LOCAL_POSITION_NED"]
        return int(position.time_boot_ms * 1000 + self._now_us - arrived_us)

    # ------------------------------------------------------------------ what it is told

    def _send(self, message: Message) -> None:
        self._out.append(self._encoder.encode(message))

    def _command(self, number: int, *params: float) -> None:
        assert self._target is not None
        rest = (0.0,) * (7 - len(params))
        self._send(mavlink.MAVLink_command_long_message(*self._target, number, 0, *params, *rest))

    def _select(self, name: str) -> None:
        self._command(176, 1.0, *(map(float, PX4_MODES[name]) if self._is_px4 else (float(GUIDED),)))

    def _in(self, name: str) -> bool:
        return self._mode() == (PX4_MODES[name] if self._is_px4 else (GUIDED, 0))

    def _ask_for_streams(self) -> None:
        streams = self._config.streams
        rates = {30: streams.attitude_hz, 32: streams.position_hz, 1: 2.0, 245: 5.0}
        for number, rate_hz in rates.items():
            self._command(511, float(number), 1e6 / rate_hz)

    def _take_off(self) -> None:
        if self._is_px4:
            self._command(22, NAN, 0.0, 0.0, NAN, NAN, NAN, NAN)
        else:
            self._command(22, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, HEIGHT_M)

    def _land(self) -> None:
        if self._is_px4:
            self._command(21, 0.0, 0.0, 0.0, NAN, NAN, NAN, NAN)
        else:
            self._command(176, 1.0, float(LAND))

    def _set_target(self) -> None:
        """Where to be when the setpoint arrives: place, velocity, acceleration and heading."""
        assert self._flown is not None and self._target is not None
        point = self._flown.reference(self._vehicle_us() + self._delay_us)
        ned = [ned_from_nwu((point.x_m[k], point.y_m[k], point.z_m[k])) for k in range(3)]
        self._send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                self._now_us // 1000 & 0xFFFFFFFF,
                *self._target,
                LOCAL_NED,
                IGNORE_YAW_RATE,
                *ned[0],
                *ned[1],
                *ned[2],
                -point.yaw_rad[0],
                0.0,
            )
        )

    # ------------------------------------------------------------------ the flight

    def _until(self, what: str, shown: Callable[[], bool], act: Callable[[], None] | None = None) -> Iterator[None]:
        """Wait for something to show, and do `act` about it now and again."""
        started_us, tried_us = self._now_us, 0
        while not shown():
            if self._now_us - started_us > LIMIT_US:
                raise GaveUp(f"{what}: not within {LIMIT_US / 1e6:.0f} s; the vehicle's last text: {self._text!r}")
            if act is not None and self._now_us - tried_us >= TRY_US:
                tried_us = self._now_us
                act()
            if self._flown is not None:
                self._set_target()
            yield

    def _fly(self) -> Iterator[None]:
        yield from self._until("a HEARTBEAT", lambda: self._target is not None)
        if not self._is_px4:
            yield from self._until("GUIDED", lambda: self._in("own"), lambda: self._select("own"))
        else:
            yield from self._until("AUTO.LOITER", lambda: self._in("hold"), lambda: self._select("hold"))
        yield from self._until("ready to arm", self._may_arm, self._ask_for_streams)
        ground_m = -self._seen["LOCAL_POSITION_NED"][1].z
        yield from self._until("arming", self._is_armed, lambda: self._command(400, 1.0))
        yield from self._until("takeoff", lambda: self._is_rising(ground_m), self._take_off)
        yield from self._until("a steady hover", self._steady_since(ground_m))
        self._flown = self._begin(self._config.mission.model_copy(update={"name": "hover"}))
        yield from self._until("its own control", lambda: self._in("own"), lambda: self._select("own"))
        self._flown = self.mission = self._begin(self._config.mission)
        while not self.mission.over(self._vehicle_us()):
            if not self._in("own") or not self._is_armed():
                raise GaveUp(f"it left the mode in flight; its last text: {self._text!r}")
            self._set_target()
            yield
        yield from self._until("the landing", lambda: not self._in("own"), self._land)
        self._flown = None
        yield from self._until("disarmed", lambda: not self._is_armed())
        if self._is_px4:  # it goes back to OFFBOARD, in which it cannot be armed
            yield from self._until("AUTO.LOITER", lambda: self._in("hold"), lambda: self._select("hold"))

    def _is_rising(self, ground_m: float) -> bool:
        """Whether the takeoff is under way. PX4 would begin it anew each time that it is asked for."""
        return self._mode() == PX4_MODES["takeoff"] if self._is_px4 else self._height_m() - ground_m > 0.5

    def _height_m(self) -> float:
        return -float(self._seen["LOCAL_POSITION_NED"][1].z)

    def _steady_since(self, ground_m: float) -> Callable[[], bool]:
        """Whether it has hovered for a while: slow, off the ground, and on PX4 in its hold mode."""
        since_us = NEVER_US

        def steady() -> bool:
            nonlocal since_us
            position = self._seen["LOCAL_POSITION_NED"][1]
            slow = math.hypot(position.vx, position.vy, position.vz) < STEADY_M_S
            up = self._in("hold") if self._is_px4 else self._height_m() - ground_m > NEAR_SHARE * HEIGHT_M
            since_us = min(since_us, self._now_us) if slow and up else NEVER_US
            return self._now_us - since_us >= STEADY_US

        return steady

    def _begin(self, mission: MissionParams) -> Mission:
        """The mission from here; where a place is held already, from that place."""
        if self._flown is not None:
            return Mission(mission, self._held, self._vehicle_us())
        position, attitude = self._seen["LOCAL_POSITION_NED"][1], self._seen["ATTITUDE"][1]
        self._held = Pose(nwu_from_ned((position.x, position.y, position.z)), -attitude.yaw)
        return Mission(mission, self._held, self._vehicle_us())
