"""The server over real loopback sockets: who is answered, who may leave, and whose time it is."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import socket
import struct
from typing import ClassVar

import pytest

from mavquad.endpoint import advance, deliver
from mavquad.errors import EndpointError, InternalError
from mavquad.protocol.codec import Encoder, Framer, decode, mavlink
from mavquad.schema import parse_section
from mavquad.url import Address
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.clock import SimClock
from sitl_mock.config import MockConfig
from sitl_mock.endpoints import LinkSpec, parse_endpoint
from sitl_mock.faults import ImpairedLink
from sitl_mock.lateness import Lateness
from sitl_mock.server import Server, Vehicle, VehicleSpec
from sitl_mock.transports import TcpLink, UdpLink

START_US = 1_700_000_000_000_000
LIMIT_S = 20.0
"""Longer than any of this takes on a busy machine; a condition that comes true ends the wait at once."""
UDP, TCP = "udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"
ARM = (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
QUICK = {"ready_s": 0.0, "link": {"latency_ms": 0.0}}


def config(**keys):
    return parse_section(MockConfig, {**QUICK, **keys}, "test")


def specs(*urls, vehicles=1, **keys):
    links = tuple(parse_endpoint(url, "px4") for url in urls)
    return [VehicleSpec(config(system_id=number + 1, **keys), number, links) for number in range(vehicles)]


@contextlib.asynccontextmanager
async def serving(vehicle_specs, speed=5.0, clock=None, **options):
    """A server that runs; what its vehicles raise ends the test."""
    async with (
        Server(vehicle_specs, clock or SimClock(START_US, speed), **options) as server,
        asyncio.TaskGroup() as group,
    ):
        group.create_task(server.run())
        yield server
        server.stop()


@pytest.fixture(autouse=True)
def clients_leave():
    """Their sockets are closed, however a test ends."""
    yield
    while Client.sockets:
        Client.sockets.pop().close()


class Client:
    """A client's socket: sends messages, and waits for those that it wants."""

    sockets: ClassVar = []

    def __init__(self, kind=socket.SOCK_DGRAM):
        self.socket = socket.socket(socket.AF_INET, kind)
        self.socket.setblocking(False)
        self.sockets.append(self.socket)
        self.encoder = Encoder(255, 190)
        self.framer = Framer()
        self.waiting = []

    @classmethod
    async def to(cls, link, kind=socket.SOCK_DGRAM):
        client = cls(kind)
        await asyncio.wait_for(asyncio.get_running_loop().sock_connect(client.socket, place(link)), LIMIT_S)
        return client

    @classmethod
    async def tcp(cls, link):
        return await cls.to(link, socket.SOCK_STREAM)

    async def send(self, *messages):
        data = b"".join(self.encoder.encode(message) for message in messages)
        await asyncio.get_running_loop().sock_sendall(self.socket, data)

    async def command(self, number, *params, system=1):
        """Send a COMMAND_LONG; the result in its ACK."""
        await self.send(command(number, *params, system=system))
        return (await self.receive("COMMAND_ACK")).result

    async def receive(self, name):
        """The next message of that name."""
        async with asyncio.timeout(LIMIT_S):
            while (message := await self.next()).get_type() != name:
                pass
            return message

    async def names_until(self, name):
        """The names of all messages up to the next one of that name."""
        names = set()
        async with asyncio.timeout(LIMIT_S):
            while name not in names:
                names.add((await self.next()).get_type())
        return names

    async def next(self):
        """The next message."""
        while not self.waiting:
            data = await asyncio.get_running_loop().sock_recv(self.socket, 65535)
            assert data, "the server hung up"
            self.waiting = self.framer.push(data)
        return decode(self.waiting.pop(0))

    def hears_nothing(self):
        """Whether nothing has arrived since it was last looked at."""
        try:
            self.socket.recv(1)
        except BlockingIOError:
            return True
        return False


