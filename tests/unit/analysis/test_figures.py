"""The figures are there, whole, and show what they were given."""

from __future__ import annotations

import subprocess
import sys

import matplotlib.image
import numpy as np
import pytest

from mavquad.analysis import canvas
from mavquad.analysis.figures import flight_figure, survey_figure
from mavquad.analysis.metrics import FlightMetrics
from mavquad.analysis.shadow import shadow
from mavquad.analysis.survey import survey
from mavquad.control.defaults import DEPTHS
from mavquad.errors import RunFolderError
from mavquad.tlog import scan


def pixels_of(path, colour):
    """How many pixels of the picture have just that colour."""
    picture = np.round(matplotlib.image.imread(path)[..., :3] * 255).astype(int)
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((picture == wanted).all(axis=2).sum())


def size_of(path):
    height, width, _ = matplotlib.image.imread(path).shape
    return width, height


@pytest.fixture(scope="module", params=DEPTHS)
def flight_png(request, make_trace, tmp_path_factory):
    path = tmp_path_factory.mktemp("figures") / "flight.png"
    rows = make_trace(20.0, rate_hz=20, depth=request.param)
    flight_figure(rows, [(rows[100].stamp_us, "box begins")], path, "a flight")
    return path


def test_every_channel_is_drawn(flight_png):
    assert size_of(flight_png) == (1760, 1100)
    for name, colour in canvas.CHANNEL_COLOURS.items():
        assert pixels_of(flight_png, colour) > 500, name
    assert pixels_of(flight_png, canvas.ORANGE) > 100


def test_no_part_file_is_left(flight_png):
    assert [path.name for path in flight_png.parent.iterdir()] == ["flight.png"]


def texts_of(monkeypatch, draw):
    """All texts of the page that `draw` saves."""
    pages = []
    monkeypatch.setattr(canvas, "save_png", lambda figure, path: pages.append(figure))
    draw()
    [page] = pages
    page.canvas.draw()
    from matplotlib.text import Text

    return [text.get_text().strip() for text in page.findobj(Text) if text.get_text()]


def test_phases_events_limits_and_metrics_are_named(monkeypatch, make_trace):
    rows = make_trace(20.0, rate_hz=20)
    events = [(rows[100].stamp_us, "box begins"), (rows[0].stamp_us - 9_000_000, "long before")]
    metrics = FlightMetrics(0.123, 0.456, 0.01, None)
    texts = texts_of(monkeypatch, lambda: flight_figure(rows, events, "x.png", "the title", metrics))
    assert {"the title", "hover", "mission", "box begins", "tilt", "snap", "12.3 cm", "45.6 cm", "0.6°", "–"} <= set(
        texts
    )
    assert "long before" not in texts


@pytest.mark.parametrize(
    ("depth", "sigma", "controls"),
    [
        ("torque", "σ (m/s⁴;\nyaw rad/s²)", "torque (norm.)"),
        ("rate", "σ (m/s³;\nyaw rad/s)", "body rates\n(rad/s)"),
        ("attitude", "σ (m/s²;\nyaw rad/s)", "attitude (rad)"),
    ],
)
def test_each_depth_has_its_own_units(monkeypatch, make_trace, depth, sigma, controls):
    rows = make_trace(2.0, rate_hz=20, depth=depth)
    texts = texts_of(monkeypatch, lambda: flight_figure(rows, [], "x.png", ""))
    assert {sigma, controls} <= set(texts)


def test_a_padded_yaw_has_the_units_of_its_longer_chain(monkeypatch, make_trace):
    rows = [
        row._replace(zeta_hat=(row.zeta_hat[0], row.zeta_hat[0], *row.zeta_hat[2:]))
        for row in make_trace(2.0, rate_hz=20)
    ]
    assert "σ (m/s⁴;\nyaw rad/s⁴)" in texts_of(monkeypatch, lambda: flight_figure(rows, [], "x.png", ""))


def test_without_limits_it_says_so(monkeypatch, make_trace):
    rows = [row._replace(limits=()) for row in make_trace(2.0, rate_hz=20)]
    assert "none was active" in texts_of(monkeypatch, lambda: flight_figure(rows, [], "x.png", ""))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_short_flights(make_trace, tmp_path, count):
    path = tmp_path / "flight.png"
    flight_figure(make_trace(1.0)[:count], [], path, "short")
    assert size_of(path) == (1760, 1100)


def test_a_folder_that_is_not_there(make_trace, tmp_path):
    with pytest.raises(RunFolderError, match=r"flight\.png: the figure cannot be written"):
        flight_figure([], [], tmp_path / "none" / "flight.png", "")


def test_a_failed_write_leaves_the_old_figure_and_no_part(tmp_path, monkeypatch):
    path = tmp_path / "flight.png"
    flight_figure([], [], path, "old")
    before = path.read_bytes()

    def full(figure, part, **_):
        part.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    with pytest.raises(RunFolderError, match="No space left"):
        flight_figure([], [], path, "new")
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_log_with_poses(log, tmp_path):
    for k in range(200):
        log.local(k / 10, (k / 50, k / 100, -3.0), (0.2, 0.1, 0.0))
        log.attitude(k / 10, 0, 0, 0.001 * k, (0, 0, 0.01))
    for second in range(20):
        log.heartbeat(second, armed=True)
    contents = log.contents()
    path = tmp_path / "replay.png"
    survey_figure(survey(contents), shadow(contents, (1, 1)), path, "a log")
    assert pixels_of(path, canvas.BLUE) > 300
    assert pixels_of(path, canvas.SHADE) > 100_000
    assert pixels_of(path, canvas.SKY) > 2_000


def test_a_log_without_poses_shows_its_messages(log, tmp_path):
    for second in range(20):
        log.heartbeat(second)
    path = tmp_path / "replay.png"
    survey_figure(survey(log.contents()), None, path, "a log")
    assert pixels_of(path, canvas.SKY) > 100_000
    assert pixels_of(path, canvas.BLUE) == 0


def test_a_log_with_nothing(tmp_path):
    contents = scan(b"")
    survey_figure(survey(contents), shadow(contents, (1, 1)), tmp_path / "replay.png", "nothing")
    assert (tmp_path / "replay.png").exists()


def test_a_log_of_one_frame(log, tmp_path):
    log.heartbeat(0)
    survey_figure(survey(log.contents()), None, tmp_path / "replay.png", "one frame")
    assert pixels_of(tmp_path / "replay.png", canvas.SKY) == 0


def test_matplotlib_is_not_imported_before_a_figure_is_drawn():
    code = "import sys, mavquad.analysis.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
