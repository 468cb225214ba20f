"""How many frames of a sender were lost, from the gaps in its sequence numbers."""

from __future__ import annotations


class SequenceCount:
    """Counts what is missing between the first and the last frame of one sender.

    Attributes:
        lost: frames missing so far; one that comes late is taken off again.
    """

    __slots__ = ("_next", "lost")

    def __init__(self) -> None:
        self.lost = 0
        self._next = -1

    def take(self, sequence: int) -> None:
        """Take in the sequence number (0 to 255) of a frame."""
        if sequence == self._next or self._next < 0:
            self._next = (sequence + 1) % 256
            return
        # A gap of more than half the circle is a frame that came late, not 128 lost ones.
        gap = (sequence - self._next) % 256
        if gap < 128:
            self.lost += gap
            self._next = (sequence + 1) % 256
        elif self.lost > 0 and gap != 255:
            self.lost -= 1
