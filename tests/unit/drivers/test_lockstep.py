"""The lockstep driver: what a step leaves behind."""

from __future__ import annotations

import gc

import pytest

from mavquad.drivers.collector import without_collector
from tests.support import prepare, run


@pytest.mark.parametrize("depth", ["torque", "attitude"])
def test_steps_leave_no_cyclic_garbage(depth):
    flight = prepare({"law.depth": depth})
    run(flight, until="flying")
    gc.collect()
    with without_collector():
        run(flight, flight.seconds + 1.0)
        assert gc.collect() == 0


@pytest.mark.parametrize("was_on", [True, False])
def test_the_collector_is_left_as_it_was(was_on):
    (gc.enable if was_on else gc.disable)()
    try:
        with pytest.raises(KeyError), without_collector():
            assert not gc.isenabled()
            raise KeyError
        assert gc.isenabled() is was_on
    finally:
        gc.enable()
