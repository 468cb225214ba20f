"""The law, and then the autopilot's own position control, on the same vehicle in one run: hover and figure-eight.

    python tests/bench/own_control.py                                         # the mock's PX4 in lockstep
    python tests/bench/own_control.py --autopilot ardupilot --wind 8,0,0      # the mock's ArduCopter in wind
    python tests/bench/own_control.py --live --firmware 1.16                  # the mock in real time
    python tests/bench/own_control.py --connect udpin:127.0.0.1:14540         # a vehicle, or a real simulator
    python tests/bench/own_control.py --connect tcp:127.0.0.1:5760 --depth rate --set law.omega0_rad_s=3

Whatever it does not know itself goes to `mavquad sim` or `mavquad fly`, which flies the law, and whose configuration then
holds for both: mission, streams, link, mock. The figure-eight is x = 1.25 sin t, z = 0.75 sin 2t, begun and ended
smoothly. The autopilot's own control gets place, velocity and acceleration at 50 Hz, those of the moment when they arrive
(`law.delay_s`).

Printed: RMS (largest) of the 3-D error of every LOCAL_POSITION_NED against the reference of its own stamp, in cm. Hover: all
but the first 5 s; figure-eight: the laps at full pace. The autopilot's estimate is what counts, not the truth, for both alike.
"""

from __future__ import annotations

import argparse
import asyncio
import bisect
import contextlib
import csv
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.cli.flight import load_config
from mavquad.cli.mock_process import start_mock
from mavquad.config import Config
from mavquad.control.reference import Pose
from mavquad.drivers.live import Clock, open_live
from mavquad.drivers.lockstep import START_US, Lockstep
from mavquad.flight.mission import Mission
from mavquad.frames import ned_from_nwu
from mavquad.protocol.codec import decode, mavlink, message_id
from mavquad.tlog import TlogWriter, read_records
from mavquad.types import Vec3
from mavquad.url import parse_url
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink
from tests.bench.own_pilot import GaveUp, OwnPilot

ROOT = Path(__file__).resolve().parents[2]
SETTLED_S = 5.0
MISSIONS = {
    "hover": {"name": "hover", "hover_s": 25.0},
    "eight": {
        "name": "figure_eight",
        "along_m": 1.25,
        "across_m": 0.75,
        "plane": "vertical",
        "period_s": 2.0 * math.pi,
        "repeat": 5,
        "ramp_s": 5.0,
        "hover_s": 6.0,
        "reference.speed_max_m_s": 4.0,
        "reference.acceleration_max_m_s2": 6.0,
        "reference.jerk_max_m_s3": 16.0,
        "reference.snap_max_m_s4": 60.0,
    },
}
LIMIT_S = 400.0

Reference = Callable[[int], Vec3 | None]
"""Position NED in m at a stamp of the vehicle's clock in us."""
Flown = tuple[list[tuple[int, Vec3]], Reference, int]
"""All places with their stamps, where they should have been, and the stamp at which the mission began."""


@dataclass(frozen=True, slots=True)
class Figures:
    """Root mean square and largest value of the 3-D position error, how many positions counted, and in how many seconds."""

    rms_cm: float
    max_cm: float
    positions: int
    span_s: float


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], allow_abbrev=False)
    parser.add_argument("--connect", help="a vehicle; the bundled mock without it")
    parser.add_argument("--live", action="store_true", help="the mock in real time")
    parser.add_argument("--only", choices=[*MISSIONS], help="this mission alone")
    parser.add_argument("--rest-s", type=float, default=5.0, help="between two flights of a real vehicle")
    parser.add_argument(
        "--runs", type=Path, help="where to keep what was flown: run folders of the law, logs of the other"
    )
    parser.add_argument("--json", action="store_true")
    mine, others = parser.parse_known_args()
    found: dict[str, dict[str, object]] = {}
    with _folder(mine.runs) as folder:
        for name in [mine.only] if mine.only else MISSIONS:
            run = folder / name
            _fly_law(name, run, mine, others)
            config, mock = load_config(run / "config.toml", [])
            law = _figures(config, *_flown_by_law(run))
            time.sleep(mine.rest_s if mine.connect else 0.0)
            with _Log(folder / f"{name}-own.tlog") as log:
                own = _figures(config, *_fly_own(config, mock, mine, log))
            time.sleep(mine.rest_s if mine.connect else 0.0)
            summary = json.loads((run / "summary.json").read_text())
            words = {"vehicle": summary["vehicle"], "depth": summary["depth"]}
            found[name] = {**words, "law": asdict(law), "own": asdict(own)}
            if not mine.json:
                _print(name, words, law, own, first=len(found) == 1)
    if mine.json:
        print(json.dumps(found, indent=2))
    return 0


def _print(name: str, words: dict[str, str], law: Figures, own: Figures, first: bool) -> None:
    if first:
        print(f"{words['vehicle']}; law at depth {words['depth']}; 3-D error, RMS (largest) in cm")
        print(f"{'':8}{'law':>16}{'its own control':>20}{'span, s':>10}")
    pairs = (f"{figures.rms_cm:.1f} ({figures.max_cm:.1f})" for figures in (law, own))
    print(f"{name:8}{next(pairs):>16}{next(pairs):>20}{law.span_s:10.1f}", flush=True)


@contextlib.contextmanager
def _folder(kept: Path | None) -> Iterator[Path]:
    if kept is not None:
        yield kept
        return
    with tempfile.TemporaryDirectory(prefix="own-control-") as folder:
        yield Path(folder)


