"""Where on earth PX4's SIH starts."""

from __future__ import annotations

from sitl_mock.config import Px4Release
from sitl_mock.geodesy import Origin

_MONTREAL = Origin(45.4671182, -73.7578241, 32.5)
_ZURICH = Origin(47.3977432, 8.5455942, 489.4)
ORIGINS: dict[Px4Release, Origin] = {
    "1.13": _MONTREAL,
    "1.14": _MONTREAL,
    "1.15": _MONTREAL,
    "1.16": _ZURICH,
    "1.17": _ZURICH,
}
"""Montreal: as the estimator had it in a recording of 1.13; from 1.16 on: SIH_LOC_LAT0, SIH_LOC_LON0, SIH_LOC_H0."""
