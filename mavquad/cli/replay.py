"""`mavquad replay`: one of our flights bit for bit, or a survey of any other log."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table
from rich.text import Text

from mavquad.analysis.shadow import Shadow, shadow
from mavquad.analysis.survey import Survey, survey_file
from mavquad.cli.log_part import LogPart
from mavquad.cli.new_file import new_file
from mavquad.cli.replay_flight import OtherLaw, is_ours, replay_flight
from mavquad.cli.replay_shadow import draw_shadow, print_shadow, shadow_of
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, InputError
from mavquad.tlog import Selection, read_records


def replay(path: Path, part: LogPart, other: OtherLaw, output: Path | None, as_json: bool) -> int:
    """Replay or survey; returns the exit code."""
    if output is not None and output.suffix.lower() != ".png":
        raise InputError(f"--output: {str(output)!r} does not end with .png", "figures are PNG")
    if is_ours(path):
        if not part.is_all:
            raise InputError(
                "--system, --from, --to: a flight of ours is replayed whole",
                "with --list or --play, or of a copy of flight.tlog in another folder, a part can be had",
            )
        return replay_flight(path, read_records(path), other, output, as_json)
    selection = part.selection(path)
    return _survey(path, selection, other, output, as_json)


def _survey(path: Path, selection: Selection, other: OtherLaw, output: Path | None, as_json: bool) -> int:
    found = survey_file(path, selection)
    contents = read_records(path).only(selection)
    vehicle = found.main_vehicle()
    observed = shadow(contents, vehicle.sender) if vehicle else None
    flown = shadow_of(contents, vehicle, other) if vehicle else None
    figure = output or new_file(path.stem, ".png")
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.log_figure import survey_figure

    survey_figure(found, observed, figure, path.name)
    flights = draw_shadow(flown, path, output) if flown else None
    if as_json:
        result = {**found.to_json(), "observer": observed.to_json() if observed else None, "figure": str(figure)}
        law = {"law": flown.to_json() if flown else None, "law_figure": str(flights) if flights else None}
        say(to_json({**result, **law}))
    else:
        shown(lambda: _print_survey(found, observed, figure))
        if flown is not None:
            shown(lambda: print_shadow(QuietConsole(highlight=False), flown, flights))
    return EXIT_OK


def _print_survey(found: Survey, observed: Shadow | None, figure: Path) -> None:
    console = QuietConsole(highlight=False)
    console.print(
        f"{found.frames} frames over {found.duration_s:.1f} s, {found.bad_bytes} bad bytes"
        f" in {len(found.bad_ranges)} places, {found.unknown_frames} frames of unknown messages"
    )
    table = Table(box=None, padding=(0, 2), header_style="dim")
    for name in ("system/component", "autopilot", "type", "frames", "armed"):
        table.add_column(name)
    for sender in found.senders:
        armed_s = sum(span.to_s - span.from_s for span in sender.armed_spans)
        table.add_row(
            "/".join(map(str, sender.sender)),
            sender.autopilot.removeprefix("MAV_AUTOPILOT_") or "-",
            sender.vehicle_type.removeprefix("MAV_TYPE_") or "-",
            str(sender.frames),
            f"{armed_s:.0f} s" if sender.armed_spans else "-",
        )
    console.print(table)
    if observed is not None and observed.tracks:
        console.print(_observer_words(observed))
    console.print(Text(f"figure: {figure}"), soft_wrap=True)


def _observer_words(observed: Shadow) -> str:
    words = f"observer over {observed.source or 'no position stream'} of {observed.sender[0]}/{observed.sender[1]}"
    if observed.position_rate_hz is not None and observed.kappa_rad_s is not None:
        words += f" at {observed.position_rate_hz:.1f} Hz, kappa {observed.kappa_rad_s:.1f} rad/s"
    rms = observed.velocity_rms_m_s
    if None not in rms:
        words += f"; velocity against the log's own, RMS N/W/U: {rms[0]:.2f} / {rms[1]:.2f} / {rms[2]:.2f} m/s"
    return words
