"""What telemetry can deliver."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mavquad.schema import Section

Hz = Annotated[float, Field(gt=0, le=250)]


class StreamsConfig(Section):
    """What telemetry can deliver, whatever is asked for. "auto": as the imitated release does."""

    max_attitude_hz: Hz | Literal["auto"] = "auto"
    """Fastest ATTITUDE and ATTITUDE_QUATERNION in Hz. "auto": PX4 1.13 248, 1.16 208, the others 241."""
    max_position_hz: Hz | Literal["auto"] = "auto"
    """Fastest LOCAL_POSITION_NED, ODOMETRY and what else comes from the position in Hz. "auto": PX4 1.13 89, 1.15 and
    1.16 125."""
