"""Streams under the live driver: TCP over loopback, serial over a pair of pseudo-terminals; lost, slow and back again."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import tty
from collections.abc import AsyncIterator, Callable

import pytest

from mavquad.drivers import transports
from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.endpoint import NEVER_US
from mavquad.errors import EndpointError
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.url import Address, Place, SerialPort

BEAT = Encoder(1, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3))
OTHER = Encoder(1, 1).encode(mavlink.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0))
LOOPBACK = "127.0.0.1"


class Echo:
    """Sends back what it gets."""

    def __init__(self) -> None:
        self.received: list[bytes] = []
        self._outbox: list[bytes] = []

    def receive(self, data: bytes, now_us: int) -> None:
        self.received.append(data)
        self._outbox.append(data)

    def next_deadline_us(self) -> int:
        return NEVER_US

    def on_deadline(self, now_us: int) -> None:
        raise AssertionError("it has no deadline")

    def datagrams_to_send(self) -> list[bytes]:
        outbox, self._outbox = self._outbox, []
        return outbox


class Chatty(Echo):
    """Sends frame after frame as a deadline, as fast as the loop turns."""

    deadline_us = 0

    def next_deadline_us(self) -> int:
        return self.deadline_us

    def on_deadline(self, now_us: int) -> None:
        self.deadline_us = now_us + 4000
        self._outbox += [BEAT] * 50


async def driving(place: Place, endpoint: Echo | None = None) -> tuple[LiveDriver, Echo]:
    clock, echo = Clock(), endpoint or Echo()
    echo.deadline_us = start_us = clock.now_us() & -4
    return await open_live(echo, place, clock, start_us), echo


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(20):
        while not condition():
            await asyncio.sleep(0)


class Server:
    """A TCP server that keeps its clients."""

    def __init__(self) -> None:
        self.clients: asyncio.Queue[tuple[asyncio.StreamReader, asyncio.StreamWriter]] = asyncio.Queue()
        self.port = 0

    async def start(self) -> None:
        async def keep(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await self.clients.put((reader, writer))

        self._server = await asyncio.start_server(keep, LOOPBACK, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    def stop(self) -> None:
        self._server.close()


@contextlib.asynccontextmanager
async def served() -> AsyncIterator[tuple[Server, LiveDriver, Echo]]:
    server = Server()
    await server.start()
    driver, echo = await driving(Address(False, LOOPBACK, server.port, "tcp"))
    yield server, driver, echo
    driver.close()
    server.stop()


def texts(driver: LiveDriver) -> str:
    return "; ".join(note.text for note in driver.take_notes())


def test_tcp_hands_on_frame_by_frame_however_the_stream_is_cut() -> None:
    async def scene() -> None:
        async with served() as (server, driver, echo):
            reader, writer = await server.clients.get()
            stream = b"rubbish" + BEAT + OTHER + BEAT
            for at in range(0, len(stream), 5):
                writer.write(stream[at : at + 5])
                await writer.drain()
                await asyncio.sleep(0)
            assert await reader.readexactly(len(stream) - 7) == BEAT + OTHER + BEAT
            assert echo.received == [BEAT, OTHER, BEAT]
            assert driver.runner.framer.bad_bytes == 7
            assert driver.port > 0
            writer.close()

    asyncio.run(scene())


def test_a_tcp_connection_that_is_lost_is_opened_again_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transports, "RECONNECT_S", 0.0)

    async def scene() -> None:
        async with served() as (server, driver, echo):
            _, writer = await server.clients.get()
            writer.write(BEAT[:10])
            await writer.drain()
            server.stop()
            writer.close()
            told: list[str] = []
            await until(lambda: bool(told.append(texts(driver)) or told[-1]))
            assert "the connection was lost" in told[-1]
            assert "tried again" in told[-1]
            driver.runner.command("receive", lambda now_us: echo.receive(OTHER, now_us), 1 << 60)
            assert driver.runner.dropped == 1  # nobody is there
            await server.start()
            reader, writer = await server.clients.get()
            await until(lambda: "connected again" in texts(driver))
            writer.write(BEAT[10:] + OTHER)  # the rest of a frame of another connection completes nothing
            assert await reader.readexactly(len(OTHER)) == OTHER
            assert echo.received == [OTHER, OTHER]
            writer.close()

    asyncio.run(scene())


def test_closing_while_it_tries_to_connect_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transports, "RECONNECT_S", 0.0)

    async def scene() -> None:
        async with served() as (server, driver, _):
            _, writer = await server.clients.get()
            server.stop()
            writer.close()
            await until(lambda: bool(texts(driver)))
            driver.close()
            await asyncio.sleep(0)
            assert len(asyncio.all_tasks()) == 1

    asyncio.run(scene())


def test_what_a_slow_peer_does_not_take_is_dropped_and_not_kept_for_later() -> None:
    async def scene() -> None:
        listener = socket.create_server((LOOPBACK, 0))
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        driver, _ = await driving(Address(False, LOOPBACK, listener.getsockname()[1], "tcp"), Chatty())
        client, _ = listener.accept()
        with listener, client:
            await until(lambda: driver.runner.dropped > 1000)
            assert len(driver.lateness_us) * len(BEAT) < 200_000
            driver.close()

    asyncio.run(scene())


def test_a_server_serves_one_client_and_then_the_next() -> None:
    async def scene() -> None:
        driver, echo = await driving(Address(True, LOOPBACK, 0, "tcp"))
        reader, writer = await asyncio.open_connection(LOOPBACK, driver.port)
        writer.write(BEAT)
        assert await reader.readexactly(len(BEAT)) == BEAT
        second, second_writer = await asyncio.open_connection(LOOPBACK, driver.port)
        with contextlib.suppress(ConnectionResetError):
            assert await second.read(1) == b""
        second_writer.close()
        assert driver.runner.strangers == 1
        writer.close()
        await until(lambda: "next client is waited for" in texts(driver))
        reader, writer = await asyncio.open_connection(LOOPBACK, driver.port)
        writer.write(OTHER)
        assert await reader.readexactly(len(OTHER)) == OTHER
        assert echo.received == [BEAT, OTHER]
        writer.close()
        driver.close()

    asyncio.run(scene())


# ---------------------------------------------------------------------- serial


class Pty:
    """A pair of pseudo-terminals; `name` is the end that is opened as a serial port."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self.master)
        os.set_blocking(self.master, False)
        self.name = os.ttyname(self._slave)
        self.is_open = True

    async def read(self, length: int) -> bytes:
        data = b""
        async with asyncio.timeout(20):
            while len(data) < length:
                with contextlib.suppress(BlockingIOError):
                    data += os.read(self.master, length - len(data))
                await asyncio.sleep(0)
        return data

    def unplug(self) -> None:
        if self.is_open:
            self.is_open = False
            os.close(self._slave)
            os.close(self.master)


