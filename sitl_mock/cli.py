"""`sitl-mock`: mock vehicles on the ports of the real simulators, or on those that are named."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from mavquad.errors import InputError, MavquadError
from sitl_mock.clock import SimClock
from sitl_mock.config import MockConfig
from sitl_mock.endpoints import links_of, parse_endpoint
from sitl_mock.options import load_config, three_numbers
from sitl_mock.server import Server, VehicleSpec
from sitl_mock.words import announcement, opening_lines, summary_lines

EXIT_CODES = """\
Exit codes: 0 ended by Ctrl-C, SIGTERM, or with --announce the end of standard input; 2 bad input: an option, a file,
a port that is taken; 70 an error of the mock itself."""

SPEED_MIN, SPEED_MAX = 0.01, 100.0
VEHICLES_MAX = 250

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

_VEHICLE, _WORLD, _LINKS = "The vehicle", "Its world", "Links and time"


@app.command(epilog=EXIT_CODES)
def run(
    autopilot: Annotated[
        str | None, typer.Option(help="px4 (default) or ardupilot.", show_default=False, rich_help_panel=_VEHICLE)
    ] = None,
    firmware: Annotated[
        str | None,
        typer.Option(
            help="Release: 1.13 (default), 1.15 or 1.16 of PX4; 4.7 of ArduCopter.",
            show_default=False,
            rich_help_panel=_VEHICLE,
        ),
    ] = None,
    instance: Annotated[
        int, typer.Option(min=0, max=200, help="Number of the simulator, for its ports.", rich_help_panel=_VEHICLE)
    ] = 0,
    vehicles: Annotated[
        int, typer.Option(min=1, max=VEHICLES_MAX, help="How many, in this process.", rich_help_panel=_VEHICLE)
    ] = 1,
    system_id: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=255,
            help="MAVLink system id of the first; else PX4's is its instance + 1, ArduPilot's 1.",
            show_default=False,
            rich_help_panel=_VEHICLE,
        ),
    ] = None,
    ready: Annotated[
        float | None,
        typer.Option(help="Seconds from boot until it can arm.", show_default=False, rich_help_panel=_VEHICLE),
    ] = None,
    wind: Annotated[
        str | None,
        typer.Option(help="Wind towards N,E,D in m/s, e.g. 3,0,0.", show_default=False, rich_help_panel=_WORLD),
    ] = None,
    gusts: Annotated[
        float | None, typer.Option(help="Standard deviation of gusts, m/s.", show_default=False, rich_help_panel=_WORLD)
    ] = None,
    fault: Annotated[
        list[Path] | None,
        typer.Option(
            help="TOML file with \\[\\[faults]]; may be repeated.", show_default=False, rich_help_panel=_WORLD
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Of everything random; vehicle k has seed + k.", rich_help_panel=_WORLD)
    ] = 1,
    config: Annotated[
        Path | None,
        typer.Option(
            help="TOML file: the mock's keys, or a file with a \\[mock] table. Options win.",
            show_default=False,
            rich_help_panel=_WORLD,
        ),
    ] = None,
    endpoint: Annotated[
        list[str] | None,
        typer.Option(
            help="udpin:HOST:PORT, udpout:HOST:PORT or tcpin:HOST:PORT in place of the usual ports; may be repeated.",
            show_default=False,
            rich_help_panel=_LINKS,
        ),
    ] = None,
    answer_all: Annotated[
        bool,
        typer.Option(
            "--answer-all", help="Answer everybody on a UDP port, not the first alone.", rich_help_panel=_LINKS
        ),
    ] = False,
    speed: Annotated[
        float,
        typer.Option(min=SPEED_MIN, max=SPEED_MAX, help="Simulated seconds a second.", rich_help_panel=_LINKS),
    ] = 1.0,
    announce: Annotated[
        bool,
        typer.Option(
            "--announce",
            help="Print the URLs for clients as JSON on stdout; end when stdin closes.",
            rich_help_panel=_LINKS,
        ),
    ] = False,
) -> None:
    """Run mock vehicles that speak MAVLink, on the ports of the real simulators.

    PX4, instance N: from UDP 14580+N to 14540+N (companion computer), from 18570+N to 14550 (ground station).
    ArduPilot, instance N: TCP 5760+10N, 5762+10N and 5763+10N; it boots when a client connects to the first of them.
    Further vehicles are the next instances; with --endpoint, each listens one port higher.
    """
    options: dict[str, Any] = {
        "autopilot": autopilot,
        "firmware": firmware,
        "ready_s": ready,
        "gusts_m_s": gusts,
        "wind_ned_m_s": None if wind is None else three_numbers("--wind", wind),
    }
    mock = load_config(config, options, fault or ())
    first_id = first_system_id(mock, system_id, instance)
    specs = fleet(mock, vehicles, instance, first_id, seed, endpoint or [])
    asyncio.run(_serve(specs, speed, answer_all, announce))


def first_system_id(mock: MockConfig, option: int | None, instance: int) -> int:
    """The system id of the first vehicle: the option's, the file's, or as the real simulator numbers itself."""
    if option is not None:
        return option
    if "system_id" in mock.model_fields_set or mock.autopilot == "ardupilot":
        return mock.system_id
    return instance + 1


def fleet(
    mock: MockConfig, vehicles: int, instance: int, first_id: int, seed: int, endpoints: list[str]
) -> list[VehicleSpec]:
    """Vehicles alike, with their own ids, seeds and links.

    Raises:
        EndpointError: an endpoint cannot be understood.
        InputError: a system id would be beyond 255.
    """
    if first_id + vehicles - 1 > 255:
        raise InputError(
            f"--vehicles {vehicles}: system ids would run from {first_id} to {first_id + vehicles - 1}",
            "MAVLink's end at 255: choose --system-id, or fewer vehicles",
        )
    named = [parse_endpoint(url, mock.autopilot) for url in endpoints]
    return [
        VehicleSpec(
            mock.model_copy(update={"system_id": first_id + number}),
            seed + number,
            links_of(mock.autopilot, instance, named, number),
        )
        for number in range(vehicles)
    ]


async def _serve(specs: list[VehicleSpec], speed: float, answer_all: bool, announce: bool) -> None:
    clock = SimClock(time.time_ns() // 1000, speed)
    loop = asyncio.get_running_loop()
    async with Server(specs, clock, answer_all) as server:
        for number in (signal.SIGINT, signal.SIGTERM):
            with contextlib.suppress(NotImplementedError):
                loop.add_signal_handler(number, server.stop)
        if announce:
            typer.echo(json.dumps(announcement(server)))
            threading.Thread(target=_wait_for_end_of_input, args=(loop, server), daemon=True).start()
        _tell(opening_lines(server, speed))
        await server.run()
    _tell(summary_lines(server, clock))


def _tell(lines: list[str]) -> None:
    """On stderr; one who no longer reads changes nothing."""
    with contextlib.suppress(OSError):
        for line in lines:
            typer.echo(line, err=True)


def _wait_for_end_of_input(loop: asyncio.AbstractEventLoop, server: Server) -> None:
    with contextlib.suppress(OSError, ValueError):
        while sys.stdin.buffer.read(4096):
            pass
    with contextlib.suppress(RuntimeError):
        loop.call_soon_threadsafe(server.stop)


def main() -> None:
    """Entry point: an error becomes one message and its exit code."""
    try:
        app()
    except MavquadError as error:
        _tell([f"error: {error.message}", *([f"       {error.hint}"] if error.hint else [])])
        raise SystemExit(error.exit_code) from None
    except Exception as error:  # noqa: BLE001 - no traceback reaches a user
        _tell([f"error in the mock autopilot itself: {type(error).__name__}: {error}"])
        raise SystemExit(MavquadError.exit_code) from None


if __name__ == "__main__":
    main()
