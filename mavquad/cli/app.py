"""The commands and their options."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavquad import __version__
from mavquad.cli.log_part import LogPart
from mavquad.cli.outcome import EXIT_CODES, run
from mavquad.errors import ConfigError

if TYPE_CHECKING:
    from mavquad.config import Override

Options = dict[str, dict[str, object]]
"""Of each option, the keys of the configuration that it sets; None leaves a key as it is."""

app = typer.Typer(
    name="mavquad",
    help="Flies quadcopters over MAVLink with a robust output-feedback law.",
    epilog=EXIT_CODES.replace("\n", "\n\n"),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mavquad {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Flies quadcopters over MAVLink with a robust output-feedback law."""


ConfigArgument = Annotated[
    Path | None,
    typer.Argument(help="Configuration (TOML); without it, the one for the bundled mock.", show_default=False),
]
ConnectOption = Annotated[
    str | None,
    typer.Option(
        help="Vehicle: udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, /dev/ttyACM0,57600.", show_default=False
    ),
]
MissionOption = Annotated[
    str | None,
    typer.Option(help="hover, box, goto, circle, figure_eight, waypoints, file.", show_default=False),
]
GotoOption = Annotated[
    str | None, typer.Option(help="Fly there: N,E,D in m from the hand-over point.", show_default=False)
]
FileOption = Annotated[
    Path | None,
    typer.Option(help="Fly a trajectory: CSV with t_s,north_m,east_m,down_m[,yaw_deg].", show_default=False),
]
DurationOption = Annotated[
    float | None, typer.Option(help="Seconds under the law; 0: the mission's own length.", show_default=False)
]
DepthOption = Annotated[
    str | None,
    typer.Option(help="What the law commands: torque, rate, attitude; auto: by the firmware.", show_default=False),
]
LawOption = Annotated[str | None, typer.Option(help="output-feedback or state-feedback.", show_default=False)]
ForceOption = Annotated[bool, typer.Option("--force", help="Fly gains that leave no margin on this link all the same.")]
SeedOption = Annotated[int | None, typer.Option(help="Seed of the mock's noise and losses.", show_default=False)]
SetOption = Annotated[
    list[str] | None, typer.Option("--set", help="Any key of the configuration: key.path=value.", show_default=False)
]
RunDirOption = Annotated[Path | None, typer.Option(help="Run folder; new, or empty.", show_default=False)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the summary, and nothing else, on stdout.")]
WindOption = Annotated[str | None, typer.Option(help="Of the mock: wind N,E,D in m/s.", show_default=False)]
AutopilotOption = Annotated[str | None, typer.Option(help="Of the mock: px4 or ardupilot.", show_default=False)]
FirmwareOption = Annotated[
    str | None, typer.Option(help="Of the mock: PX4 1.13 to 1.17; ArduCopter 4.7.", show_default=False)
]
VehicleOption = Annotated[
    str | None, typer.Option(help="Of the mock: sih, arducopter, or a TOML file.", show_default=False)
]
FaultOption = Annotated[
    list[Path] | None,
    typer.Option(help="Of the mock: TOML file of scripted faults; may be repeated.", show_default=False),
]
LatencyOption = Annotated[float | None, typer.Option(help="Delay of the link, each way, ms.", show_default=False)]
SystemOption = Annotated[
    int | None, typer.Option(help="Only this vehicle of a log of others: system id.", show_default=False)
]
FromOption = Annotated[
    str | None,
    typer.Option(
        "--from", help="Only from there: 12.5 (s), 2026-05-01T10:20:30Z, flight:1, mode:GUIDED.", show_default=False
    ),
]
ToOption = Annotated[str | None, typer.Option(help="Only up to there; as --from.", show_default=False)]
JitterOption = Annotated[float | None, typer.Option(help="Largest further delay, each way, ms.", show_default=False)]
LossOption = Annotated[float | None, typer.Option(help="Share of frames lost, each way, 0 to 1.", show_default=False)]


@app.command(epilog="Exit codes: see mavquad --help.")
def fly(
    config: ConfigArgument = None,
    connect: ConnectOption = None,
    mission: MissionOption = None,
    goto: GotoOption = None,
    file: FileOption = None,
    duration: DurationOption = None,
    depth: DepthOption = None,
    law: LawOption = None,
    force: ForceOption = False,
    seed: SeedOption = None,
    wind: WindOption = None,
    autopilot: AutopilotOption = None,
    firmware: FirmwareOption = None,
    vehicle: VehicleOption = None,
    fault: FaultOption = None,
    set_: SetOption = None,
    run_dir: RunDirOption = None,
    json: JsonOption = False,
) -> int:
    """Fly a mission on a vehicle; without --connect, on a mock autopilot that it starts itself."""
    from mavquad.cli.fly import fly as command

    options: Options = {
        "--connect": {"link.url": connect},
        **_mission(mission, goto, file, duration),
        **_law(depth, law, force),
        **_mock(seed, wind, autopilot, firmware, vehicle),
    }
    return command(config, _overrides(set_, options, fault), run_dir, json)


@app.command(epilog="Exit codes: see mavquad --help.")
def sim(
    config: ConfigArgument = None,
    mission: MissionOption = None,
    goto: GotoOption = None,
    file: FileOption = None,
    duration: DurationOption = None,
    depth: DepthOption = None,
    law: LawOption = None,
    force: ForceOption = False,
    seed: SeedOption = None,
    wind: WindOption = None,
    autopilot: AutopilotOption = None,
    firmware: FirmwareOption = None,
    vehicle: VehicleOption = None,
    fault: FaultOption = None,
    latency_ms: LatencyOption = None,
    jitter_ms: JitterOption = None,
    loss: LossOption = None,
    set_: SetOption = None,
    run_dir: RunDirOption = None,
    json: JsonOption = False,
) -> int:
    """Fly the same agent on the same mock in lockstep: virtual time, deterministic, as fast as the machine can."""
    from mavquad.cli.sim import sim as command

    options: Options = {
        **_mission(mission, goto, file, duration),
        **_law(depth, law, force),
        **_mock(seed, wind, autopilot, firmware, vehicle),
        "--latency-ms": {"mock.link.latency_ms": latency_ms},
        "--jitter-ms": {"mock.link.jitter_ms": jitter_ms},
        "--loss": {"mock.link.loss": loss},
    }
    return command(config, _overrides(set_, options, fault), run_dir, json)


@app.command(epilog="Exit codes: see mavquad --help.")
def replay(
    log: Annotated[
        Path, typer.Argument(help="RUN/flight.tlog of a flight of ours, or any other tlog.", show_default=False)
    ],
    config: Annotated[
        Path | None, typer.Option(help="What the law of this configuration would have commanded.", show_default=False)
    ] = None,
    depth: DepthOption = None,
    law: LawOption = None,
    set_: SetOption = None,
    output: Annotated[Path | None, typer.Option(help="Where the figure goes, PNG.", show_default=False)] = None,
    play: Annotated[
        str | None, typer.Option(help="Play the log to whoever listens there: udpout:HOST:PORT.", show_default=False)
    ] = None,
    speed: Annotated[float, typer.Option(help="Of --play: seconds of the log in a second.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Of --play: begin anew at the end.")] = False,
    direction: Annotated[str, typer.Option(help="Of --play: in (the vehicle's), out, both.")] = "in",
    list_: Annotated[bool, typer.Option("--list", help="What is in it, and nothing else.")] = False,
    system: SystemOption = None,
    from_: FromOption = None,
    to: ToOption = None,
    json: JsonOption = False,
) -> int:
    """Replay a flight of ours bit for bit, or with another law beside it; survey any other tlog, our law in its shadow;
    or play any to a ground station."""
    part = LogPart(system, from_, to)
    if list_:
        from mavquad.cli.replay_list import list_log

        return list_log(log, part, json)
    if play is not None:
        from mavquad.cli.replay_playback import PlayOptions
        from mavquad.cli.replay_playback import play as play_log

        wanted = part.selection(log)
        return play_log(
            log, PlayOptions(play, speed, loop, direction, wanted.system, wanted.from_us, wanted.to_us), json
        )
    from mavquad.cli.replay import replay as command
    from mavquad.cli.replay_flight import OtherLaw

    other = OtherLaw(config, tuple(_overrides(set_, _law(depth, law, force=False))))
    return command(log, part, other, output, json)


@app.command(epilog="Exit codes: see mavquad --help.")
def report(
    run_or_log: Annotated[
        Path, typer.Argument(help="A run folder of fly or sim, or any .tlog, .raw or .gz.", show_default=False)
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Its folder; by default the run folder, or NAME-report.", show_default=False
        ),
    ] = None,
    export: Annotated[
        str | None, typer.Option(help="mcap: a file for Foxglove and PlotJuggler besides.", show_default=False)
    ] = None,
    system: SystemOption = None,
    from_: FromOption = None,
    to: ToOption = None,
    json: JsonOption = False,
) -> int:
    """Write the report of a flight or of any log: an HTML page that needs no network, a figure, and its columns."""
    from mavquad.cli.report import report as command

    return command(run_or_log, LogPart(system, from_, to), output, export, json)


