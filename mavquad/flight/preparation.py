"""The vehicle's parameters before a flight and after it: read, kept, changed, verified, put back."""

from __future__ import annotations

from collections.abc import Mapping

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message
from mavquad.protocol.firmware import Firmware
from mavquad.protocol.param_change import ParamChange, restoring
from mavquad.protocol.param_record import ChangedParameters, ParamRecord, autopilot_name
from mavquad.protocol.param_value import Encoding, encoding_of

Target = tuple[int, int]


class Preparation:
    """One change and its way back.

    Nothing is set before `change`: whoever drives the agent keeps `changed` where it survives the agent, and says so.

    Attributes:
        changed: what differs from what is wanted, once all was read; None where nothing does. `restored` when all was put
            back.
        kept: whether it is kept.
    """

    def __init__(self) -> None:
        self._change = ParamChange({}, Encoding.CAST)
        self._autopilot = 0
        self._stopped = False
        self._changing = False
        self._restoring = False
        self.changed: ChangedParameters | None = None
        self.kept = False

    def start(self, wanted: Mapping[str, float], firmware: Firmware, target: Target, now_us: int) -> list[Message]:
        """Read what is to be changed."""
        self._autopilot = firmware.autopilot
        self._change = ParamChange(wanted, encoding_of(firmware.autopilot))
        return self._change.start(target, now_us) + self._noticed(target, now_us)

    def change(self, target: Target, now_us: int) -> list[Message]:
        """What it was is kept: change it."""
        if self.changed is None or self.kept or self._restoring:
            return []
        self.kept = self._changing = True
        return self._change.change(target, now_us)

    def restore(self, target: Target, now_us: int) -> list[Message]:
        """Put back what was changed."""
        self._restoring = True
        self._change = restoring(self.records if self._changing else (), encoding_of(self._autopilot))
        return self._change.start(target, now_us) + self._noticed(target, now_us)

    def stop(self) -> None:
        """Nothing more is asked for."""
        self._stopped = True

    def _noticed(self, target: Target, now_us: int) -> list[Message]:
        """What came of it: known what differs, or nothing does; or all was put back."""
        if self._restoring and self._change.done and not self._change.failed and self.changed is not None:
            self.changed = self.changed.model_copy(update={"restored": True})
        if self._restoring or self.changed is not None or not self._change.read:
            return []
        originals = self._change.originals
        if self._change.failed:
            return []
        if not originals:
            return self._change.change(target, now_us)
        system_id, component_id = target
        self.changed = ChangedParameters(
            system_id=system_id,
            component_id=component_id,
            autopilot=autopilot_name(self._autopilot),
            parameters=tuple(originals),
        )
        return []

    # ------------------------------------------------------------------ what happens

    def next_deadline_us(self) -> int:
        """When to repeat something."""
        return NEVER_US if self._stopped else self._change.next_deadline_us()

    def on_value(self, message: Message, target: Target, now_us: int) -> list[Message]:
        """Take in a PARAM_VALUE."""
        if self._stopped:
            return []
        return self._change.on_value(message, target, now_us) + self._noticed(target, now_us)

    def on_deadline(self, target: Target, now_us: int) -> list[Message]:
        """Repeat what went without an answer."""
        if now_us < self.next_deadline_us():
            return []
        return self._change.on_deadline(target, now_us) + self._noticed(target, now_us)

    @property
    def over(self) -> bool:
        """Whether nothing is waited for any more: all is changed, or put back, or it failed."""
        return self._change.done or (self._change.read and bool(self._change.failed) and not self._changing)

    @property
    def failed(self) -> str:
        """Why a parameter could not be changed, or put back."""
        return self._change.failed

    @property
    def records(self) -> tuple[ParamRecord, ...]:
        """What differs from what is wanted."""
        return self.changed.parameters if self.changed is not None else ()

    @property
    def left_over(self) -> bool:
        """Whether parameters were changed and not put back."""
        return self._changing and self.changed is not None and not self.changed.restored

    @property
    def waiting_for(self) -> str:
        """What is waited for, in words."""
        if not self._change.read:
            return "the present values of the parameters that are to be changed"
        if self.changed is not None and not self.kept:
            return "the record of what the parameters were"
        return ", ".join(record.name for record in self.records)