def command(number, *params, system=1):
    padded = [*map(float, params), *[0.0] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(system, 1, number, 0, *padded)


def heartbeat():
    return mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def place(link):
    return link.address.host, link.address.port


async def until(condition):
    """Wait for something that the event loop brings about."""
    async with asyncio.timeout(LIMIT_S):
        while not condition():
            await asyncio.sleep(0)


# ---------------------------------------------------------------------- UDP


def test_vehicles_have_their_own_ports_ids_and_states():
    async def scenario():
        async with serving(specs(UDP, vehicles=2)) as server:
            first, second = [await Client.to(vehicle.links[0]) for vehicle in server.vehicles]
            await first.send(heartbeat())
            await second.send(heartbeat())
            assert (await first.receive("HEARTBEAT")).get_srcSystem() == 1
            assert (await second.receive("HEARTBEAT")).get_srcSystem() == 2
            assert await second.command(*ARM, system=2) == 0
            return [vehicle.autopilot.armed for vehicle in server.vehicles]

    assert asyncio.run(scenario()) == [False, True]


def test_it_speaks_at_once_to_whom_it_is_told():
    async def scenario():
        client = Client()
        client.socket.bind(("127.0.0.1", 0))
        async with serving(specs(f"udpout:127.0.0.1:{client.socket.getsockname()[1]}")) as server:
            return await client.receive("HEARTBEAT"), server.vehicles[0].links[0].address.host

    said, host = asyncio.run(scenario())
    assert said.get_srcSystem() == 1
    assert host == "127.0.0.1", "who cannot reach the client need not reach the vehicle"


def test_the_first_who_speaks_is_answered_in_place_of_whom_it_spoke_to():
    async def scenario():
        passive = Client()
        passive.socket.bind(("127.0.0.1", 0))
        speak_to = Address(True, *passive.socket.getsockname())
        links = (LinkSpec("udp", "onboard", Address(True, "127.0.0.1", 0), speak_to),)
        async with serving([VehicleSpec(config(), 1, links)]) as server:
            await passive.receive("HEARTBEAT")
            active = await Client.to(server.vehicles[0].links[0])
            await active.send(heartbeat())
            await active.receive("HEARTBEAT")
            while not passive.hears_nothing():
                pass
            await active.receive("HEARTBEAT")
            return passive.hears_nothing()

    assert asyncio.run(scenario())


async def _second_client(answers_all):
    async with serving(specs(UDP), answers_all=answers_all) as server:
        link = server.vehicles[0].links[0]
        first, second = await Client.to(link), await Client.to(link)
        await first.send(heartbeat())
        await first.receive("HEARTBEAT")
        await second.send(command(*ARM))
        await until(lambda: server.vehicles[0].autopilot.armed)
        await first.receive("HEARTBEAT")
        return second.hears_nothing(), link.counts.unanswered


def test_a_second_client_is_obeyed_and_never_answered():
    assert asyncio.run(_second_client(False)) == (True, 1)


def test_everybody_is_answered_if_that_is_wanted():
    assert asyncio.run(_second_client(True)) == (False, 0)


def test_two_links_have_their_own_rates():
    async def scenario():
        async with serving(specs(UDP, UDP + ":gcs")) as server:
            companion, station = [await Client.to(link) for link in server.vehicles[0].links]
            for client in (companion, station):
                await client.send(heartbeat())
            off = (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE, -1)
            assert await station.command(*off) == 0
            await companion.receive("ATTITUDE")
            return await station.names_until("HEARTBEAT")

    assert "ATTITUDE" not in asyncio.run(scenario())


def test_half_a_frame_of_one_is_not_continued_by_another():
    async def scenario():
        async with serving(specs(UDP)) as server:
            link = server.vehicles[0].links[0]
            first, second = await Client.to(link), await Client.to(link)
            frame = first.encoder.encode(command(*ARM))
            first.socket.send(frame[:10])
            second.socket.send(frame[10:])
            await first.send(heartbeat())
            await first.receive("HEARTBEAT")
            return server.vehicles[0].autopilot.armed

    assert asyncio.run(scenario()) is False


def test_rubbish_is_counted_and_makes_nobody_a_peer():
    async def scenario():
        async with serving(specs(UDP)) as server:
            link = server.vehicles[0].links[0]
            stranger, client = await Client.to(link), await Client.to(link)
            for rubbish in (b"", b"\xfd", b"\x00" * 1400, b"\xfe" * 30, bytes(range(256))):
                stranger.socket.send(rubbish)
            await client.send(heartbeat())
            await client.receive("HEARTBEAT")
            return stranger.hears_nothing(), link.counts.bad > 0

    assert asyncio.run(scenario()) == (True, True)


def test_a_client_that_is_gone_harms_nobody():
    async def scenario():
        async with serving(specs(UDP, UDP, vehicles=2)) as server:
            link, other = server.vehicles[0].links[0], server.vehicles[1].links[0]
            leaves, stays = await Client.to(link), await Client.to(other)
            for client in (leaves, stays):
                await client.send(heartbeat())
                await client.receive("HEARTBEAT")
            leaves.socket.close()
            for _ in range(3):
                await stays.receive("HEARTBEAT")
            heir = await Client.to(server.vehicles[0].links[1])
            await heir.send(heartbeat())
            return (await heir.receive("HEARTBEAT")).get_srcSystem()

    assert asyncio.run(scenario()) == 1


def test_senders_without_end_cost_no_memory():
    frame = Encoder(255, 190).encode(heartbeat())

    async def scenario():
        link = UdpLink(asyncio.get_running_loop(), parse_endpoint(UDP, "px4"), lambda _: None, True)
        try:
            for number in range(200):
                link._take(frame, ("127.0.0.1", 20000 + number))
                link._take(b"\x00rubbish", ("127.0.0.1", 20000 + number))
            return len(link._framers), len(link._served), link.counts.received, link.counts.bad
        finally:
            link.close()

    framers, served, received, bad = asyncio.run(scenario())
    assert framers <= 32
    assert served <= 32
    assert (received, bad) == (200, 200)


# ---------------------------------------------------------------------- TCP


def test_requested_rates_outlast_a_connection():
    async def scenario():
        async with serving(specs(TCP)) as server:
            link = server.vehicles[0].links[0]
            client = await Client.tcp(link)
            assert await client.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE, -1) == 0
            client.socket.close()
            client = await Client.tcp(link)
            return await client.names_until("HEARTBEAT")

    names = asyncio.run(scenario())
    assert "LOCAL_POSITION_NED" in names
    assert "ATTITUDE" not in names


