"""Opening the sockets of links, so that whatever is wrong with a port or a host is said in a user's words."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Iterator

from mavquad.errors import EndpointError
from mavquad.url import Address
from sitl_mock.endpoints import LinkSpec

_GONE_AFTER_S = 120
"""A TCP client that takes nothing for so long is gone; one that a debugger has stopped for a while is not."""
_ENDPOINT_HINT = "another program has this port, maybe a simulator: stop it, or choose --instance or --endpoint"


def open_udp(spec: LinkSpec) -> tuple[socket.socket, tuple[str, int] | None]:
    """(the bound socket, the address that it speaks to at first).

    Raises:
        EndpointError: it cannot be opened.
    """
    speaks_to = None
    if spec.speak_to is not None:
        family, speaks_to = _resolved(spec.speak_to, "udpout", socket.SOCK_DGRAM)
        with _explained(spec.speak_to, "udpout"):
            local = (_own_host(family, speaks_to), 0)
    if spec.listen is not None:
        family, local = _resolved(spec.listen, "udpin", socket.SOCK_DGRAM)
    opened = socket.socket(family, socket.SOCK_DGRAM)
    try:
        with _explained(spec.listen or spec.speak_to, "udpin" if spec.listen else "udpout"):
            opened.setblocking(False)
            opened.bind(local)
    except EndpointError:
        opened.close()
        raise
    return opened, speaks_to


def _own_host(family: socket.AddressFamily, peer: tuple[str, int]) -> str:
    """The address of ours that reaches a peer: who is not on its network need not reach the vehicle."""
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.connect(peer)
        return str(probe.getsockname()[0])


def open_tcp(spec: LinkSpec) -> socket.socket:
    """A socket that listens.

    Raises:
        EndpointError: it cannot be opened.
    """
    assert spec.listen is not None
    family, local = _resolved(spec.listen, "tcpin", socket.SOCK_STREAM)
    with _explained(spec.listen, "tcpin"):
        listener = socket.create_server(local, family=family, backlog=5)
    listener.setblocking(False)
    return listener


def _resolved(address: Address, words: str, kind: socket.SocketKind) -> tuple[socket.AddressFamily, tuple[str, int]]:
    with _explained(address, words):
        family, _, _, _, place = socket.getaddrinfo(address.host, address.port, type=kind)[0]
    return family, (str(place[0]), int(place[1]))


@contextlib.contextmanager
def _explained(address: Address | None, words: str) -> Iterator[None]:
    assert address is not None, "a link listens, or speaks to somebody"
    url = f"{words}:{address.host}:{address.port}"
    try:
        yield
    except UnicodeError:
        raise EndpointError(url, "cannot be opened (this is no host name)", "check the host and the port") from None
    except OSError as error:
        # Of its own, Python adds the address to the words of some errors.
        number = error.errno or 0
        reason = (os.strerror(number) if number in errno.errorcode else error.strerror or str(error)).lower()
        hint = _ENDPOINT_HINT if error.errno == errno.EADDRINUSE else "check the host and the port"
        raise EndpointError(url, f"cannot be opened ({reason})", hint) from None


def local_address(opened: socket.socket) -> Address:
    """Where a socket is bound."""
    host, port = opened.getsockname()[:2]
    return Address(True, str(host), int(port))


def notice_the_gone(client: socket.socket) -> None:
    """Frames at once, and an end to a client that vanished without a word."""
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", _GONE_AFTER_S // 3),
        ("TCP_KEEPINTVL", _GONE_AFTER_S // 6),
        ("TCP_KEEPCNT", 4),
        ("TCP_USER_TIMEOUT", _GONE_AFTER_S * 1000),
    ):
        if hasattr(socket, name):
            client.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
