"""A pilot in virtual time: talks to a mock autopilot frame by frame, without any socket or clock."""

from __future__ import annotations

import copy
import copyreg
import math
import struct

import pytest

from mavquad.endpoint import advance, deliver
from mavquad.protocol.codec import Encoder, decode, mavlink, message_id
from mavquad.schema import parse_section
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig

START_US = 1_700_000_000_000_000
NO_NOISE = {
    "position_noise_m": 0.0,
    "position_wander_m": 0.0,
    "velocity_noise_m_s": 0.0,
    "attitude_noise_deg": 0.0,
    "rates_noise_rad_s": 0.0,
    "accelerometer_noise_m_s2": 0.0,
    "age_ms": 0,
}
NAN = math.nan
_HOVERING = {}
# pymavlink keeps compiled formats, which copy.deepcopy does not know.
copyreg.pickle(struct.Struct, lambda compiled: (struct.Struct, (compiled.format,)))


class Pilot:
    """Sends messages, lets time pass, and keeps every frame that comes back."""

    def __init__(self, seed=1, **config):
        self.seed = seed
        self.config = parse_section(MockConfig, config, "test")
        self.mock = MockAutopilot(self.config, seed, START_US)
        self.encoder = Encoder(255, 190)
        self.now_us = START_US
        self.frames = []

    def send(self, message, encoder=None):
        """Send one message 400 us from now; returns what comes back at once."""
        self.now_us += 400
        before = len(self.frames)
        self.frames += deliver(self.mock, (encoder or self.encoder).encode(message), self.now_us)
        return [decode(frame) for _, frame in self.frames[before:]]

    def run(self, seconds):
        """Let time pass."""
        self.now_us += round(seconds * 1e6)
        self.frames += advance(self.mock, self.now_us)
        return self

    def fly(self, seconds):
        """Let time pass, with a ground station's heartbeat every second."""
        for _ in range(int(seconds)):
            self.heartbeat().run(1.0)
        return self.heartbeat().run(seconds % 1.0)

    def messages(self, name):
        """Every message of that name since `forget`."""
        wanted = next(i for i, cls in mavlink.mavlink_map.items() if cls.msgname == name)
        return [decode(frame) for _, frame in self.frames if message_id(frame) == wanted]

    def stamps_us(self, name):
        wanted = next(i for i, cls in mavlink.mavlink_map.items() if cls.msgname == name)
        return [stamp - START_US for stamp, frame in self.frames if message_id(frame) == wanted]

    def forget(self):
        self.frames = []

    def texts(self):
        """Every STATUSTEXT since `forget`, its chunks put together."""
        whole = []
        for message in self.messages("STATUSTEXT"):
            if message.chunk_seq:
                whole[-1] += message.text
            else:
                whole.append(message.text)
        return [text.strip() for text in whole]

    def heartbeat(self):
        self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        return self

    def command(self, command, *params, target=(1, 1)):
        """Send a COMMAND_LONG; returns the results of its ACKs."""
        padded = [*params, *[0.0] * (7 - len(params))]
        answers = self.send(mavlink.MAVLink_command_long_message(*target, command, 0, *map(float, padded)))
        return [a.result for a in answers if a.get_type() == "COMMAND_ACK" and a.command == command]

    def offboard(self):
        return self.command(176, 1, 6)

    def torque(self, roll=0.0, pitch=0.0, yaw=0.0, thrust=0.4905, target=(1, 1), group=0):
        controls = [roll, pitch, yaw, thrust, 0.0, 0.0, 0.0, 0.0]
        return self.send(mavlink.MAVLink_set_actuator_control_target_message(0, group, *target, controls))

    def rates(self, roll=0.0, pitch=0.0, yaw=0.0, thrust=0.4905, mask=0x80, q=(1.0, 0.0, 0.0, 0.0)):
        return self.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), roll, pitch, yaw, thrust))

    def position(self, n=0.0, e=0.0, d=-3.0, velocity=(0.0, 0.0, 0.0), mask=0xDF8, frame=1, yaw=0.0):
        return self.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, frame, mask, n, e, d, *velocity, 0.0, 0.0, 0.0, yaw, 0.0
            )
        )

    def stream(self, setpoint, seconds, hz=50):
        """Send a setpoint (a function of the pilot) at `hz`."""
        for _ in range(round(seconds * hz)):
            setpoint(self)
            self.run(1 / hz - 0.0004)
        return self

    def hover(self):
        """From boot to a hover at takeoff altitude; flown once for each configuration, then copied."""
        key = (self.seed, self.config.model_dump_json())
        if key not in _HOVERING:
            _HOVERING[key] = copy.deepcopy(self).fly_to_hover()
        self.__dict__ = copy.deepcopy(_HOVERING[key]).__dict__
        return self

    def fly_to_hover(self):
        """The same, flown anew."""
        self.run(1.1).heartbeat()
        assert self.command(400, 1) == [0]
        assert self.command(22, 0, 0, 0, NAN, NAN, NAN, NAN) == [0]
        self.fly(12.0)
        assert self.mock.mode == "AUTO.LOITER"
        self.forget()
        return self

    @property
    def truth(self):
        return self.mock.truth()


@pytest.fixture
def pilot():
    """Makes pilots: `pilot(seed=3, wind_ned_m_s=[1, 0, 0])`."""
    return Pilot


@pytest.fixture
def quiet():
    """The sensors section without any error."""
    return dict(NO_NOISE)
