"""ArduCopter by pymavlink's mavutil, as ArduPilot's developer documentation writes it. Argument: connection string."""

import json
import math
import sys
import time

from pymavlink import mavutil
from pymavlink.quaternion import QuaternionBase

DEADLINE_S = 40
PREARM = mavutil.mavlink.MAV_SYS_STATUS_PREARM_CHECK
seen = {}


def wait_for(kind, condition=lambda message: True):
    """The next message of a kind for which the condition holds."""
    until = time.monotonic() + DEADLINE_S
    while time.monotonic() < until:
        message = master.recv_match(type=kind, blocking=True, timeout=1)
        if message is not None and condition(message):
            return message
    raise SystemExit(f"no such {kind} within {DEADLINE_S} s")


def command(number, *params):
    """Send COMMAND_LONG; the result of its acknowledgement."""
    padded = [*params, *[0] * (7 - len(params))]
    master.mav.command_long_send(master.target_system, master.target_component, number, 0, *padded)
    return wait_for("COMMAND_ACK", lambda ack: ack.command == number).result


def go_to(north, east, down):
    """SET_POSITION_TARGET_LOCAL_NED by position; once is enough."""
    master.mav.set_position_target_local_ned_send(
        0, master.target_system, master.target_component, mavutil.mavlink.MAV_FRAME_LOCAL_NED,
        0b110111111000, north, east, down, 0, 0, 0, 0, 0, 0, 0, 0,
    )  # fmt: skip
    wait_for("LOCAL_POSITION_NED", lambda p: math.dist((p.x, p.y, p.z), (north, east, down)) < 0.5)


def lean(position):
    """Stream a nose-down attitude until the vehicle is north of 5 m (thrust 0.5: hold the altitude)."""
    attitude = QuaternionBase([math.radians(angle) for angle in (0, -8, 0)])
    master.mav.set_attitude_target_send(
        0, master.target_system, master.target_component, 0b00000111, attitude, 0, 0, 0, 0.5
    )  # fmt: skip
    return position.x > 5


master = mavutil.mavlink_connection(sys.argv[1])
master.wait_heartbeat()
seen["is ardupilot"] = master.messages["HEARTBEAT"].autopilot == mavutil.mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
master.mav.heartbeat_send(mavutil.mavlink.MAV_TYPE_GCS, mavutil.mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
wait_for("STATUSTEXT", lambda text: text.text == "EKF3 IMU0 initialised")

# Mode; arming before the vehicle knows where it is
master.set_mode(master.mode_mapping()["GUIDED"])
wait_for("HEARTBEAT", lambda beat: mavutil.mode_string_v10(beat) == "GUIDED")
master.arducopter_arm()
seen["armed too early"] = wait_for("COMMAND_ACK", lambda ack: ack.command == 400).result

# Streams: the old way for all, the new way for one.
master.mav.request_data_stream_send(
    master.target_system, master.target_component, mavutil.mavlink.MAV_DATA_STREAM_ALL, 4, 1
)
seen["interval"] = command(
    mavutil.mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavutil.mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 50_000
)
seen["version asked"] = command(
    mavutil.mavlink.MAV_CMD_REQUEST_MESSAGE, mavutil.mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
)
version = wait_for("AUTOPILOT_VERSION").flight_sw_version
seen["version"] = [version >> 24 & 0xFF, version >> 16 & 0xFF]

# Parameters
master.param_fetch_one("WPNAV_SPEED_UP")
seen["parameter"] = wait_for("PARAM_VALUE", lambda value: value.param_id == "WPNAV_SPEED_UP").param_value
master.param_set_send("WPNAV_SPEED_UP", 300)
seen["parameter set"] = wait_for(
    "PARAM_VALUE", lambda value: value.param_id == "WPNAV_SPEED_UP" and value.param_value != seen["parameter"]
).param_value
master.param_fetch_all()
listed = {wait_for("PARAM_VALUE", lambda value: value.param_index == 0).param_index}
while len(listed) < master.messages["PARAM_VALUE"].param_count:
    listed.add(wait_for("PARAM_VALUE", lambda value: value.param_index != 65535).param_index)
seen["parameters"] = len(listed)

# Arming, takeoff
wait_for("LOCAL_POSITION_NED")
wait_for("SYS_STATUS", lambda status: status.onboard_control_sensors_health & PREARM)
master.arducopter_arm()
master.motors_armed_wait()
seen["takeoff"] = command(mavutil.mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
wait_for("GLOBAL_POSITION_INT", lambda position: position.relative_alt > 4500)

# GUIDED by position and by attitude
go_to(2, 1, -5)
wait_for("LOCAL_POSITION_NED", lean)

# Home
master.set_mode("RTL")
wait_for("HEARTBEAT", lambda beat: mavutil.mode_string_v10(beat) == "RTL")
master.set_mode("LAND")
master.motors_disarmed_wait()
seen["disarmed"] = not master.motors_armed()
print(json.dumps(seen))