def test_a_second_client_waits_until_the_first_has_gone():
    async def scenario():
        async with serving(specs(TCP)) as server:
            link = server.vehicles[0].links[0]
            first = await Client.tcp(link)
            await first.receive("HEARTBEAT")
            second = await Client.tcp(link)
            await second.send(command(*ARM))
            await first.receive("HEARTBEAT")
            before = second.hears_nothing(), server.vehicles[0].autopilot.armed
            first.socket.close()
            result = (await second.receive("COMMAND_ACK")).result
            return before, result

    assert asyncio.run(scenario()) == ((True, False), 0)


def test_a_reset_connection_makes_room_for_the_next():
    async def scenario():
        async with serving(specs(TCP)) as server:
            link = server.vehicles[0].links[0]
            rude = await Client.tcp(link)
            await rude.receive("HEARTBEAT")
            rude.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            rude.socket.close()
            client = await Client.tcp(link)
            return (await client.receive("HEARTBEAT")).get_srcSystem()

    assert asyncio.run(scenario()) == 1


def test_half_a_frame_of_the_one_before_is_forgotten():
    async def scenario():
        async with serving(specs(TCP)) as server:
            link = server.vehicles[0].links[0]
            first = await Client.tcp(link)
            frame = first.encoder.encode(command(*ARM))
            first.socket.send(frame[:10])
            first.socket.close()
            second = await Client.tcp(link)
            second.socket.send(frame[10:])
            await second.send(heartbeat())
            await second.receive("HEARTBEAT")
            return server.vehicles[0].autopilot.armed

    assert asyncio.run(scenario()) is False


