"""The link between the vehicle and the far side."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from mavquad.schema import Section


class LinkConfig(Section):
    """The link between the vehicle and the far side, each direction for itself."""

    latency_ms: Annotated[float, Field(ge=0, le=5000)] = 10.0
    """Delay of every frame in ms."""
    jitter_ms: Annotated[float, Field(ge=0, le=5000)] = 0.0
    """Largest additional delay in ms, uniform from 0; frames may overtake each other."""
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Probability that a frame is lost."""
