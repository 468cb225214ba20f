"""The commands that fly: arming, modes, takeoff, landing, places, missions; as PX4's commander and navigator obey."""

from __future__ import annotations

import math

from mavquad.protocol.codec import mavlink
from sitl_mock.geodesy import Origin
from sitl_mock.geometry import Vec3
from sitl_mock.personality.px4.command import (
    ACCEPTED,
    CRITICAL,
    DENIED,
    INFO,
    TEMPORARILY_REJECTED,
    Command,
    Handler,
    Params,
)
from sitl_mock.personality.px4.commander import Commander
from sitl_mock.personality.px4.modes import Mode, UnsupportedAutoModeError, mode_of, mode_of_base

_FORCE = 21196
_NAV_PRECLAND: int = mavlink.MAV_CMD_NAV_LAND_LOCAL
_CUSTOM_MODE_FLAG = 1
_GROUND_STATION_COMPONENT = mavlink.MAV_COMP_ID_MISSIONPLANNER
_NAN = math.nan
_GIMBAL_LET_GO: tuple[tuple[int, Params], ...] = (
    (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, (1.0, 1.0, -1.0, -1.0, 0.0, 0.0, 0.0)),
    (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, (_NAN, _NAN, _NAN, _NAN, 2.0, 0.0, 0.0)),
    (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, (-3.0, -3.0, -1.0, -1.0, 0.0, 0.0, 0.0)),
)
"""What 1.15 and 1.16 say to whoever hears it when it begins to land: the gimbal is put level and let go."""


