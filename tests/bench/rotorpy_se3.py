"""The law against the SE3 controller of rotorpy, both on rotorpy's plant with its parameters of PX4's SIH quadrotor.

    python -m venv BENCHVENV && BENCHVENV/bin/pip install rotorpy==3.0.0 .
    BENCHVENV/bin/python tests/bench/rotorpy_se3.py [--quick] [--processes 2] [--case eight] [--pilot se3,torque] ...

Each cell is the RMS (largest) 3-D position error in cm over 20 s, the first 5 s left out. 1 kg, J 0.025, 0.025, 0.03
kg m^2, motor lag 50 ms; wind towards +x. Each flight starts on the reference, but for 1 cm in x and y: an unstable loop in
its equilibrium would not show. Measurements are the true state, without noise. Gusts: Ornstein-Uhlenbeck, sigma 1.5 m/s,
1 s, on each axis, three seeds, RMS over all three.

A delay is from a measurement to when the command computed from it begins to act, the same for all; the law is told it (its
`delay_s`), SE3 has no place for it. SE3 gives thrust and moments; as "SE3, attitude" thrust and attitude, which the plant
then holds by SE3's own attitude gains without delay. Each "diverges" says when the error reached 10 m.
"""

from __future__ import annotations

import argparse
import itertools
import math
import platform
import sys
import time
import tomllib
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

try:
    from tests.bench.rotorpy_pilots import COLUMNS, pilot_of
    from tests.bench.rotorpy_plant import CASES, Case, Score, fly, reference_of
except ModuleNotFoundError as missing:
    if missing.name is None or missing.name.partition(".")[0] != "rotorpy":
        raise
    sys.exit(f"rotorpy is not installed here: {sys.executable} -m pip install rotorpy==3.0.0")

GUST_SEEDS = (1, 2, 3)
QUICK_CASES = ("hover, 5 m/s", "figure-eight, 5 m/s")
QUICK_PILOTS = ("se3", "torque", "rate")


class Job(NamedTuple):
    """One flight."""

    pilot: str
    case: Case
    delay_ms: int
    seed: int
    offset_m: float
    overrides: dict[str, Any]


def flown(job: Job) -> Score:
    """Runs in a process of its own."""
    delay_us = 1000 * job.delay_ms
    pilot = pilot_of(COLUMNS[job.pilot], reference_of(job.case), delay_us, job.overrides)
    return fly(pilot, job.case, delay_us, job.seed, job.offset_m)


def cell(scores: list[Score]) -> str:
    """RMS over the flights and the largest error, cm."""
    lost = [score.lost_s for score in scores if score.lost_s is not None]
    if lost:
        return f"diverges ({min(lost):.1f} s)"
    rms_m = math.sqrt(sum(score.mean_square_m2 for score in scores) / len(scores))
    return f"{100.0 * rms_m:.2f} ({100.0 * max(score.max_m for score in scores):.1f})"


def jobs_of(case: Case, delay_ms: int, pilot: str, given: argparse.Namespace) -> list[Job]:
    seeds = GUST_SEEDS if case.gusts else GUST_SEEDS[:1]
    return [Job(pilot, case, delay_ms, seed, 0.01 * given.offset_cm, dict(given.set)) for seed in seeds]


def override(text: str) -> tuple[str, Any]:
    """`key=value`, the value as TOML, or as text where it is none."""
    key, _, value = text.partition("=")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def words(text: str) -> list[str]:
    return [word for word in text.split(",") if word]


def asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two cases, three pilots, delays of 0 and 20 ms")
    parser.add_argument("--case", default="", help="only cases whose name contains this")
    parser.add_argument("--delay-ms", type=words, help="0,20,40")
    parser.add_argument("--pilot", type=words, help=",".join(COLUMNS))
    parser.add_argument("--set", type=override, action="append", default=[], metavar="KEY=VALUE", help="a key of [law]")
    parser.add_argument(
        "--offset-cm", type=float, default=1.0, help="of the start; 0 starts a hover in its equilibrium"
    )
    parser.add_argument("--processes", type=int, default=1, choices=(1, 2))
    given = parser.parse_args()
    unknown = [name for name in given.pilot or () if name not in COLUMNS]
    if unknown:
        parser.error(f"no such pilot: {', '.join(unknown)}; there are {', '.join(COLUMNS)}")
    return given


def versions() -> str:
    named = ", ".join(f"{name} {version(name)}" for name in ("mavquad", "rotorpy", "numpy", "scipy"))
    return f"{named}, Python {platform.python_version()}"


def main() -> None:
    given = asked()
    pilots = given.pilot or (QUICK_PILOTS if given.quick else list(COLUMNS))
    delays_ms = [int(text) for text in given.delay_ms or (("0", "20") if given.quick else ("0", "20", "40"))]
    cases = [c for c in CASES if given.case in c.name and (not given.quick or c.name in QUICK_CASES)]
    started = time.perf_counter()
    print(f"| case | delay, ms | {' | '.join(COLUMNS[name].title for name in pilots)} |")
    print("|---" * (len(pilots) + 2) + "|")
    with ProcessPoolExecutor(given.processes) as pool:
        rows = list(itertools.product(cases, delays_ms))
        flights = [[pool.map(flown, jobs_of(*row, name, given)) for name in pilots] for row in rows]
        for (case, delay_ms), row in zip(rows, flights, strict=True):
            cells = " | ".join(cell(list(scores)) for scores in row)
            print(f"| {case.name} | {delay_ms} | {cells} |", flush=True)
    print(f"\n{versions()}; {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
