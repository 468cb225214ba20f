"""What noise of the measurements costs: position and command in hover, for each measurement set and depth.

    python tests/bench/noise.py

White noise on position (and ten times as much per second on velocity), attitude and body rates; hover, 100 Hz, 25 ms of
delay, rotor lag 50 ms. Position is the true one against the goal; the command is that of roll and pitch, in the unit of its
depth: rad/s^2, rad/s, rad. RMS from 5 s to 20 s.
"""

from __future__ import annotations

import math
import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import AttitudeCommand, Depth, LawCommand, RateCommand
from tests.unit.control.plant import Flight, Link, fly

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
MEASUREMENTS = ("position_yaw", "position_attitude", "full")
POSITION_MM = (1.0, 3.0, 10.0)
ATTITUDE_DEG = (0.05, 0.3)
RATE_RAD_S = {0.05: 0.005, 0.3: 0.03}
HOVER = hold(Pose((0.0, 0.0, 0.0), 0.0))
BEGIN_S, END_S = 5.0, 20.0


def roll_and_pitch(command: LawCommand) -> tuple[float, float]:
    if isinstance(command, AttitudeCommand):
        return command.roll_rad, command.pitch_rad
    if isinstance(command, RateCommand):
        return command.rates_flu_rad_s[:2]
    return command.angular_acceleration_flu_rad_s2[:2]


def rms(values: list[float]) -> float:
    return math.sqrt(statistics.fmean(v * v for v in values))


def flown(depth: Depth, measurements: str, position_mm: float, attitude_deg: float) -> Flight:
    link = Link(
        white_m=1e-3 * position_mm,
        velocity_white_m_s=1e-2 * position_mm,
        wander_m=0.0,
        yaw_white_rad=math.radians(attitude_deg),
        rate_white_rad_s=RATE_RAD_S[attitude_deg],
    )
    return fly(LawParams(measurements=measurements), lambda _: HOVER, END_S, depth=depth, link=link)


def cell(flight: Flight) -> str:
    if flight.crashed:
        return "diverges"
    begin = next(k for k, t in enumerate(flight.time_s) if t >= BEGIN_S)
    place = rms([math.hypot(*p) for p in flight.truth[begin:]])
    command = rms([math.hypot(*roll_and_pitch(c)) for c in flight.commands[begin:]])
    return f"{1e3 * place:.1f} mm, {command:.2g}"


def main() -> None:
    heads = [f"{mm:g} mm, {deg:g} deg" for deg in ATTITUDE_DEG for mm in POSITION_MM]
    print("Position RMS, and RMS of the command of roll and pitch\n")
    print(f"| depth | measured | {' | '.join(heads)} |\n|---|---|{'---|' * len(heads)}")
    for depth in DEPTHS:
        for measurements in MEASUREMENTS:
            cells = [cell(flown(depth, measurements, mm, deg)) for deg in ATTITUDE_DEG for mm in POSITION_MM]
            print(f"| {depth} | {measurements} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
