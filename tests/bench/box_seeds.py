"""The box and a hover on the default mock, 20 seeds each and under several conditions: completed, errors, speed.

    python tests/bench/box_seeds.py [--seeds 20]

Errors are RMS over the time under the law, its first 5 s left out: "estimated" is the autopilot's position against the
reference, "true" the plant's own (its difference is mostly the wander of the estimator, 5 cm per axis).
"""

import argparse
import bisect
import math
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.frames import ned_from_nwu
from tests.support import LockstepFlight, prepare

CASES: dict[str, dict[str, object]] = {
    "hover 30 s": {"mission.name": '"hover"', "mission.duration_s": 30.0},
    "box": {},
    "box, wind 3 m/s": {"mock.wind_ned_m_s": [3.0, 0.0, 0.0]},
    "box, mass +15 %": {"mock.vehicle.mass_kg": 1.15},
    "box, mass -15 %": {"mock.vehicle.mass_kg": 0.85},
    "box, delay +10 ms": {"mock.link.latency_ms": 15.0},
    "box, rotor lag 65 ms": {"mock.vehicle.motor_time_constant_s": 0.065},
    "box, 5 % loss, 10 ms jitter": {"mock.link.loss": 0.05, "mock.link.jitter_ms": 10.0},
    "box, the paper's plant": {"mock.vehicle.model": '"paper"'},
    "box, state feedback (6)": {"law.form": '"state_feedback"'},
}


def fly(case: dict[str, object], seed: int) -> tuple[LockstepFlight, float, float]:
    """(flight, true position RMS in m, real-time factor)."""
    flight = prepare({**case, "seed": seed})
    stamps: list[int] = []
    truths: list[tuple[float, float, float]] = []
    started = time.perf_counter()

    def stop() -> bool:
        flight.rows += flight.agent.take_trace()
        truth = flight.mock.truth()
        if not stamps or truth.boot_us > stamps[-1]:
            stamps.append(truth.boot_us)
            truths.append(truth.position_ned_m)
        return flight.agent.done

    flight.lockstep.run(stop, 200.0)
    factor = flight.seconds / (time.perf_counter() - started)
    rows = [row for row in flight.rows if row.phase == "flying"]
    squares = []
    for row in rows:
        if row.vehicle_stamp_us - rows[0].vehicle_stamp_us >= 5_000_000:
            z, _, x, y = row.reference
            nearest = truths[bisect.bisect_left(stamps, row.vehicle_stamp_us)]
            squares.append(math.dist(nearest, ned_from_nwu((x, y, z))) ** 2)
    return flight, math.sqrt(statistics.fmean(squares)) if squares else math.nan, factor


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    seeds = parser.parse_args().seeds
    print("| case | completed | estimated, cm: median (worst) | true, cm: median (worst) | yaw, deg | x real time |")
    print("|---|---|---|---|---|---|")
    for name, case in CASES.items():
        flights = [fly(case, seed) for seed in range(1, seeds + 1)]
        completed = sum(flight.agent.error is None and flight.agent.done for flight, _, _ in flights)
        estimated = [100.0 * (flight.metrics().position_rms_m or math.nan) for flight, _, _ in flights]
        true = [100.0 * rms_m for _, rms_m, _ in flights]
        yaw = statistics.median(math.degrees(flight.metrics().yaw_rms_rad or math.nan) for flight, _, _ in flights)
        factor = statistics.median(factor for _, _, factor in flights)
        print(
            f"| {name} | {completed} of {seeds} | {statistics.median(estimated):.1f} ({max(estimated):.1f})"
            f" | {statistics.median(true):.1f} ({max(true):.1f}) | {yaw:.1f} | {factor:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
