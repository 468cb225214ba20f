"""What one tick (4 ms) of the mock's world costs: vehicle, wind, sensors; microseconds of processor time, best and median.

    python tests/bench/world_speed.py [seconds of virtual time per part]

"asked" reads every field of the estimate at each tick, as a position controller does; otherwise nobody asks.
"""

import math
import statistics
import sys
import time

from mavquad.schema import parse_section
from sitl_mock.config import MockConfig
from sitl_mock.plant import TICK_US
from sitl_mock.world import World

CASES = {
    "in flight": {},
    "in flight, asked": {},
    "in flight, gusts": {"gusts_m_s": 2.0},
    "in flight, Dryden": {"gusts_m_s": 2.0, "gusts_model": "dryden", "wind_ned_m_s": [5.0, 0.0, 0.0]},
    "in flight, coloured noise": {"sensors": {"noise_time_s": 0.05, "wander": "sih"}},
    "in flight, ArduCopter's vehicle": {"autopilot": "ardupilot"},
    "in flight, paper's model": {"vehicle": {"model": "paper"}},
    "on the ground": {},
}
CHUNK = 250


def commands(hover: float) -> list[tuple[float, float, float, float]]:
    """Ten seconds that leave the ground and then wobble about a hover."""
    climb = [(1.1 * hover,) * 4] * 250
    turns = [0.01 * hover * math.sin(k / 20) for k in range(2250)]
    return climb + [(hover - a, hover + a, hover + 0.5 * a, hover - 0.5 * a) for a in turns]


def chunks_us(name: str, config: MockConfig, seconds: float) -> list[float]:
    """Microseconds a tick, chunk by chunk."""
    world = World(config, 1)
    on_ground, asked = name == "on the ground", name.endswith("asked")
    table = [(0.0,) * 4] if on_ground else commands(config.vehicle.params().hover_thrust_norm)
    boot_us, found = 0, []
    for _ in range(max(1, round(seconds * 1e6 / TICK_US / CHUNK))):
        started = time.process_time()
        for k in range(CHUNK):
            boot_us += TICK_US
            world.step(table[k % len(table)], boot_us)
            if asked:
                e = world.estimate
                _ = e.position_ned_m, e.velocity_ned_m_s, e.quaternion, e.euler_rad, e.rates_frd_rad_s
                _ = e.specific_force_frd_m_s2
        found.append((time.process_time() - started) / CHUNK * 1e6)
    assert world.state.on_ground == on_ground, f"{name}: {world.state}"
    return found


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 200.0
    for name, table in CASES.items():
        found = chunks_us(name, parse_section(MockConfig, table, "bench"), seconds)
        print(f"{name:34s} {min(found):6.1f} {statistics.median(found):6.1f} us a tick")


if __name__ == "__main__":
    main()