class FlightCommands:
    """`origin` is where NED is zero."""

    def __init__(self, commander: Commander, origin: Origin) -> None:
        self._commander = commander
        self._origin = origin
        self.handlers: dict[int, Handler] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            mavlink.MAV_CMD_DO_SET_MODE: self._set_mode,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._take_off,
            mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: self._take_off_vtol,
            mavlink.MAV_CMD_NAV_LAND: self._land,
            _NAV_PRECLAND: self._land_precisely,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._return,
            mavlink.MAV_CMD_DO_REPOSITION: self._reposition,
            mavlink.MAV_CMD_DO_ORBIT: self._orbit,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            mavlink.MAV_CMD_DO_SET_HOME: self._set_home,
            mavlink.MAV_CMD_MISSION_START: self._start_mission,
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._terminate,
        }
        if not commander.is_113:
            self.handlers[mavlink.MAV_CMD_DO_CHANGE_ALTITUDE] = self._change_altitude

    # --- arming and modes ------------------------------------------------------------------------------------------

    def _arm(self, command: Command) -> list[int]:
        action = command.params[0]
        if action == 1:
            return [self._commander.arm(command.boot_us)]
        if action == 0:
            return [self._commander.disarm(forced=command.params[1] == _FORCE)]
        self._commander.say(CRITICAL, f"Unsupported ARM_DISARM param: {action:.3f}")
        return []

    def _set_mode(self, command: Command) -> list[int]:
        try:
            if command.whole(1) & _CUSTOM_MODE_FLAG:
                mode = mode_of(command.whole(2), command.whole(3), self._commander.firmware)
            else:
                mode = mode_of_base(command.whole(1))
        except UnsupportedAutoModeError:
            self._commander.say(CRITICAL, "Unsupported auto mode")
            return [TEMPORARILY_REJECTED]
        if mode is None:
            return [ACCEPTED]  # as PX4: acknowledged, and nothing happens
        return [self._request(mode, command)]

    def _request(self, mode: Mode, command: Command) -> int:
        """PX4 1.14 and later tell the reason of a refusal to ground stations only."""
        return self._commander.request(mode, command.boot_us, command.sender[1] == _GROUND_STATION_COMPONENT)

    def _terminate(self, command: Command) -> list[int]:
        value = command.params[0]
        if value > 0.5:
            if self._commander.is_113 or self._commander.armed:
                self._commander.terminate()
                return [ACCEPTED]
            return [TEMPORARILY_REJECTED]
        if not self._commander.is_113:
            return [DENIED]
        self._commander.restore()
        return [ACCEPTED]

    # --- takeoff, landing, return ----------------------------------------------------------------------------------

    def _take_off(self, command: Command) -> list[int]:
        return [self._climb(Mode.TAKEOFF, command)]

    def _take_off_vtol(self, command: Command) -> list[int]:
        return [self._climb(Mode.VTOL_TAKEOFF, command)]

    def _climb(self, mode: Mode, command: Command) -> int:
        commander, settings = self._commander, self._commander.settings
        _, _, _, yaw_deg, latitude, longitude, altitude_m = command.params
        n, e, d = self._place(latitude, longitude, altitude_m)
        least_m = settings.mis_takeoff_alt
        lowest = commander.home_ned_m[2] - least_m
        if not commander.armed:
            lowest = commander.position_ned_m[2] - least_m
        if not d <= lowest:
            d = lowest
            known = (
                f"minimum takeoff altitude: {least_m:.2f}"
                if commander.is_113
                else f"default takeoff altitude: {least_m:.1f}"
            )
            if commander.armed:
                commander.say(INFO, f"Using {known} m")
        if not commander.landed and commander.position_ned_m[2] < d:
            commander.say(CRITICAL, "Already higher than takeoff altitude")
            d = commander.position_ned_m[2]
        commander.guidance.takeoff.aim((n, e, d), math.radians(yaw_deg))
        return self._request(mode, command)

    def _land(self, command: Command) -> list[int]:
        commander = self._commander
        if commander.firmware in ("1.15", "1.16") and not commander.landed:
            commander.broadcasts += _GIMBAL_LET_GO
        result = self._request(Mode.LAND, command)
        commander.say(INFO, "Landing at current position")
        return [result]

    def _land_precisely(self, command: Command) -> list[int]:
        result = self._request(Mode.PRECLAND, command)
        self._commander.say(INFO, "Precision landing")
        return [result]

    def _return(self, command: Command) -> list[int]:
        commander = self._commander
        if commander.is_113 and commander.intended is Mode.RTL:
            commander.say(CRITICAL, "Return to launch denied")
            return [TEMPORARILY_REJECTED]
        commander.say(INFO, "Returning to launch")
        return [self._request(Mode.RTL, command)]

    # --- places ----------------------------------------------------------------------------------------------------

    def _reposition(self, command: Command) -> list[int]:
        speed_m_s, flags, _, yaw, latitude, longitude, altitude_m = command.params
        if not math.isfinite(flags) or not int(flags) & 1:
            return [ACCEPTED]
        result = self._request(Mode.LOITER, command)
        if result != ACCEPTED:
            self._commander.say(CRITICAL, "Reposition command rejected")
        elif self._commander.armed and not self._commander.landed:
            hold = self._commander.guidance.hold
            hold.cruise_m_s = speed_m_s if speed_m_s > 0 else None
            hold.go_to(
                self._place(latitude, longitude, altitude_m), _yaw_rad(yaw), self._commander.view(command.boot_us)
            )
        return [result]

    def _change_altitude(self, command: Command) -> list[int]:
        result = self._request(Mode.LOITER, command)
        if result == ACCEPTED and self._commander.armed and not self._commander.landed:
            to = self._place(math.nan, math.nan, command.params[0])
            self._commander.guidance.hold.go_to(to, math.nan, self._commander.view(command.boot_us))
        return [result]

    def _orbit(self, command: Command) -> list[int]:
        radius_m, speed_m_s, _, _, latitude, longitude, altitude_m = command.params
        self._commander.guidance.orbit.aim(self._place(latitude, longitude, altitude_m), radius_m, speed_m_s)
        result = self._request(Mode.ORBIT, command)
        # the commander answers, and then the flight task
        return [result, result] if result == ACCEPTED else [result]

    def _change_speed(self, command: Command) -> list[int]:
        speed_m_s = command.params[1]
        cruise = speed_m_s if speed_m_s > 0 else None
        guidance = self._commander.guidance
        guidance.mission.cruise_m_s = guidance.hold.cruise_m_s = cruise
        return [ACCEPTED]

    def _set_home(self, command: Command) -> list[int]:
        if command.params[0] > 0.5:
            self._commander.home_ned_m = self._commander.position_ned_m
            return [ACCEPTED]
        n, e, d = self._place(*command.params[4:])
        if not all(map(math.isfinite, (n, e, d))):
            return [DENIED]
        self._commander.home_ned_m = (n, e, d)
        return [ACCEPTED]

    def _place(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> Vec3:
        """The place in NED, each part NaN if it is not given; 0, 0 is no place either."""
        if latitude_deg == 0.0 and longitude_deg == 0.0:
            latitude_deg = longitude_deg = math.nan
        if not (abs(latitude_deg) <= 90 and abs(longitude_deg) <= 360):
            latitude_deg = longitude_deg = math.nan
        if math.isinf(altitude_m):
            altitude_m = math.nan
        return self._origin.local(latitude_deg, longitude_deg, altitude_m)

    # --- missions --------------------------------------------------------------------------------------------------

    def _start_mission(self, command: Command) -> list[int]:
        commander, first = self._commander, command.params[0]
        if not commander.mission.is_valid:
            commander.say(CRITICAL, "Mission start denied! No valid mission")
            return [DENIED]
        if not -1 <= first < len(commander.mission.items):
            return [DENIED]
        if first >= 0:
            commander.mission.set_current(int(first))
        result = self._request(Mode.MISSION, command)
        if result == ACCEPTED:
            result = commander.arm(command.boot_us, by="mission start")
        return [result]


def _yaw_rad(yaw: float) -> float:
    """DO_REPOSITION's yaw, which PX4 takes in rad."""
    return yaw if math.isfinite(yaw) else math.nan
