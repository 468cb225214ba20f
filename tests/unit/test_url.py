"""Connection strings: every form that is read, and every way of being wrong."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.errors import EndpointError
from mavquad.url import Address, parse_url, speaks_first


@pytest.mark.parametrize(
    ("url", "address"),
    [
        ("udpin:0.0.0.0:14540", Address(True, "0.0.0.0", 14540)),
        ("udpin:127.0.0.1:0", Address(True, "127.0.0.1", 0)),
        ("udp:127.0.0.1:14540", Address(True, "127.0.0.1", 14540)),
        ("udpout:192.168.1.7:14580", Address(False, "192.168.1.7", 14580)),
        ("udpout:drone.local:65535", Address(False, "drone.local", 65535)),
        ("udpin://127.0.0.1:14540", Address(True, "127.0.0.1", 14540)),
        ("udpout://127.0.0.1:1", Address(False, "127.0.0.1", 1)),
        ("udp://:14540", Address(True, "0.0.0.0", 14540)),
        ("udpin::14540", Address(True, "0.0.0.0", 14540)),
        ("udpin:[::1]:14540", Address(True, "::1", 14540)),
    ],
)
def test_what_is_read(url, address):
    assert parse_url(url) == address


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("", "not a connection string"),
        ("udp", "not a connection string"),
        ("14540", "not a connection string"),
        ("tcp:127.0.0.1:5760", "not a connection string"),
        ("UDP:127.0.0.1:14540", "not a connection string"),
        ("/dev/ttyACM0", "not a connection string"),
        ("udpin:", "'' is not a port number"),
        ("udpin:127.0.0.1", "'127.0.0.1' is not a port number"),
        ("udpin:127.0.0.1:", "'' is not a port number"),
        ("udpin:127.0.0.1:http", "'http' is not a port number"),
        ("udpin:127.0.0.1:1.5", "'1.5' is not a port number"),
        ("udpin:127.0.0.1:65536", "port 65536 is out of range"),
        ("udpout:127.0.0.1:0", "port 0 is out of range"),
        ("udpin:127.0.0.1:-1", "'-1' is not a port number"),
        ("udpout::14580", "a host to send to is missing"),
    ],
)
def test_what_is_refused(url, reason):
    with pytest.raises(EndpointError) as caught:
        parse_url(url)
    assert reason in caught.value.message
    assert caught.value.message.startswith(f"{url}: ")
    assert "udpin:127.0.0.1:14540" in caught.value.hint
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("url", "first"), [("mock", True), ("udpout:h:1", True), ("udpin:h:1", False), ("udp:h:1", False)]
)
def test_who_speaks_first(url, first):
    assert speaks_first(url) is first


@given(st.text(max_size=30))
def test_any_text_is_an_address_or_an_error_of_ours(text):
    try:
        assert 0 <= parse_url(text).port <= 65535
    except EndpointError as error:
        assert error.hint


@given(st.text(alphabet=":/[]-_ 0123456789udpinot.", max_size=20))
def test_nearly_right_text_too(text):
    try:
        assert parse_url("udpin:" + text).listens
    except EndpointError as error:
        assert error.hint
