"""A pymavlink connection in virtual time.

Everything that `mavutil.mavfile` offers works; where it would look at the clock or wait for the socket, it looks at
virtual time and lets it pass. A message's `_timestamp` is the virtual Unix time at which it came.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from pymavlink import mavutil

if TYPE_CHECKING:
    from sitl_mock.api.virtual import Outlet

_PATIENCE_S = 120.0
"""How much virtual time a client may wait that has set no timeout."""
_POLL_US = 4000
"""What a poll that finds nothing costs, so that a loop of polls comes to an end."""
_FETCH_AGAIN_S = 2.0
_SIGNING_EPOCH_S = 1_420_070_400
_SIGNING_TICKS_PER_S = 100_000


class VirtualConnection(mavutil.mavfile):  # type: ignore[misc]
    """What `mavutil.mavlink_connection(...)` returns, to a vehicle in virtual time."""

    def __init__(self, outlet: Outlet, source_system: int = 255, source_component: int = 0) -> None:
        self._outlet = outlet
        self._vehicle = outlet.vehicle
        self._came_s = self._now_s()
        self._tlog: Any = None
        super().__init__(None, "virtual", source_system, source_component, input=False)
        self.start_time = self._now_s()
        self.param_fetch_start: float = 0.0
        self.logfile: Any = None

    def _now_s(self) -> float:
        return self._vehicle.now_us * 1e-6

    @property
    def _timestamp(self) -> float:
        """When the message at hand came; mavfile stamps messages with it instead of the clock."""
        return self._came_s

    @_timestamp.setter
    def _timestamp(self, value: float | None) -> None:
        """Only mavfile's constructor sets it."""

    # --- the transport -------------------------------------------------------------------------------------------

    def recv(self, n: int | None = None) -> bytes:
        """The next frame that came; empty if there is none."""
        if not self._outlet.inbox:
            return b""
        stamp_us, frame = self._outlet.inbox.popleft()
        self._came_s = stamp_us * 1e-6
        return frame

    def write(self, buf: bytes) -> None:
        """Send bytes."""
        self._outlet.write(bytes(buf))

    def select(self, timeout: float) -> bool:
        """Let virtual time pass until something comes, at most so long; says whether it did."""
        return self._wait(self._vehicle.now_us + round(timeout * 1e6))

    def close(self) -> None:
        """Nothing more comes."""
        self._vehicle.disconnect(self._outlet)

    def _wait(self, until_us: int) -> bool:
        inbox = self._outlet.inbox
        return self._vehicle.wait(lambda: bool(inbox), until_us)

    # --- what looks at the clock ---------------------------------------------------------------------------------

    def recv_match(
        self, condition: str | None = None, type: Any = None, blocking: bool = False, timeout: float | None = None
    ) -> Any:
        """The next message that matches; None when there is none, or none within `timeout` of virtual time.

        Raises:
            TimeoutError: without a timeout, none came for 120 s of virtual time.
        """
        wanted = {type} if isinstance(type, str) else type
        start_us = self._vehicle.now_us
        until_us = start_us + round((_PATIENCE_S if timeout is None else timeout) * 1e6)
        while True:
            message = self.recv_msg()
            if message is None:
                if not blocking:
                    self._wait(self._vehicle.now_us + _POLL_US)
                    return None
                for hook in self.idle_hooks:
                    hook(self)
                if self._wait(until_us):
                    continue
                if timeout is not None:
                    return None
                raise TimeoutError(
                    f"waited {_PATIENCE_S:g} s of virtual time for {type or 'a message'}:\n{self._vehicle.report()}"
                )
            if (wanted is None or message.get_type() in wanted) and self._meets(condition, message):
                return message
            if self._vehicle.now_us > until_us and not self._outlet.inbox:
                return None

    def _meets(self, condition: str | None, message: Any) -> bool:
        system = self.sysid_state.get(message.get_srcSystem()) if hasattr(message, "get_srcSystem") else None
        messages = self.messages if system is None else system.messages
        return bool(mavutil.evaluate_condition(condition, messages))

    def recv_msg(self) -> Any:
        """The next message that came, or None."""
        message = super().recv_msg()
        if message is not None and self._tlog is not None and message.get_type() != "BAD_DATA":
            self._tlog.write(struct.pack(">Q", round(self._came_s * 1e6) & -4) + message.get_msgbuf())
        return message

    def setup_logfile(self, logfile: str, mode: str = "wb") -> None:
        """Write what comes to a tlog, with virtual time."""
        super().setup_logfile(logfile, mode)
        self._tlog, self.logfile = self.logfile, None

    def param_fetch_all(self) -> None:
        """Ask for all parameters, at most every 2 s of virtual time."""
        if self._now_s() - self.param_fetch_start >= _FETCH_AGAIN_S:
            self.param_fetch_start = self._now_s()
            self.mav.param_request_list_send(self.target_system, self.target_component)

    def time_since(self, mtype: str) -> float:
        """Virtual time since a message of that type came, or since the connection was made."""
        came_s = self.messages[mtype]._timestamp if mtype in self.messages else self.start_time
        return float(self._now_s() - came_s)

    def setup_signing(
        self,
        secret_key: bytes,
        sign_outgoing: bool = True,
        allow_unsigned_callback: Any = None,
        initial_timestamp: int | None = None,
        link_id: int | None = None,
    ) -> None:
        """Sign from now on; timestamps start from virtual time."""
        if initial_timestamp is None:
            initial_timestamp = round((self._now_s() - _SIGNING_EPOCH_S) * _SIGNING_TICKS_PER_S)
        super().setup_signing(secret_key, sign_outgoing, allow_unsigned_callback, initial_timestamp, link_id)


def live_connection(url: str, source_system: int, source_component: int) -> Any:
    """A pymavlink connection over a socket."""
    return mavutil.mavlink_connection(url, source_system=source_system, source_component=source_component)
