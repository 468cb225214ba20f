"""`mavquad check`: who is there, what arrives, and whether it can be flown."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from mavquad.check.checker import LOOKING_S, Checker, Stage
from mavquad.check.findings import Findings, findings
from mavquad.check.roster import Participant
from mavquad.cli.flight import load_config
from mavquad.cli.mock_process import start_mock
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.config import Override
from mavquad.drivers.key_file import key_of
from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, VehicleTimeout
from mavquad.protocol.link import LinkParams
from mavquad.url import MOCK, parse_url

LOOK_S = 0.1
EXIT_NOT_READY = 3


def check(config: Path | None, overrides: list[Override], duration_s: float, rate_hz: float, as_json: bool) -> int:
    """Check the vehicle of a configuration's link; returns the exit code.

    Raises:
        ConfigError: the configuration, or the file with the key, is wrong.
        EndpointError: there is no way to it.
        VehicleTimeout: no autopilot was heard.
    """
    given, _ = load_config(config, overrides)
    if given.link.url != MOCK:
        return _check(given.link, duration_s, rate_hz, as_json)
    with start_mock(given) as url:
        return _check(given.link.model_copy(update={"url": url}), duration_s, rate_hz, as_json)


def _check(link: LinkParams, duration_s: float, rate_hz: float, as_json: bool) -> int:
    clock = Clock()
    checker = Checker(link, clock.now_us(), duration_s, rate_hz, key_of(link))
    driver = asyncio.run(_run(checker, link, clock))
    if checker.link.vehicle is None:
        raise _nobody(checker)
    found = findings(checker)
    if as_json:
        say(to_json(_json(checker, found, driver)))
    else:
        shown(lambda: _print(checker, found))
    return EXIT_OK if found.ready else EXIT_NOT_READY


async def _run(checker: Checker, link: LinkParams, clock: Clock) -> LiveDriver:
    driver = await open_live(
        checker, parse_url(link.url), clock, clock.now_us(), locked=lambda: checker.link.vehicle is not None
    )
    loop = asyncio.get_running_loop()
    with contextlib.suppress(NotImplementedError):
        loop.add_signal_handler(signal.SIGINT, driver.command, "stop")
    try:
        while checker.stage is not Stage.DONE:
            await driver.wait(LOOK_S)
    finally:
        driver.close()
    return driver


def _nobody(checker: Checker) -> VehicleTimeout:
    """No autopilot: who else spoke, and what was not taken, may say why."""
    unsigned = checker.link.rejected.total()
    others = ", ".join(f"{p.system_id}/{p.component_id} {p.kind}".strip() for p in checker.roster.everybody())
    hint = "is it on, and does it send to this address? a PX4 simulator speaks to udpin:127.0.0.1:14540"
    if unsigned:
        hint = f"{unsigned} frames came that are not rightly signed: is this key the vehicle's?"
    elif others:
        hint = f"heard were {others}: is link.target_system right?"
    return VehicleTimeout("the HEARTBEAT of an autopilot", 1, LOOKING_S, hint=hint)


# ---------------------------------------------------------------------- what is told


def _json(checker: Checker, found: Findings, driver: LiveDriver) -> dict[str, Any]:
    framer = driver.runner.framer
    return {
        **found.to_json(),
        "participants": [
            {
                "system_id": p.system_id,
                "component_id": p.component_id,
                "component": p.component,
                "kind": p.kind,
                "autopilot": p.autopilot,
                "mavlink": sorted(p.versions),
                "frames": p.frames,
                "lost": p.lost,
            }
            for p in checker.roster.everybody()
        ],
        "rate_asked_hz": checker.rate_hz,
        "answers": dict(checker.asking.results),
        "link": {
            "bad": framer.bad_chunks,
            "unknown": framer.unknown,
            "foreign": checker.link.foreign,
            "forged": checker.link.forged,
            "rejected": checker.link.rejected.total(),
            "strangers": driver.runner.strangers,
        },
    }


def _print(checker: Checker, found: Findings) -> None:
    console = QuietConsole(highlight=False)
    console.print(_participants(checker.roster.everybody(), found.vehicle))
    console.print()
    console.print(_vehicle(checker, found))
    console.print()
    console.print(_streams(checker, found))
    console.print()
    console.print(_verdict(found))


def _participants(everybody: list[Participant], vehicle: tuple[int, int]) -> Table:
    table = Table("system", "component", "is a", "autopilot", "MAVLink", "frames", "lost", box=None, padding=(0, 1))
    for p in everybody:
        style = "bold" if (p.system_id, p.component_id) == vehicle else "dim"
        versions = "+".join(map(str, sorted(p.versions)))
        cells = (str(p.system_id), f"{p.component_id} {p.component}", p.kind or "-", p.autopilot or "-", versions)
        table.add_row(*cells, str(p.frames), str(p.lost), style=style)
    return table


def _vehicle(checker: Checker, found: Findings) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    for name, words in _facts(checker, found):
        if words:
            table.add_row(name, Text(words))
    return table


def _facts(checker: Checker, found: Findings) -> list[tuple[str, str]]:
    version, clock = found.version, found.clock
    git = f" ({version.git})" if version is not None and version.git else ""
    hover = ", ".join(f"{value:.3f} ({source})" for source, value in found.hover_thrust.items())
    facts = [
        ("autopilot", f"{found.autopilot} {version.release if version else 'of an unknown version'}{git}"),
        (
            "state",
            f"{found.mode}, {'ARMED' if found.armed else 'disarmed'}" + (f", {found.landed}" * bool(found.landed)),
        ),
        ("capabilities", ", ".join(version.capabilities) if version else ""),
        ("hover thrust", hover or "not known: no parameter, and it does not fly"),
        *((f"depth {depth}", words) for depth, words in found.depths.items()),
    ]
    trips = clock.round_trips
    if trips is None or clock.drift_ms_s is None:
        return [*facts, ("round trip", "it does not answer TIMESYNC")]
    steps = f"; it stepped {clock.steps} times" if clock.steps else ""
    return [
        *facts,
        (
            "round trip",
            f"p50 {trips.p50_ms:.2f}, p99 {trips.p99_ms:.2f}, max {trips.max_ms:.2f} ms, of {trips.count}",
        ),
        (
            "clock",
            f"{clock.boot_s:.1f} s, drifts {clock.drift_ms_s:+.2f} ms/s (+- {clock.drift_bound_ms_s:.2f}), "
            f"ages within {clock.uncertainty_ms:.2f} ms{steps}",
        ),
    ]


def _streams(checker: Checker, found: Findings) -> Table:
    table = Table(box=None, padding=(0, 2))
    table.add_column(f"{found.bytes_s / 1000:.1f} kB/s")
    for name in ("Hz", "jitter ms", "longest gap ms", "age ms"):
        table.add_column(name, justify="right")
    for name, stream in found.streams.items():
        cells = (stream.rate_hz, stream.jitter_ms, stream.gap_ms, stream.age_ms)
        table.add_row(name, *("-" if value is None else f"{value:.1f}" for value in cells))
    return table


def _verdict(found: Findings) -> Text:
    if found.ready:
        return Text("ready to arm", "bold green")
    lines = [Text("not ready to arm", "bold red")]
    lines += [Text(f"  {reason}") for reason in found.reasons]
    lines += [Text(f'  it says: "{text}"', "yellow") for text in found.texts]
    if found.unhealthy:
        lines.append(Text(f"  not healthy: {', '.join(found.unhealthy)}"))
    if found.not_restored:
        lines.append(Text(f"  left at the rate that was asked for: {', '.join(found.not_restored)}", "dim"))
    return Text("\n").join(lines)
