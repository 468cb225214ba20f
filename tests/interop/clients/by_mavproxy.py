"""A flight typed into MAVProxy. Arguments: master, folder for its logs, autopilot."""

import json
import queue
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

DEADLINE_S = 90
MODULES = "log,param,mode,arm,cmdlong,misc,link"
FLIGHTS = {
    # typed (? again and again), what MAVProxy must say then (< or may have said before)
    "px4": [
        ("param set MIS_TAKEOFF_ALT 4", ""),
        ("?param show MIS_TAKEOFF_ALT", r"MIS_TAKEOFF_ALT +4\.0"),
        ("?arm throttle", r"^(\S+> )*ARMED"),
        ("takeoff 4", r"Mode TAKEOFF"),
        ("", r"Mode LOITER"),
        ("?status HEARTBEAT", r"HEARTBEAT \{.*base_mode : 157"),
        ("long MAV_CMD_NAV_LAND 0 0 0 0 0 0 0", r"NAV_LAND: ACCEPTED"),
        ("", r"DISARMED"),
    ],
    "ardupilot": [
        ("param set WPNAV_SPEED_UP 300", ""),
        ("?param show WPNAV_SPEED_UP", r"WPNAV_SPEED_UP +300\.0"),
        ("mode guided", r"Mode GUIDED"),
        ("<", r"using GPS"),
        ("?arm throttle", r"^(\S+> )*ARMED"),
        ("takeoff 5", r"NAV_TAKEOFF: ACCEPTED"),
        ("?status HEARTBEAT", r"HEARTBEAT \{.*custom_mode : 4"),
        ("mode land", r"DISARMED"),
    ],
}


def main():
    master, folder, autopilot = sys.argv[1:]
    options = ["--master", master, "--state-basedir", folder, "--aircraft", "mock"]
    script = Path(sys.executable).with_name("mavproxy.py")
    process = subprocess.Popen(
        [sys.executable, str(script), *options, "--default-modules", MODULES],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1, cwd=folder,
    )  # fmt: skip
    listener = Listener(process)
    try:
        seen = {"parameters": int(listener.wait_for(r"Received (\d+) parameters")[1])}
        for typed, answer in FLIGHTS[autopilot]:
            if typed == "<" and listener.has_said(answer):
                continue
            listener.type(typed.strip("?<"))
            if answer:
                listener.wait_for(answer, typed.strip("?") if typed.startswith("?") else "")
        seen["tlogs"] = [str(path) for path in Path(folder).rglob("*.tlog")]
    finally:
        process.kill()
        listener.close()
    print(json.dumps(seen))


class Listener:
    """Reads what MAVProxy says, types what the pilot types."""

    def __init__(self, process):
        self._process = process
        self._lines = queue.Queue()
        self._said = ""
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            print(line, end="", flush=True)
            self._said += line
            self._lines.put(line)

    def close(self):
        """Nothing more is printed after this."""
        self._reader.join()
        self._process.wait()

    def has_said(self, pattern):
        return re.search(pattern, self._said) is not None

    def type(self, line):
        if line:
            self._process.stdin.write(line + "\n")

    def wait_for(self, pattern, again=""):
        until = time.monotonic() + DEADLINE_S
        while time.monotonic() < until:
            try:
                line = self._lines.get(timeout=0.3)
            except queue.Empty:
                self.type(again)
                continue
            if match := re.search(pattern, line):
                return match
        raise SystemExit(f"MAVProxy did not say {pattern!r} within {DEADLINE_S} s")


main()
