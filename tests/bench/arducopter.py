"""How the mock's ArduCopter flies by itself, beside what was measured on the real one.

    python tests/bench/arducopter.py

Rates: from the setpoint to 63 % of a step in ATTITUDE (250 Hz); the real figures contain a few ms of transport. Hover and
figure-eight: GUIDED position setpoints, 3-D RMS in a calm, the hover against its own estimate (as the real one's), the
figure-eight x = 1.25 sin t, z = 0.75 sin 2t against the truth.
"""

from __future__ import annotations

import copy
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.endpoint import advance, deliver
from mavquad.protocol.codec import Encoder, decode, mavlink
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.config.sensors import SensorsConfig

START_US = 1_700_000_000_000_000
QUIET = {
    "position_noise_m": 0.0,
    "position_wander_m": 0.0,
    "velocity_noise_m_s": 0.0,
    "attitude_noise_deg": 0.0,
    "rates_noise_rad_s": 0.0,
}
HOVER = 0.364
ALL, POSITION_ALONE = 0xC00, 0xDF8


class Pilot:
    """An ArduCopter and who commands it."""

    def __init__(self, **config):
        self.mock = MockAutopilot(MockConfig(autopilot="ardupilot", **config), 1, START_US)
        self.encoder = Encoder(255, 190)
        self.now_us = START_US
        self.frames = []

    def send(self, message):
        self.now_us += 400
        self.frames += deliver(self.mock, self.encoder.encode(message), self.now_us)

    def run(self, seconds):
        self.now_us += round(seconds * 1e6)
        self.frames += advance(self.mock, self.now_us)

    def command(self, command, *params):
        self.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *params, *[0.0] * (7 - len(params))))

    def set(self, name, value):
        self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, 9))

    def rates(self, rates, seconds):
        for _ in range(round(100 * seconds)):
            self.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0x80, [1, 0, 0, 0], *rates, HOVER))
            self.run(0.0096)

    def hover(self):
        self.run(1.2)
        for command in ((176, 1, 4), (400, 1), (22, 0, 0, 0, 0, 0, 0, 10)):
            self.command(*command)
        self.run(25.0)
        return self


def step_ms(hovering, axis, degrees, is_limited):
    """(time to 63 %, overshoot in per cent) of a step of one body rate."""
    pilot = copy.deepcopy(hovering)
    pilot.set("GUID_OPTIONS", 8)
    for name in () if is_limited else "RPY":
        pilot.set(f"ATC_ACCEL_{name}_MAX", 0)
    pilot.rates((0.0, 0.0, 0.0), 0.5)
    pilot.command(511, mavlink.MAVLINK_MSG_ID_ATTITUDE, 4000)
    pilot.frames, sent_us = [], pilot.now_us
    pilot.rates(tuple(math.radians(degrees) * (i == axis) for i in range(3)), 0.6)
    messages = ((stamp, decode(frame)) for stamp, frame in pilot.frames)
    name = ("rollspeed", "pitchspeed", "yawspeed")[axis]
    seen = [(t - sent_us, getattr(m, name) / math.radians(degrees)) for t, m in messages if m.get_type() == "ATTITUDE"]
    return next(t for t, part in seen if part >= 0.63) / 1e3, 100 * (max(part for _, part in seen) - 1)


def hover_cm(pilot):
    pilot.command(511, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20_000)
    pilot.frames = []
    pilot.run(20.0)
    places = [m for m in (decode(frame) for _, frame in pilot.frames) if m.get_type() == "LOCAL_POSITION_NED"]
    mean = [sum(getattr(m, axis) for m in places) / len(places) for axis in "xyz"]
    return 100 * math.sqrt(sum(math.dist((m.x, m.y, m.z), mean) ** 2 for m in places) / len(places))


def eight(t):
    place = (1.25 * math.sin(t), 0.0, -10.0 + 0.75 * math.sin(2 * t))
    velocity = (1.25 * math.cos(t), 0.0, 1.5 * math.cos(2 * t))
    return place, velocity, (-1.25 * math.sin(t), 0.0, -3.0 * math.sin(2 * t))


def eight_cm(hovering, mask):
    pilot = copy.deepcopy(hovering)
    start_us, squares = pilot.now_us, []
    while (t := (pilot.now_us - start_us) / 1e6) < 50.0:
        place, velocity, acceleration = eight(t)
        pilot.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, mask, *place, *velocity, *acceleration, 0.0, 0.0
            )
        )
        pilot.run(0.0196)
        if t > 10.0:
            there = eight((pilot.now_us - start_us) / 1e6)[0]
            squares.append(math.dist(pilot.mock.truth().position_ned_m, there) ** 2)
    return 100 * math.sqrt(sum(squares) / len(squares))


def main():
    still = Pilot(sensors=SensorsConfig(**QUIET)).hover()
    print("step of the body rate     63 % after ms (overshoot %)   real")
    for axis, degrees, is_limited, real in (
        (0, 30, True, "45"),
        (0, 100, True, "87"),
        (0, 200, True, "147"),
        (0, 100, False, "34 (4 to 5)"),
        (0, 400, False, "45 (4 to 5)"),
        (2, 90, False, "237"),
    ):
        name = f"{('roll', 'pitch', 'yaw')[axis]} {degrees} deg/s{'' if is_limited else ', ATC_ACCEL 0'}"
        ms, overshoot = step_ms(still, axis, degrees, is_limited)
        print(f"{name:28}{ms:6.0f} ({overshoot:.0f}){'':18}{real}")
    flying = Pilot().hover()
    print("own position control      RMS in cm                     real")
    print(f"{'hover':28}{hover_cm(copy.deepcopy(flying)):6.1f}{'':22}1.8")
    print(f"{'figure-eight, feed-forward':28}{eight_cm(flying, ALL):6.1f}{'':22}20.2")
    print(f"{'figure-eight, position':28}{eight_cm(flying, POSITION_ALONE):6.0f}{'':22}124")


if __name__ == "__main__":
    main()
