"""`mavquad restore RUN`: put back what a run changed on its vehicle and could not put back itself."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.drivers.key_file import key_of
from mavquad.drivers.live import Clock, open_live
from mavquad.drivers.parameters_file import mark_restored, read_parameters
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, RunFolderError
from mavquad.protocol.link import LinkParams
from mavquad.protocol.param_record import ChangedParameters, number_words
from mavquad.protocol.restore import Restorer
from mavquad.schema import parse_section, read_toml
from mavquad.url import MOCK, parse_url

LOOK_S = 0.1


def restore(run: Path, connect: str | None, force: bool, as_json: bool) -> int:
    """Restore; returns the exit code."""
    changed = read_parameters(run)
    if changed is None or changed.restored or not changed.parameters:
        _say_nothing_to_do(changed, as_json)
        return EXIT_OK
    restorer = asyncio.run(_restore(changed, _link(run, connect), force))
    if restorer.error is None:
        mark_restored(run, changed)
    if as_json:
        say(to_json(_json(changed, restorer)))
    else:
        shown(lambda: _print(changed, restorer))
    if restorer.error is not None:
        raise restorer.error
    return EXIT_OK


def _link(run: Path, connect: str | None) -> LinkParams:
    """The connection of the run, or another one to the same vehicle.

    Raises:
        EndpointError: the option is no connection.
        ConfigError: the run's configuration is wrong.
        RunFolderError: the run had no connection.
    """
    path = run / "config.toml"
    table = read_toml(path).get("link", {})
    if connect is not None:
        parse_url(connect)
        table = {**table, "url": connect}
    link = parse_section(LinkParams, table, str(path), "link")
    if link.url == MOCK:
        raise RunFolderError(str(run), "its vehicle was a mock of its own", "--connect tells where the vehicle is now")
    return link


async def _restore(changed: ChangedParameters, link: LinkParams, force: bool) -> Restorer:
    clock = Clock()
    start_us = clock.now_us()
    restorer = Restorer(changed, link, start_us, key_of(link), force)
    driver = await open_live(
        restorer, parse_url(link.url), clock, start_us, locked=lambda: restorer.link.vehicle is not None
    )
    try:
        while not restorer.done:
            await driver.wait(LOOK_S)
    finally:
        driver.close()
    return restorer


# ---------------------------------------------------------------------- what the user sees


def _say_nothing_to_do(changed: ChangedParameters | None, as_json: bool) -> None:
    words = "it is restored already" if changed is not None and changed.restored else "the run changed no parameters"
    if as_json:
        say(to_json({"restored": True, "parameters": []}))
    else:
        shown(lambda: QuietConsole(highlight=False).print(Text(f"nothing to restore: {words}")))


def _json(changed: ChangedParameters, restorer: Restorer) -> dict[str, Any]:
    found, failures = _found(restorer)
    return {
        **changed.model_dump(mode="json", exclude={"parameters", "restored"}),
        "restored": restorer.error is None,
        "armed": restorer.armed,
        "parameters": [
            {**record.model_dump(mode="json"), "found": found.get(record.name), "failure": failures.get(record.name)}
            for record in changed.parameters
        ],
    }


def _found(restorer: Restorer) -> tuple[dict[str, float], dict[str, str]]:
    return (restorer.change.found, restorer.change.failures) if restorer.change is not None else ({}, {})


def _print(changed: ChangedParameters, restorer: Restorer) -> None:
    console = QuietConsole(highlight=False)
    if restorer.armed and restorer.change is not None:
        console.print(Text("warning: the vehicle is armed", style="bold yellow"))
    if restorer.change is None:
        return  # the error says it all
    found, failures = _found(restorer)
    table = Table("parameter", "was set to", "found at", "restored to", box=None, padding=(0, 2))
    for record in changed.parameters:
        put_back = Text(number_words(record.original), "bold")
        now = Text("not restored", "bold red") if record.name in failures else put_back
        seen = number_words(found[record.name]) if record.name in found else "-"
        table.add_row(record.name, number_words(record.changed), seen, now)
    console.print(table)
