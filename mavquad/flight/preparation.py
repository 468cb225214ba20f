"""The vehicle's parameters before a flight and after it: read, kept, changed, verified, put back."""

from __future__ import annotations

from collections.abc import Mapping

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message
from mavquad.protocol.firmware import Firmware
from mavquad.protocol.param_change import ParamChange, ParamRecord, restoring
from mavquad.protocol.param_value import Encoding, encoding_of

Target = tuple[int, int]


class Preparation:
    """One change and its way back.

    Nothing is set before `change`: whoever drives the agent keeps `changes` where they survive it, and says so.

    Attributes:
        changes: what differs from what is wanted, known once all was read.
        kept: whether they are kept.
        restored: whether they were put back, all of them.
    """

    def __init__(self) -> None:
        self._change = ParamChange({}, Encoding.CAST)
        self._encoding = Encoding.CAST
        self._stopped = False
        self._changing = False
        self._restoring = False
        self.changes: list[ParamRecord] = []
        self.kept = False

    def start(self, wanted: Mapping[str, float], firmware: Firmware, target: Target, now_us: int) -> list[Message]:
        """Read what is to be changed."""
        self._encoding = encoding_of(firmware.autopilot)
        self._change = ParamChange(wanted, self._encoding)
        return self._change.start(target, now_us) + self._after_reading(target, now_us)

    def change(self, target: Target, now_us: int) -> list[Message]:
        """What it was is kept: change it."""
        if self.kept or self._restoring or not self._change.read:
            return []
        self.kept = self._changing = True
        return self._change.change(target, now_us)

    def restore(self, target: Target, now_us: int) -> list[Message]:
        """Put back what was changed."""
        self._restoring = True
        self._change = restoring(self.changes if self._changing else [], self._encoding)
        return self._change.start(target, now_us)

    def stop(self) -> None:
        """Nothing more is asked for."""
        self._stopped = True

    def _after_reading(self, target: Target, now_us: int) -> list[Message]:
        """Where nothing differs, or it failed, nothing need be kept."""
        if self._restoring or self.kept or not self._change.read:
            return []
        self.changes = [] if self._change.failed else self._change.originals
        return [] if self.changes or self._change.failed else self._change.change(target, now_us)

    # ------------------------------------------------------------------ what happens

    def next_deadline_us(self) -> int:
        """When to repeat something."""
        return NEVER_US if self._stopped else self._change.next_deadline_us()

    def on_value(self, message: Message, target: Target, now_us: int) -> list[Message]:
        """Take in a PARAM_VALUE."""
        if self._stopped:
            return []
        return self._change.on_value(message, target, now_us) + self._after_reading(target, now_us)

    def on_deadline(self, target: Target, now_us: int) -> list[Message]:
        """Repeat what went without an answer."""
        if now_us < self.next_deadline_us():
            return []
        return self._change.on_deadline(target, now_us) + self._after_reading(target, now_us)

    @property
    def over(self) -> bool:
        """Whether nothing is waited for any more: all is changed, or put back, or it failed."""
        return self._change.done or (self._change.read and bool(self._change.failed) and not self._changing)

    @property
    def failed(self) -> str:
        """Why a parameter could not be changed, or put back."""
        return self._change.failed

    @property
    def restored(self) -> bool:
        """Whether all that was changed is as it was."""
        return self._restoring and self._change.done and not self._change.failed

    @property
    def left_over(self) -> bool:
        """Whether parameters were changed and not put back."""
        return self._changing and not self.restored

    @property
    def waiting_for(self) -> str:
        """What is waited for, in words."""
        if not self._change.read:
            return "the present values of the parameters that are to be changed"
        if self.changes and not self.kept:
            return "the record of what the parameters were"
        return ", ".join(record.name for record in self.changes)
