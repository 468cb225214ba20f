"""The law on vehicles that nobody told it of: hover and figure-eight on the mock, both personalities, in lockstep.

    python tests/bench/vehicles.py [--depths rate attitude] [--only WORD] [--workers 2] [--own]

Each vehicle differs from PX4's SIH quadcopter (1 kg, rotors of 50 ms) by what its row says. No gain is told. A cell: RMS of
the position error in cm, hover / figure-eight, as the autopilot estimates it, without the first 5 s; or how the flight ended.
With --own the autopilot's own position control flies the same, fed forward.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.drivers.lockstep import START_US, Lockstep
from mavquad.flight.mission import Mission
from mavquad.frames import ned_from_nwu
from mavquad.schema import parse_section
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink
from tests.bench.own_pilot import GaveUp, OwnPilot
from tests.support import Recording, prepare, run

SETTLED_S = 5.0
LIMIT_S = 150.0
PERSONALITIES = {"PX4 1.16": ("px4", "1.16"), "ArduCopter": ("ardupilot", "4.7")}
MISSIONS: dict[str, dict[str, object]] = {
    "hover": {"mission.name": '"hover"', "mission.duration_s": 20.0},
    "eight": {"mission.name": '"figure_eight"'},
}


def vehicle(lag_ms: float = 50.0, inertia: float = 1.0, mass_kg: float = 1.0, motors: float = 1.0) -> dict[str, object]:
    """SIH's with some numbers changed; `inertia` and `motors` are factors."""
    return {
        "mock.vehicle.mass_kg": mass_kg,
        "mock.vehicle.inertia_kg_m2": [inertia * each for each in (0.025, 0.025, 0.030)],
        "mock.vehicle.motor_thrust_max_n": 5.0 * motors,
        "mock.vehicle.motor_torque_max_nm": 0.1 * motors,
        "mock.vehicle.motor_time_constant_s": lag_ms * 1e-3,
    }


def wind(speed_m_s: float, gusts_m_s: float = 0.0) -> dict[str, object]:
    """Towards the north-east."""
    part = round(speed_m_s * math.sqrt(0.5), 3)
    return {"mock.wind_ned_m_s": [part, part, 0.0], "mock.gusts_m_s": gusts_m_s}


def latency(each_way_ms: float) -> dict[str, object]:
    return {"mock.link.latency_ms": each_way_ms}


CASES: dict[str, dict[str, object]] = {
    "SIH as it is": vehicle(),
    "rotor lag 20 ms": vehicle(20.0),
    "rotor lag 35 ms": vehicle(35.0),
    "rotor lag 75 ms": vehicle(75.0),
    "inertia x 0.5": vehicle(inertia=0.5),
    "inertia x 0.7": vehicle(inertia=0.7),
    "inertia x 1.4": vehicle(inertia=1.4),
    "inertia x 2": vehicle(inertia=2.0),
    "mass 0.5 kg": vehicle(mass_kg=0.5),
    "mass 0.7 kg": vehicle(mass_kg=0.7),
    "mass 1.4 kg": vehicle(mass_kg=1.4),
    "mass 2 kg, motors x 2": vehicle(mass_kg=2.0, motors=2.0),
    "mass, motors, inertia x 2": vehicle(mass_kg=2.0, motors=2.0, inertia=2.0),
    "latency 0 ms": vehicle() | latency(0.0),
    "latency 20 ms": vehicle() | latency(20.0),
    "latency 40 ms": vehicle() | latency(40.0),
    "wind 4 m/s, gusts 1 m/s": vehicle() | wind(4.0, 1.0),
    "wind 8 m/s, gusts 1 m/s": vehicle() | wind(8.0, 1.0),
    "lag 20 ms, inertia x 0.5": vehicle(20.0, 0.5),
    "lag 20 ms, inertia x 2": vehicle(20.0, 2.0),
    "lag 75 ms, inertia x 0.5": vehicle(75.0, 0.5),
    "lag 75 ms, inertia x 2": vehicle(75.0, 2.0),
    "lag 75 ms, latency 40 ms": vehicle(75.0) | latency(40.0),
    "lag 75 ms, inertia x 2, latency 40 ms, wind 4 m/s, gusts": vehicle(75.0, 2.0) | latency(40.0) | wind(4.0, 1.0),
    "1.4 kg, lag 75 ms, latency 20 ms, wind 8 m/s, gusts": vehicle(75.0, mass_kg=1.4) | latency(20.0) | wind(8.0, 1.0),
    "0.7 kg, lag 20 ms, inertia x 0.7, latency 0, wind 4 m/s": vehicle(20.0, 0.7, 0.7) | latency(0.0) | wind(4.0, 1.0),
}