def test_a_vehicle_may_wait_for_its_client_to_boot():
    async def scenario():
        async with serving(specs(TCP + ":wait", UDP)) as server:
            vehicle = server.vehicles[0]
            other = await Client.to(vehicle.links[1])
            await other.send(heartbeat())
            await until(lambda: vehicle.links[1].counts.received == 1)
            before = vehicle.autopilot
            client = await Client.tcp(vehicle.links[0])
            first = await client.receive("ATTITUDE")
            client.socket.close()
            await until(lambda: vehicle.autopilot.truth().boot_us > 1_000_000)
            again = await Client.tcp(vehicle.links[0])
            return before, first.time_boot_ms, (await again.receive("ATTITUDE")).time_boot_ms

    before, first_ms, again_ms = asyncio.run(scenario())
    assert before is None
    assert first_ms < 50
    assert again_ms >= 1000, "it does not boot twice"


def test_a_slow_reader_gets_the_latest_and_the_rest_is_counted():
    frames = [Encoder(1, 1).encode(mavlink.MAVLink_ping_message(number, 0, 0, 0)) for number in range(60_000)]

    async def scenario():
        loop = asyncio.get_running_loop()
        link = TcpLink(loop, parse_endpoint(TCP, "px4"), lambda _: None, lambda: None)
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.setblocking(False)
        try:
            await loop.sock_connect(client, place(link))
            await until(lambda: link._client is not None)
            link._client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
            for frame in frames:
                link.send([frame])
            dropped, waiting = link.counts.dropped, link._waiting_bytes
            read, framer = [], Framer()
            while not read or decode(read[-1]).time_usec != len(frames) - 1:
                read += framer.push(await asyncio.wait_for(loop.sock_recv(client, 65535), LIMIT_S))
            return dropped, waiting, [decode(frame).time_usec for frame in read], framer.bad_chunks
        finally:
            client.close()
            link.close()

    dropped, waiting, numbers, bad = asyncio.run(scenario())
    assert dropped > 0
    assert waiting <= 64 * 1024
    assert len(numbers) == len(frames) - dropped
    assert numbers == sorted(numbers)
    assert bad == 0, "only whole frames are dropped"


# ---------------------------------------------------------------------- ports that cannot be opened


@pytest.mark.parametrize(("url", "kind"), [(UDP, socket.SOCK_DGRAM), (TCP, socket.SOCK_STREAM)])
def test_a_port_in_use_is_an_error_and_leaves_none_open(url, kind):
    with socket.socket(socket.AF_INET, kind) as other, socket.socket() as probe:
        other.bind(("127.0.0.1", 0))
        if kind == socket.SOCK_STREAM:
            other.listen()
        probe.bind(("127.0.0.1", 0))
        free = probe.getsockname()[1]
        probe.close()
        taken = url.replace(":0", f":{other.getsockname()[1]}")

        async def scenario():
            async with Server(specs(f"tcpin:127.0.0.1:{free}", taken), SimClock(START_US)):
                pass

        with pytest.raises(EndpointError) as caught:
            asyncio.run(scenario())
        assert caught.value.message.startswith(f"{taken}: cannot be opened (address already in use)")
        assert "--instance" in caught.value.hint
        assert caught.value.exit_code == 2
        with socket.create_server(("127.0.0.1", free)):
            pass


