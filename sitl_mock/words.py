"""What `sitl-mock` says about its vehicles: to people, line by line, and to programs, as JSON."""

from __future__ import annotations

from typing import Any

from mavquad.url import Address
from sitl_mock.clock import SimClock
from sitl_mock.config import MockConfig
from sitl_mock.server import Server
from sitl_mock.transports import Counts, Transport

_ANYWHERE = ("0.0.0.0", "::")
_KINDS = {"onboard": "companion", "gcs": "ground station", "serial": "serial port"}


def client_url(link: Transport) -> str:
    """How a client reaches a link, in the words of pymavlink: it connects, sends first, or listens."""
    spec, local = link.spec, link.address
    if spec.transport == "tcp":
        return f"tcp:{_host(local)}:{local.port}"
    if spec.speak_to is not None:
        return f"udpin:{_host(spec.speak_to)}:{spec.speak_to.port}"
    return f"udpout:{_host(local)}:{local.port}"


def _host(address: Address) -> str:
    """A host that a client on this machine can use."""
    if address.host in _ANYWHERE:
        return "127.0.0.1"
    return f"[{address.host}]" if ":" in address.host else address.host


def announcement(server: Server) -> dict[str, Any]:
    """For a program: {"url": of the first link, "vehicles": [{"system_id": 1, "urls": [...]}, ...]}."""
    vehicles = [
        {"system_id": vehicle.spec.config.system_id, "urls": [client_url(link) for link in vehicle.links]}
        for vehicle in server.vehicles
    ]
    return {"url": client_url(server.vehicles[0].links[0]), "vehicles": vehicles}


def opening_lines(server: Server, speed: float) -> list[str]:
    """A line for each vehicle, and one for each of its links."""
    lines = []
    for vehicle in server.vehicles:
        lines.append(f"{_firmware(vehicle.spec.config)}, system {vehicle.spec.config.system_id}")
        lines += [f"  {_link(link)}" for link in vehicle.links]
    pace = "" if speed == 1.0 else f"{speed:g} times real time; "
    return [*lines, f"{pace}Ctrl-C ends it"]


def _firmware(config: MockConfig) -> str:
    if config.autopilot == "ardupilot":
        return f"mock ArduCopter {config.ardupilot_release}"
    return f"mock PX4 {config.px4_release}"


def _link(link: Transport) -> str:
    spec, local = link.spec, link.address
    place = f"{spec.transport} {local.host}:{local.port}"
    if spec.waits:
        words = "boots when a client comes"
    elif spec.speak_to is not None:
        words = f"speaks to {spec.speak_to.host}:{spec.speak_to.port}"
    else:
        words = "listens"
    return f"{place:<20}  {words:<25}  {_KINDS[spec.kind]:<14}  {client_url(link)}"


def summary_lines(server: Server, clock: SimClock) -> list[str]:
    """What came of it, for each vehicle and in time."""
    lines = []
    for vehicle in server.vehicles:
        flights = f"{vehicle.flights} flight{'' if vehicle.flights == 1 else 's'}"
        rejected = 0 if vehicle.autopilot is None else vehicle.autopilot.rejected.total()
        lines.append(f"system {vehicle.spec.config.system_id}: {flights}; {_counts(vehicle.counts(), rejected)}")
    simulated_s = (clock.now_us() - clock.start_us) * 1e-6
    slipped_s = clock.slipped_us * 1e-6
    slip = f"; the machine was too slow by {slipped_s:.1f} s" if slipped_s >= 0.05 else ""
    late = (
        f"late by {server.lateness.percentile_ms(0.5):.1f} ms (median), {server.lateness.percentile_ms(0.99):.1f} (p99)"
    )
    return [*lines, f"{simulated_s:.1f} s simulated, {late}{slip}"]


def _counts(counts: Counts, rejected: int) -> str:
    """Frames that passed; what went wrong with some is told only if it did."""
    odd = {
        "of unknown messages": counts.unknown,
        "from others than the one served": counts.unanswered,
        "refused for their signature": rejected,
        "dropped": counts.dropped,
    }
    told = [f"{number} {name}" for name, number in odd.items() if number]
    bad = [f"{counts.bad} bad chunks"] if counts.bad else []
    return ", ".join([f"{counts.received} frames in", f"{counts.sent} out", *told, *bad])