@pytest.fixture
def device() -> Pty:
    pytest.importorskip("serialx", reason="serial ports need the extra 'serial'")
    return Pty()


def test_frames_go_in_and_out_of_a_serial_port(device: Pty) -> None:
    async def scene() -> None:
        driver, echo = await driving(SerialPort(device.name, 921600))
        os.write(device.master, BEAT[:7])
        await asyncio.sleep(0)
        os.write(device.master, BEAT[7:] + OTHER)
        assert await device.read(len(BEAT + OTHER)) == BEAT + OTHER
        assert echo.received == [BEAT, OTHER]
        assert driver.port == 0
        driver.close()
        await until(lambda: len(asyncio.all_tasks()) == 1)
        device.unplug()

    asyncio.run(scene())


def test_a_serial_port_that_vanishes_is_told_and_its_return_is_noticed(
    device: Pty, monkeypatch: pytest.MonkeyPatch, tmp_path
) -> None:
    monkeypatch.setattr(transports, "RECONNECT_S", 0.0)
    link = tmp_path / "ttyACM0"
    link.symlink_to(device.name)

    async def scene() -> None:
        driver, echo = await driving(SerialPort(str(link)))
        device.unplug()
        link.unlink()
        told: list[str] = []
        await until(lambda: bool(told.append(texts(driver)) or told[-1]))
        assert "the connection was lost" in told[-1]
        again = Pty()
        link.symlink_to(again.name)
        await until(lambda: "connected again" in texts(driver))
        os.write(again.master, OTHER)
        assert await again.read(len(OTHER)) == OTHER
        assert echo.received == [OTHER]
        driver.close()
        await until(lambda: len(asyncio.all_tasks()) == 1)
        again.unplug()

    asyncio.run(scene())


def test_a_serial_port_that_nobody_reads_is_not_filled_with_old_setpoints(device: Pty) -> None:
    async def scene() -> None:
        driver, _ = await driving(SerialPort(device.name), Chatty())
        await until(lambda: driver.runner.dropped > 1000)
        assert len(driver.lateness_us) * len(BEAT) < 70_000  # what the pair of pseudo-terminals holds by itself
        driver.close()
        await asyncio.sleep(0)
        device.unplug()
        await until(lambda: len(asyncio.all_tasks()) == 1)

    asyncio.run(scene())


# ---------------------------------------------------------------------- what cannot be opened


@pytest.mark.parametrize(
    ("place", "reason", "hint"),
    [
        (Address(False, LOOPBACK, 1, "tcp"), "connection refused", "nobody listens there"),
        (Address(False, "localhost", 1, "tcp"), "connection refused", "nobody listens there"),
        (Address(False, "no-such-host.invalid", 1, "tcp"), "cannot be opened", "check the host"),
        (Address(True, "192.0.2.1", 0, "tcp"), "cannot assign requested address", "check the host"),
        (SerialPort("/dev/no-such-device"), "no such file", "plugged in"),
        (SerialPort("/dev/null"), "inappropriate ioctl", "check the device"),
    ],
)
def test_what_cannot_be_opened_is_explained(place: Place, reason: str, hint: str) -> None:
    if isinstance(place, SerialPort):
        pytest.importorskip("serialx", reason="serial ports need the extra 'serial'")
    with pytest.raises(EndpointError) as caught:
        asyncio.run(driving(place))
    assert caught.value.message.startswith(f"{place}: cannot be opened")
    assert reason in caught.value.message
    assert hint in caught.value.hint


def test_without_the_extra_a_serial_port_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "serialx", None)
    with pytest.raises(EndpointError) as caught:
        asyncio.run(driving(SerialPort("/dev/ttyACM0")))
    assert "mavquad[serial]" in caught.value.hint
