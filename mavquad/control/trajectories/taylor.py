"""A polynomial given by its value and derivatives at one moment, some time later.

    f(h) = c0 + h (c1 + h/2 (c2 + h/3 (c3 + ...))),      f'(h) = c1 + h (c2 + h/2 (c3 + ...)), ...

`c[k]` is the k-th derivative at h = 0. Near its own start a piece has no cancellation, however late that start is; powers
of the time since the beginning would lose all digits. Written out, since this is what a sample of a reference costs.
"""

from __future__ import annotations

Row = tuple[float, ...]


def quintic(c: Row, h: float) -> tuple[float, float, float, float, float]:
    """Value and four derivatives of a polynomial of degree 5; `c` has 6 entries."""
    c0, c1, c2, c3, c4, c5 = c
    half, third, fourth, fifth = h * 0.5, h / 3.0, h * 0.25, h * 0.2
    return (
        c0 + h * (c1 + half * (c2 + third * (c3 + fourth * (c4 + fifth * c5)))),
        c1 + h * (c2 + half * (c3 + third * (c4 + fourth * c5))),
        c2 + h * (c3 + half * (c4 + third * c5)),
        c3 + h * (c4 + half * c5),
        c4 + h * c5,
    )


def septic(c: Row, h: float) -> tuple[float, float, float, float, float, float]:
    """Value and five derivatives of a polynomial of degree 7; `c` has 8 entries."""
    c0, c1, c2, c3, c4, c5, c6, c7 = c
    half, third, fourth, fifth, sixth, seventh = h * 0.5, h / 3.0, h * 0.25, h * 0.2, h / 6.0, h / 7.0
    return (
        c0 + h * (c1 + half * (c2 + third * (c3 + fourth * (c4 + fifth * (c5 + sixth * (c6 + seventh * c7)))))),
        c1 + h * (c2 + half * (c3 + third * (c4 + fourth * (c5 + fifth * (c6 + sixth * c7))))),
        c2 + h * (c3 + half * (c4 + third * (c5 + fourth * (c6 + fifth * c7)))),
        c3 + h * (c4 + half * (c5 + third * (c6 + fourth * c7))),
        c4 + h * (c5 + half * (c6 + third * c7)),
        c5 + h * (c6 + half * c7),
    )
