"""What holds for all tests.

Hypothesis: the same examples in every run, no time limits (machines are noisy), nothing left in the project's folder.
"""

import gc

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
