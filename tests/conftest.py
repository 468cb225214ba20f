"""What holds for all tests.

Hypothesis: the same examples in every run, no time limits (machines are noisy), nothing left in the project's folder.
"""

import gc
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "mavquad", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("mavquad")


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """What was imported and collected stays to the end: Python need not look for garbage in it again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def flown_run(tmp_path_factory) -> Path:
    """The run folder of a short lockstep flight; whoever wants to spoil it makes a copy."""
    from mavquad.cli.sim import sim
    from mavquad.config import Override

    folder = tmp_path_factory.mktemp("flight") / "run"
    given = {"mission.name": "goto", "mission.offset_ned_m": "[0.6, 0.3, -0.4]"}
    assert sim(None, [Override(key, text) for key, text in given.items()], folder, as_json=True) == 0
    return folder
