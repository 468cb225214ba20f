"""PX4 by pymavlink's mavutil, as its documentation and MAVLink's guide write it. Argument: connection string."""

import json
import math
import sys
import time

from pymavlink import mavutil

DEADLINE_S = 40
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
    """Send COMMAND_LONG; the results of its acknowledgement."""
    padded = [*params, *[0] * (7 - len(params))]
    master.mav.command_long_send(master.target_system, master.target_component, number, 0, *padded)
    return wait_for("COMMAND_ACK", lambda ack: ack.command == number).result


master = mavutil.mavlink_connection(sys.argv[1])
master.wait_heartbeat()
seen["heartbeat from system"] = master.target_system
seen["is px4"] = master.messages["HEARTBEAT"].autopilot == mavutil.mavlink.MAV_AUTOPILOT_PX4
master.mav.heartbeat_send(mavutil.mavlink.MAV_TYPE_GCS, mavutil.mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)

# Parameters: PX4 sends an INT32 as its bytes.
master.param_fetch_one("MIS_TAKEOFF_ALT")
seen["parameter"] = wait_for("PARAM_VALUE", lambda value: value.param_id == "MIS_TAKEOFF_ALT").param_value
master.param_set_send("MIS_TAKEOFF_ALT", 4.0, mavutil.mavlink.MAV_PARAM_TYPE_REAL32)
seen["parameter set"] = wait_for("PARAM_VALUE", lambda value: value.param_id == "MIS_TAKEOFF_ALT").param_value
master.param_fetch_all()
listed = {wait_for("PARAM_VALUE").param_id}
count = master.messages["PARAM_VALUE"].param_count
while len(listed - {"_HASH_CHECK"}) < count:
    listed.add(wait_for("PARAM_VALUE").param_id)
seen["all parameters"] = len(listed - {"_HASH_CHECK"}) == count

# Streams
seen["interval"] = command(
    mavutil.mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavutil.mavlink.MAVLINK_MSG_ID_ATTITUDE, 20_000
)
first = wait_for("ATTITUDE").time_boot_ms
stamps = [wait_for("ATTITUDE").time_boot_ms for _ in range(50)]
seen["attitude hz"] = 1000 * len(stamps) / (stamps[-1] - first)

# Arm and take off
wait_for("SYS_STATUS", lambda s: s.onboard_control_sensors_health & mavutil.mavlink.MAV_SYS_STATUS_PREARM_CHECK)
master.arducopter_arm()
master.motors_armed_wait()
seen["armed"] = bool(master.motors_armed())
seen["takeoff"] = command(mavutil.mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, math.nan, math.nan, math.nan, math.nan)
wait_for("LOCAL_POSITION_NED", lambda position: position.z < -3.7)
wait_for("HEARTBEAT", lambda beat: mavutil.mode_string_v10(beat) == "LOITER")
seen["flight mode"] = master.flightmode


def setpoint():
    """Position (2, 1, -4) with yaw 0."""
    master.mav.set_position_target_local_ned_send(
        0, master.target_system, master.target_component, mavutil.mavlink.MAV_FRAME_LOCAL_NED,
        0b0000_1001_1111_1000, 2.0, 1.0, -4.0, 0, 0, 0, 0, 0, 0, 0.0, 0,
    )  # fmt: skip


# Offboard
for _ in range(3):
    setpoint()
seen["offboard"] = command(mavutil.mavlink.MAV_CMD_DO_SET_MODE, mavutil.mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, 6)


def arrived(position):
    setpoint()
    return math.dist((position.x, position.y, position.z), (2.0, 1.0, -4.0)) < 0.5


wait_for("LOCAL_POSITION_NED", arrived)
seen["offboard mode"] = master.flightmode

# Land
seen["land"] = command(mavutil.mavlink.MAV_CMD_NAV_LAND, 0, 0, 0, math.nan, math.nan, math.nan, 0)
master.motors_disarmed_wait()
seen["disarmed"] = not master.motors_armed()
print(json.dumps(seen))
