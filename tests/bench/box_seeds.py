"""The box, a hover and a figure-eight on the default mock, some seeds each, at each depth and under several conditions.

    python tests/bench/box_seeds.py [--seeds 5]

Each cell: flights completed, and the RMS of the position error in cm, median (worst): the autopilot's position against the
reference, over the time under the law but its first 5 s. The true error is larger by the wander of the estimator, 5 cm per
axis. The last row is the real-time factor, median, of one core.
"""

import argparse
import math
import statistics
import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.control.defaults import DEPTHS
from tests.support import prepare, run

CASES: dict[str, dict[str, object]] = {
    "hover 30 s": {"mission.name": '"hover"', "mission.duration_s": 30.0},
    "box": {},
    "figure-eight": {"mission.name": '"figure_eight"'},
    "box, wind 3 m/s": {"mock.wind_ned_m_s": [3.0, 0.0, 0.0]},
    "box, wind 8 m/s": {"mock.wind_ned_m_s": [5.66, 5.66, 0.0]},
    "box, wind 5 m/s, gusts 1.5 m/s": {"mock.wind_ned_m_s": [5.0, 0.0, 0.0], "mock.gusts_m_s": 1.5},
    "box, mass +30 %": {"mock.vehicle.mass_kg": 1.3},
    "box, mass -30 %": {"mock.vehicle.mass_kg": 0.7},
    "box, delay +20 ms": {"mock.link.latency_ms": 20.0},
    "box, rotor lag 75 ms": {"mock.vehicle.motor_time_constant_s": 0.075},
    "box, 5 % loss, 10 ms jitter": {"mock.link.loss": 0.05, "mock.link.jitter_ms": 10.0},
    "box, 20 ms jitter": {"mock.link.jitter_ms": 20.0},
    "box, friction not told": {"law.friction_1_s": 0.0, "law.angular_friction_1_s": 0.0},
    "box, the paper's plant": {"mock.vehicle.model": '"paper"'},
    "box, state feedback (6)": {"law.form": '"state_feedback"'},
}


@dataclass
class Outcome:
    """Of all flights of one cell."""

    completed: int
    rms_cm: list[float]
    factors: list[float]

    def __str__(self) -> str:
        worst = max(self.rms_cm)
        return f"{self.completed} of {len(self.rms_cm)}: {statistics.median(self.rms_cm):.1f} ({worst:.1f})"


def fly(case: dict[str, object], depth: str, seed: int) -> tuple[bool, float, float]:
    """(completed, position RMS in cm, real-time factor)."""
    flight = prepare({"law.depth": f'"{depth}"', **case, "seed": seed})
    started = time.perf_counter()
    run(flight, 200.0)
    factor = flight.seconds / (time.perf_counter() - started)
    completed = flight.agent.done and flight.agent.error is None
    return completed, 100.0 * (flight.metrics().position_rms_m or math.nan), factor


def outcome(case: dict[str, object], depth: str, seeds: int) -> Outcome:
    flights = [fly(case, depth, seed) for seed in range(1, seeds + 1)]
    return Outcome(sum(done for done, _, _ in flights), [rms for _, rms, _ in flights], [f for _, _, f in flights])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    seeds = parser.parse_args().seeds
    print(f"| case | {' | '.join(DEPTHS)} |\n|---|{'---|' * len(DEPTHS)}")
    factors: dict[str, list[float]] = {depth: [] for depth in DEPTHS}
    for name, case in CASES.items():
        cells = [outcome(case, depth, seeds) for depth in DEPTHS]
        for depth, cell in zip(DEPTHS, cells, strict=True):
            factors[depth] += cell.factors
        print(f"| {name} | {' | '.join(map(str, cells))} |", flush=True)
    print(f"| x real time | {' | '.join(f'{statistics.median(factors[depth]):.0f}' for depth in DEPTHS)} |")


if __name__ == "__main__":
    main()
