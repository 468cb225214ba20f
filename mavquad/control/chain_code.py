"""What time and measurements do to chains of one kind, written out without loops over their states: it is done for every
channel at every measurement, and is most of what the observer costs. The theory is in `observer` and `actuation`.

A kind is a length and a shape: (index of the state that it measures, number of poles) of each row. The functions take
several chains at once, those that go through an interval together or are measured together; what these share is done once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

from mavquad.control.actuation import Interval, sums, written

Shape = tuple[tuple[int, int], ...]
Drifts = list[list[float]]
Gain = tuple[float, ...]
Chains = Iterable[Any]
"""Objects with values, drifts and lagged: `observer.Chain`."""


class RowCode(NamedTuple):
    """One row's arithmetic."""

    offset: Callable[[Drifts], float]
    """What of its state the row does not measure: the parts of the drifts before it that have come as far as that state."""
    correct: Callable[[list[float], Drifts, Gain, float], None]
    """Values and drifts, by the gain times the innovation."""
    take: Callable[[Chains, Gain, Iterable[float]], None]
    """The same for chains that are measured together, each by what its row measured."""


class ChainCode(NamedTuple):
    """The arithmetic of one kind of chain."""

    predict: Callable[[Chains, Iterable[int], Interval], None]
    """Chains, with the channel of each, to the end of an interval."""
    ahead: Callable[[Chains, Iterable[int], Interval], list[list[float]]]
    """Their values at the end of an interval; they stay where they are."""
    rows: tuple[RowCode, ...]


@lru_cache(maxsize=64)
def chain_code(length: int, shape: Shape) -> ChainCode:
    """The code of one kind of chain."""
    code = sums(length)
    each = ["for chain, channel in zip(chains, channels):", "    state, lagged = chain.values, chain.lagged"]
    own = [f"    {line}" for line in code.own]
    seen = [f"    {line}" for line in sums(length, with_lagged=False).own]
    moved = [f"    chain.values, chain.lagged = {code.state}, {code.lagged}", *_slide(shape)]
    return ChainCode(
        predict=written("def predict(chains, channels, span):", [*code.shared, *each, *own, *moved]),
        ahead=written(
            "def ahead(chains, channels, span):",
            [*code.shared, "found = []", *each, *seen, f"    found.append({code.state})", "return found"],
        ),
        rows=tuple(_row(length, shape, row) for row in range(len(shape))),
    )


def _slide(shape: Shape) -> list[str]:
    """drift_i += sum_k taylor_k drift_(i+k): how offsets that have derivatives go on."""
    lines = [
        f"        drifts[{stretch}][{i}] += h{k} * drifts[{stretch}][{i + k}]"
        for stretch, order in enumerate(_orders(shape))
        for i in range(order)
        for k in range(1, order - i)
    ]
    return ["    drifts = chain.drifts", "    if drifts:", *lines] if lines else []


def _row(length: int, shape: Shape, row: int) -> RowCode:
    unpacked, correction = _correction(length, shape, row)
    predicted = f"values[{shape[row][0]}]" + (f" - ({_offset(shape, row)})" if row else "")
    each = [
        "for chain, value in zip(chains, measured):",
        "    values, drifts = chain.values, chain.drifts",
        f"    innovation = value - ({predicted})",
        *(f"    {line}" for line in correction),
    ]
    return RowCode(
        written("def offset(drifts):", [f"return {_offset(shape, row)}"]),
        written("def correct(values, drifts, gain, innovation):", [unpacked, *correction]),
        written("def take(chains, gain, measured):", [unpacked, *each]),
    )


def _orders(shape: Shape) -> list[int]:
    """Parts of the offset that each stretch but the last has as its disturbance."""
    return [count - (after - index) for (index, count), (after, _) in pairwise(shape)]


def _offset(shape: Shape, row: int) -> str:
    index = shape[row][0]
    parts = [
        f"drifts[{stretch}][{index - after}]"
        for stretch, ((after, _), order) in enumerate(zip(shape[1:], _orders(shape), strict=True))
        if 0 <= index - after < order
    ]
    return " + ".join(parts) or "0.0"


def _correction(length: int, shape: Shape, row: int) -> tuple[str, list[str]]:
    """The states from the row's own on; the step of the next rows' states is a step of their offsets as well, so that what
    those rows predict stays as it was."""
    index, count = shape[row]
    lines = [f"values[{index + i}] += k{i} * innovation" for i in range(min(count, length + 1 - index))]
    order = _orders(shape)[row] if row < len(shape) - 1 else 0
    lines += [f"drifts[{row}][{i}] += k{count - order + i} * innovation" for i in range(order)]
    return f"{''.join(f'k{i}, ' for i in range(count))} = gain", lines
