"""Where a mock vehicle can be reached: the ports of the real simulators, or those that a user names.

    udpin:HOST:PORT         listen there, answer who speaks
    udpout:HOST:PORT        speak first, to that address
    tcpin:HOST:PORT         a TCP server for one client at a time
    ...:gcs  ...:onboard    what PX4 takes the link for: a ground station's, or a companion computer's (the default)
    tcpin:HOST:PORT:wait    the vehicle boots when the first client connects

Of several vehicles each listens one port higher than the one before; a port that is spoken to is the same for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from mavquad.errors import EndpointError
from mavquad.url import Address, parse_place
from sitl_mock.config import Autopilot
from sitl_mock.port import PortKind

LOOPBACK = "127.0.0.1"
PX4_ONBOARD_PORT, PX4_ONBOARD_CLIENT = 14580, 14540
PX4_GCS_PORT, PX4_GCS_CLIENT = 18570, 14550
PX4_ONBOARD_CLIENT_LAST = 14549
"""PX4's instances from the tenth on all speak to this one (its px4-rc.mavlink), or their ports would overlap."""
ARDUPILOT_PORTS = (5760, 5762, 5763)
"""SERIAL0, SERIAL1, SERIAL2."""
_PORT_MAX = 65535
ARDUPILOT_STEP = 10
"""Between the ports of two instances of ArduPilot."""

_EXAMPLES = "examples: udpin:127.0.0.1:14580, udpout:127.0.0.1:14550:gcs, tcpin:127.0.0.1:5760:wait"
_TRANSPORTS: dict[str, tuple[Literal["udp", "tcp"], bool]] = {
    "udpin": ("udp", True),
    "udpout": ("udp", False),
    "tcpin": ("tcp", True),
}


@dataclass(frozen=True, slots=True)
class LinkSpec:
    """One link of a vehicle, before it is opened.

    Attributes:
        transport: UDP, or a TCP server for one client.
        kind: what the autopilot takes it for.
        listen: the local address; None for any free port.
        speak_to: whom it speaks to before it has heard anybody; UDP only.
        waits: whether the vehicle boots only when a client has connected; TCP only.
    """

    transport: Literal["udp", "tcp"]
    kind: PortKind
    listen: Address | None
    speak_to: Address | None = None
    waits: bool = False

    def of_vehicle(self, number: int) -> LinkSpec:
        """The same link of the vehicle of that number, from 0.

        Raises:
            EndpointError: its port would be beyond the last one.
        """
        if self.listen is None or self.listen.port == 0:
            return self
        port = self.listen.port + number
        if port > _PORT_MAX:
            url = f"{self.transport}in:{self.listen.host}:{self.listen.port}"
            raise EndpointError(url, f"vehicle {number + 1} would listen at port {port}", f"ports end at {_PORT_MAX}")
        return replace(self, listen=replace(self.listen, port=port))


def parse_endpoint(url: str, autopilot: Autopilot) -> LinkSpec:
    """The link in a connection string.

    Raises:
        EndpointError: with the reason and examples.
    """
    transport, separator, rest = url.partition(":")
    if transport not in _TRANSPORTS or not separator:
        raise EndpointError(url, "not an endpoint of the mock", _EXAMPLES)
    protocol, listens = _TRANSPORTS[transport]
    words = ["wait"] if protocol == "tcp" else ["gcs", "onboard"] if autopilot == "px4" else []
    place, _, word = rest.rpartition(":")
    if word.isalpha() and place.count(":"):
        if word not in words:
            allowed = f"allowed here: {', '.join(words)}" if words else "nothing may follow the port here"
            raise EndpointError(url, f"{word!r} says nothing about this link; {allowed}", _EXAMPLES)
        rest = place
    else:
        word = ""
    address = parse_place(url, rest, listens, _EXAMPLES)
    kind: PortKind = "serial" if autopilot == "ardupilot" else "gcs" if word == "gcs" else "onboard"
    return LinkSpec(protocol, kind, address if listens else None, None if listens else address, word == "wait")


def default_links(autopilot: Autopilot, instance: int) -> tuple[LinkSpec, ...]:
    """The links of the real simulator's instance, on the loopback interface.

    PX4 speaks at once, to a companion computer and to a ground station; ArduPilot waits for a client of SERIAL0.
    """
    if autopilot == "ardupilot":
        ports = [port + ARDUPILOT_STEP * instance for port in ARDUPILOT_PORTS]
        return tuple(LinkSpec("tcp", "serial", _loopback(port), waits=number == 0) for number, port in enumerate(ports))
    client = min(PX4_ONBOARD_CLIENT + instance, PX4_ONBOARD_CLIENT_LAST)
    return (
        LinkSpec("udp", "onboard", _loopback(PX4_ONBOARD_PORT + instance), _loopback(client)),
        LinkSpec("udp", "gcs", _loopback(PX4_GCS_PORT + instance), _loopback(PX4_GCS_CLIENT)),
    )


def _loopback(port: int) -> Address:
    return Address(True, LOOPBACK, port)


def links_of(autopilot: Autopilot, instance: int, endpoints: Sequence[LinkSpec], vehicle: int) -> tuple[LinkSpec, ...]:
    """The links of a vehicle of that number, from 0: those that were named, or those of the real simulator."""
    if endpoints:
        return tuple(spec.of_vehicle(vehicle) for spec in endpoints)
    return default_links(autopilot, instance + vehicle)
