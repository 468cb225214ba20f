"""PX4's sender: on each link the messages that are due, each made once a tick whichever links it goes to."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import Px4Release
from sitl_mock.config.streams import StreamsConfig
from sitl_mock.personality.px4.picture import Picture, int32
from sitl_mock.personality.px4.rates import Topic, streams_of, topics_us
from sitl_mock.personality.px4.telemetry import BUILDERS, ON_REQUEST
from sitl_mock.port import Port
from sitl_mock.sensors import Estimate


class Reporter:
    """The streams of all links.

    Attributes:
        position: the estimate that the position topics were published with last.
        publishes_us: when they are published next.
        next_us: nothing is due on any link before.
    """

    def __init__(self, release: Px4Release, ports: Sequence[Port], limits: StreamsConfig, estimate: Estimate) -> None:
        self.position = estimate
        self._streams = {port: streams_of(port.kind, release, limits) for port in ports}
        self._position_every_us = topics_us(release, limits)[Topic.POSITION]
        self.publishes_us = 0
        self.next_us = 0

    def publish(self, estimate: Estimate, boot_us: int) -> None:
        """Publish the position topics with the estimate of this tick, which is due."""
        self.publishes_us = (boot_us // self._position_every_us + 1) * self._position_every_us
        self.position = estimate

    def report(self, boot_us: int, draw: Callable[[int], Picture]) -> None:
        """Send what is due; `draw` is called if there is anything."""
        picture = None
        made: dict[int, Message | None] = {}
        next_us = NEVER_US
        for port, streams in self._streams.items():
            if boot_us >= streams.next_us:
                for message_id in streams.due(boot_us):
                    if message_id in made:
                        message = made[message_id]
                    else:
                        picture = picture or draw(boot_us)
                        message = made[message_id] = BUILDERS[message_id](picture)
                    if message is not None:
                        port.send(message)
            if streams.next_us < next_us:
                next_us = streams.next_us
        self.next_us = next_us

    def send(self, port: Port, message_id: int, picture: Picture) -> bool:
        """Send one message on a link, asked for by its id; False: there is no such message now."""
        is_known = message_id in ON_REQUEST or self._streams[port].sends(message_id)
        message = BUILDERS[message_id](picture) if is_known else None
        if message is None:
            return False
        port.send(message)
        return True

    def send_interval(self, port: Port, message_id: int) -> None:
        """MESSAGE_INTERVAL of a stream."""
        interval_us = int32(self._streams[port].interval_us(message_id))
        port.send(mavlink.MAVLink_message_interval_message(message_id, interval_us))

    def set_interval(self, port: Port, message_id: int, interval_us: float, boot_us: int) -> bool:
        """Obey SET_MESSAGE_INTERVAL; False: there is no such stream."""
        is_there = self._streams[port].set_interval(message_id, interval_us, boot_us)
        self.next_us = min(streams.next_us for streams in self._streams.values())
        return is_there
