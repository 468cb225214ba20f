"""An endpoint that echoes, behind an impaired link."""

from mavquad.endpoint import advance, deliver
from sitl_mock.config.faults import faults_of
from sitl_mock.config.link import LinkConfig
from sitl_mock.faults import ImpairedLink
from sitl_mock.script import Script

STEP_US = 10_000


class Echo:
    """Answers each frame at once and ticks every 4 ms; keeps when each call came."""

    def __init__(self, *faults):
        self.script = Script(faults, 0)
        self.inputs = []
        self.ticks = []
        self._out = []

    def receive(self, data, now_us, port=0):
        self.inputs.append((now_us, data))
        self._out.append(data)

    def next_deadline_us(self):
        return (self.ticks[-1] if self.ticks else 0) + 4000

    def on_deadline(self, now_us):
        self.ticks.append(now_us)

    def datagrams_to_send(self, port=0):
        out, self._out = self._out, []
        return out


def fault(kind, **keys):
    """A fault of the link by its kind."""
    (made,) = faults_of([{"kind": kind, **keys}], "test")
    return made


def exchange(frames, seed=1, faults=(), spacing_us=STEP_US, **link):
    """Send `frames` frames, one each `spacing_us`; returns (echo endpoint, what came back as (stamp, data))."""
    echo = Echo(*faults)
    impaired = ImpairedLink(echo, LinkConfig(**link), seed)
    back = []
    for k in range(1, frames + 1):
        back += deliver(impaired, k.to_bytes(4, "big"), k * spacing_us)
    back += advance(impaired, frames * spacing_us + 2_000_000)
    return echo, back


def number(data):
    """Which frame it is, from 1."""
    return int.from_bytes(data, "big")
