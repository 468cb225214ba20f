"""The printed b4(0, yaw) against the corrected one, flown at six yaw angles: `python tests/bench/decoupling.py`.

The paper's own form of the law: torque, position and yaw alone, constant gain, yaw padded to length 4. Rigid body of the
controller's tests without noise; start at rest, 0.3 m and 0.2 m away from the goal.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from tests.unit.control.plant import Flight, Link, fly
from tests.unit.control.printed import YAW_ANGLES_DEG, law_as_printed

PAPER = LawParams(depth="torque", measurements="position_yaw", decoupling="constant", yaw_padding=2)
QUIET = Link(white_m=0.0, wander_m=0.0, yaw_white_rad=0.0, rate_white_rad_s=0.0)
SETTLED_M = 0.05


def flown(yaw_rad: float) -> Flight:
    goal = hold(Pose((0.3, 0.2, 0.0), yaw_rad))
    return fly(PAPER, lambda _: goal, 12.0, link=QUIET, start_yaw=yaw_rad)


def verdict(flight: Flight) -> str:
    if flight.crashed:
        return f"diverges: upside down or 30 m away after {flight.time_s[-1]:.1f} s"
    outside = [t for t, e in zip(flight.time_s, flight.error_m, strict=True) if math.hypot(*e) > SETTLED_M]
    return f"settles to 5 cm in {outside[-1]:.1f} s"


def main() -> None:
    print("| yaw | corrected | printed |\n|---|---|---|")
    for yaw_deg in YAW_ANGLES_DEG:
        yaw = math.radians(yaw_deg)
        right = verdict(flown(yaw))
        with law_as_printed():
            printed = verdict(flown(yaw))
        print(f"| {yaw_deg} deg | {right} | {printed} |")


if __name__ == "__main__":
    main()
