"""The campaign on what goes wrong: flights in lockstep against the mock, both personalities, depths rate and attitude.

    python -m tests.bench.safety [--seeds 50] [--runs 500] [--jobs 2] [--only TEXT] [--part loss|faults|hopeless]

1. loss: 20 % of the frames lost each way, each up to 50 ms late, 5 % twice, 5 % out of order; `seeds` flights of each
   personality and depth. Each must complete.
2. faults: `runs` flights, each with one survivable fault of the mock, drawn by its seed (`tests.bench.scenarios`), in turn
   over kinds, personalities and depths. The vehicle must end safe: landed, holding, or in its pilot's hands; and nothing of
   ours goes out after the first HEARTBEAT that shows a take-over.
3. hopeless: what is not survivable, and what happens then.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from mavquad.types import Depth
from tests.bench.safety_flight import Verdict, fly_scenario
from tests.bench.scenarios import CRAFT, DEPTHS, HOPELESS, LOSSY, PX4_1_13, SURVIVABLE, Craft, Scenario, lossy

LOSS = Scenario("20 % lost, 50 ms jitter, duplicates, reordering", lossy, LOSSY)
_NAMED = {scenario.name: scenario for scenario in (LOSS, *SURVIVABLE, *HOPELESS)}
_CRAFT = {craft.name: craft for craft in (*CRAFT, PX4_1_13)}


@dataclass(frozen=True)
class Job:
    """One flight, by names, so that it can be handed to another process."""

    scenario: str
    craft: str
    depth: Depth
    seed: int

    def fly(self) -> Verdict:
        try:
            return fly_scenario(_NAMED[self.scenario], _CRAFT[self.craft], self.depth, self.seed)
        except Exception as error:  # noqa: BLE001 - one that fails is counted, and the campaign goes on
            return Verdict(f"failed: {error!r}", "", str(self), 0.0)


def loss_jobs(seeds: int) -> Iterator[Job]:
    for seed in range(1, seeds + 1):
        for craft in CRAFT:
            for depth in DEPTHS:
                yield Job(LOSS.name, craft.name, depth, seed)


def fault_jobs(runs: int) -> Iterator[Job]:
    """Kinds in turn; personality and depth change with each round, so that four rounds meet all of them."""
    for run in range(runs):
        turn, kind = divmod(run, len(SURVIVABLE))
        craft, depth = CRAFT[turn % 2], DEPTHS[turn // 2 % 2]
        yield Job(SURVIVABLE[kind].name, craft.name, depth, run + 1)


def hopeless_jobs(seeds: int) -> Iterator[Job]:
    flown: list[tuple[Craft, Depth]] = [(craft, depth) for craft in CRAFT for depth in DEPTHS]
    for scenario in HOPELESS:
        for craft, depth in [(PX4_1_13, "torque"), *flown]:
            for seed in range(1, seeds + 1):
                yield Job(scenario.name, craft.name, depth, seed)


def fly_all(jobs: list[Job], processes: int) -> dict[Job, Verdict]:
    """Fly them, and tell of each that does not end well."""
    verdicts = {}
    with ProcessPoolExecutor(processes) as pool:
        for job, verdict in zip(jobs, pool.map(Job.fly, jobs), strict=True):
            verdicts[job] = verdict
            wrong = verdict.error if job.scenario == LOSS.name and verdict.end != "completed" else ""
            if wrong or not verdict.safe:
                print(f"  {verdict.name}: {verdict.end} {verdict.error}", file=sys.stderr, flush=True)
    return verdicts


def table(verdicts: dict[Job, Verdict], by_depth: bool) -> str:
    """Rows: the kind (and who flies at which depth); columns: flights, safe ones, and how they ended."""
    rows: dict[str, list[Verdict]] = {}
    for job, verdict in verdicts.items():
        row = f"{job.scenario} | {job.craft}, {job.depth}" if by_depth else job.scenario
        rows.setdefault(row, []).append(verdict)
    head = (
        "| fault | vehicle | flights | ends |\n|---|---|---|---|"
        if by_depth
        else "| fault | safe | ends |\n|---|---|---|"
    )
    lines = [head]
    for row, flights in rows.items():
        ends = ", ".join(f"{count} {end}" for end, count in Counter(each.end for each in flights).most_common())
        safe = len(flights) if by_depth else f"{sum(each.safe for each in flights)} of {len(flights)}"
        lines.append(f"| {row} | {safe} | {ends} |")
    return "\n".join(lines)


def part(name: str, jobs: list[Job], processes: int, by_depth: bool) -> bool:
    """Fly one part and print its table; whether all is as it must be."""
    began = time.monotonic()
    verdicts = fly_all(jobs, processes)
    good = [each.end == "completed" if name == "loss" else each.safe for each in verdicts.values()]
    print(f"\n{table(verdicts, by_depth)}\n")
    words = "complete" if name == "loss" else "end safe"
    print(f"{name}: {sum(good)} of {len(good)} {words}, in {time.monotonic() - began:.0f} s", flush=True)
    return all(good) or name == "hopeless"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=50, help="of the lossy flights")
    parser.add_argument("--runs", type=int, default=500, help="flights with faults")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--only", default="", help="scenarios whose name contains this")
    parser.add_argument("--part", choices=("loss", "faults", "hopeless"), help="only this part")
    given = parser.parse_args()
    parts = {
        "loss": list(loss_jobs(given.seeds)),
        "faults": list(fault_jobs(given.runs)),
        "hopeless": list(hopeless_jobs(max(1, given.seeds // 10))),
    }
    good = True
    for name, jobs in parts.items():
        chosen = [job for job in jobs if given.only in job.scenario]
        if chosen and given.part in (None, name):
            good &= part(name, chosen, given.jobs, name != "faults")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
