"""How many vehicles one process serves in real time: `python tests/bench/many_vehicles.py [--speed X] [--seconds S]`.

For 1, 5, 10 and 20 vehicles, `sitl-mock --vehicles N` runs as a process of its own, and N clients in this one ask for
ATTITUDE and LOCAL_POSITION_NED at 100 Hz (all other streams of PX4's companion link off but HEARTBEAT), arm and take
off; when all of them hover, processor time, lateness and what arrives are measured for some seconds.

`cost` is the mock's processor time for a simulated second, what else the machine does left out: 50 % is half a core in
real time. `pace` is simulated time over real time: below 1 the machine was too slow, or busy with other things. `late` is
told by the mock: how long after their time deadlines fired, from its start to its end.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import selectors
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field

from mavquad.protocol.codec import Encoder, decode, mavlink, message_id

WANTED = (mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
RATE_HZ = 100.0
NAN = float("nan")
LIMIT_S = 90.0
ANSWERS = (mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_COMMAND_ACK, mavlink.MAVLINK_MSG_ID_STATUSTEXT)


@dataclass
class Client:
    """A companion computer that asks for two streams, then for a takeoff."""

    system: int
    place: tuple[str, int]
    counts: dict[int, int] = field(default_factory=dict)
    height_m: float = 0.0
    armed: bool = False
    first: bytes = b""
    last: bytes = b""

    def __post_init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.socket.connect(self.place)
        self.encoder = Encoder(255, 190)

    def command(self, number: int, *params: float) -> None:
        padded = [*params, *[NAN if number == mavlink.MAV_CMD_NAV_TAKEOFF else 0.0] * (7 - len(params))]
        self._send(mavlink.MAVLink_command_long_message(self.system, 1, number, 0, *padded))

    def heartbeat(self) -> None:
        self._send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def _send(self, message: object) -> None:
        self.socket.send(self.encoder.encode(message))

    def set_rates(self) -> None:
        for number in WANTED:
            self.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, 1e6 / RATE_HZ)

    def stop_the_rest(self) -> None:
        """No stream that comes unasked."""
        for number in self.counts.keys() - {*WANTED, *ANSWERS}:
            self.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, -1.0)
        self.counts.clear()

    def read(self) -> None:
        while True:
            try:
                data = self.socket.recv(65535)
            except BlockingIOError:
                return
            number = message_id(data)
            self.counts[number] = self.counts.get(number, 0) + 1
            if number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED and self.counts[number] % 20 == 1:
                self.height_m = -decode(data).z
            elif number == mavlink.MAVLINK_MSG_ID_ATTITUDE:
                self.first, self.last = self.first or data, data
            elif number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self.armed = bool(decode(data).base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)

    def begin(self) -> None:
        """Count from now on."""
        self.counts.clear()
        self.first = b""

    def simulated_s(self) -> float:
        """Vehicle's time that passed since."""
        return (decode(self.last).time_boot_ms - decode(self.first).time_boot_ms) * 1e-3


class Fleet:
    """Clients of all vehicles, read as datagrams arrive."""

    def __init__(self, vehicles: list[dict[str, object]]) -> None:
        self.clients = []
        self._selector = selectors.DefaultSelector()
        for vehicle in vehicles:
            host, port = str(vehicle["urls"][0]).removeprefix("udpout:").rsplit(":", 1)  # type: ignore[index]
            client = Client(int(str(vehicle["system_id"])), (host, int(port)))
            self.clients.append(client)
            self._selector.register(client.socket, selectors.EVENT_READ, client)

    def read_for(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            for key, _ in self._selector.select(left):
                key.data.read()

    def hover(self) -> None:
        """Until all of them are in the air."""
        end = time.monotonic() + LIMIT_S
        for client in self.clients:
            client.heartbeat()
            client.set_rates()
        while not all(client.height_m > 2.0 for client in self.clients):
            assert time.monotonic() < end, [round(client.height_m, 1) for client in self.clients]
            for client in self.clients:
                client.heartbeat()
                client.stop_the_rest()
                if not client.armed:
                    client.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
                    client.command(mavlink.MAV_CMD_NAV_TAKEOFF)
            self.read_for(1.0)

    def close(self) -> None:
        for client in self.clients:
            client.socket.close()


def processor_s(process: int) -> float:
    """User and system time of a process so far."""
    with open(f"/proc/{process}/stat") as stat:  # noqa: PTH123
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(vehicles: int, firmware: str, speed: float, seconds: float) -> str:
    """One row of the table."""
    command = [sys.executable, "-m", "sitl_mock", "--vehicles", str(vehicles), "--firmware", firmware, "--ready", "0"]
    command += ["--endpoint", "udpin:127.0.0.1:0", "--announce", "--speed", str(speed)]
    mock = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert mock.stdout is not None
    fleet = Fleet(json.loads(mock.stdout.readline())["vehicles"])
    try:
        fleet.hover()
        for client in fleet.clients:
            client.begin()
        before_s, began = processor_s(mock.pid), time.monotonic()
        fleet.read_for(seconds)
        passed_s, spent_s = time.monotonic() - began, processor_s(mock.pid) - before_s
        simulated_s = sum(client.simulated_s() for client in fleet.clients) / vehicles
        rates = [client.counts.get(number, 0) / client.simulated_s() for client in fleet.clients for number in WANTED]
    finally:
        mock.send_signal(signal.SIGINT)
        _, said = mock.communicate()
        fleet.close()
    late = re.search(r"late by ([\d.]+) ms \(median\), ([\d.]+) \(p99\)", said)
    assert late is not None, said
    return (
        f"{vehicles:8d}  {spent_s / simulated_s * 100:6.0f} %  {simulated_s / passed_s:6.3f}  {late[1]:>7} {late[2]:>7}"
        f"  {min(rates):8.1f} {max(rates):7.1f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vehicles", default="1,5,10,20", help="fleets to measure")
    parser.add_argument("--firmware", default="1.16")
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    print("vehicles      cost    pace     late, ms      rate, Hz of simulated time")
    print("                             p50     p99     least    most")
    for vehicles in map(int, options.vehicles.split(",")):
        print(measure(vehicles, options.firmware, options.speed, options.seconds), flush=True)
    print(f"(this process: {sum(resource.getrusage(resource.RUSAGE_SELF)[:2]):.0f} s of processor time)")


if __name__ == "__main__":
    main()
