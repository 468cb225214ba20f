"""The script of what goes wrong: which of the configured faults act now, and which happen now.

Times are stamps of the mock's clock; each fault counts its own from a moment that the script watches for: the start, the
first arming, the takeoff, the first entry into a mode.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from sitl_mock.config.fault_base import Moment, Window
from sitl_mock.config.faults import AckWithoutActing, CommandFault, Fault, LateAnswer, Refuse
from sitl_mock.config.link_faults import LinkFault

_US_PER_S = 1_000_000
_GUIDED = ("GUIDED", "GUIDED_NOGPS")

W = TypeVar("W", bound=Window)
C = TypeVar("C", bound=CommandFault)


@dataclass(slots=True)
class Entry:
    """A fault of the script.

    Attributes:
        number: its place in the script, from 0; its random stream is told by it.
        origin_us: what its times count from; None before that moment.
        times_left: how often it may still answer a command.
    """

    number: int
    fault: Fault
    origin_us: int | None
    times_left: int = 0

    def acts(self, now_us: int) -> bool:
        """Whether a window is open."""
        fault = self.fault
        assert isinstance(fault, Window)
        if self.origin_us is None:
            return False
        since_s = (now_us - self.origin_us) / _US_PER_S
        return fault.from_s <= since_s < fault.from_s + fault.for_s

    def has_come(self, now_us: int) -> bool:
        """Whether a moment is reached."""
        fault = self.fault
        assert isinstance(fault, Moment)
        return self.origin_us is not None and (now_us - self.origin_us) / _US_PER_S >= fault.at_s


class Script:
    """The faults of one vehicle.

    Attributes:
        now_us: the vehicle's time, to be kept up to date while there are faults.
        has_faults: whether there is anything in it at all.
        link_faults: those of the link; the list stays the same object.
    """

    def __init__(self, faults: Iterable[Fault], start_us: int) -> None:
        self.now_us = start_us
        self.has_faults = False
        self.link_faults: list[Entry] = []
        self._start_us = start_us
        self._windows: list[Entry] = []
        self._moments: list[Entry] = []
        self._waiting: list[Entry] = []
        self._count = 0
        for fault in faults:
            self.add(fault)

    def add(self, fault: Fault, origin_us: int | None = None) -> None:
        """One more fault; its times count from `origin_us`, if given, instead of from its own moment."""
        if origin_us is None and fault.since == "boot":
            origin_us = self._start_us
        entry = Entry(self._count, fault, origin_us, getattr(fault, "times", 0))
        entries = self._moments if isinstance(fault, Moment) else self._windows
        (self.link_faults if isinstance(fault, LinkFault) else entries).append(entry)
        if origin_us is None:
            self._waiting.append(entry)
        self._count += 1
        self.has_faults = True

    def observe(self, mode: str, armed: bool, landed: bool) -> None:
        """Take notice of the moments that faults wait for: the first of its kind since the fault is there."""
        if not self._waiting:
            return
        offboard = mode in _GUIDED or (armed and mode == "OFFBOARD")
        now = {mode: True, "offboard": offboard, "armed": armed, "takeoff": armed and not landed}
        for entry in self._waiting:
            if now.get(entry.fault.since):
                entry.origin_us = self.now_us
        self._waiting = [entry for entry in self._waiting if entry.origin_us is None]

    def acting(self, kind: type[W]) -> Iterator[W]:
        """The faults of a kind whose window is open."""
        for entry in self._windows:
            if isinstance(entry.fault, kind) and entry.acts(self.now_us):
                yield entry.fault

    def happening(self) -> list[Fault]:
        """The faults that happen now; each is handed out once."""
        if not self._moments:
            return []
        due = [entry for entry in self._moments if entry.has_come(self.now_us)]
        if due:
            self._moments = [entry for entry in self._moments if entry not in due]
        return [entry.fault for entry in due]

    def answer(self, command: int) -> Refuse | AckWithoutActing | None:
        """The fault that answers this command instead of the autopilot; uses up one of its times."""
        return self._use_up(Refuse, command) or self._use_up(AckWithoutActing, command)

    def late_us(self, command: int) -> int:
        """How late the answer to this command is; uses up one of the fault's times."""
        fault = self._use_up(LateAnswer, command)
        return round(fault.late_s * _US_PER_S) if fault is not None else 0

    def _use_up(self, kind: type[C], command: int) -> C | None:
        for entry in self._windows:
            fault = entry.fault
            if isinstance(fault, kind) and fault.command == command and entry.times_left and entry.acts(self.now_us):
                entry.times_left -= 1
                return fault
        return None