def overrides(case: str, personality: str, mission: str) -> dict[str, object]:
    autopilot, firmware = PERSONALITIES[personality]
    told = {"mock.autopilot": f'"{autopilot}"', "mock.firmware": f'"{firmware}"', "mock.vehicle.frame": '"x"'}
    if autopilot == "ardupilot":
        told |= {
            "mock.vehicle.thrust_curve": 0.0,
            "mock.vehicle.arm_m": 0.2,
            "mock.vehicle.linear_drag_n_s_m": 1.0,
            "mock.vehicle.quadratic_drag_n_s2_m2": 0.0,
            "mock.vehicle.rotor_drag_n_s_m": 0.0,
            "mock.vehicle.angular_drag_nm_s_rad": 0.025,
            "mock.vehicle.battery_full_v": 16.2,
            "mock.vehicle.battery_empty_v": 14.0,
            "mock.vehicle.battery_capacity_ah": 0.0,
            "mock.vehicle.hover_current_a": 0.0,
        }
    return {**told, **MISSIONS[mission], **CASES[case]}


def fly(case: str, personality: str, depth: str, mission: str) -> str:
    """RMS in cm, or how it ended."""
    if depth == "own":
        return fly_own(case, personality, mission)
    flight = prepare({**overrides(case, personality, mission), "law.depth": f'"{depth}"'})
    run(flight, LIMIT_S)
    error = flight.agent.error
    if not flight.agent.done:
        return "does not end"
    if error is not None:
        began = any(row.phase == "flying" for row in flight.rows)
        return ("" if began else "before the law: ") + error.message.split(":")[0].replace("guard ", "")
    return f"{100.0 * (flight.metrics().position_rms_m or math.nan):.1f}"


def fly_own(case: str, personality: str, mission: str) -> str:
    flight = prepare(overrides(case, personality, mission))
    mock = parse_section(MockConfig, flight.config.mock, "bench", "mock")
    pilot = OwnPilot(flight.config, START_US, flight.config.law.delay())
    try:
        with contextlib.suppress(StopIteration):
            far = ImpairedLink(flight.mock, mock.link, flight.config.seed)
            Lockstep(pilot, far, Recording()).run(lambda: pilot.done, LIMIT_S)
    except GaveUp as error:
        return f"gave up: {error}"
    flown = pilot.mission
    if flown is None or not pilot.done:
        return "does not end"
    return _own_rms(pilot.places, flown)


def _own_rms(places: Iterable[tuple[int, tuple[float, float, float]]], flown: Mission) -> str:
    squares = []
    for stamp_us, place in places:
        if flown.start_us + SETTLED_S * 1e6 <= stamp_us and not flown.over(stamp_us):
            point = flown.reference(stamp_us)
            squares.append(math.dist(place, ned_from_nwu((point.x_m[0], point.y_m[0], point.z_m[0]))) ** 2)
    return f"{100.0 * math.sqrt(math.fsum(squares) / len(squares)):.1f}" if squares else "-"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--depths", nargs="+", default=["rate", "attitude"], choices=["torque", "rate", "attitude"])
    parser.add_argument("--only", default=[""], nargs="+", help="cases whose name has one of these in it")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--own", action="store_true")
    mine = parser.parse_args()
    columns = [(personality, depth) for personality in PERSONALITIES for depth in mine.depths + ["own"] * mine.own]
    print("| vehicle | " + " | ".join(f"{personality}, {depth}" for personality, depth in columns) + " |")
    print("|---|" + "---|" * len(columns))
    with ProcessPoolExecutor(mine.workers) as pool:
        rows = {
            case: [[pool.submit(fly, case, *column, mission) for mission in MISSIONS] for column in columns]
            for case in CASES
            if any(word in case for word in mine.only)
        }
        for case, cells in rows.items():
            print(
                f"| {case} | " + " | ".join(" / ".join(each.result() for each in cell) for cell in cells) + " |",
                flush=True,
            )


if __name__ == "__main__":
    main()
