"""What goes out on ArduPilot's ports: streams, answers by id, texts in chunks, parameters, its own TIMESYNC."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.personality.ardupilot import telemetry
from sitl_mock.personality.ardupilot.missions import Mission
from sitl_mock.personality.ardupilot.news import News
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.personality.ardupilot.picture import Picture
from sitl_mock.personality.ardupilot.streams import Streams, group_named
from sitl_mock.port import Port

_TIMESYNC_EVERY_US = 10_002_664
_TEXT_LENGTH = 50
_PORTS_WITH_PARAMETERS = 3
_HEARTBEAT: int = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_HOME: tuple[int, ...] = (mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, mavlink.MAVLINK_MSG_ID_HOME_POSITION)


class Reporter:
    """Sends. `picture` makes the picture of the moment; it is asked for only when something is due."""

    def __init__(
        self,
        ports: Sequence[Port],
        params: Parameters,
        first_heartbeat_us: int,
        picture: Callable[[int], Picture],
    ) -> None:
        self._ports = ports
        self._streams = {port: Streams(first_heartbeat_us) for port in ports}
        self._params = params
        self._picture = picture
        self._timesync_us = _TIMESYNC_EVERY_US
        self._requested: list[tuple[Port, int]] = []
        self._text_id = 0

    def streams(self, port: Port) -> Streams:
        """The intervals in force on a port."""
        return self._streams[port]

    def set_group(self, port: Port, group: int, rate_hz: int, boot_us: int) -> None:
        """Obey REQUEST_DATA_STREAM; the port's MAVn_ parameters (of the first three) show the rate."""
        number = self._ports.index(port) + 1
        for name in self._streams[port].set_group_hz(group, rate_hz, boot_us):
            if number <= _PORTS_WITH_PARAMETERS:
                self._params.set(f"MAV{number}_{name}", rate_hz)

    def parameter_set(self, name: str, boot_us: int) -> None:
        """Obey a MAVn_ parameter that is the rate of a group."""
        link, _, rest = name.partition("_")
        number, group = link.removeprefix("MAV"), group_named(rest)
        if number.isdecimal() and 1 <= int(number) <= len(self._ports) and group is not None:
            self._streams[self._ports[int(number) - 1]].set_group_hz(group, int(self._params[name]), boot_us)

    def request(self, port: Port, message_id: int) -> bool:
        """Send a message once, with `send_requested`; False if the mock has none of that id."""
        if message_id not in telemetry.BUILDERS:
            return False
        self._requested.append((port, message_id))
        return True

    def send_requested(self, boot_us: int) -> None:
        """Send what was requested: after the ACK."""
        requested, self._requested = self._requested, []
        for port, message_id in requested:
            _send_built(port, message_id, self._picture(boot_us))

    def send_due(self, boot_us: int) -> None:
        """Send the telemetry that is due on each port."""
        picture = None
        self._params.step(boot_us)
        for port, streams in self._streams.items():
            for message_id in streams.due(boot_us, self._params.is_listing(port)):
                picture = picture or self._picture(boot_us)
                _send_built(port, message_id, picture)
        if boot_us >= self._timesync_us:
            self._timesync_us += _TIMESYNC_EVERY_US
            self.send_everywhere(telemetry.timesync(picture or self._picture(boot_us)))

    def send_news(self, news: News, mission: Mission, boot_us: int) -> None:
        """Tell what happened: a HEARTBEAT when the mode changed, home when it was set, texts, items, parameters."""
        if news.mode_changed or news.home_changed:
            ids = (*((_HEARTBEAT,) if news.mode_changed else ()), *(_HOME if news.home_changed else ()))
            picture = self._picture(boot_us)
            news.mode_changed = news.home_changed = False
            for port in self._streams:
                for message_id in ids:
                    _send_built(port, message_id, picture)
        for number in mission.reached:
            self.send_everywhere(mavlink.MAVLink_mission_item_reached_message(number))
        mission.reached.clear()
        for texts in (news.texts, mission.texts):
            for severity, text in texts:
                self._send_text(severity, text)
            texts.clear()
        for name in news.parameters:
            self.send_everywhere(self._params.message(name))
        news.parameters.clear()

    def send_everywhere(self, message: Message) -> None:
        """Send on every port."""
        for port in self._streams:
            port.send(message)

    def _send_text(self, severity: int, text: str) -> None:
        """Tell those who have said anything yet; more than 50 characters go out in chunks of one id."""
        pieces = [text[at : at + _TEXT_LENGTH] for at in range(0, len(text), _TEXT_LENGTH)]
        if len(pieces) > 1:
            self._text_id = self._text_id % 0xFFFF + 1
        text_id = self._text_id if len(pieces) > 1 else 0
        for number, piece in enumerate(pieces):
            message = mavlink.MAVLink_statustext_message(severity, piece.encode(), text_id, number)
            for port in self._ports:
                if port.heard:
                    port.send(message)


def _send_built(port: Port, message_id: int, picture: Picture) -> None:
    build = telemetry.BUILDERS.get(message_id)
    message = build(picture) if build is not None else None
    if message is not None:
        port.send(message)