@pytest.mark.parametrize(
    "url", ["udpin:no.such.host.invalid:1", f"tcpin:{'x' * 70}.y:1", "udpout:no.such.host.invalid:1"]
)
def test_an_unknown_host_is_an_error(url):
    async def scenario():
        async with Server(specs(url), SimClock(START_US)):
            pass

    with pytest.raises(EndpointError, match="cannot be opened") as caught:
        asyncio.run(scenario())
    assert caught.value.hint == "check the host and the port"


def test_what_a_vehicle_raises_ends_the_run(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("a fault of ours")

    async def scenario():
        async with Server(specs(UDP), SimClock(START_US)) as server:
            monkeypatch.setattr(MockAutopilot, "on_deadline", broken)
            await asyncio.wait_for(server.run(), LIMIT_S)

    with pytest.raises(ZeroDivisionError):
        asyncio.run(scenario())


# ---------------------------------------------------------------------- time


class Wall:
    """A monotonic clock that stands until it is moved on."""

    def __init__(self):
        self.ns = 77

    def __call__(self):
        return self.ns

    def pass_s(self, seconds):
        self.ns += round(seconds * 1e9)


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 10.0])
def test_simulated_time_passes_at_its_speed(speed):
    wall = Wall()
    clock = SimClock(START_US, speed, wall)
    assert clock.now_us() == START_US
    wall.pass_s(3.0)
    assert clock.now_us() == START_US + speed * 3e6
    assert clock.real_s(round(speed * 1e6)) == 1.0
    clock.slip(1_000_000)
    assert clock.now_us() == START_US + speed * 3e6 - 1e6


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_vehicles_live_by_that_time(speed):
    async def scenario():
        wall = Wall()
        async with serving(specs(UDP, vehicles=2), clock=SimClock(START_US, speed, wall)) as server:
            wall.pass_s(0.08)
            await until(lambda: all(vehicle.autopilot.truth().boot_us == speed * 80_000 for vehicle in server.vehicles))
            for _ in range(100):
                await asyncio.sleep(0)
            return {vehicle.autopilot.truth().boot_us for vehicle in server.vehicles}

    assert asyncio.run(scenario()) == {speed * 80_000}


def test_time_slips_where_the_machine_is_too_slow():
    async def scenario():
        wall = Wall()
        clock = SimClock(START_US, 2.0, wall)
        async with serving(specs(UDP), clock=clock) as server:
            wall.pass_s(10.0)
            await until(lambda: server.vehicles[0].autopilot.truth().boot_us > 192_000)
            return server.vehicles[0].autopilot.truth().boot_us, clock.slipped_us

    boot_us, slipped_us = asyncio.run(scenario())
    assert boot_us == pytest.approx(200_000, abs=8000)
    assert slipped_us == pytest.approx(19_800_000, abs=8000)


def test_a_late_loop_serves_its_sockets_between_slices():
    async def scenario():
        wall = Wall()
        async with serving(specs(UDP), clock=SimClock(START_US, 1.0, wall)) as server:
            client = await Client.to(server.vehicles[0].links[0])
            await client.send(heartbeat())
            await until(lambda: server.vehicles[0].links[0].counts.received)
            wall.pass_s(0.1)
            seen = set()
            while max(seen, default=0) < 96_000:
                seen.add(server.vehicles[0].autopilot.truth().boot_us)
                await asyncio.sleep(0)
            return sorted(seen)

    seen = asyncio.run(scenario())
    assert max(after - before for before, after in itertools.pairwise(seen)) <= 24_000


class Wire:
    """A link without a socket."""

    def __init__(self):
        self.frames = []

    def send(self, frames):
        self.frames += frames


def inputs():
    """(stamp in us after the boot, frame): some at the same moment, some between two ticks."""
    encoder = Encoder(255, 190)
    messages = [heartbeat(), command(*ARM), command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0), heartbeat()]
    return [
        (at_us, encoder.encode(message)) for at_us, message in zip((6000, 6000, 9000, 41_004), messages, strict=True)
    ]


