"""Who is let in on a port: what the vehicle asks of signatures there, and how it signs its answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from mavquad.protocol.codec import Message, is_signed, mavlink, message_id
from mavquad.protocol.signing import Fault, Signing, Streams
from sitl_mock.config.signing import SigningConfig, SigningMode

_RADIOS = frozenset((mavlink.MAVLINK_MSG_ID_RADIO_STATUS, mavlink.MAVLINK_MSG_ID_RADIO))
"""What telemetry radios put into the stream by themselves; they have no key."""


class Signatures:
    """The signatures of one port.

    Attributes:
        signs: whether answers are signed.
        rejected: frames not taken, by what was wrong with their signature.
    """

    def __init__(self, mode: SigningMode, signing: Signing) -> None:
        self._is_required = mode == "require"
        self._signing = signing
        self.signs = self._is_required
        self.rejected: Counter[Fault] = Counter()

    def lets_in(self, frame: bytes, now_us: int) -> bool:
        """Whether a frame is taken; one that is not is counted."""
        fault = self._signing.check(frame, now_us)
        if fault is None:
            self.signs = True
        elif message_id(frame) not in _RADIOS and (self._is_required or is_signed(frame)):
            self.rejected[fault] += 1
            return False
        return True

    def sign(self, frame: bytes, now_us: int) -> bytes:
        """The frame with its signature."""
        return self._signing.sign(frame, now_us)


def signatures_of(config: SigningConfig, ports: int) -> list[Signatures | None]:
    """The signatures of each port; None where signatures are not looked at."""
    if config.mode == "off":
        return [None] * ports
    return _keyed([config.mode] * ports, config.key(), config.link_id)


def signatures_set_up(config: SigningConfig, ports: int, message: Message) -> list[Signatures | None]:
    """Those after a SETUP_SIGNING, as ArduPilot has them (GCS_Signing.cpp): all zero switches signing off. Its first
    port goes on taking unsigned frames, for it is thought to be a cable; a mode that was configured stays as it was."""
    key, timestamp = bytes(message.secret_key), message.initial_timestamp
    if not any(key) and timestamp == 0:
        return [None] * ports
    modes: list[SigningMode] = [config.mode if config.mode != "off" else "require"] * ports
    if config.mode == "off":
        modes[0] = "accept"
    return _keyed(modes, key, config.link_id, timestamp)


def _keyed(modes: Sequence[SigningMode], key: bytes, link_id: int, timestamp: int = 0) -> list[Signatures | None]:
    streams: Streams = {}
    return [Signatures(mode, Signing(key, (link_id + n) % 256, streams, timestamp)) for n, mode in enumerate(modes)]
