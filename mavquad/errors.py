"""Every error that mavquad shows to a user: whose fault it is, and what to do.

    MavquadError                      exit code
    ├── InputError                    2   the user's file, option or config
    │   ├── ConfigError                   a key of a configuration
    │   ├── EndpointError                 a connection string, or a port that cannot be opened
    │   ├── LogError                      a tlog that cannot be read
    │   └── RunFolderError                a run folder that exists or cannot be written
    ├── VehicleError                  3   the vehicle refused, or did not answer
    │   ├── VehicleRefused
    │   └── VehicleTimeout
    ├── FlightEnded                   4   a guard, the pilot or a lost vehicle ended the flight
    ├── Abandoned                     4   the operator left without waiting for the landing
    ├── ReplayDiffers                 5   a replayed frame is not the recorded one
    └── InternalError                 70  a broken promise of our own code

The command line turns an error into one message and its exit code; no traceback reaches a user.
"""

from __future__ import annotations

EXIT_OK = 0
EXIT_INTERNAL = 70
EXIT_INTERRUPTED = 130


class MavquadError(Exception):
    """Root of the tree. `hint` says what to do about it; it may be empty."""

    exit_code = EXIT_INTERNAL

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def followed_by(self, later: MavquadError) -> None:
        """Something else happened after this: say both, and what to do about the later one. The class and code stay."""
        if later.message not in self.message:  # a refusal that is repeated each second is one
            self.message = f"{self.message}; then {later.message}"
        self.hint = later.hint
        self.args = (self.message,)


class InputError(MavquadError):
    """The user's file, option or configuration is wrong."""

    exit_code = 2


class ConfigError(InputError):
    """One key of a configuration is unknown, of the wrong type or out of range."""

    def __init__(self, path: str, key: str, reason: str, hint: str = "") -> None:
        super().__init__(f"{path}: {key}: {reason}" if key else f"{path}: {reason}", hint)
        self.path = path
        self.key = key
        self.reason = reason


class EndpointError(InputError):
    """A connection string cannot be understood, or its port cannot be opened."""

    def __init__(self, url: str, reason: str, hint: str = "") -> None:
        super().__init__(f"{url}: {reason}", hint)
        self.url = url
        self.reason = reason


class LogError(InputError):
    """A telemetry log cannot be read."""

    def __init__(self, path: str, reason: str, hint: str = "") -> None:
        super().__init__(f"{path}: {reason}", hint)
        self.path = path
        self.reason = reason


class RunFolderError(InputError):
    """A run folder exists already, is incomplete, or cannot be written."""

    def __init__(self, path: str, reason: str, hint: str = "") -> None:
        super().__init__(f"{path}: {reason}", hint)
        self.path = path
        self.reason = reason


class VehicleError(MavquadError):
    """The vehicle refused what was asked, or did not answer."""

    exit_code = 3


class VehicleRefused(VehicleError):
    """The vehicle answered no. Carries the request, the MAV_RESULT name and the last STATUSTEXT."""

    def __init__(self, request: str, result: str, statustext: str = "", hint: str = "") -> None:
        said = f'; the vehicle says: "{statustext}"' if statustext else ""
        super().__init__(f"the vehicle refused: {request} ({result}){said}", hint)
        self.request = request
        self.result = result
        self.statustext = statustext


class VehicleTimeout(VehicleError):
    """The vehicle did not answer."""

    def __init__(self, request: str, tries: int, waited_s: float, statustext: str = "", hint: str = "") -> None:
        said = f'; the vehicle says: "{statustext}"' if statustext else ""
        attempts = f", {tries} tries" if tries > 1 else ""
        super().__init__(f"no answer: {request} (waited {waited_s:.1f} s{attempts}){said}", hint)
        self.request = request
        self.tries = tries
        self.waited_s = waited_s
        self.statustext = statustext


class FlightEnded(MavquadError):
    """A guard, the pilot or the loss of the vehicle ended the flight before the mission was complete."""

    exit_code = 4


class ReplayDiffers(MavquadError):
    """A replayed outbound frame is not the recorded one."""

    exit_code = 5


class Abandoned(MavquadError):
    """The operator left without waiting for the landing; 130 would say that it landed."""

    exit_code = 4


class InternalError(MavquadError):
    """Our own code broke one of its promises."""
