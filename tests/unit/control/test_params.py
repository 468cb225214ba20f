"""What a configuration may say."""

from __future__ import annotations

import pytest

from mavquad.control.params import LawParams
from mavquad.control.tuning import tuning
from mavquad.errors import ConfigError
from mavquad.schema import parse_section


def test_defaults_are_valid_and_keep_the_observer_ahead() -> None:
    params = LawParams()
    assert params.kappa_rad_s > params.omega0_rad_s
    assert tuning(params) is tuning(LawParams())


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"kappa_rad_s": 1.0, "omega0_rad_s": 2.0}, "kappa_rad_s"),
        ({"yaw_kappa_rad_s": 1.0, "yaw_omega0_rad_s": 2.0}, "yaw_kappa_rad_s"),
        ({"observer_moduli": [1.0, 1.0, 1.0, 1.0]}, "observer_moduli"),
        ({"observer_moduli": [1.0, 1.0, 1.0, 1.0, -1.0]}, "observer_moduli"),
        ({"polynomial": "poles"}, "wants 4 poles"),
        ({"polynomial": "poles", "poles": [[-1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-2.0, 0.0]]}, "-0.05 or less"),
        ({"polynomial": "poles", "poles": [[-1.0, 1.0], [-1.0, 0.0], [-1.0, 0.0], [-2.0, 0.0]]}, "conjugate"),
        ({"limits": {"thrust_min_g": 0.0}}, "limits.thrust_min_g"),
        ({"depth": "rates"}, "depth"),
        ({"kapa_rad_s": 3.0}, "kapa_rad_s"),
    ],
)
def test_what_cannot_fly_is_refused_by_name(table: dict, key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        parse_section(LawParams, table, "flight.toml", "law")


def test_poles_scale_with_omega0() -> None:
    poles = ((-1.0, 0.5), (-1.0, -0.5), (-1.0, 0.0), (-2.0, 0.0))
    slow = tuning(LawParams(polynomial="poles", poles=poles, omega0_rad_s=1.0)).gammas[0]
    fast = tuning(LawParams(polynomial="poles", poles=poles, omega0_rad_s=2.0)).gammas[0]
    assert [f / s for f, s in zip(fast, slow, strict=True)] == pytest.approx([16.0, 8.0, 4.0, 2.0])
