"""The law with b4(0, yaw) as eq. (5) prints it, for showing where that leads. Nothing that flies imports this."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from mavquad.types import Vec4

YAW_ANGLES_DEG = (0, 60, 120, 180, 240, 300)


def apply_printed(s_yaw: float, c_yaw: float, gravity_m_s2: float, inputs: Vec4) -> Vec4:
    """blkdiag(I2, g [[-c, -s], [-s, c]]) U."""
    v1, v2, roll, pitch = inputs
    return (v1, v2, gravity_m_s2 * (-c_yaw * roll - s_yaw * pitch), gravity_m_s2 * (-s_yaw * roll + c_yaw * pitch))


def solve_printed(s_yaw: float, c_yaw: float, gravity_m_s2: float, demanded: Vec4) -> Vec4:
    """The printed block is a reflection, up to g: its own inverse."""
    wz, wyaw, _wx, _wy = demanded
    _, _, roll, pitch = apply_printed(s_yaw, c_yaw, 1.0 / gravity_m_s2, demanded)
    return (wz, wyaw, roll, pitch)


@contextmanager
def law_as_printed() -> Iterator[None]:
    """Inside, the controller inverts the printed block, and its observer believes in it."""
    with (
        patch("mavquad.control.inversion.apply_b0", apply_printed),
        patch("mavquad.control.inversion.solve_b0", solve_printed),
    ):
        yield