@pytest.mark.parametrize("link_table", [{"latency_ms": 0.0}, {"latency_ms": 1.0, "jitter_ms": 3.0}])
def test_a_loop_that_wakes_late_changes_no_byte(link_table):
    spec = VehicleSpec(config(link=link_table), 5, (parse_endpoint(UDP, "px4"),))
    link = ImpairedLink(MockAutopilot(spec.config, 5, START_US), spec.config.link, 5)
    wanted = []
    last_us = 0
    for at_us, frame in inputs():
        last_us = max(START_US + at_us, last_us + 4)
        wanted += [data for _, data in deliver(link, frame, last_us)]
    wanted += [data for _, data in advance(link, START_US + 2_000_000)]

    vehicle = Vehicle(spec)
    wire = Wire()
    vehicle.links = [wire]
    vehicle.boot(START_US)
    for at_us, frame in inputs():
        vehicle.take([frame], 0, START_US + at_us)
    for late_us in itertools.chain(range(50_000, 2_000_000, 70_004), (2_000_000,)):
        vehicle.advance(START_US + late_us)
    assert wire.frames == wanted
    assert len(wanted) > 500


def test_no_two_inputs_have_the_same_stamp(monkeypatch):
    stamps = []
    monkeypatch.setattr(ImpairedLink, "receive", lambda _, data, now_us, port: stamps.append(now_us - START_US))
    vehicle = Vehicle(specs(UDP)[0])
    vehicle.links = [Wire()]
    vehicle.boot(START_US)
    frames = [frame for _, frame in inputs()]
    vehicle.take(frames, 0, START_US + 8000)
    vehicle.take(frames[:1], 0, START_US + 8004)
    assert stamps == [8000, 8004, 8008, 8012, 8016]


def test_before_the_boot_nobody_hears():
    vehicle = Vehicle(specs(UDP)[0])
    vehicle.take([frame for _, frame in inputs()], 0, START_US)
    vehicle.advance(START_US)
    assert vehicle.autopilot is None


def test_a_deadline_that_does_not_move_on_is_our_error(monkeypatch):
    vehicle = Vehicle(specs(UDP)[0])
    vehicle.links = [Wire()]
    vehicle.boot(START_US)
    monkeypatch.setattr(ImpairedLink, "on_deadline", lambda *_: None)
    with pytest.raises(InternalError, match="does not move on"):
        vehicle.advance(START_US + 10_000)


def test_flights_are_counted():
    vehicle = Vehicle(specs(UDP)[0])
    vehicle.links = [Wire()]
    vehicle.boot(START_US)
    nan = float("nan")
    encoder = Encoder(255, 190)
    takeoff = command(mavlink.MAV_CMD_NAV_TAKEOFF, nan, nan, nan, nan, nan, nan, nan)
    for after_us, message in (
        (50_000, HEARTBEAT),  # without a ground station 1.13 turns back at once
        (100_000, command(*ARM)),
        (200_000, takeoff),
        (8_000_000, command(mavlink.MAV_CMD_NAV_LAND)),
    ):
        vehicle.take([encoder.encode(message)], 0, START_US + after_us)
    in_the_air = vehicle.flights
    for after_us in range(8_000_000, 25_000_000, 200_000):
        vehicle.advance(START_US + after_us)
    assert (in_the_air, vehicle.flights, vehicle.autopilot.armed) == (1, 1, False)


def test_percentiles_of_lateness():
    late = Lateness()
    assert late.percentile_ms(0.99) == 0.0
    for _ in range(98):
        late.add(0.00105)
    for seconds in (0.02, 100.0):
        late.add(seconds)
    assert late.percentile_ms(0.5) == pytest.approx(1.1)
    assert late.percentile_ms(0.99) == pytest.approx(20.1)
    assert late.percentile_ms(1.0) == pytest.approx(500.1)
