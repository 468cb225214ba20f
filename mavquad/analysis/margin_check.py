"""Before a flight: do the gains leave any margin on the link that is configured?"""

from __future__ import annotations

from mavquad.analysis.gain_search import PLACE, TURN, Gains, Limits, fastest_gains, gains_of
from mavquad.analysis.loop_spec import KINDS, Kind, LoopSpec, loop_spec
from mavquad.analysis.margins import Margins, margins
from mavquad.control.params import LawParams
from mavquad.errors import ConfigError
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

LEAST_DELAY_S = 0.005
"""Half a sample at 100 Hz: what the link's own jitter takes."""
GREATEST_PEAK = 5.0
"""Ms: the input gain would have to be known to 17 %, and a disturbance may come out five times as large."""

_NO_MARGIN = Limits(phase_deg=0.0, delay_s=LEAST_DELAY_S, peak=GREATEST_PEAK)
_NAMES: dict[Kind, str] = {"vertical": "z", "horizontal": "x and y", "yaw": "yaw"}


def check_margins(law: LawParams, streams: StreamParams, depth: Depth, path: str = "law") -> dict[Kind, Margins]:
    """Margins of every channel at a depth, about 10 ms of work.

    Args:
        law: the law.
        streams: rates of position and attitude.
        depth: where the law will act; one of `law.depths`.
        path: the file to blame.

    Returns:
        The margins, by channel.

    Raises:
        ConfigError: a loop is unstable, bears less than `LEAST_DELAY_S` of additional delay, or has an Ms above
            `GREATEST_PEAK`. The message names the channel, its margin, and gains that would do.
    """
    found = {}
    for kind in KINDS:
        spec = loop_spec(law, depth, kind, streams)
        found[kind] = margins(spec)
        if is_short(found[kind]):
            raise _error(law, streams, spec, found[kind], path)
    return found


def is_short(found: Margins) -> bool:
    """Whether this is no margin to fly with."""
    return not found.stable or found.delay_s < LEAST_DELAY_S or found.peak > GREATEST_PEAK


def described(found: Margins) -> str:
    """The margins in words."""
    if not found.stable:
        return "is unstable"
    return (
        f"has a delay margin of {found.delay_s * 1e3:.1f} ms (at least {LEAST_DELAY_S * 1e3:g}) "
        f"and Ms {found.peak:.1f} (at most {GREATEST_PEAK:g})"
    )


def _error(law: LawParams, streams: StreamParams, spec: LoopSpec, found: Margins, path: str) -> ConfigError:
    kinds = TURN if spec.kind == "yaw" else PLACE
    prefix = "yaw_" if spec.kind == "yaw" else ""
    at = gains_of(spec)
    reason = (
        f"no margin at depth {spec.depth}: the loop of {_NAMES[spec.kind]} {described(found)} at "
        f"{_keys(prefix, at)}, delay_s = {spec.delay_us * 1e-6:g} and {1e6 / spec.beat.tick_us:.0f} Hz"
    )
    better = _better(law, streams, spec.depth, kinds)
    advice = f"{_keys(prefix, better)} would do" if better else "no gains would do: a shorter delay or more rows might"
    return ConfigError(path, f"law.{prefix}omega0_rad_s", reason, f"{advice}; --force flies all the same")


def _better(law: LawParams, streams: StreamParams, depth: Depth, kinds: tuple[Kind, ...]) -> Gains | None:
    """Gains with good margins; where there are none, with enough."""
    return fastest_gains(law, depth, streams, kinds, Limits()) or fastest_gains(law, depth, streams, kinds, _NO_MARGIN)


def _keys(prefix: str, gains: Gains) -> str:
    return f"{prefix}omega0_rad_s = {gains.omega0_rad_s:.3g} and {prefix}kappa_rad_s = {gains.kappa_rad_s:.3g}"
