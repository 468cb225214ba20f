"""Hypothesis keeps its files out of the project's folder."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hypothesis import configuration

configuration.set_hypothesis_home_dir(Path(tempfile.gettempdir()) / "mavquad-hypothesis")
