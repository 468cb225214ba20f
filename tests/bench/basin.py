"""How far off a start may be: offset, tilt and speed, at each depth, with both decouplings.

    python tests/bench/basin.py [--figure basin.png] [--workers 2]

The default law on the plant of the controller's tests (rotor lag 50 ms, 25 ms of delay, 100 Hz, no noise); the directions of
offset, tilt and speed are drawn for each start, the same for every law. Recovered: within 0.2 m in the last second of 14 s,
never upside down, never 30 m away.
"""

from __future__ import annotations

import argparse
import itertools
import math
import random
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Depth
from tests.unit.control.ideal import quiet
from tests.unit.control.plant import fly

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
DECOUPLINGS = ("attitude", "constant")
OFFSETS_M = (0.0, 3.0, 6.0, 9.0, 12.0)
TILTS_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
SPEEDS_M_S = (0.0, 2.0, 4.0, 6.0)
DURATION_S = 14.0
Start = tuple[float, float, float]
Case = tuple[Depth, str, Start]


def recovered(case: Case) -> bool:
    depth, decoupling, (offset_m, tilt_deg, speed_m_s) = case
    rng = random.Random(repr(case[2]))
    toward, along, about = (rng.uniform(-math.pi, math.pi) for _ in range(3))
    yaw = rng.uniform(-math.pi, math.pi)
    up = rng.uniform(-0.3, 0.3)
    goal = hold(Pose((offset_m * math.cos(toward), offset_m * math.sin(toward), offset_m * up), yaw))
    tilt = math.radians(tilt_deg)
    flight = fly(
        LawParams(decoupling=decoupling),
        lambda _: goal,
        DURATION_S,
        depth=depth,
        link=quiet(100.0, 0.025),
        start_yaw=yaw,
        start_lean=(tilt * math.cos(about), tilt * math.sin(about)),
        start_velocity=(speed_m_s * math.cos(along), speed_m_s * math.sin(along), 0.0),
    )
    return not flight.crashed and flight.max_m(DURATION_S - 1.0) < 0.2


def share(results: dict[Case, bool], depth: Depth, decoupling: str, place: int, value: float) -> float:
    """Of the starts with this offset (place 0), tilt (1) or speed (2)."""
    picked = [ok for (d, c, start), ok in results.items() if (d, c) == (depth, decoupling) and start[place] == value]
    return sum(picked) / len(picked)


def table(results: dict[Case, bool]) -> None:
    columns = list(itertools.product(DEPTHS, DECOUPLINGS))
    print(f"| start | {' | '.join(f'{depth}, {decoupling}' for depth, decoupling in columns)} |")
    print("|---|" + "---|" * len(columns))
    for place, (name, values) in enumerate(
        (("offset {:g} m", OFFSETS_M), ("tilt {:g} deg", TILTS_DEG), ("speed {:g} m/s", SPEEDS_M_S))
    ):
        for value in values:
            cells = [f"{100 * share(results, depth, decoupling, place, value):.0f} %" for depth, decoupling in columns]
            print(f"| {name.format(value)} | {' | '.join(cells)} |")
    every = [[ok for (d, c, _), ok in results.items() if (d, c) == column] for column in columns]
    print(f"| all {len(every[0])} | {' | '.join(f'{100 * sum(e) / len(e):.0f} %' for e in every)} |")


def draw(results: dict[Case, bool], path: Path) -> None:
    """Share over offset and tilt, all speeds together."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(DECOUPLINGS), len(DEPTHS), figsize=(9.6, 5.6), sharex=True, sharey=True)
    for (row, decoupling), (column, depth) in itertools.product(enumerate(DECOUPLINGS), enumerate(DEPTHS)):
        grid = [
            [
                sum(results[depth, decoupling, (offset, tilt, speed)] for speed in SPEEDS_M_S) / len(SPEEDS_M_S)
                for offset in OFFSETS_M
            ]
            for tilt in TILTS_DEG
        ]
        axis = axes[row][column]
        image = axis.imshow(grid, origin="lower", vmin=0.0, vmax=1.0, cmap="RdYlGn", aspect="auto")
        axis.set_xticks(range(len(OFFSETS_M)), [f"{v:g}" for v in OFFSETS_M])
        axis.set_yticks(range(len(TILTS_DEG)), [f"{v:g}" for v in TILTS_DEG])
        axis.set_title(f"{depth}, {decoupling}", fontsize=10)
        if row == len(DECOUPLINGS) - 1:
            axis.set_xlabel("offset, m")
        if column == 0:
            axis.set_ylabel("tilt, deg")
    figure.colorbar(image, ax=axes, label="recovered, all speeds")
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    starts = list(itertools.product(OFFSETS_M, TILTS_DEG, SPEEDS_M_S))
    cases: list[Case] = list(itertools.product(DEPTHS, DECOUPLINGS, starts))
    with ProcessPoolExecutor(options.workers) as pool:
        results = dict(zip(cases, pool.map(recovered, cases, chunksize=5), strict=True))
    table(results)
    if options.figure is not None:
        draw(results, options.figure)


if __name__ == "__main__":
    main()
