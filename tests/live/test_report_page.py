"""The report's page in a real browser: drawn without complaint, with every point, zoomed and read as by hand."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from mavquad.analysis.report.model import Line, Panel, Report
from mavquad.analysis.report.of_log import read_log, report_of_log
from mavquad.analysis.report.page import page
from mavquad.protocol.codec import mavlink
from tests.browser import CHROMIUM, Browser, browser
from tests.unit.analysis.report.logs import circling

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed (apt-get install chromium)")

EVIL = ("</script><script>window.evil = 1</script>", "<img src=x onerror='window.evil = 1'>")
ASKED = (0, 1, 1, 0b10000000, [1, 0, 0, 0], 0.1, -0.2, 0.3, 0.6)
VIEWS = "JSON.stringify(report.charts.map(c => [c.scales.x.min, c.scales.x.max]))"


@pytest.fixture(scope="module")
def tab():
    with browser() as tab:
        yield tab


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> tuple[Path, Report]:
    """A page of a small log."""
    log = circling()
    for text in EVIL:
        log.at(5.0).text(text, 2)
    for step in range(120):  # a stream whose times are nobody else's
        log.at(3.0 + step / 30 + 0.011).add(mavlink.MAVLink_set_attitude_target_message(*ASKED), outbound=True)
    folder = tmp_path_factory.mktemp("page")
    report = report_of_log(read_log(log.write(folder / "some.tlog")))
    (folder / "report.html").write_text(page(report))
    return folder / "report.html", report


@pytest.fixture
def opened(tab, made) -> Browser:
    tab.complaints.clear()
    tab.requests.clear()
    tab.open(made[0])
    yield tab
    assert tab.complaints == []


def box(tab: Browser, selector: str, index: int = 0) -> tuple[float, float, float, float]:
    """Left, top, width, height of an element, scrolled into sight."""
    found = f"document.querySelectorAll({json.dumps(selector)})[{index}]"
    tab.value(f"{found}.scrollIntoView({{block: 'center'}})")
    return tuple(tab.value(f"(r => [r.left, r.top, r.width, r.height])({found}.getBoundingClientRect())"))


def views(tab: Browser) -> np.ndarray:
    tab.settled()
    return np.array(json.loads(tab.value(VIEWS)))


def picture_of(tab: Browser, name: str) -> str:
    tab.settled()
    return tab.value(f"document.querySelector('[data-path={name}] canvas').toDataURL()")


def test_it_draws_every_point_and_asks_for_nothing_else(opened, made):
    path, report = made
    finite = sum(int(np.isfinite(line.values.astype("f4")).sum()) for panel in report.panels for line in panel.lines)
    assert finite > 1000
    assert int(opened.value("document.documentElement.dataset.points")) == finite
    drawn = "report.charts.slice(1).map(c => c.data.slice(1).map(d => d.filter(v => v != null).length)).flat()"
    assert sum(opened.value(drawn)) == finite
    assert int(opened.value("document.querySelectorAll('.panel canvas').length")) == len(report.panels)
    assert opened.requests == [path.resolve().as_uri()]


def test_something_is_to_be_seen(opened):
    painted = """(canvas => { const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
        const seen = new Set();
        for (let i = 0; i < data.length; i += 4) seen.add(data.slice(i, i + 4).join());
        return seen.size; })"""
    sizes = opened.value(f"[...document.querySelectorAll('canvas')].map({painted})")
    assert len(sizes) > 6
    assert min(sizes) > 10, sizes


def test_what_a_log_says_does_not_run(opened):
    assert opened.value("typeof window.evil") == "undefined"
    assert set(EVIL) <= set(opened.value("[...document.querySelectorAll('.texts b')].map(b => b.textContent)"))
    assert opened.value("document.querySelectorAll('img').length") == 0


def test_a_drag_zooms_all_panels_and_a_double_click_shows_all(opened):
    low, high = views(opened)[0]
    left, top, width, _ = box(opened, ".u-over", 1)
    opened.drag((left + width * 0.25, top + 30), (left + width * 0.75, top + 30))
    span = high - low
    np.testing.assert_allclose(
        views(opened), [[low + span * 0.25, low + span * 0.75]] * len(views(opened)), atol=span / 200
    )
    opened.drag((left + width * 0.75, top + 30), (left + width * 0.5, top + 30), shift=True)
    np.testing.assert_allclose(views(opened)[:, 0], low + span * 0.375, atol=span / 200)
    for clicks in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            place = {"x": left + 50, "y": top + 30, "button": "left", "clickCount": clicks}
            opened.ask("Input.dispatchMouseEvent", type=kind, **place)
    np.testing.assert_allclose(views(opened), [[0.0, 9.95]] * len(views(opened)), atol=1e-3)


@pytest.mark.parametrize(
    ("keys", "share"),
    [(["+"], (0.25, 0.75)), (["+", "ArrowLeft"], (0.125, 0.625)), (["+", "-"], (0, 1)), (["+", "0"], (0, 1))],
)
def test_keys(opened, keys, share):
    for key in keys:
        opened.ask("Input.dispatchKeyEvent", type="keyDown", key=key, text=key if len(key) == 1 else "")
    np.testing.assert_allclose(views(opened)[0], [9.95 * share[0], 9.95 * share[1]], atol=0.01)


def test_the_cursor_shows_the_values_of_its_moment(opened, made):
    _, report = made
    left, top, width, _ = box(opened, "[data-key=altitude] .u-over")
    opened.move(left + width * 0.4, top + 40)
    low, high = views(opened)[0]
    moment = opened.value("document.getElementById('moment').textContent")
    time_s = float(moment.split()[0])
    assert time_s == pytest.approx(low + 0.4 * (high - low), abs=0.02)
    assert moment.endswith("· OFFBOARD · armed")
    for panel in report.panels:
        shown = opened.value(
            f"[...document.querySelectorAll('[data-key={panel.key}] .lines i')].map(i => i.textContent)"
        )
        assert len(shown) == len(panel.lines)
        # The page may hold the lines in another order: those of one stream stand together.
        for line in panel.lines:
            value = float(line.values[np.abs(line.times_s - time_s).argmin()])
            assert min(abs(float(text) - value) for text in shown) < 0.02 * max(abs(value), 1.0), (panel.key, line.name)


def test_a_name_hides_its_line(opened):
    left, top, *_ = box(opened, "[data-key=velocity] .lines button")
    place = {"x": left + 20, "y": top + 8, "button": "left", "clickCount": 1}
    for kind in ("mousePressed", "mouseReleased"):
        opened.ask("Input.dispatchMouseEvent", type=kind, **place)
    index = opened.value("[...document.querySelectorAll('.panel')].findIndex(p => p.dataset.key === 'velocity')")
    assert opened.value(f"report.charts[{index + 1}].series.map(s => s.show)")[1:3] == [False, True]


def test_a_text_leads_to_its_moment(opened):
    opened.value("report.setView(0, 1)")
    opened.value("document.querySelectorAll('.texts li')[6].click()")
    opened.settled()
    low, high = views(opened)[0]
    said_s = opened.value("parseFloat(document.querySelectorAll('.texts li')[6].textContent)")
    assert low < said_s < high
    assert opened.value("document.querySelector('.texts li.now').textContent").startswith(f"{said_s:.2f}")


def test_the_path_turns_moves_and_follows_the_view(opened):
    turned, above = picture_of(opened, "turned"), picture_of(opened, "above")
    opened.value("report.setView(2, 3)")
    part = picture_of(opened, "turned"), picture_of(opened, "above")
    assert part[0] != turned and part[1] != above
    left, top, width, height = box(opened, "[data-path=turned] canvas")
    middle = (left + width / 2, top + height / 2)
    opened.drag(middle, (middle[0] + 80, middle[1]))
    aside = picture_of(opened, "turned")
    opened.drag(middle, (middle[0], middle[1] + 30))
    assert len({part[0], aside, picture_of(opened, "turned")}) == 3
    assert picture_of(opened, "above") == part[1]
    opened.value("document.querySelector('[data-path=turned] [data-act=reset]').click()")
    assert picture_of(opened, "turned") == part[0]


@pytest.mark.parametrize(("dark", "brightness"), [(False, range(200, 256)), (True, range(60))])
def test_light_and_dark(tab, made, dark, brightness):
    tab.open(made[0], dark=dark)
    channels = tab.value("getComputedStyle(document.body).backgroundColor.match(/[0-9]+/g).map(Number)")
    assert all(channel in brightness for channel in channels)
    tab.value("document.getElementById('theme').click()")
    after = tab.value("getComputedStyle(document.body).backgroundColor.match(/[0-9]+/g).map(Number)")
    assert all(channel not in brightness for channel in after)


@pytest.mark.parametrize("width", [380, 800, 2500])
def test_it_fits_any_width(tab, made, width):
    tab.open(made[0], width=width)
    assert tab.value("document.documentElement.scrollWidth") <= width
    charts = tab.value("report.charts.map(c => c.root.getBoundingClientRect().right)")
    assert max(charts) <= width


def test_a_hundred_thousand_points_a_line(tab, tmp_path):
    times_s = np.arange(100_000) * 0.01
    lines = tuple(Line(name, times_s, np.sin(times_s * k), name) for k, name in enumerate("xyz", start=1))
    report = Report("many", "", 0, 1000.0, (0.0, 1000.0), (), {}, panels=(Panel("many", "many", "m", lines),))
    (tmp_path / "report.html").write_text(page(report))
    tab.complaints.clear()
    tab.open(tmp_path / "report.html")
    assert int(tab.value("document.documentElement.dataset.points")) == 300_000
    left, top, width, _ = box(tab, ".u-over", 1)
    tab.drag((left + width * 0.5, top + 30), (left + width * 0.51, top + 30))
    np.testing.assert_allclose(views(tab)[1], [500, 510], atol=2.5)
    assert tab.complaints == []


def test_the_page_of_a_flight(tab, flown_run, tmp_path):
    shutil.copy(flown_run / "report.html", tmp_path / "alone.html")  # it needs nothing beside it
    tab.complaints.clear()
    tab.open(tmp_path / "alone.html")
    panels = tab.value("[...document.querySelectorAll('.panel')].map(p => p.dataset.key)")
    assert panels[:5] == ["altitude", "error", "yaw_error", "velocity", "sigma"]
    assert tab.value("document.querySelectorAll('details td').length") > 30
    assert tab.complaints == []
