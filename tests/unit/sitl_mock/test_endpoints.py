"""The links of a mock vehicle: those of the real simulators as data, and those that are named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.errors import EndpointError
from sitl_mock.endpoints import default_links, links_of, parse_endpoint


def ports(spec):
    return spec.listen.port, spec.speak_to and spec.speak_to.port


@pytest.mark.parametrize(
    ("instance", "onboard", "gcs"),
    [
        (0, (14580, 14540), 18570),
        (3, (14583, 14543), 18573),
        (9, (14589, 14549), 18579),
        (10, (14590, 14549), 18580),
        (200, (14780, 14549), 18770),
    ],
)
def test_ports_of_px4(instance, onboard, gcs):
    links = default_links("px4", instance)
    assert [link.kind for link in links] == ["onboard", "gcs"]
    assert [ports(link) for link in links] == [onboard, (gcs, 14550)]
    assert all(link.transport == "udp" and link.listen.host == link.speak_to.host == "127.0.0.1" for link in links)


@pytest.mark.parametrize(("instance", "first"), [(0, 5760), (2, 5780)])
def test_ports_of_ardupilot(instance, first):
    links = default_links("ardupilot", instance)
    assert [ports(link) for link in links] == [(first, None), (first + 2, None), (first + 3, None)]
    assert [link.waits for link in links] == [True, False, False]
    assert {(link.transport, link.kind) for link in links} == {("tcp", "serial")}


def test_further_vehicles_are_further_instances():
    assert links_of("px4", 2, (), 3) == default_links("px4", 5)
    assert links_of("ardupilot", 2, (), 3) == default_links("ardupilot", 5)


def test_named_links_of_further_vehicles_listen_one_port_higher_and_speak_to_the_same():
    named = [parse_endpoint(url, "px4") for url in ("udpin:h:7000", "udpin:h:0", "tcpin:h:8000", "udpout:h:9000")]
    udp, free, tcp, spoken = links_of("px4", 0, named, 2)
    assert (udp.listen.port, free.listen.port, tcp.listen.port) == (7002, 0, 8002)
    assert (spoken.listen, spoken.speak_to.port) == (None, 9000)


@pytest.mark.parametrize(
    ("url", "autopilot", "wanted"),
    [
        ("udpin:127.0.0.1:0", "px4", ("udp", "onboard", False)),
        ("udpin:127.0.0.1:7000:gcs", "px4", ("udp", "gcs", False)),
        ("udpout:drone.local:7000:onboard", "px4", ("udp", "onboard", False)),
        ("tcpin://127.0.0.1:7000", "px4", ("tcp", "onboard", False)),
        ("tcpin:[::1]:7000:wait", "ardupilot", ("tcp", "serial", True)),
        ("tcpin::7000", "ardupilot", ("tcp", "serial", False)),
    ],
)
def test_what_is_read(url, autopilot, wanted):
    spec = parse_endpoint(url, autopilot)
    assert (spec.transport, spec.kind, spec.waits) == wanted
    assert (spec.listen is None) == url.startswith("udpout")


@pytest.mark.parametrize(
    ("url", "autopilot", "reason"),
    [
        ("", "px4", "not an endpoint"),
        ("tcp:h:1", "px4", "not an endpoint"),
        ("serial:/dev/ttyS0", "px4", "not an endpoint"),
        ("udpin:h", "px4", "'h' is not a port number"),
        ("udpin:h:70000", "px4", "out of range"),
        ("udpout:h:0", "px4", "out of range"),
        ("udpout::9", "px4", "a host to send to is missing"),
        ("udpin:h:7000:wait", "px4", "'wait' says nothing about this link; allowed here: gcs, onboard"),
        ("tcpin:h:7000:gcs", "ardupilot", "allowed here: wait"),
        ("udpin:h:7000:gcs", "ardupilot", "nothing may follow the port here"),
    ],
)
def test_what_is_refused(url, autopilot, reason):
    with pytest.raises(EndpointError) as caught:
        parse_endpoint(url, autopilot)
    assert reason in caught.value.message
    assert caught.value.message.startswith(f"{url}: ")
    assert "tcpin:127.0.0.1:5760:wait" in caught.value.hint


@given(st.sampled_from(["", "udpin:", "udpout:", "tcpin:"]), st.text(alphabet=":/[]-_ 0123456789gcswait", max_size=20))
def test_any_text_is_a_link_or_an_error_of_ours(head, rest):
    try:
        assert parse_endpoint(head + rest, "px4").transport in ("udp", "tcp")
    except EndpointError as error:
        assert error.hint


def test_ports_of_further_vehicles_end_at_65535():
    spec = parse_endpoint("udpin:127.0.0.1:65534", "px4")
    assert spec.of_vehicle(1).listen.port == 65535
    with pytest.raises(EndpointError, match="vehicle 3 would listen at port 65536"):
        spec.of_vehicle(2)
