"""From a pose datagram to the setpoint datagram that answers it, of three clients of one kind of mock, one after the other:

    echo      asyncio and pymavlink and nothing else: every ATTITUDE is answered with one SET_ATTITUDE_TARGET
    mavquad   `mavquad fly`, under the law
    mavsdk    MAVSDK-Python, asyncio: every attitude is answered with set_attitude_rate (if it is installed)

`python tests/bench/latency.py [--seconds 20] [--json] [CLIENT ...]`. All are measured from outside, by a proxy between mock
and client: from just before the pose is sent to the client until the kernel has its setpoint. The poses come at 100 Hz, by
PX4 1.16's manners. CPU is that of the client and its children in the same time, of one core. For mavquad the summary's
own measurement is told beside, and the stream that steps the law is taken from its log.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from mavquad.protocol.codec import Framer, mavlink, message_id  # noqa: E402

RATE_HZ = 100
POSES = {"ATTITUDE": mavlink.MAVLINK_MSG_ID_ATTITUDE, "LOCAL_POSITION_NED": mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED}
SETPOINT = mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET
LIMIT_S = 60.0
WARM_S = 2.0
_TIMESTAMPNS = 35
"""SO_TIMESTAMPNS of Linux: the kernel's time of arrival comes with each datagram."""


class Proxy:
    """Carries datagrams between the mock and the client; keeps when poses left and setpoints came, by the kernel's clock."""

    def __init__(self, client_port: int) -> None:
        self.mock_side, self.client_side = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for side in (self.mock_side, self.client_side):
            side.bind(("127.0.0.1", 0))
            side.setblocking(False)
            side.setsockopt(socket.SOL_SOCKET, _TIMESTAMPNS, 1)
        self.client_side.connect(("127.0.0.1", client_port))
        self.poses_ns: dict[str, list[int]] = {name: [] for name in POSES}
        self.setpoints_ns: list[int] = []
        self._mock: tuple[str, int] | None = None
        self._names = {number: name for name, number in POSES.items()}
        self._framers = {self.mock_side: Framer(), self.client_side: Framer()}

    @property
    def port(self) -> int:
        """Where the mock speaks to."""
        return int(self.mock_side.getsockname()[1])

    def carry(self, wait_s: float) -> None:
        """Carry what is there."""
        ready, _, _ = select.select([self.mock_side, self.client_side], [], [], wait_s)
        for side in ready:
            with contextlib.suppress(BlockingIOError, ConnectionRefusedError):  # the client does not listen yet
                data, ancillary, _, sender = side.recvmsg(65535, 64)
                frames = [message_id(frame) for frame in self._framers[side].push(data)]
                self._to_client(data, frames, sender) if side is self.mock_side else self._to_mock(
                    data, frames, ancillary
                )

    def _to_client(self, data: bytes, numbers: list[int], sender: tuple[str, int]) -> None:
        self._mock = sender
        sent_ns = time.time_ns()
        self.client_side.send(data)
        for number in numbers:
            if number in self._names:
                self.poses_ns[self._names[number]].append(sent_ns)

    def _to_mock(self, data: bytes, numbers: list[int], ancillary: list[tuple[int, int, bytes]]) -> None:
        if SETPOINT in numbers:
            seconds, nanoseconds = struct.unpack("qq", ancillary[0][2][:16])
            self.setpoints_ns.append(seconds * 1_000_000_000 + nanoseconds)
        if self._mock is not None:
            self.mock_side.sendto(data, self._mock)

    def latencies_ms(self, stream: str, from_ns: int, to_ns: int) -> list[float]:
        """Of each setpoint of that time: how long before it the latest pose of that stream had been sent."""
        poses, at, latencies = self.poses_ns[stream], 0, []
        for setpoint_ns in self.setpoints_ns:
            while at < len(poses) and poses[at] <= setpoint_ns:
                at += 1
            if at and from_ns <= setpoint_ns <= to_ns:
                latencies.append((setpoint_ns - poses[at - 1]) * 1e-6)
        return latencies


