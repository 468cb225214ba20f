"""Every place of a buffer where a MAVLink frame with the right CRC stands, found for all places at once.

The CRC (X.25: 16 bits, reflected polynomial 0x8408, started with 0xFFFF) takes two bytes at a time. One step from state
s with the little-endian word w is F(s ^ w), where F runs 16 zero bits through the register: as both are 16 bits wide,
one table of 65536 entries is the whole of F. The frames go through it side by side, word by word, the longest first, so
that those which are not over yet are always the first ones of the array.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavquad.protocol.codec import MAGIC_V1, MAGIC_V2, mavlink

LONGEST_FRAME = 280
"""MAVLink 2: header 10, payload 255, CRC 2, signature 13."""

_POLYNOMIAL = 0x8408
_START = 0xFFFF
_SIDE_BY_SIDE = 8192  # frames that go through the CRC together: their bytes fit into the processor's cache
_UNKNOWN = -1
_SIGNATURE_LENGTH = 13
_HEADER = np.dtype(
    {
        "names": ["magic", "length", "flags", "v1_id", "v2_id", "v2_id_high"],
        "formats": ["u1", "u1", "u1", "u1", "<u2", "u1"],
        "offsets": [0, 1, 2, 5, 7, 9],
        "itemsize": 10,
    }
)
"""What of a frame's header tells its extent; the versions differ in where the message id stands."""


class Candidates(NamedTuple):
    """Frames with a right CRC, by where they begin; they may overlap. Offsets count from the start of the buffer."""

    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    numbers: NDArray[np.int32]
    """Message ids."""

    def only(self, wanted: Any) -> Candidates:
        """Those of these indices, or where this mask is true."""
        return Candidates(self.starts[wanted], self.ends[wanted], self.numbers[wanted])


def rows(buffer: NDArray[np.uint8], kind: np.dtype[Any], starts: NDArray[np.int64]) -> NDArray[Any]:
    """What stands at each of these places, read as this kind; it may lie at any byte and reach into its neighbour."""
    raw = np.dtype((np.void, kind.itemsize))  # copied in one piece each, not field by field
    return np.ndarray((len(buffer) - kind.itemsize + 1,), raw, buffer.data, strides=(1,))[starts].view(kind)


def find_frames(buffer: NDArray[np.uint8], size: int) -> Candidates:
    """All frames with a right CRC that lie in the first `size` bytes; behind these, LONGEST_FRAME more must exist."""
    starts = np.flatnonzero(buffer[:size] - np.uint8(MAGIC_V2) < 2)  # FD or FE: smaller ones wrap around
    header = rows(buffer, _HEADER, starts)
    is_v2 = header["magic"] == MAGIC_V2
    signed = is_v2 & (header["flags"] == 1)
    crc_at = starts + header["length"] + np.where(is_v2, 10, 6)
    ends = crc_at + 2 + _SIGNATURE_LENGTH * signed
    high = np.where(is_v2, header["v2_id_high"], 0).astype(np.int32)
    numbers = np.where(is_v2, header["v2_id"], header["v1_id"]) + (high << 16)
    extras = _EXTRA.take(numbers, mode="clip")
    possible = (ends <= size) & (extras != _UNKNOWN) & (~is_v2 | (header["flags"] <= 1))
    at = np.flatnonzero(possible)
    right = at[_have_right_crc(buffer, starts[at], crc_at[at], extras[at])]
    return Candidates(starts, ends, numbers).only(right)


def _have_right_crc(
    buffer: NDArray[np.uint8], starts: NDArray[np.int64], crc_at: NDArray[np.int64], extras: NDArray[np.int16]
) -> NDArray[np.bool_]:
    """Whether the CRC of the bytes between the marker at `starts` and `crc_at`, and of the extra byte, stands there."""
    lengths = crc_at - starts - 1
    order = np.argsort(-lengths.astype(np.int16), kind="stable")
    starts_by_length, by_length = starts[order] + 1, lengths[order]
    state = np.empty(len(starts), np.uint16)
    at = 0
    while at < len(order):
        half_as_long = np.searchsorted(-by_length, -by_length[at] // 2, side="right")
        end = min(at + _SIDE_BY_SIDE, int(half_as_long))
        state[order[at:end]] = _crc(buffer, starts_by_length[at:end], by_length[at:end])
        at = end
    state = _step_byte(state ^ extras.astype(np.uint16))
    right: NDArray[np.bool_] = state == rows(buffer, np.dtype("<u2"), crc_at)
    return right


def _crc(buffer: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64]) -> NDArray[np.uint16]:
    """CRC of so many bytes from each start on; the longest first."""
    odd = lengths & 1
    after_first = _step_byte(buffer[starts] ^ np.uint16(_START))
    state = np.where(odd, after_first, _START).astype(np.uint16)
    counts = lengths >> 1
    most = int(counts[0])
    words = rows(buffer, np.dtype(("<u2", (most,))), starts + odd)
    going_on = len(counts) - np.searchsorted(counts[::-1], np.arange(most), side="right")
    for column, count in zip(np.ascontiguousarray(words.T), going_on.tolist(), strict=True):
        state[:count] = _STEP_WORD.take(state[:count] ^ column[:count])
    return state


def _step_byte(state: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """The register after eight zero bits."""
    return ((state >> 8) ^ _STEP_BYTE.take(state & 0xFF)).astype(np.uint16, copy=False)


def _byte_table() -> NDArray[np.uint16]:
    state = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        state = np.where(state & 1, (state >> 1) ^ _POLYNOMIAL, state >> 1).astype(np.uint16)
    return state


def _extra_table() -> NDArray[np.int16]:
    """CRC_EXTRA by message id; _UNKNOWN where there is no such message, and at the end."""
    table = np.full(max(mavlink.mavlink_map) + 2, _UNKNOWN, np.int16)
    for number, kind in mavlink.mavlink_map.items():
        table[number] = kind.crc_extra
    return table


_STEP_BYTE = _byte_table()
_STEP_WORD = _step_byte(_step_byte(np.arange(65536, dtype=np.uint16)))
_EXTRA = _extra_table()
assert MAGIC_V1 == MAGIC_V2 + 1
