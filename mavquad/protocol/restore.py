"""Putting back what a run changed on its vehicle and did not put back itself, as an `Endpoint` of its own.

It locks on the vehicle of the record, by its system id, and changes nothing on another autopilot, nor on one that is
armed: a law may be flying it with just these parameters.
"""

from __future__ import annotations

from mavquad.endpoint import NEVER_US, floor_to_grid_us, grid_us
from mavquad.errors import InputError, MavquadError, VehicleError, VehicleTimeout
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.protocol.link import Link, LinkParams, heartbeat
from mavquad.protocol.param_change import ParamChange, restoring
from mavquad.protocol.param_record import ChangedParameters, autopilot_name
from mavquad.protocol.param_value import encoding_of

HEARTBEAT_US = 1_000_000
CONNECT_S = 10.0
"""How long the vehicle's HEARTBEAT is waited for."""


class Restorer:
    """Restores one record on one vehicle. See `mavquad.endpoint.Endpoint` for the calls.

    Args:
        changed: what the run changed.
        link: the connection, and who we are on it.
        start_us: now.
        key: of a signed link.
        armed_too: whether to go on where the vehicle is armed.

    Attributes:
        link: who the vehicle is.
        armed: whether the vehicle was seen armed.
        change: the exchange, once the vehicle is known.
        error: why nothing, or not all, was restored.
    """

    def __init__(
        self,
        changed: ChangedParameters,
        link: LinkParams,
        start_us: int,
        key: bytes | None = None,
        armed_too: bool = False,
    ) -> None:
        start_us = floor_to_grid_us(start_us)
        self._changed = changed
        self._armed_too = armed_too
        self._outbox: list[bytes] = []
        self._heartbeat_us = start_us if link.speaks_first else NEVER_US
        self._connect_us = start_us + grid_us(CONNECT_S)
        self._now_us = start_us
        self._others: dict[tuple[int, int], str] = {}
        self.link = Link(link.model_copy(update={"target_system": changed.system_id}), key)
        self.armed = False
        self.change: ParamChange | None = None
        self.error: MavquadError | None = None

    @property
    def done(self) -> bool:
        """Whether it is over, well or not."""
        return self.error is not None or (self.change is not None and self.change.done)

    # ------------------------------------------------------------------ Endpoint

    def receive(self, data: bytes, now_us: int) -> None:
        """Take in one frame."""
        self._now_us = now_us
        if self.done:
            return
        if self._heartbeat_us == NEVER_US:
            self._send_heartbeat()
        number = message_id(data)
        if not self.link.accept(data, now_us):
            if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self._note_other(frame_source(data), decode(data))
        elif number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._on_heartbeat(decode(data))
        elif number == mavlink.MAVLINK_MSG_ID_PARAM_VALUE and self.change is not None:
            self._go_on(self.change.on_value(decode(data), self._target, now_us))

    def next_deadline_us(self) -> int:
        """The earliest of: our heartbeat, a repeated request, the end of our patience."""
        if self.done:
            return NEVER_US
        return min(self._heartbeat_us, self._connect_us if self.change is None else self.change.next_deadline_us())

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self._now_us = now_us
        if now_us >= self._heartbeat_us:
            self._send_heartbeat()
        if self.change is not None:
            self._go_on(self.change.on_deadline(self._target, now_us))
        elif now_us >= self._connect_us:
            self.error = self._not_found()

    def datagrams_to_send(self) -> list[bytes]:
        """What the last call made ready, one frame a datagram."""
        outbox, self._outbox = self._outbox, []
        return outbox

    # ------------------------------------------------------------------ who is there

    @property
    def _target(self) -> tuple[int, int]:
        return self._changed.system_id, self._changed.component_id

    def _note_other(self, source: tuple[int, int], message: Message) -> None:
        if message.autopilot != mavlink.MAV_AUTOPILOT_INVALID and source != self._target:
            self._others[source] = autopilot_name(message.autopilot)

    def _on_heartbeat(self, message: Message) -> None:
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        if self.armed and not self._armed_too:
            self.error = VehicleError(
                "the vehicle is armed: its parameters are not changed in flight",
                "land and disarm it first; or --force, if it flies well without those values",
            )
        elif self.change is None:
            self._start(autopilot_name(message.autopilot), message.autopilot)

    def _start(self, name: str, autopilot: int) -> None:
        if (name, self.link.vehicle) != (self._changed.autopilot, self._target):
            self.error = _another({self.link.vehicle or self._target: name}, self._changed)
            return
        self.change = restoring(self._changed.parameters, encoding_of(autopilot))
        self._go_on(self.change.start(self._target, self._now_us))

    def _not_found(self) -> MavquadError:
        if self._others:
            return _another(self._others, self._changed)
        if self.link.rejected:
            words = f"{self.link.rejected.total()} frames came that are not rightly signed"
            return VehicleError(f"no frame of the vehicle could be trusted: {words}", "is the key the vehicle's?")
        hint = "is it powered, is the connection right, and does no other program have it? --connect gives another one"
        return VehicleTimeout(f"HEARTBEAT of system {self._changed.system_id}", 1, CONNECT_S, hint=hint)

    # ------------------------------------------------------------------ sending

    def _go_on(self, messages: list[Message]) -> None:
        for message in messages:
            self._send(message)
        if self.change is not None and self.change.done and self.change.failed:
            self.error = VehicleError(
                f"not restored: {self.change.failed}",
                "try again, or set them with a ground station",
            )

    def _send(self, message: Message) -> None:
        self._outbox.append(self.link.encode(message, self._now_us))

    def _send_heartbeat(self) -> None:
        self._heartbeat_us = self._now_us + HEARTBEAT_US
        self._send(heartbeat())


def _another(heard: dict[tuple[int, int], str], changed: ChangedParameters) -> InputError:
    there = ", ".join(f"{name} {system}/{component}" for (system, component), name in sorted(heard.items()))
    flown = f"{changed.autopilot} {changed.system_id}/{changed.component_id}"
    return InputError(
        f"the run was flown on {flown}, and what is heard there is {there}",
        "connect to the vehicle of the run, with --connect if need be",
    )
