"""The story of a flight: what happened, line by line, and why it did not complete."""

from __future__ import annotations

from mavquad.errors import MavquadError
from mavquad.flight_record import Note


class Story:
    """Grows with the flight.

    Attributes:
        error: why the flight did not complete; None while it may still.
    """

    def __init__(self) -> None:
        self._notes: list[Note] = []
        self.error: MavquadError | None = None

    def note(self, stamp_us: int, kind: str, text: str) -> None:
        """One line more."""
        self._notes.append(Note(stamp_us, kind, text))

    def blame(self, stamp_us: int, error: MavquadError) -> None:
        """The first error is why the flight did not complete; what goes wrong after it is told too."""
        self.note(stamp_us, "error", error.message)
        if self.error is None:
            self.error = error
        else:
            self.error.followed_by(error)

    def take_notes(self) -> list[Note]:
        """The lines since the last call."""
        notes, self._notes = self._notes, []
        return notes
