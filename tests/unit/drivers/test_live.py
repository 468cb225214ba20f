"""The live driver on loopback sockets, in real time but without waiting for it: everything is an event."""

import asyncio
import socket
import sys
import time

import pytest

from mavquad.drivers import transports
from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.endpoint import NEVER_US
from mavquad.errors import EndpointError
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.url import Address

PING = Encoder(7, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3))
STALL_NS = 300_000_000
VEHICLE = Encoder(1, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3))


class Echo:
    """Sends back what it gets; fails on demand."""

    def __init__(self) -> None:
        self.received: list[tuple[int, bytes]] = []
        self.fired: list[int] = []
        self.deadline_us = NEVER_US
        self.fails = False
        self._outbox: list[bytes] = []

    def receive(self, data: bytes, now_us: int) -> None:
        if self.fails:
            raise ZeroDivisionError("planted")
        self.received.append((now_us, data))
        self._outbox.append(data)

    def next_deadline_us(self) -> int:
        return self.deadline_us

    def on_deadline(self, now_us: int) -> None:
        self.fired.append(now_us)
        self.deadline_us = NEVER_US
        self._outbox.append(PING)

    def datagrams_to_send(self) -> list[bytes]:
        outbox, self._outbox = self._outbox, []
        return outbox


async def listening(echo: Echo) -> tuple[LiveDriver, socket.socket]:
    clock = Clock()
    driver = await open_live(echo, Address(True, "127.0.0.1", 0), clock, clock.now_us())
    peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    peer.setblocking(False)
    peer.connect(("127.0.0.1", driver.port))
    return driver, peer


async def answer(peer: socket.socket) -> bytes:
    return await asyncio.wait_for(asyncio.get_running_loop().sock_recv(peer, 2000), 10)


def test_frames_go_in_and_out() -> None:
    async def scene() -> None:
        echo = Echo()
        driver, peer = await listening(echo)
        with peer:
            peer.send(b"rubbish" + PING + PING)
            assert await answer(peer) == PING
            assert await answer(peer) == PING
        (one_us, _), (other_us, _) = echo.received
        assert other_us == one_us + 4
        assert one_us % 4 == 0
        assert driver.runner.framer.bad_bytes == len(b"rubbish")
        assert len(driver.lateness_us) == 2
        driver.close()

    asyncio.run(scene())


def test_the_first_who_speaks_is_the_peer() -> None:
    async def scene() -> None:
        echo = Echo()
        driver, peer = await listening(echo)
        with peer, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            peer.send(PING)
            assert await answer(peer) == PING
            stranger.sendto(PING, ("127.0.0.1", driver.port))
            peer.send(PING)
            assert await answer(peer) == PING
        assert len(echo.received) == 2
        assert driver.runner.strangers == 1
        driver.close()

    asyncio.run(scene())


def test_until_the_vehicle_is_known_nobody_takes_its_place() -> None:
    async def scene() -> None:
        echo = Echo()
        clock = Clock()

        def known() -> bool:
            return any(frame == VEHICLE for _, frame in echo.received)

        driver = await open_live(echo, Address(True, "127.0.0.1", 0), clock, clock.now_us(), locked=known)
        first, vehicle = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        with first, vehicle:
            for peer in (first, vehicle):
                peer.setblocking(False)
                peer.connect(("127.0.0.1", driver.port))
            first.send(PING)
            assert await answer(first) == PING
            first.send(VEHICLE[:9])
            vehicle.send(VEHICLE[9:])  # completes no frame: the two are not one stream
            vehicle.send(VEHICLE)
            assert await answer(vehicle) == VEHICLE
            first.send(PING)
            vehicle.send(PING)
            assert await answer(vehicle) == PING
        assert [frame for _, frame in echo.received] == [PING, VEHICLE, PING]
        assert driver.runner.strangers == 1
        driver.close()

    asyncio.run(scene())


def test_a_deadline_fires_at_its_own_time_however_late_the_wake_up() -> None:
    async def scene() -> None:
        echo = Echo()
        clock = Clock()
        start_us = clock.now_us()
        echo.deadline_us = (start_us - 50_000) & -4
        driver = await open_live(echo, Address(True, "127.0.0.1", 0), clock, start_us)
        while not echo.fired:
            await asyncio.sleep(0)
        assert echo.fired == [(start_us - 50_000) & -4]
        driver.close()

    asyncio.run(scene())


def test_what_an_endpoint_raises_reaches_the_one_who_waits() -> None:
    async def scene() -> None:
        echo = Echo()
        driver, peer = await listening(echo)
        with peer:
            peer.send(PING)
            await answer(peer)
            echo.fails = True
            peer.send(PING)
            with pytest.raises(ZeroDivisionError, match="planted"):
                await driver.wait(10.0)
            echo.deadline_us = 4
            driver.abandon([b"last words"])
            assert await answer(peer) == b"last words"
            driver.close()
        assert echo.fired == []

    asyncio.run(scene())


@pytest.mark.parametrize(
    ("address", "words"),
    [
        (Address(True, "192.0.2.1", 0), "cannot assign requested address"),
        (Address(False, "no-such-host.invalid", 14550), "cannot be opened"),
        (Address(False, "host..local", 14550), "no host name"),
        (Address(True, "a" * 64, 14550), "no host name"),
    ],
)
def test_a_port_that_cannot_be_opened(address: Address, words: str) -> None:
    async def scene() -> None:
        clock = Clock()
        await open_live(Echo(), address, clock, clock.now_us())

    with pytest.raises(EndpointError, match=words):
        asyncio.run(scene())


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's stamps of datagrams are Linux's")
def test_what_waited_while_we_stalled_counts_as_of_its_own_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stall of 0.3 s, by the clock, between the datagrams' arrival and the reading of them."""

    async def scene() -> None:
        echo = Echo()
        driver, peer = await listening(echo)
        clock = driver._clock
        with peer:
            peer.send(PING)
            sent_us = clock.now_us()
            monkeypatch.setattr(clock, "_offset_ns", clock._offset_ns + STALL_NS)
            monkeypatch.setattr(transports.time, "time_ns", lambda now=time.time_ns: now() + STALL_NS)
            # Due in the middle of the stall: it fires behind what had arrived before it.
            echo.deadline_us = driver.runner.deadline_us = sent_us // 4 * 4 + 200_000
            await answer(peer)
            await answer(peer)
        [(first_us, _)] = echo.received
        assert abs(first_us - sent_us) < 150_000
        assert first_us < echo.fired[0] == sent_us // 4 * 4 + 200_000
        driver.close()

    asyncio.run(scene())
