"""What a step of observer and law costs, at each depth and measurement set: `python tests/bench/cost.py`.

One step is an attitude, a position and a command, at 250 Hz with 25 ms of delay, after a warm-up; the collector is off.
Time is that of the processor: what else the machine does is left out, but for what it does to the caches.
"""

from __future__ import annotations

import gc
import random
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.control.controller import Controller
from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Attitude, Depth, Position

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
MEASUREMENTS = ("position_yaw", "position_attitude", "full")
RATE_HZ = 250
WARM, COUNT = 500, 5000


def inputs() -> list[tuple[Position, Attitude]]:
    rng = random.Random(1)
    made = []
    for k in range(1, WARM + COUNT + 1):
        stamp = round(k * 1e6 / RATE_HZ)
        place, velocity, rates = (tuple(rng.gauss(0.0, 0.003) for _ in range(3)) for _ in range(3))
        roll, pitch, yaw = (rng.gauss(0.0, 0.001) for _ in range(3))
        made.append((Position(stamp, place, velocity), Attitude(stamp, roll, pitch, yaw, rates)))
    return made


def step_us(depth: Depth, measurements: str, form: str, made: list[tuple[Position, Attitude]]) -> list[float]:
    goal = hold(Pose((0.0, 0.0, 0.0), 0.0))
    start = Position(0, (0.0,) * 3, (0.0,) * 3), Attitude(0, 0.0, 0.0, 0.0, (0.0,) * 3)
    law = Controller(LawParams(measurements=measurements, form=form), depth, *start, 9.81)
    clock, spent = time.thread_time_ns, []
    for position, attitude in made:
        before = clock()
        law.observe_attitude(attitude)
        law.observe_position(position)
        law.command(lambda _: goal)
        spent.append((clock() - before) * 1e-3)
    return spent[WARM:]


def main() -> None:
    made = inputs()
    gc.disable()
    print(f"| depth | measured | median, us | p99, us | of a core at {RATE_HZ} Hz |\n|---|---|---|---|---|")
    rows = [(depth, m, "output_feedback") for depth in DEPTHS for m in MEASUREMENTS]
    rows += [(depth, "full", "state_feedback") for depth in DEPTHS]
    for depth, measurements, form in rows:
        spent = sorted(step_us(depth, measurements, form, made))
        median, p99 = statistics.median(spent), spent[round(0.99 * len(spent))]
        name = measurements if form == "output_feedback" else "state feedback"
        print(f"| {depth} | {name} | {median:.0f} | {p99:.0f} | {median * RATE_HZ * 1e-4:.1f} % |", flush=True)


if __name__ == "__main__":
    main()