# ---------------------------------------------------------------------- the law


def _fly_law(name: str, run: Path, mine: argparse.Namespace, others: list[str]) -> None:
    """`mavquad` as a process of its own, as a user calls it."""
    command = [sys.executable, "-m", "mavquad", "fly" if mine.connect or mine.live else "sim", *others]
    command += ["--connect", mine.connect] if mine.connect else []
    for key, value in MISSIONS[name].items():
        command += ["--set", f"mission.{key}={json.dumps(value)}"]
    done = subprocess.run(
        [*command, "--json", "--run-dir", str(run)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{name}, the law: mavquad ended with {done.returncode}\n{done.stderr}")


def _flown_by_law(run: Path) -> Flown:
    """The log's places, the trace's reference."""
    stamps_us: list[int] = []
    references: list[Vec3] = []
    with (run / "trace.csv").open(newline="") as stream:
        for row in csv.DictReader(stream):
            stamp_us = int(row["vehicle_stamp_us"])
            if row["phase"] == "flying" and (not stamps_us or stamp_us > stamps_us[-1]):
                stamps_us.append(stamp_us)
                x, y, z = (float(row[f"reference_{axis}_m"]) for axis in "xyz")
                references.append(ned_from_nwu((x, y, z)))

    def reference(stamp_us: int) -> Vec3 | None:
        after = bisect.bisect_left(stamps_us, stamp_us)
        if not 0 < after < len(stamps_us):
            return None
        before_us, after_us = stamps_us[after - 1], stamps_us[after]
        share = (stamp_us - before_us) / (after_us - before_us)
        n, e, d = (a + share * (b - a) for a, b in zip(references[after - 1], references[after], strict=True))
        return (n, e, d)

    return list(_places(run / "flight.tlog")), reference, stamps_us[0]


def _places(log: Path) -> Iterator[tuple[int, Vec3]]:
    for record in read_records(log):
        if message_id(record.frame) == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            message = decode(record.frame)
            yield message.time_boot_ms * 1000, (message.x, message.y, message.z)


# ---------------------------------------------------------------------- the autopilot's own control


class _Log:
    """Keeps the frames of the autopilot's own flight: a `Recorder`."""

    def __init__(self, path: Path) -> None:
        self._stream = path.open("wb")
        self._writer = TlogWriter(self._stream)

    def __enter__(self) -> _Log:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def frame(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        self._writer.write(stamp_us, frame, outbound)

    def event(self, stamp_us: int, name: str, args: tuple[float, ...] = ()) -> None:
        """The start and the end are not kept."""


def _fly_own(config: Config, mock: MockConfig, mine: argparse.Namespace, log: _Log) -> Flown:
    """The same mission by the autopilot itself."""
    try:
        if mine.connect:
            pilot = asyncio.run(_live(config, config.link.url, log))
        elif mine.live:
            with start_mock(config) as url:
                pilot = asyncio.run(_live(config, url, log))
        else:
            pilot = _in_lockstep(config, mock, log)
    except GaveUp as error:
        raise SystemExit(f"its own control: {error}") from None
    mission = pilot.mission
    assert mission is not None

    def reference(stamp_us: int) -> Vec3:
        point = mission.reference(stamp_us)
        return ned_from_nwu((point.x_m[0], point.y_m[0], point.z_m[0]))

    return pilot.places, reference, mission.start_us


def _in_lockstep(config: Config, mock: MockConfig, log: _Log) -> OwnPilot:
    pilot = OwnPilot(config, START_US, config.law.delay())
    far = ImpairedLink(MockAutopilot(mock, config.seed, START_US), mock.link, config.seed)
    Lockstep(pilot, far, log).run(lambda: pilot.done, LIMIT_S)
    return pilot


async def _live(config: Config, url: str, log: _Log) -> OwnPilot:
    clock = Clock()
    start_us = clock.now_us()
    pilot = OwnPilot(config, start_us, config.law.delay())
    driver = await open_live(pilot, parse_url(url), clock, start_us, log)
    try:
        while not pilot.done:
            await driver.wait(0.25)
    finally:
        driver.close()
    return pilot


# ---------------------------------------------------------------------- figures


def _figures(config: Config, places: list[tuple[int, Vec3]], reference: Reference, start_us: int) -> Figures:
    """The errors of the places that count."""
    first_us, last_us = (start_us + round(moment_s * 1e6) for moment_s in _span_s(config))
    errors = []
    for stamp_us, place in places:
        there = reference(stamp_us) if first_us <= stamp_us <= last_us else None
        if there is not None:
            errors.append(math.dist(place, there))
    rms = math.sqrt(math.fsum(error * error for error in errors) / len(errors))
    return Figures(100.0 * rms, 100.0 * max(errors), len(errors), (last_us - first_us) * 1e-6)


def _span_s(config: Config) -> tuple[float, float]:
    """From when to when the error counts, s since the start of the mission."""
    mission = Mission(config.mission, Pose((0.0, 0.0, 0.0), 0.0), 0)
    curves = [(start_s, end_s) for start_s, end_s, curved in mission.spans() if curved]
    if not curves:
        return SETTLED_S, mission.duration_s
    return curves[0][0] + config.mission.ramp_s, curves[-1][1] - config.mission.ramp_s


if __name__ == "__main__":
    sys.exit(main())
