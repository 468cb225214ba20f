"""How a live flight ends when our own code fails in it, or the operator leaves: the vehicle is asked to hold first."""

import asyncio
from types import SimpleNamespace

import pytest

from mavquad.cli.fly import _drive
from mavquad.config import Config
from mavquad.errors import Abandoned

LAST_WORDS = [b"hold", b"no rotation"]


def ended_by(error: BaseException) -> None:
    """A flight whose waiting ends with this error; the driver must be told the last words, then to close."""
    told: list[object] = []

    async def wait(_: float) -> None:
        raise error

    agent = SimpleNamespace(done=False, last_resort=lambda: LAST_WORDS)
    driver = SimpleNamespace(wait=wait, abandon=told.append, close=lambda: told.append("close"), lateness_us=[])
    flight = SimpleNamespace(collect=lambda _: [], config=Config())
    try:
        asyncio.run(_drive(agent, driver, flight, as_json=True))
    finally:
        assert told == [LAST_WORDS, "close"]


def test_an_operator_who_leaves_has_the_vehicle_hold(capsys: pytest.CaptureFixture[str]) -> None:
    ended_by(Abandoned("left", "take it over"))
    assert "left" in capsys.readouterr().err


@pytest.mark.parametrize("error", [ZeroDivisionError("planted"), SystemExit(1)])
def test_a_failure_of_our_own_has_the_vehicle_hold_and_goes_on(error: BaseException) -> None:
    with pytest.raises(type(error)):
        ended_by(error)
