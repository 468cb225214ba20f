"""PX4 by MAVSDK-Python 4's asyncio API: telemetry, parameters, a flight, OFFBOARD, a mission. Argument: UDP port."""

import asyncio
import json
import sys

from mavsdk import ComponentType
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.offboard import AttitudeRate, OffboardError, PositionNedYaw
from mavsdk.plugins.telemetry import FlightMode, LandedState

DEADLINE_S = 25
TELEMETRY = (
    "position", "home", "battery", "attitude_euler", "velocity_ned", "gps_info", "raw_gps", "flight_mode", "landed_state",
    "imu", "odometry", "altitude", "position_velocity_ned",
)  # fmt: skip
seen = {}


async def until(stream, condition=lambda value: True):
    """The next value for which the condition holds."""

    async def wait():
        async for value in stream:
            if condition(value):
                return value
        raise SystemExit("the stream ended")

    return await asyncio.wait_for(wait(), DEADLINE_S)


def waypoint(home, north_m, east_m, up_m):
    """A waypoint about home: 1e-5 degrees of latitude are 1.11 m."""
    return MissionItem(
        latitude_deg=home.latitude_deg + north_m * 0.9e-5, longitude_deg=home.longitude_deg + east_m * 1.3e-5,
        relative_altitude_m=up_m, speed_m_s=5.0, is_fly_through=True, acceptance_radius_m=1.0,
    )  # fmt: skip


async def ground(telemetry, info, params, action):
    version = await info.get_version()
    seen["version"] = [version.flight_sw_major, version.flight_sw_minor]
    await until(telemetry.subscribe_health(), lambda health: health.is_armable and health.is_global_position_ok)
    await until(telemetry.subscribe_health_all_ok(), bool)
    streams = [asyncio.create_task(until(getattr(telemetry, f"subscribe_{name}")())) for name in TELEMETRY]
    values = dict(zip(TELEMETRY, await asyncio.gather(*streams, return_exceptions=True), strict=True))
    seen["telemetry missing"] = [name for name, value in values.items() if isinstance(value, BaseException)]
    await params.set_param_int("COM_RCL_EXCEPT", 4)
    await action.set_takeoff_altitude(4.0)
    seen["takeoff altitude"] = await params.get_param_float("MIS_TAKEOFF_ALT")
    seen["int parameter"] = await params.get_param_int("COM_RCL_EXCEPT")
    everything = await params.get_all_params()
    seen["parameters"] = len(everything.int_params) + len(everything.float_params)
    await telemetry.set_rate_position(20.0)
    return values["home"]


async def offboard_flight(telemetry, offboard):
    try:
        await offboard.start()
    except OffboardError as error:
        seen["offboard without setpoint"] = error.result.name
    await offboard.set_position_ned(PositionNedYaw(3.0, 0.0, -4.0, 0.0))
    await offboard.start()
    await until(telemetry.subscribe_flight_mode(), lambda mode: mode == FlightMode.OFFBOARD)
    await until(telemetry.subscribe_position_velocity_ned(), lambda state: state.position.north_m > 2.5)
    await offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 30.0, 0.49))
    await until(telemetry.subscribe_attitude_euler(), lambda attitude: attitude.yaw_deg > 20)
    await offboard.set_position_ned(PositionNedYaw(0.0, 0.0, -4.0, 0.0))
    await until(telemetry.subscribe_position_velocity_ned(), lambda state: state.position.north_m < 0.5)
    await offboard.stop()
    await until(telemetry.subscribe_flight_mode(), lambda mode: mode == FlightMode.HOLD)


async def mission_flight(telemetry, mission, home):
    plan = MissionPlan([waypoint(home, 5, 0, 4), waypoint(home, 5, 5, 5), waypoint(home, 0, 0, 4)])
    await mission.upload_mission(plan)
    seen["mission items"] = len((await mission.download_mission()).mission_items)
    await mission.start_mission()
    await until(telemetry.subscribe_flight_mode(), lambda mode: mode == FlightMode.MISSION)
    progress = await until(mission.subscribe_mission_progress(), lambda done: 0 < done.total == done.current)
    seen["mission progress"] = [progress.current, progress.total]


async def main():
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
        system = await mavsdk.first_autopilot(timeout_s=10.0)
        telemetry, action = TelemetryAsync(system), ActionAsync(system)
        home = await ground(telemetry, InfoAsync(system), ParamAsync(system), action)
        await action.arm()
        await until(telemetry.subscribe_armed(), bool)
        await action.takeoff()
        await until(telemetry.subscribe_position(), lambda position: position.relative_altitude_m > 3.5)
        await until(telemetry.subscribe_flight_mode(), lambda mode: mode == FlightMode.HOLD)
        await offboard_flight(telemetry, OffboardAsync(system))
        await mission_flight(telemetry, MissionAsync(system), home)
        await action.land()
        await until(telemetry.subscribe_landed_state(), lambda state: state == LandedState.ON_GROUND)
        await until(telemetry.subscribe_armed(), lambda armed: not armed)
        seen["landed"] = True
    print(json.dumps(seen))


asyncio.run(main())