@app.command(epilog="Exit codes: see mavquad --help.")
def identify(
    log: Annotated[Path, typer.Argument(help="RUN/flight.tlog, or any other tlog.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Draw the fits into this PNG.", show_default=False)
    ] = None,
    own: Annotated[
        bool, typer.Option("--own", help="From the autopilot's own rate commands, even if there are others.")
    ] = False,
    json: JsonOption = False,
) -> int:
    """Identify delay, lag and gain of a vehicle's answer to commands from a flight's log."""
    from mavquad.cli.identify import identify as command

    return command(log, output, own, json)


@app.command(epilog="Exit codes: see mavquad --help; 3 also if it is not ready to arm.")
def check(
    url: Annotated[
        str,
        typer.Argument(help="Vehicle: udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, /dev/ttyACM0,57600; mock."),
    ],
    duration: Annotated[float, typer.Option(help="Seconds that it is measured.", min=0.5, max=3600.0)] = 5.0,
    rate: Annotated[float, typer.Option(help="Hz, asked of attitude and position.", min=1.0, max=1000.0)] = 100.0,
    system: Annotated[int | None, typer.Option(help="Its system id; else the first.", show_default=False)] = None,
    key: Annotated[
        Path | None, typer.Option(help="File with the key of MAVLink 2 signing.", show_default=False)
    ] = None,
    set_: SetOption = None,
    json: JsonOption = False,
) -> int:
    """Who is there, what arrives, round trip and clock, what may be flown, and why it cannot be armed. Changes nothing."""
    from mavquad.cli.check import check as command

    options: Options = {
        "URL": {"link.url": url},
        "--system": {"link.target_system": system},
        "--key": {"link.signing_key_file": key},
    }
    return command(None, _overrides(set_, options), duration, rate, json)


