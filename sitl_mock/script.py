"""Scripted faults of the autopilot itself: which of the configured faults act now. (The link's faults: `faults`.)"""

from __future__ import annotations

from sitl_mock.config.faults import (
    AckWithoutActing,
    Die,
    Fault,
    ModeChange,
    ModeName,
    NanPose,
    Refuse,
    Silent,
    StreamStops,
    Timed,
)

_US_PER_S = 1_000_000


class Script:
    """Answers 'is this fault acting?'; times count from boot or from the first entry into OFFBOARD."""

    def __init__(self, faults: tuple[Fault, ...]) -> None:
        self._windows = [fault for fault in faults if isinstance(fault, Silent | StreamStops | NanPose)]
        self._deaths = [fault for fault in faults if isinstance(fault, Die)]
        self._mode_changes = [fault for fault in faults if isinstance(fault, ModeChange)]
        self._answers: list[tuple[Refuse | AckWithoutActing, list[int]]] = [
            (fault, [fault.times]) for fault in faults if isinstance(fault, Refuse | AckWithoutActing)
        ]
        self._offboard_us: int | None = None

    def offboard_entered(self, boot_us: int) -> None:
        """Start the clock of the faults that count from OFFBOARD; later entries change nothing."""
        if self._offboard_us is None:
            self._offboard_us = boot_us

    def is_dead(self, boot_us: int) -> bool:
        """Whether the autopilot has stopped for ever."""
        return any(self._has_passed(fault, fault.at_s, boot_us) for fault in self._deaths)

    def is_silent(self, boot_us: int) -> bool:
        """Whether nothing is sent now."""
        return bool(self._windows) and any(isinstance(fault, Silent) for fault in self._acting(boot_us))

    def has_nan_pose(self, boot_us: int) -> bool:
        """Whether LOCAL_POSITION_NED carries NaN now."""
        return bool(self._windows) and any(isinstance(fault, NanPose) for fault in self._acting(boot_us))

    def is_stopped(self, message: str, boot_us: int) -> bool:
        """Whether this message is held back now."""
        return bool(self._windows) and any(
            isinstance(fault, StreamStops) and fault.message == message for fault in self._acting(boot_us)
        )

    def mode_change(self, boot_us: int) -> ModeName | None:
        """The mode that the pilot selects now; each is handed out once."""
        for fault in self._mode_changes:
            if self._has_passed(fault, fault.at_s, boot_us):
                self._mode_changes.remove(fault)
                return fault.mode
        return None

    def answer(self, command: int) -> Refuse | AckWithoutActing | None:
        """The fault that answers this command instead of the autopilot; uses up one of its times."""
        for fault, left in self._answers:
            if fault.command == command and left[0] > 0:
                left[0] -= 1
                return fault
        return None

    def _acting(self, boot_us: int) -> list[Silent | StreamStops | NanPose]:
        return [
            fault
            for fault in self._windows
            if self._has_passed(fault, fault.from_s, boot_us)
            and not self._has_passed(fault, fault.from_s + fault.for_s, boot_us)
        ]

    def _has_passed(self, fault: Timed, after_s: float, boot_us: int) -> bool:
        origin_us = 0 if fault.since == "boot" else self._offboard_us
        return origin_us is not None and boot_us - origin_us >= after_s * _US_PER_S
