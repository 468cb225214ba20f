"""A whole flight in lockstep, in memory, for tests and campaigns."""

from dataclasses import dataclass, field

from mavquad.agent import Agent
from mavquad.analysis.metrics import FlightMetrics, error_samples, flight_metrics
from mavquad.config import Config, Override, load
from mavquad.config import default_path as default_config
from mavquad.drivers.lockstep import START_US, Lockstep
from mavquad.drivers.replay import OperatorEvent, ReplayResult, replay
from mavquad.flight.machine import Phase
from mavquad.flight_record import Note, TraceRow
from mavquad.schema import parse_section
from mavquad.tlog import Record
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink


@dataclass
class Recording:
    """A `Recorder` that keeps everything in memory."""

    records: list[Record] = field(default_factory=list)
    events: list[OperatorEvent] = field(default_factory=list)

    def frame(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        self.records.append(Record(stamp_us, 3 if outbound else 0, frame))

    def event(self, stamp_us: int, name: str, args: tuple[float | str, ...] = ()) -> None:
        self.events.append(OperatorEvent(stamp_us, name, args))


@dataclass
class LockstepFlight:
    """What is left of a flight."""

    config: Config
    agent: Agent
    mock: MockAutopilot
    lockstep: Lockstep
    recording: Recording
    rows: list[TraceRow] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        return self.agent.error.exit_code if self.agent.error else 0

    @property
    def seconds(self) -> float:
        return (self.lockstep.now_us - START_US) * 1e-6

    def metrics(self, last_s: float = 1e9) -> FlightMetrics:
        """Over the time that the law is in control, or its first `last_s` seconds."""
        samples = [s for s in error_samples(self.rows, ("flying",)) if s.t_s <= last_s]
        return flight_metrics(samples)

    def replayed(self) -> ReplayResult:
        return replay(Agent(self.config, START_US), START_US, self.recording.records, self.recording.events)


def prepare(
    overrides: dict[str, object] | None = None, faults: list[dict[str, object]] | None = None, key: bytes | None = None
) -> LockstepFlight:
    """A flight that is ready to be run; overrides are keys of the configuration with their values as TOML text.

    `key` is the agent's of MAVLink 2 signing.
    """
    given = [Override(key, str(value)) for key, value in (overrides or {}).items()]
    config = load(default_config(), given)
    mock_config = parse_section(MockConfig, {**config.mock, "faults": faults or []}, "test", "mock")
    agent = Agent(config, START_US, key)
    mock = MockAutopilot(mock_config, config.seed, START_US)
    recording = Recording()
    lockstep = Lockstep(agent, ImpairedLink(mock, mock_config.link, config.seed), recording)
    return LockstepFlight(config, agent, mock, lockstep, recording)


def fly(
    overrides: dict[str, object] | None = None, faults: list[dict[str, object]] | None = None, limit_s: float = 150.0
) -> LockstepFlight:
    """Fly from start to end, at most `limit_s` of virtual time."""
    flight = prepare(overrides, faults)
    run(flight, limit_s)
    return flight


def run(flight: LockstepFlight, limit_s: float = 150.0, until: str = "") -> None:
    """Run on until the agent is done, or in the phase `until`."""

    agent, last = flight.agent, Phase(until) if until else Phase.DONE

    def over() -> bool:
        if agent.awaits_record:
            flight.lockstep.command("kept", agent.kept)
        return agent.phase is last or agent.done

    flight.lockstep.run(over, limit_s)
    flight.rows += agent.take_trace()
    flight.notes += agent.take_notes()
    if agent.done:
        flight.lockstep.end()
