"""Hypothesis: the same examples in every run, no time limits (machines are noisy), nothing left in the project's folder."""

from hypothesis import HealthCheck, settings

settings.register_profile(
    "mavquad", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("mavquad")
