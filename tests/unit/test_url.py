"""Connection strings: every form that is read, and every way of being wrong."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.errors import EndpointError
from mavquad.url import BAUD, Address, SerialPort, parse_url, speaks_first


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
        ("udp://:14540", Address(True, "127.0.0.1", 14540)),
        ("udpin::14540", Address(True, "127.0.0.1", 14540)),
        ("udpin:14540", Address(True, "127.0.0.1", 14540)),
        ("udpin://0.0.0.0:14540", Address(True, "0.0.0.0", 14540)),
        ("udpin:[::1]:14540", Address(True, "::1", 14540)),
        ("tcp:127.0.0.1:5760", Address(False, "127.0.0.1", 5760, "tcp")),
        ("tcp://drone.local:5760", Address(False, "drone.local", 5760, "tcp")),
        ("tcpout:10.0.0.1:1", Address(False, "10.0.0.1", 1, "tcp")),
        ("tcpout://10.0.0.1:1", Address(False, "10.0.0.1", 1, "tcp")),
        ("tcpin:0.0.0.0:5760", Address(True, "0.0.0.0", 5760, "tcp")),
        ("tcpin://:5760", Address(True, "127.0.0.1", 5760, "tcp")),
        ("/dev/ttyACM0", SerialPort("/dev/ttyACM0", BAUD)),
        ("/dev/ttyACM0,115200", SerialPort("/dev/ttyACM0", 115200)),
        ("/dev/ttyACM0:921600", SerialPort("/dev/ttyACM0", 921600)),
        ("serial:/dev/ttyUSB0:57600", SerialPort("/dev/ttyUSB0", 57600)),
        ("serial:///dev/ttyACM0:57600", SerialPort("/dev/ttyACM0", 57600)),
        ("serial:///dev/ttyACM0", SerialPort("/dev/ttyACM0", BAUD)),
        ("serial://COM3:57600", SerialPort("COM3", 57600)),
        (
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0,57600",
            SerialPort("/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0", 57600),
        ),
        ("COM3", SerialPort("COM3", BAUD)),
        ("com12,115200", SerialPort("com12", 115200)),
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
        ("14540", "a port alone; udpin:127.0.0.1:14540 listens there"),
        ("UDP:127.0.0.1:14540", "did you mean udp?"),
        ("upd:127.0.0.1:14540", "did you mean udp?"),
        ("seriall:/dev/ttyACM0", "did you mean serial?"),
        ("moc", "did you mean mock?"),
        ("127.0.0.1:14550", "how to reach it is missing"),
        ("localhost:14550", "how to reach it is missing"),
        ("flight.tlog", "mavquad replay reads logs"),
        ("udpbcast:192.168.1.255:14550", "broadcasting is not supported"),
        ("serial_flowcontrol:///dev/ttyUSB0:57600", "flow control is not supported"),
        ("https://px4.io", "this is a web address"),
        ("tcp:127.0.0.1", "'127.0.0.1' is not a port number"),
        ("tcp::5760", "a host to connect to is missing"),
        ("tcp:127.0.0.1:0", "port 0 is out of range"),
        ("serial:", "'' is not a serial port"),
        ("serial:dev/ttyACM0", "'dev/ttyACM0' is not a serial port"),
        ("/dev/ttyACM0,", "'' is not a baud rate"),
        ("/dev/ttyACM0,fast", "'fast' is not a baud rate"),
        ("/dev/ttyACM0,0", "a baud rate of 0 is out of range"),
        ("COM3,99999999", "a baud rate of 99999999 is out of range"),
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
    ("url", "first"),
    [
        ("mock", True),
        ("udpout:h:1", True),
        ("udpin:h:1", False),
        ("udp:h:1", False),
        ("tcp:h:1", True),
        ("tcpin:h:1", False),
        ("/dev/ttyACM0", True),
    ],
)
def test_who_speaks_first(url, first):
    assert speaks_first(url) is first


@given(st.text(max_size=30))
def test_any_text_is_an_address_or_an_error_of_ours(text):
    try:
        place = parse_url(text)
        assert isinstance(place, SerialPort) or 0 <= place.port <= 65535
    except EndpointError as error:
        assert error.hint


@given(st.text(alphabet=":/[]-_ 0123456789udpinot.", max_size=20))
def test_nearly_right_text_too(text):
    try:
        assert parse_url("udpin:" + text).listens
    except EndpointError as error:
        assert error.hint


@given(
    st.text(alphabet=":/,- 0123456789devtyACMCOM", max_size=20), st.sampled_from(["serial:", "serial://", "", "COM"])
)
def test_nearly_right_serial_ports_too(text, kind):
    try:
        place = parse_url(kind + text)
        assert not isinstance(place, SerialPort) or (place.device and place.baud > 0)
    except EndpointError as error:
        assert error.hint


@pytest.mark.parametrize("url", ["udpin:127.0.0.1:1", "udpout:[::1]:1", "tcp:h:1", "tcpin:h:1", "/dev/ttyACM0,57600"])
def test_a_place_is_written_as_it_is_read(url):
    assert str(parse_url(url)) == url
