"""What `fly` and `sim` share: the run folder, what is kept while it flies, and the summary at the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.text import Text

from mavquad import __version__
from mavquad.agent import Agent
from mavquad.analysis.metrics import FlightMetrics, error_samples, flight_metrics
from mavquad.cli.display import summary_table
from mavquad.cli.outcome import show
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.config import Config, Override, blaming_options, default_path, dump, load
from mavquad.drivers.parameters_file import write_parameters
from mavquad.drivers.run_folder import RunFolder, to_json
from mavquad.drivers.runner import Runner
from mavquad.errors import EXIT_INTERRUPTED, EXIT_OK, Abandoned, RunFolderError
from mavquad.flight.machine import Phase
from mavquad.flight_record import Note, TraceRow
from mavquad.schema import parse_section
from sitl_mock.config import MockConfig


def load_config(path: Path | None, overrides: Sequence[Override]) -> tuple[Config, MockConfig]:
    """The configuration with the mock's table checked and completed.

    Raises:
        ConfigError: with the full path of the wrong key and what is allowed.
    """
    path = path or default_path()
    config = load(path, overrides)
    with blaming_options(overrides):
        mock = parse_section(MockConfig, config.mock, str(path), "mock")
    link = config.link
    if link.signing_key_file:  # a replay may be started elsewhere
        link = link.model_copy(update={"signing_key_file": str(Path(link.signing_key_file).expanduser().absolute())})
    return config.model_copy(update={"link": link, "mock": mock.model_dump(mode="json")}), mock


def default_run_dir(kind: str) -> Path:
    """A new folder under runs/, named by the time in UTC."""
    return Path("runs") / f"{datetime.now(UTC):%Y%m%d-%H%M%S-%f}-{kind}"


class Flight:
    """A flight and its run folder, whichever driver flies it; the folder is closed with the block, come what may."""

    def __init__(self, config: Config, run_dir: Path) -> None:
        self.config = config
        self.folder = RunFolder(run_dir, dump(config))
        self.rows: list[TraceRow] = []
        self._notes: list[Note] = []

    def __enter__(self) -> Flight:
        return self

    def __exit__(self, *_: object) -> None:
        self.folder.close()

    def collect(self, agent: Agent, further: Sequence[Note] = ()) -> list[Note]:
        """Keep what the agent handed out, and further notes; returns the new lines of the story."""
        rows, notes = agent.take_trace(), [*agent.take_notes(), *further]
        self.rows += rows
        self._notes += notes
        self.folder.add(rows, notes)
        return notes

    def keep_parameters(self, agent: Agent) -> None:
        """Write down what is changed on the vehicle, before it is, and that it was put back.

        Raises:
            RunFolderError: it cannot be written.
        """
        if agent.changed_parameters is not None:
            write_parameters(self.folder, agent.changed_parameters)

    def finish(
        self,
        agent: Agent,
        runner: Runner,
        start_us: int,
        wall_s: float,
        lateness_us: list[int],
        extra: dict[str, Any],
        as_json: bool,
    ) -> int:
        """Close the folder, print, write the summary and the figure; returns the exit code."""
        self.collect(agent)
        self.folder.close()
        flight_s = (runner.last_us - start_us) * 1e-6
        status = agent.status()
        metrics = flight_metrics(error_samples(self.rows, (Phase.FLYING.value,)))
        summary = {
            **self._outcome(agent),
            **metrics.to_json(),
            "error_of": "the position that the autopilot estimates, against the reference",
            "vehicle": status.vehicle,
            "depth": status.depth or None,
            "measurements": agent.law.measurements,
            "hover_thrust_norm": status.hover_thrust_norm if status.setpoints_sent else None,
            "setpoints_sent": status.setpoints_sent,
            "safe_setpoints": status.safe_setpoints,
            "flight_s": flight_s,
            "wall_s": wall_s,
            "real_time_factor": flight_s / wall_s,
            "lateness_us": percentiles(lateness_us),
            "link": self._link(agent, runner),
            "old_poses": status.old_poses,
            "seed": self.config.seed,
            "mavquad": __version__,
            **extra,
            "run_dir": str(self.folder.path),
        }
        if as_json:
            say(to_json(summary))
        else:
            shown(lambda: self._print(summary))
        if agent.error is not None:
            show(agent.error)
        kept = self._keep(agent, summary, metrics)
        return self.exit_code(agent) or (EXIT_OK if kept else RunFolderError.exit_code)

    def _keep(self, agent: Agent, summary: dict[str, Any], metrics: FlightMetrics) -> bool:
        """Write what remains; a failure is told, and does not hide how the flight ended."""
        failures = [self.folder.failure] if self.folder.failure is not None else []
        writes: list[Callable[[], None]] = [
            lambda: self.keep_parameters(agent),
            lambda: self.folder.write_whole("summary.json", to_json(summary)),
            lambda: self._draw(summary, metrics),
            lambda: self.folder.write_whole("report.html", self._page(summary)),
        ]
        for write in writes:
            try:
                write()
            except RunFolderError as error:
                failures.append(error)
        for failure in failures:
            show(failure)
        return not failures

    def _print(self, summary: dict[str, Any]) -> None:
        console = QuietConsole(highlight=False)
        if summary["setpoints_sent"]:
            console.print(summary_table(summary))
        else:
            console.print(Text(f"run folder: {self.folder.path}"), soft_wrap=True)

    @staticmethod
    def _link(agent: Agent, runner: Runner) -> dict[str, int]:
        """Frames lost on the way here, chunks with damage, frames of unknown messages and of others than the vehicle,
        frames that bear its name and are not its own, frames that are not rightly signed, and frames of the vehicle that
        came twice, or HEARTBEATs after a later one.

        Strangers are datagrams that came from elsewhere than the vehicle's address; dropped are frames of ours that
        could not be sent.
        """
        framer = runner.framer
        lost = framer.lost(agent.link.vehicle) if agent.link.vehicle else 0
        return {
            "lost": lost,
            "bad": framer.bad_chunks,
            "unknown": framer.unknown,
            "foreign": agent.link.foreign,
            "forged": agent.link.forged,
            "rejected": agent.link.rejected.total(),
            "out_of_order": agent.link.out_of_order.total(),
            "strangers": runner.strangers,
            "dropped": runner.dropped,
        }

    def _outcome(self, agent: Agent) -> dict[str, Any]:
        completed = agent.done and agent.error is None and not agent.interrupted
        if agent.error is not None:
            outcome = agent.error.message
        elif agent.interrupted and agent.done:
            outcome = "interrupted by the operator and landed"
        else:
            outcome = "mission complete" if completed else "left before the landing"
        return {"completed": completed, "outcome": outcome, "exit_code": self.exit_code(agent)}

    @staticmethod
    def exit_code(agent: Agent) -> int:
        """The exit code of a flight."""
        if not agent.done:
            return Abandoned.exit_code
        if agent.error is not None:
            return agent.error.exit_code
        return EXIT_INTERRUPTED if agent.interrupted else EXIT_OK

    def _page(self, summary: dict[str, Any]) -> str:
        # What reads logs is not needed in flight.
        from mavquad.analysis.report.of_run import MESSAGES, report_of_run
        from mavquad.analysis.report.page import page
        from mavquad.analysis.report.run_data import RunData, add_log

        run = RunData(self.folder.path, self.rows, self._notes, summary, dump(self.config))
        add_log(run, MESSAGES)
        return page(report_of_run(run))

    def _draw(self, summary: dict[str, Any], metrics: FlightMetrics) -> None:
        # matplotlib takes half a second to import, and a flight must not wait for it.
        from mavquad.analysis.figures import flight_figure

        marks = [(note.stamp_us, note.text) for note in self._notes if note.kind in ("guard", "operator")]
        title = f"{summary['vehicle'] or 'no vehicle'}: {summary['outcome']}"
        flight_figure(self.rows, marks, self.folder.path / "flight.png", title, metrics)


def percentiles(values_us: list[int]) -> dict[str, int]:
    """p50, p99 and max; zeros where there is nothing to measure (virtual time is never late)."""
    if not values_us:
        return {"p50": 0, "p99": 0, "max": 0}
    ordered = sorted(values_us)
    last = len(ordered) - 1
    return {"p50": ordered[last // 2], "p99": ordered[round(last * 0.99)], "max": ordered[-1]}
