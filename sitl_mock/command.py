"""The command `sitl-mock`: its options, and the vehicles that they describe."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from mavquad.errors import InputError
from sitl_mock.cli import tell
from sitl_mock.clock import SimClock
from sitl_mock.config import MockConfig
from sitl_mock.endpoints import links_of, parse_endpoint
from sitl_mock.options import Options, load_config, three_numbers
from sitl_mock.server import Server, VehicleSpec
from sitl_mock.words import announcement, opening_lines, summary_lines

EXIT_CODES = """\
Exit codes: 0 ended by Ctrl-C, SIGTERM or, with --announce, the end of standard input; \
2 bad input: an option, a file, a port that is taken; 70 an error of the mock itself."""

_STDIN = 0
SPEED_MIN, SPEED_MAX = 0.01, 100.0
VEHICLES_MAX = 250

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def _option(panel: str, help_: str, *names: str, metavar: str | None = None, **more: Any) -> Any:
    return typer.Option(*names, help=help_, metavar=metavar, rich_help_panel=panel, **{"show_default": False, **more})


_VEHICLE, _WORLD, _LINKS = "The vehicle", "Its world", "Links and time"
_Autopilot = Annotated[str | None, _option(_VEHICLE, "px4 (the default) or ardupilot.", metavar="NAME")]
_Firmware = Annotated[
    str | None, _option(_VEHICLE, "PX4 1.13 (the default) to 1.17; ArduCopter 4.7.", metavar="RELEASE")
]
_Vehicle = Annotated[
    str | None,
    _option(_VEHICLE, "sih (PX4's, the default), arducopter (ArduPilot's), or a TOML file.", metavar="NAME|FILE"),
]
_Instance = Annotated[int, _option(_VEHICLE, "Number of the simulator, for its ports.", metavar="N", min=0, max=200)]
_Vehicles = Annotated[int, _option(_VEHICLE, "How many, in this one process.", metavar="N", min=1, max=VEHICLES_MAX)]
_SystemId = Annotated[
    int | None,
    _option(
        _VEHICLE,
        "System id of the first; else PX4's is its instance + 1, ArduPilot's is 1.",
        metavar="ID",
        min=1,
        max=255,
    ),
]
_Ready = Annotated[float | None, _option(_VEHICLE, "Time from boot until it can be armed.", metavar="SECONDS")]
_Wind = Annotated[str | None, _option(_WORLD, "Wind towards north, east, down in m/s, e.g. 3,0,0.", metavar="N,E,D")]
_Gusts = Annotated[float | None, _option(_WORLD, "Standard deviation of gusts in m/s.", metavar="M_S")]
_Faults = Annotated[
    list[Path] | None,
    _option(_WORLD, "TOML with \\[\\[fault]]: what goes wrong, and when. Repeatable.", metavar="FILE"),
]
_Seed = Annotated[
    int,
    _option(_WORLD, "Of everything random; the next vehicle has the next seed.", metavar="N", min=0, show_default=True),
]
_File = Annotated[
    Path | None,
    _option(
        _WORLD,
        "TOML: the mock's keys, or a file with a \\[mock] table; options win over it.",
        "--config",
        metavar="FILE",
    ),
]
_Endpoints = Annotated[
    list[str] | None,
    _option(
        _LINKS,
        "udpin:HOST:PORT, udpout:HOST:PORT or tcpin:HOST:PORT, in place of the usual ports. Repeatable.",
        "--endpoint",
        metavar="URL",
    ),
]
_AnswerAll = Annotated[
    bool, _option(_LINKS, "Answer everybody who speaks to a UDP port, not the first alone.", "--answer-all")
]
_Speed = Annotated[
    float,
    _option(_LINKS, "Times real time, e.g. 2 or 0.5.", metavar="X", min=SPEED_MIN, max=SPEED_MAX, show_default=True),
]
_Announce = Annotated[
    bool, _option(_LINKS, "Print the URLs for clients as JSON on stdout; end when stdin closes.", "--announce")
]


@app.command(epilog=EXIT_CODES)
def run(
    autopilot: _Autopilot = None,
    firmware: _Firmware = None,
    vehicle: _Vehicle = None,
    instance: _Instance = 0,
    vehicles: _Vehicles = 1,
    system_id: _SystemId = None,
    ready: _Ready = None,
    wind: _Wind = None,
    gusts: _Gusts = None,
    fault: _Faults = None,
    seed: _Seed = 1,
    config: _File = None,
    endpoint: _Endpoints = None,
    answer_all: _AnswerAll = False,
    speed: _Speed = 1.0,
    announce: _Announce = False,
) -> None:
    """Run mock vehicles that speak MAVLink, on the ports of the real simulators.

    PX4, instance N: UDP 14580+N speaks to 14540+N at once (companion computer; 14549 from N = 9 on), 18570+N to 14550
    (ground station).

    ArduPilot, instance N: TCP 5760+10N, 5762+10N, 5763+10N; it boots when a client connects to the first.

    Further vehicles are the next instances. With --endpoint, each vehicle listens one port higher than the one before.
    An endpoint may end in :gcs (PX4: a link for a ground station) or :wait (TCP: boot when a client connects).
    """
    options: Options = {
        "--autopilot": ("autopilot", autopilot),
        "--firmware": ("firmware", firmware),
        "--ready": ("ready_s", ready),
        "--wind": ("wind_ned_m_s", None if wind is None else three_numbers("--wind", wind)),
        "--gusts": ("gusts_m_s", gusts),
    }
    mock = load_config(config, options, vehicle, fault or ())
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
            with contextlib.suppress(OSError):  # nobody reads it
                print(json.dumps(announcement(server)), flush=True)  # noqa: T201 - for a program
            threading.Thread(target=_wait_for_end_of_input, args=(loop, server), daemon=True).start()
        tell(*opening_lines(server, speed))
        gc.freeze()  # what was imported stays: looking through it again would stop all vehicles for tens of milliseconds
        await server.run()
    # Behind the ^C that a terminal shows.
    tell(*([""] if sys.stderr is not None and sys.stderr.isatty() else []), *summary_lines(server, clock))


def _wait_for_end_of_input(loop: asyncio.AbstractEventLoop, server: Server) -> None:
    # Without Python's own buffer, whose lock a thread must not hold when the process ends.
    with contextlib.suppress(OSError, ValueError):
        while os.read(_STDIN, 4096):
            pass
    with contextlib.suppress(RuntimeError):
        loop.call_soon_threadsafe(server.stop)
