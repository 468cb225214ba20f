"""`sitl-mock`: the mock autopilot on a UDP port of its own."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import sys
import threading
import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer

from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.errors import ConfigError, EndpointError, InputError, MavquadError
from mavquad.schema import parse_section
from mavquad.url import Address, parse_url
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink

PX4_LISTENS = "udpin:127.0.0.1:14580"
PX4_SPEAKS_TO = Address(listens=False, host="127.0.0.1", port=14540)
"""The ports of PX4's offboard link: it sends to 14540 before it has heard anything."""

_POLL_S = 0.5

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def run(
    listen: Annotated[str, typer.Option(help="Listen here and answer the first who speaks; port 0: a free one.")] = "",
    send: Annotated[str, typer.Option(help="Speak first, to this address.")] = "",
    config: Annotated[
        Path | None, typer.Option(help="TOML file: the mock's keys, or a file with a [mock] table.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sensors' and the link's randomness.")] = 1,
    wind: Annotated[str, typer.Option(help="Wind towards N,E,D in m/s, e.g. 3,0,0; overrides the file.")] = "",
    firmware: Annotated[str, typer.Option(help="PX4 version imitated: 1.13, 1.15 or 1.16; overrides the file.")] = "",
    announce: Annotated[bool, typer.Option(help="Print the bound address as JSON; end when stdin closes.")] = False,
) -> None:
    """Run a mock PX4 with a simulated quadcopter; without options it behaves as PX4 SITL on ports 14580 and 14540."""
    mock = load_config(config, wind, firmware)
    address, speak_to = addresses(listen, send)
    asyncio.run(_serve(mock, seed, address, speak_to, announce))


def load_config(path: Path | None, wind: str, firmware: str) -> MockConfig:
    """The configuration in a file (or the default one), with the options laid over it.

    Raises:
        ConfigError: the file cannot be read or a value is not allowed.
        InputError: the wind is not three numbers.
    """
    table = _read(path) if path is not None else {}
    if wind:
        table["wind_ned_m_s"] = _three_numbers(wind)
    if firmware:
        table["firmware"] = firmware
    return parse_section(MockConfig, table, str(path) if path is not None else "sitl-mock", "mock")


def _read(path: Path) -> dict[str, Any]:
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ConfigError(str(path), "", reason) from None
    table = document.get("mock", document)
    if not isinstance(table, dict):
        raise ConfigError(str(path), "mock", "must be a table")
    return table


def _three_numbers(text: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3:
        raise InputError(f"--wind {text}: not three numbers", "write N,E,D in m/s, e.g. --wind 3,0,0")
    return numbers


def addresses(listen: str, send: str) -> tuple[Address, Address | None]:
    """(the socket's address, the peer to speak to at once); without options those of PX4.

    Raises:
        InputError: both options are given, or one of the wrong kind.
    """
    if listen and send:
        raise InputError("--listen and --send exclude each other", "give one of them, or neither")
    if listen or send:
        address = parse_url(listen or send)
        if address.listens is not bool(listen):
            wanted = "udpin:HOST:PORT" if listen else "udpout:HOST:PORT"
            raise EndpointError(listen or send, f"--{'listen' if listen else 'send'} takes {wanted}")
        return address, None
    return parse_url(PX4_LISTENS), PX4_SPEAKS_TO


async def _serve(mock: MockConfig, seed: int, address: Address, speak_to: Address | None, announce: bool) -> None:
    clock = Clock()
    start_us = clock.now_us()
    endpoint = ImpairedLink(MockAutopilot(mock, seed, start_us), mock.link, seed)
    driver = await open_live(endpoint, address, clock, start_us, speak_to=speak_to)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):
            loop.add_signal_handler(number, stop.set)
    _tell(driver, address, announce)
    if announce:
        threading.Thread(target=_wait_for_end_of_input, args=(loop, stop), daemon=True).start()
    try:
        while not stop.is_set():
            await driver.wait(_POLL_S)
    finally:
        driver.close()


def _tell(driver: LiveDriver, address: Address, announce: bool) -> None:
    if announce:
        typer.echo(json.dumps({"url": f"udpout:{address.host}:{driver.port}"}))
    elif address.listens:
        typer.echo(f"mock PX4 listens at {address.host}:{driver.port}; Ctrl-C ends it", err=True)
    else:
        typer.echo(f"mock PX4 speaks to {address.host}:{address.port}; Ctrl-C ends it", err=True)


def _wait_for_end_of_input(loop: asyncio.AbstractEventLoop, stop: asyncio.Event) -> None:
    with contextlib.suppress(OSError, ValueError):
        while sys.stdin.buffer.read(4096):
            pass
    with contextlib.suppress(RuntimeError):
        loop.call_soon_threadsafe(stop.set)


def main() -> None:
    """Entry point: an error becomes one message and its exit code."""
    try:
        app()
    except MavquadError as error:
        typer.echo(f"error: {error.message}", err=True)
        if error.hint:
            typer.echo(f"       {error.hint}", err=True)
        raise SystemExit(error.exit_code) from None
    except Exception as error:  # noqa: BLE001 - no traceback reaches a user
        typer.echo(f"error in the mock autopilot itself: {type(error).__name__}: {error}", err=True)
        raise SystemExit(MavquadError.exit_code) from None


if __name__ == "__main__":
    main()
