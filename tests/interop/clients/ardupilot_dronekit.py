"""ArduCopter by dronekit, as its documentation's "simple goto" writes it. Argument: connection string."""

import json
import sys
import time

import dronekit

DEADLINE_S = 40
seen = {}


def wait_until(condition):
    """dronekit's examples poll as well."""
    until = time.monotonic() + DEADLINE_S
    while not condition():
        if time.monotonic() > until:
            raise SystemExit(f"not within {DEADLINE_S} s; {seen}")
        time.sleep(0.05)


def armed():
    """The pre-arm checks pass up to a second after `is_armable`: ask again."""
    vehicle.armed = True
    return vehicle.armed


vehicle = dronekit.connect(sys.argv[1], wait_ready=True, timeout=DEADLINE_S)
seen["version"] = [vehicle.version.major, vehicle.version.minor]
seen["parameters"] = len(vehicle.parameters)
vehicle.parameters["WPNAV_SPEED_UP"] = 300
wait_until(lambda: vehicle.parameters["WPNAV_SPEED_UP"] == 300)
wait_until(lambda: vehicle.battery.voltage is not None and vehicle.battery.voltage > 10)

vehicle.mode = dronekit.VehicleMode("GUIDED")
wait_until(lambda: vehicle.mode.name == "GUIDED")
wait_until(lambda: vehicle.is_armable)
seen["gps fix"] = vehicle.gps_0.fix_type >= 3
wait_until(armed)

vehicle.simple_takeoff(5)
wait_until(lambda: vehicle.location.global_relative_frame.alt > 4.75)
home = vehicle.location.global_relative_frame
vehicle.simple_goto(dronekit.LocationGlobalRelative(home.lat + 5e-5, home.lon, 5), groundspeed=3)
wait_until(lambda: vehicle.location.local_frame.north > 5)

vehicle.mode = dronekit.VehicleMode("LAND")
wait_until(lambda: not vehicle.armed)
seen["landed"] = vehicle.location.global_relative_frame.alt < 0.5
vehicle.close()
print(json.dumps(seen))