def cpu_s(pid: int) -> float:
    """Processor time of a process and all below it."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") + sum(cpu_s(int(child)) for child in children)


@contextlib.contextmanager
def mock(proxy: Proxy) -> Iterator[None]:
    arguments = ["--autopilot", "px4", "--firmware", "1.16", "--endpoint", f"udpout:127.0.0.1:{proxy.port}"]
    process = subprocess.Popen(
        [sys.executable, "-m", "sitl_mock", "--announce", *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=ROOT,
    )  # fmt: skip
    try:
        yield
    finally:
        process.kill()
        process.communicate()


def measure(name: str, seconds: float) -> dict[str, Any]:
    """Run one client; its figures."""
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
        probe.close()
        run = Path(folder) / "run"
        command = [sys.executable, __file__, "--client", name, str(port)]
        if name == "mavquad":
            flight = ["--mission", "hover", "--duration", str(seconds + 2 * WARM_S), "--depth", "rate", "--json"]
            command = [sys.executable, "-m", "mavquad", "fly", "--connect", f"udpin:127.0.0.1:{port}", *flight]
            # A busy machine is no reason to land here.
            patient = ("guards.stale_attitude_s=0.8", "guards.stale_position_s=0.8", "flight.connect_s=60.0")
            command += [word for key in patient for word in ("--set", key)]
            command += ["--run-dir", str(run)]
        proxy = Proxy(port)
        client = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT)
        try:
            with mock(proxy):
                from_ns, to_ns, used_s = watch(proxy, client, seconds)
                stream = "ATTITUDE"
                result: dict[str, Any] = {}
                if name == "mavquad":
                    while client.poll() is None:
                        proxy.carry(0.1)
                    stream = stepping_stream(run)
                    result["inside_us"] = json.loads((run / "summary.json").read_text())["lateness_us"]
        finally:
            client.kill()
            client.communicate()
    return {**figures(proxy.latencies_ms(stream, from_ns, to_ns)), "cpu": used_s / seconds, "stream": stream, **result}


def watch(proxy: Proxy, client: subprocess.Popen[bytes], seconds: float) -> tuple[int, int, float]:
    """Carry until enough setpoints of a steady stream were seen; (from, to, processor time of the client between)."""
    ends_s = time.monotonic() + LIMIT_S + seconds
    while len(proxy.setpoints_ns) < RATE_HZ * WARM_S and time.monotonic() < ends_s and client.poll() is None:
        proxy.carry(0.1)
    from_ns, before_s = time.time_ns(), cpu_s(client.pid) if client.poll() is None else 0.0
    to_ns = from_ns + round(seconds * 1e9)
    while time.time_ns() < to_ns and client.poll() is None:
        proxy.carry(0.1)
    if client.poll() is not None:
        raise SystemExit(f"the client ended early: {' '.join(map(str, client.args))}")
    return from_ns, to_ns, cpu_s(client.pid) - before_s


def stepping_stream(run: Path) -> str:
    """The stream whose arrivals carry the stamps of the setpoints."""
    from mavquad.tlog import read_records

    stamps: dict[int, int] = {}
    counts = dict.fromkeys(POSES.values(), 0)
    for record in read_records(run / "flight.tlog"):
        number = message_id(record.frame)
        if not record.outbound:
            stamps[record.stamp_us] = number
        elif number == SETPOINT and stamps.get(record.stamp_us) in counts:
            counts[stamps[record.stamp_us]] += 1
    return max(POSES, key=lambda name: counts[POSES[name]])


def figures(latencies_ms: list[float]) -> dict[str, Any]:
    ordered = sorted(latencies_ms)
    last = len(ordered) - 1
    return {
        "count": len(ordered),
        "p50_ms": ordered[last // 2],
        "p99_ms": ordered[round(last * 0.99)],
        "max_ms": ordered[-1],
    }


# ---------------------------------------------------------------------- the other clients


async def echo(port: int) -> None:
    """The least that asyncio and pymavlink can do."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    parser, packer = dialect.MAVLink(None), dialect.MAVLink(None, srcSystem=245, srcComponent=190)
    parser.robust_parsing = True

    class Protocol(asyncio.DatagramProtocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            self.transport: Any = transport

        def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
            for message in parser.parse_buffer(data) or ():
                if message.get_type() == "ATTITUDE":
                    target = dialect.MAVLink_set_attitude_target_message(
                        message.time_boot_ms, 1, 1, 0x80, [1, 0, 0, 0], 0.0, 0.0, 0.0, 0.0
                    )
                    self.transport.sendto(target.pack(packer), addr)
                elif message.get_type() == "HEARTBEAT":
                    for number in POSES.values():
                        wanted = dialect.MAVLink_command_long_message(
                            1, 1, 511, 0, number, 1e6 / RATE_HZ, 0, 0, 0, 0, 0
                        )
                        self.transport.sendto(wanted.pack(packer), addr)

    await asyncio.get_running_loop().create_datagram_endpoint(Protocol, local_addr=("127.0.0.1", port))
    await asyncio.sleep(10 * LIMIT_S)


async def mavsdk(port: int) -> None:
    """As its examples: a subscription, and a setpoint for each value of it."""
    from mavsdk import ComponentType
    from mavsdk.asyncio import Configuration, Mavsdk
    from mavsdk.asyncio.plugins.offboard import OffboardAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
    from mavsdk.plugins.offboard import AttitudeRate

    sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    await sdk.add_any_connection(f"udpin://127.0.0.1:{port}")
    system = await sdk.first_autopilot(timeout_s=LIMIT_S)
    telemetry, offboard = TelemetryAsync(system), OffboardAsync(system)
    await telemetry.set_rate_position_velocity_ned(float(RATE_HZ))
    await telemetry.set_rate_attitude_euler(float(RATE_HZ))
    still = AttitudeRate(roll_deg_s=0.0, pitch_deg_s=0.0, yaw_deg_s=0.0, thrust_value=0.0)
    async for _ in telemetry.subscribe_attitude_euler():
        await offboard.set_attitude_rate(still)


CLIENTS = {"echo": echo, "mavquad": None, "mavsdk": mavsdk}


def has_mavsdk() -> bool:
    try:
        import mavsdk  # noqa: F401
    except ImportError:
        return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clients", nargs="*", default=list(CLIENTS), metavar="CLIENT")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--client", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.client:
        asyncio.run(CLIENTS[given.client[0]](int(given.client[1])))
        return
    results = {name: measure(name, given.seconds) for name in given.clients if name != "mavsdk" or has_mavsdk()}
    if given.json:
        print(json.dumps(results, indent=2))
        return
    print(f"{'client':<9}{'p50 ms':>9}{'p99 ms':>9}{'max ms':>9}{'CPU':>8}{'count':>8}  answers")
    for name, r in results.items():
        words = f"{r['p50_ms']:9.3f}{r['p99_ms']:9.3f}{r['max_ms']:9.3f}{100 * r['cpu']:7.1f}%{r['count']:8d}  {r['stream']}"
        print(f"{name:<9}{words}")
        if "inside_us" in r:
            print(f"{'':<9}by its own clocks: {r['inside_us']} us")


if __name__ == "__main__":
    main()
