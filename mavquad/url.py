"""Connection strings as the users of MAVSDK, MAVProxy and pymavlink write them.

    udpin:HOST:PORT     listen there, answer who speaks        udpin://HOST:PORT, udp:HOST:PORT, udp://HOST:PORT
    udpout:HOST:PORT    speak first, to that address           udpout://HOST:PORT
    tcp:HOST:PORT       connect to a server                    tcp://HOST:PORT, tcpout:HOST:PORT, tcpout://HOST:PORT
    tcpin:HOST:PORT     be the server, of one client           tcpin://HOST:PORT
    /dev/ttyACM0,57600  a serial port and its baud rate        /dev/ttyACM0:57600, serial:///dev/ttyACM0:57600, COM3,57600

Without a HOST, listening is listening on this computer alone (udpin::14540 is udpin:127.0.0.1:14540): who wants to be
reached from elsewhere says so, udpin:0.0.0.0:14540. Without a baud rate a serial port has 57600.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from typing import Literal

from mavquad.errors import EndpointError

MOCK = "mock"
LOOPBACK = "127.0.0.1"
BAUD = 57600
"""What telemetry radios and flight controllers are set to; over USB it means nothing."""
_BAUD_MAX = 12_000_000
_EXAMPLES = (
    "examples: udpin:127.0.0.1:14540 (listen), udpout:127.0.0.1:14580 (speak first), tcp:127.0.0.1:5760, "
    "/dev/ttyACM0,57600"
)
Transport = Literal["udp", "tcp"]
_SOCKETS: dict[str, tuple[Transport, bool]] = {
    "udp": ("udp", True),
    "udpin": ("udp", True),
    "udpout": ("udp", False),
    "tcp": ("tcp", False),
    "tcpout": ("tcp", False),
    "tcpin": ("tcp", True),
}
_SERIAL = "serial"
_OTHERS = {
    "serial_flowcontrol": "hardware flow control is not supported; write serial:///dev/ttyUSB0:57600",
    "udpbcast": "broadcasting is not supported: name the vehicle's address, or listen",
    "http": "this is a web address",
    "https": "this is a web address",
}
_DEVICE = re.compile(r"(?P<device>/.*?|[a-zA-Z]+[0-9]+)(?:[,:](?P<baud>[^,:/]*))?")
_COM = re.compile(r"(?i:com)[0-9]+\b")


@dataclass(frozen=True, slots=True)
class Address:
    """Where to bind (`listens`), or whom to speak to."""

    listens: bool
    host: str
    port: int
    transport: Transport = "udp"

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        out = "" if self.transport == "tcp" else "out"
        return f"{self.transport}{'in' if self.listens else out}:{host}:{self.port}"


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial port, by the name that the operating system has for it."""

    device: str
    baud: int = BAUD

    def __str__(self) -> str:
        return f"{self.device},{self.baud}"


Place = Address | SerialPort


def parse_url(url: str) -> Place:
    """The place in a connection string.

    Raises:
        EndpointError: with the reason and examples.
    """
    kind, separator, rest = url.partition(":")
    if separator and kind in _SOCKETS:
        transport, listens = _SOCKETS[kind]
        return parse_place(url, rest, listens, _EXAMPLES, transport)
    if separator and kind == _SERIAL:
        return _serial_port(url, rest.removeprefix("//"))
    if url.startswith("/") or _COM.match(url):
        return _serial_port(url, url)
    raise EndpointError(url, _what_is_wrong(url, kind), _EXAMPLES)


def parse_place(url: str, place: str, listens: bool, examples: str, transport: Transport = "udp") -> Address:
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
        raise EndpointError(url, f"a host to {'send' if transport == 'udp' else 'connect'} to is missing", examples)
    return Address(listens, host or LOOPBACK, port, transport)


def _serial_port(url: str, place: str) -> SerialPort:
    parts = _DEVICE.fullmatch(place)
    if parts is None:
        raise EndpointError(url, f"{place!r} is not a serial port", _EXAMPLES)
    device, baud_text = parts["device"], parts["baud"]
    if baud_text is None:
        return SerialPort(device)
    if not (baud_text.isascii() and baud_text.isdigit()):
        raise EndpointError(url, f"{baud_text!r} is not a baud rate", _EXAMPLES)
    baud = int(baud_text)
    if not 1 <= baud <= _BAUD_MAX:
        raise EndpointError(url, f"a baud rate of {baud} is out of range", _EXAMPLES)
    return SerialPort(device, baud)


def _what_is_wrong(url: str, kind: str) -> str:
    """Why a text is none of the forms above, with the likeliest thing that was meant."""
    no = "not a connection string that can be used here"
    if kind in _OTHERS:
        return f"{no}: {_OTHERS[kind]}"
    if url.isascii() and url.isdigit():
        return f"{no}: a port alone; udpin:{LOOPBACK}:{url} listens there"
    if re.fullmatch(r"[\w.-]*[.][\w.-]*:\d+|localhost:\d+", url):
        return f"{no}: how to reach it is missing, udpin: (listen there), udpout: (speak first) or tcp:"
    if url.endswith((".tlog", ".raw", ".bin", ".ulg")):
        return f"{no}: this is a file; mavquad replay reads logs"
    meant = difflib.get_close_matches(kind.lower(), [*_SOCKETS, _SERIAL, MOCK], n=1)
    return f"{no}: did you mean {meant[0]}?" if meant and kind not in _SOCKETS else no


def speaks_first(url: str) -> bool:
    """Whether our side must, or may, send before it is spoken to.

    A PX4 on USB begins to speak when it hears MAVLink, a server may wait for its client.
    """
    if url == MOCK:
        return True
    place = parse_url(url)
    return isinstance(place, SerialPort) or not place.listens
