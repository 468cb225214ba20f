"""Connection strings as the users of MAVLink tools write them.

    udpin:HOST:PORT    listen there, answer whoever speaks (pymavlink, MAVSDK)
    udp:HOST:PORT      the same (pymavlink); MAVSDK's udp://:PORT too
    udpout:HOST:PORT   speak first, to that address

Listening without a HOST (udpin::14540, udp://:14540) is listening on every interface, as it is for them.
Both udpin:HOST:PORT and udpin://HOST:PORT are read.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.errors import EndpointError

MOCK = "mock"
_EXAMPLES = "examples: udpin:127.0.0.1:14540 (listen), udpout:127.0.0.1:14580 (speak first)"


@dataclass(frozen=True, slots=True)
class Address:
    """Where to bind (`listens`) or where to send to."""

    listens: bool
    host: str
    port: int


def parse_url(url: str) -> Address:
    """The address in a connection string.

    Raises:
        EndpointError: with the reason and examples.
    """
    kind, separator, rest = url.partition(":")
    if kind not in ("udp", "udpin", "udpout") or not separator:
        raise EndpointError(url, "not a connection string that can be used here", _EXAMPLES)
    return parse_place(url, rest, kind != "udpout", _EXAMPLES)


def parse_place(url: str, place: str, listens: bool, examples: str) -> Address:
    """The HOST:PORT, or //HOST:PORT, of a connection string; `examples` is the hint of what is wrong with it.

    Raises:
        EndpointError: with the reason and the hint.
    """
    host, _, port_text = place.removeprefix("//").rpartition(":")
    host = host.strip("[]")
    if not (port_text.isascii() and port_text.isdigit()):
        raise EndpointError(url, f"{port_text!r} is not a port number", examples)
    port = int(port_text)
    if not (0 if listens else 1) <= port <= 65535:
        raise EndpointError(url, f"port {port} is out of range", examples)
    if not host and not listens:
        raise EndpointError(url, "a host to send to is missing", examples)
    return Address(listens, host or "0.0.0.0", port)


def speaks_first(url: str) -> bool:
    """Whether our side must send before it can be answered."""
    return url == MOCK or not parse_url(url).listens
