"""Where on earth PX4's SIH starts."""

from __future__ import annotations

from sitl_mock.config import Px4Release
from sitl_mock.geodesy import Origin

_ZURICH = Origin(47.3977432, 8.5455942, 489.4)
ORIGINS: dict[Px4Release, Origin] = {
    "1.13": Origin(45.4671182, -73.7578241, 32.5),
    "1.15": _ZURICH,
    "1.16": _ZURICH,
}
"""1.13: Montreal, as the estimator had it in a recording; later: SIH_LOC_LAT0, SIH_LOC_LON0, SIH_LOC_H0."""
