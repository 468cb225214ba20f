"""What `mavquad tune` says of a configuration at one depth: margins and noise of each channel, and the fastest gains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mavquad.analysis.gain_search import PLACE, TURN, Gains, Limits, fastest_gains, gains_of, noise_share
from mavquad.analysis.loop_spec import KINDS, Kind, LoopSpec, loop_spec
from mavquad.analysis.margins import DELAY_MAX_S, Margins, margins
from mavquad.analysis.noise_gain import NoiseGain, noise_gain
from mavquad.control.params import LawParams
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

NAMES: dict[Kind, str] = {"vertical": "z", "horizontal": "x, y", "yaw": "yaw"}


@dataclass(frozen=True, slots=True)
class ChannelReport:
    """One channel with the gains in force; no noise where the loop is unstable."""

    spec: LoopSpec
    gains: Gains
    margins: Margins
    noise: NoiseGain | None
    share: float | None
    """RMS of the input as a share of its saturation level."""

    def to_json(self) -> dict[str, Any]:
        """SI units, angles of margins in degrees; null: none, or without bound."""
        found, noise = self.margins, self.noise
        return {
            "omega0_rad_s": self.gains.omega0_rad_s,
            "kappa_rad_s": self.gains.kappa_rad_s,
            "stable": found.stable,
            "spectral_radius": found.spectral_radius,
            "slowest_s": _finite(found.slowest_s),
            "eigenvalues": [[value.real, value.imag] for value in found.eigenvalues],
            "gain_margin": [found.gain_low, _finite(found.gain_high)],
            "phase_margin_deg": found.phase_deg,
            "crossover_rad_s": found.crossover_rad_s,
            "delay_margin_s": found.delay_s,
            "delay_margin_at_least": found.delay_s >= DELAY_MAX_S,
            "ms": _finite(found.peak),
            "noise": None if noise is None else {"output": noise.output, "w": noise.command, "input": noise.physical},
            "noise_share": self.share,
        }


@dataclass(frozen=True, slots=True)
class TuneReport:
    """All channels at one depth, and the fastest gains for z, x and y, and for yaw; None where there are none."""

    law: LawParams
    depth: Depth
    channels: Mapping[Kind, ChannelReport]
    limits: Limits
    place: Gains | None
    turn: Gains | None

    def settings(self) -> dict[str, Any] | None:
        """The fastest gains as keys of [law]; None unless there are both pairs."""
        if self.place is None or self.turn is None:
            return None
        return {
            "depth": self.depth,
            "omega0_rad_s": self.place.omega0_rad_s,
            "kappa_rad_s": self.place.kappa_rad_s,
            "yaw_omega0_rad_s": self.turn.omega0_rad_s,
            "yaw_kappa_rad_s": self.turn.kappa_rad_s,
        }

    def to_json(self) -> dict[str, Any]:
        """For --json."""
        return {
            "depth": self.depth,
            "measurements": self.law.measured(),
            "delay_s": self.law.delay(),
            "channels": {kind: report.to_json() for kind, report in self.channels.items()},
            "limits": {
                "phase_margin_deg": self.limits.phase_deg,
                "delay_margin_s": self.limits.delay_s,
                "ms": self.limits.peak,
                "noise_share": self.limits.noise_share,
                "approach_share": self.limits.approach_share,
            },
            "fastest": {"z_x_y": _pair(self.place), "yaw": _pair(self.turn)},
        }


def tune_report(law: LawParams, depth: Depth, streams: StreamParams, limits: Limits) -> TuneReport:
    """The report of one depth: some seconds of work, nearly all of it the search."""
    return TuneReport(
        law=law,
        depth=depth,
        channels={kind: _channel(law, depth, kind, streams) for kind in KINDS},
        limits=limits,
        place=fastest_gains(law, depth, streams, PLACE, limits),
        turn=fastest_gains(law, depth, streams, TURN, limits),
    )


def _channel(law: LawParams, depth: Depth, kind: Kind, streams: StreamParams) -> ChannelReport:
    spec = loop_spec(law, depth, kind, streams)
    found = margins(spec)
    noise = noise_gain(spec) if found.stable else None
    share = noise_share(law, depth, spec) if found.stable else None
    return ChannelReport(spec, gains_of(spec), found, noise, share)


def _pair(gains: Gains | None) -> dict[str, float] | None:
    return None if gains is None else {"omega0_rad_s": gains.omega0_rad_s, "kappa_rad_s": gains.kappa_rad_s}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