@app.command(epilog="Exit codes: see mavquad --help.")
def tune(
    config: ConfigArgument = None,
    depth: DepthOption = None,
    phase_margin_deg: Annotated[
        float | None, typer.Option(help="Least phase margin of the fastest gains, deg.", show_default="20")
    ] = None,
    delay_margin_ms: Annotated[
        float | None, typer.Option(help="Least further delay that they bear, ms.", show_default="20")
    ] = None,
    ms: Annotated[float | None, typer.Option(help="Greatest peak of their sensitivity.", show_default="2.5")] = None,
    output: Annotated[
        Path | None, typer.Option(help="Where a map of the margins goes, PNG.", show_default=False)
    ] = None,
    write: Annotated[
        Path | None, typer.Option(help="A configuration with the fastest gains, TOML.", show_default=False)
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite that file.")] = False,
    set_: SetOption = None,
    json: JsonOption = False,
) -> int:
    """Margins of the law on the configured link, what it makes of noise, and the fastest gains that keep given margins."""
    from mavquad.cli.tune import TuneOptions, limits_of
    from mavquad.cli.tune import tune as command

    limits = limits_of(phase_margin_deg, delay_margin_ms, ms)
    overrides = _overrides(set_, {"--depth": {"law.depth": depth}})
    return command(config, overrides, limits, TuneOptions(output, write, force, json))


@app.command(epilog="Exit codes: see mavquad --help.")
def restore(
    run: Annotated[Path, typer.Argument(help="Run folder of the flight.", show_default=False)],
    connect: ConnectOption = None,
    force: Annotated[bool, typer.Option("--force", help="Even while the vehicle is armed.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print what was done, and nothing else, on stdout.")] = False,
) -> int:
    """Put back the parameters that a flight changed on its vehicle, where it could not do so itself."""
    from mavquad.cli.restore import restore as command

    return command(run, connect, force, json)


def _overrides(own: list[str] | None, options: Options, faults: list[Path] | None = None) -> list[Override]:
    """An option {--name: {key: value}} sets keys of the configuration; what --set says of the same key wins."""
    from mavquad.cli.mock_options import fault_overrides
    from mavquad.config import Override, parse_override

    given = [
        Override(key, str(value), option)
        for option, keys in options.items()
        for key, value in keys.items()
        if value is not None
    ]
    set_ = [parse_override(assignment) for assignment in own or []]
    return given + set_ + fault_overrides(faults or ())


def _mission(mission: str | None, goto: str | None, file: Path | None, duration: float | None) -> Options:
    """What is flown; only one option can choose it."""
    given = [name for name, value in (("--mission", mission), ("--goto", goto), ("--file", file)) if value is not None]
    if len(given) > 1:
        raise ConfigError(given[1], "", f"{given[0]} chooses the mission already: give one of them")
    place = _vector("--goto", goto, "m")
    return {
        "--mission": {"mission.name": mission},
        "--goto": {"mission.offset_ned_m": place, "mission.name": place and "goto"},
        "--file": {"mission.file": file},
        "--duration": {"mission.duration_s": duration},
    }


def _law(depth: str | None, law: str | None, force: bool) -> Options:
    return {
        "--depth": {"law.depth": depth},
        "--force": {"flight.force": "true" if force else None},
        "--law": {"law.form": law and law.replace("-", "_")},
    }


def _mock(
    seed: int | None, wind: str | None, autopilot: str | None, firmware: str | None, vehicle: str | None
) -> Options:
    from mavquad.cli.mock_options import mock_options

    return {
        "--seed": {"seed": seed},
        "--wind": {"mock.wind_ned_m_s": _vector("--wind", wind, "m/s")},
        **mock_options(autopilot, firmware, vehicle),
    }


def _vector(option: str, text: str | None, unit: str) -> str | None:
    """N,E,D as a TOML array."""
    if text is None:
        return None
    try:
        north, east, down = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(option, "", f"{text!r} is not three numbers N,E,D in {unit}, e.g. {option} 3,0,0") from None
    return f"[{north}, {east}, {down}]"


def main() -> None:
    """Entry point of the `mavquad` command."""
    command = typer.main.get_command(app)
    sys.exit(run(lambda: command.main(prog_name="mavquad", standalone_mode=False)))
