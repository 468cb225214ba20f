"""What a configuration may say, and what "auto" stands for at each depth."""

from __future__ import annotations

import math

import pytest

from mavquad.control.defaults import CHAIN_LENGTHS, DEPTHS, YAW_LENGTHS, defaults
from mavquad.control.params import LawParams
from mavquad.control.tuning import ACCELERATION, JERK, VELOCITY, tuning
from mavquad.errors import ConfigError
from mavquad.schema import parse_section
from mavquad.types import Depth

MEASUREMENTS = ("position_yaw", "position_attitude", "full")
AUTO = (
    "omega0_rad_s", "yaw_omega0_rad_s", "kappa_rad_s", "velocity_kappa_rad_s", "attitude_kappa_rad_s",
    "rates_kappa_rad_s", "yaw_kappa_rad_s", "observer_spread", "dead_time_s", "lag_s", "thrust_lag_s", "yaw_dead_time_s",
    "yaw_lag_s",
)  # fmt: skip
GAINS = AUTO[:7]

every_depth = pytest.mark.parametrize("depth", DEPTHS)
every_set = pytest.mark.parametrize("measurements", MEASUREMENTS)


def _parse(table: dict) -> LawParams:
    return parse_section(LawParams, table, "flight.toml", "law")


@every_depth
@every_set
def test_defaults_are_valid_and_keep_the_observer_ahead(depth: Depth, measurements: str) -> None:
    own = defaults("px4", depth, measurements)
    assert own.kappa_per_omega0 > 1.0
    assert own.yaw_kappa_per_omega0 > 1.0
    params = LawParams(measurements=measurements)
    assert tuning(params, depth) is tuning(LawParams(measurements=measurements), depth)
    spec = tuning(params, depth).horizontal.spec
    assert spec.rows[0].kappa_rad_s == own.kappa_per_omega0 * own.omega0_rad_s
    assert (spec.lag_s, spec.dead_us) == (own.lag_s, round(own.dead_time_s * 1e6))


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"depth": "torque", "kappa_rad_s": 1.0, "omega0_rad_s": 2.0}, "kappa_rad_s"),
        ({"yaw_kappa_rad_s": 1.0, "yaw_omega0_rad_s": 2.0}, "yaw_kappa_rad_s"),
        ({"observer_spread": 0.5}, "observer_spread"),
        ({"observer_spread": 40.0}, "observer_spread"),
        ({"depth": "torque", "polynomial": "poles"}, "wants 4 poles"),
        ({"depth": "rate", "polynomial": "poles"}, "wants 3 poles"),
        ({"depth": "attitude", "polynomial": "poles", "poles": [[-1.0, 0.0]] * 3}, "wants 2 poles"),
        ({"poles": [[-1.0, 0.0]]}, "polynomial = .poles. only"),
        ({"polynomial": "poles", "poles": [[-1.0, 0.0]] * 4}, "depth of their own"),
        (
            {"depth": "torque", "polynomial": "poles", "poles": [[-1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-2.0, 0.0]]},
            "-0.05 or less",
        ),
        (
            {"depth": "torque", "polynomial": "poles", "poles": [[-1.0, 1.0], [-1.0, 0.0], [-1.0, 0.0], [-2.0, 0.0]]},
            "conjugate",
        ),
        ({"limits": {"thrust_min_g": 0.0}}, "limits.thrust_min_g"),
        ({"limits": {"tilt_max_deg": 90.0}}, "limits.tilt_max_deg"),
        ({"saturation": {"roll_pitch_rad_s": 0.0}}, "saturation.roll_pitch_rad_s"),
        ({"yaw_padding": 3}, "yaw_padding"),
        ({"depth": "rates"}, "depth"),
        ({"measurements": "position"}, "measurements"),
        ({"decoupling": "level"}, "decoupling"),
        ({"kapa_rad_s": 3.0}, "kapa_rad_s"),
        ({"omega0_rad_s": "fast"}, "omega0_rad_s"),
        ({"lag_s": -0.1}, "lag_s"),
        ({"friction_1_s": -1.0}, "friction_1_s"),
    ],
)
def test_what_cannot_fly_is_refused_by_name(table: dict, key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        _parse(table)


@pytest.mark.parametrize("key", AUTO)
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_are_refused_by_name(key: str, value: float) -> None:
    with pytest.raises(ConfigError, match=key):
        _parse({key: value})


@pytest.mark.parametrize("key", GAINS)
def test_a_gain_of_zero_is_refused_by_name(key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        _parse({key: 0.0})


@pytest.mark.parametrize("key", ["friction_1_s", "angular_friction_1_s", "delay_s", "lag_bridged"])
def test_plain_numbers_are_finite(key: str) -> None:
    for value in (math.nan, math.inf, -1.0):
        with pytest.raises(ConfigError, match=key):
            _parse({key: value})


# ---------------------------------------------------------------- "auto"


@pytest.mark.parametrize("key", AUTO)
def test_auto_goes_in_and_comes_out(key: str) -> None:
    assert LawParams().model_dump()[key] == "auto"
    assert _parse({key: "auto"}) == LawParams()
    assert _parse(LawParams().model_dump()) == LawParams()


@pytest.mark.parametrize("key", AUTO)
def test_a_number_instead_is_kept(key: str) -> None:
    value = 3.0 if key == "observer_spread" else 20.0 if "kappa" in key else 2.5 if "omega0" in key else 0.07
    params = _parse({key: value})
    assert params.model_dump()[key] == value
    assert _parse(params.model_dump()) == params


def test_a_number_instead_is_flown() -> None:
    params = LawParams(
        omega0_rad_s=2.5, kappa_rad_s=11.0, velocity_kappa_rad_s=12.0, attitude_kappa_rad_s=13.0, rates_kappa_rad_s=14.0,
        yaw_omega0_rad_s=1.5, yaw_kappa_rad_s=15.0, dead_time_s=0.01, lag_s=0.02, thrust_lag_s=0.03, yaw_dead_time_s=0.04,
        yaw_lag_s=0.06, observer_spread=1.5,
    )  # fmt: skip
    tune = tuning(params, "torque")
    assert [row.kappa_rad_s for row in tune.horizontal.spec.rows] == [11.0, 12.0, 13.0, 14.0]
    assert [row.kappa_rad_s for row in tune.yaw.spec.rows] == [15.0, 14.0]
    assert tune.horizontal.gammas[0] == pytest.approx(2.5**4)
    assert tune.yaw.gammas == pytest.approx((1.5**2, 2 * 1.5))
    assert (tune.horizontal.spec.lag_s, tune.horizontal.spec.dead_us) == (0.02, 10_000)
    assert (tune.vertical.spec.lag_s, tune.vertical.spec.dead_us) == (0.03, 0)
    assert (tune.yaw.spec.lag_s, tune.yaw.spec.dead_us) == (0.06, 40_000)
    assert tune.horizontal.ahead_us == 30_000
    assert tune.horizontal.spec.rows[0].moduli == pytest.approx((1.5**-0.5, 1.5**0.5))


@every_depth
def test_kappa_must_be_above_the_omega0_of_its_depth(depth: Depth) -> None:
    """The default one, too: what leads at one depth may lag behind at another."""
    known = defaults("px4", depth, "full").omega0_rad_s
    with pytest.raises(ConfigError, match=f"{known:g} at depth {depth}"):
        _parse({"depth": depth, "kappa_rad_s": known})
    assert _parse({"depth": depth, "kappa_rad_s": known + 0.1}).kappa_rad_s == known + 0.1


def test_an_open_depth_must_suit_all_of_them() -> None:
    largest = max(DEPTHS, key=lambda depth: defaults("px4", depth, "full").omega0_rad_s)
    with pytest.raises(ConfigError, match=f"at depth {largest}"):
        _parse({"kappa_rad_s": defaults("px4", largest, "full").omega0_rad_s})


@every_depth
def test_yaw_kappa_must_be_above_its_own_omega0(depth: Depth) -> None:
    known = defaults("px4", depth, "full").yaw_omega0_rad_s
    with pytest.raises(ConfigError, match="yaw_kappa_rad_s must be greater"):
        _parse({"depth": depth, "yaw_kappa_rad_s": known})


@pytest.mark.parametrize("depth", DEPTHS)
def test_poles_of_each_depth_scale_with_omega0(depth: Depth) -> None:
    poles = ((-1.0, 0.5), (-1.0, -0.5), (-1.0, 0.0), (-2.0, 0.0))[: CHAIN_LENGTHS[depth]]
    slow, fast = (
        tuning(LawParams(depth=depth, polynomial="poles", poles=poles, omega0_rad_s=omega0), depth).horizontal.gammas
        for omega0 in (1.0, 2.0)
    )
    length = CHAIN_LENGTHS[depth]
    assert [f / s for f, s in zip(fast, slow, strict=True)] == pytest.approx(
        [2.0 ** (length - i) for i in range(length)]
    )


def test_yaw_is_binomial_where_the_poles_are_not_for_its_length() -> None:
    poles = ((-1.0, 0.5), (-1.0, -0.5), (-1.0, 0.0), (-2.0, 0.0))
    short = LawParams(depth="torque", polynomial="poles", poles=poles, yaw_omega0_rad_s=2.0)
    assert tuning(short, "torque").yaw.gammas == pytest.approx((4.0, 4.0))
    padded = LawParams(depth="torque", polynomial="poles", poles=poles, yaw_omega0_rad_s=1.0, yaw_padding=2)
    assert tuning(padded, "torque").yaw.gammas == pytest.approx((2.5, 7.75, 9.25, 5.0))


# ---------------------------------------------------------------- chains and rows


@every_depth
def test_lengths_of_the_chains(depth: Depth) -> None:
    for padding in (0, 1, 2):
        tune = tuning(LawParams(yaw_padding=padding), depth)
        assert tune.horizontal.spec.length == tune.vertical.spec.length == CHAIN_LENGTHS[depth]
        assert tune.yaw.spec.length == YAW_LENGTHS[depth] + padding
        assert (tune.vertical.integrators, tune.yaw.integrators) == (CHAIN_LENGTHS[depth] - 2, padding)


@pytest.mark.parametrize(
    ("depth", "measurements", "measured"),
    [
        ("torque", "position_yaw", [0]),
        ("torque", "position_attitude", [0, ACCELERATION]),
        ("torque", "full", [0, VELOCITY, ACCELERATION, JERK]),
        ("rate", "position_yaw", [0]),
        ("rate", "position_attitude", [0, ACCELERATION]),
        ("rate", "full", [0, VELOCITY, ACCELERATION]),
        ("attitude", "position_yaw", [0]),
        ("attitude", "position_attitude", [0]),
        ("attitude", "full", [0, VELOCITY]),
    ],
)
def test_which_states_are_measured(depth: Depth, measurements: str, measured: list[int]) -> None:
    """As far as the chain has them."""
    tune = tuning(LawParams(measurements=measurements), depth)
    for channel in (tune.horizontal, tune.vertical):
        assert [row.index for row in channel.spec.rows] == measured
        assert [channel.row(index) for index in measured] == list(range(len(measured)))
    assert len(tune.yaw.spec.rows) == (2 if (depth, measurements) == ("torque", "full") else 1)


def test_what_auto_means_for_the_words() -> None:
    params = LawParams()
    assert params.measured() == "full"
    assert params.mistrusting("rate").kappa_rad_s == 15.0
    assert LawParams(kappa_rad_s=20.0).mistrusting("rate").kappa_rad_s == 20.0
    assert [params.mistrusting(depth).velocity for depth in DEPTHS] == ["ignored"] * 3
    for told in ({"measurements": "position_yaw"}, {"velocity_slopes": 0}, {"velocity": "measured"}):
        assert LawParams(**told).mistrusting("rate") == LawParams(**told)
    assert params.depths == DEPTHS
    assert LawParams(depth="rate").depths == ("rate",)
    assert [params.constant_gain(depth) for depth in DEPTHS] == [False] * 3
    paper = LawParams(measurements="position_yaw")
    assert [paper.constant_gain(depth) for depth in DEPTHS] == [True, False, False]
    assert not LawParams(measurements="position_yaw", form="state_feedback").constant_gain("torque")
    assert LawParams(decoupling="constant").constant_gain("rate")
    assert not LawParams(measurements="position_yaw", decoupling="attitude").constant_gain("torque")
