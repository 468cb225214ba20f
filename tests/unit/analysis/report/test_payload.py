"""The page's numbers read back as they were, within the budget of bytes; too much is told, not dropped in silence."""

import base64
import json

import numpy as np
import pytest

from mavquad.analysis.report.model import Lane, Line, Mark, Panel, Report, Span, Track
from mavquad.analysis.report.payload import MARKS, payload


def report(**parts):
    return Report("t", "s", 0, 100.0, (0.0, 100.0), (), {}, **parts)


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def panel(*lines):
    return Panel("key", "title", "unit", lines)


def test_lines_of_the_same_times_share_them_and_read_back():
    times_s = np.array([0.0, 0.25, 1.0])
    first, second = np.array([1.0, -2.5, np.nan]), np.array([1e-9, 3e38, 7.0])
    other_s = np.array([0.5, 0.75])
    lines = (Line("a", times_s, first, "x"), Line("b", times_s, second, "y"), Line("c", other_s, other_s, "z"))
    found = payload(report(panels=(panel(*lines),)))
    assert [(line["table"], line["column"]) for line in found["panels"][0]["lines"]] == [(0, 0), (0, 1), (1, 0)]
    table = found["tables"][0]
    assert numbers(table["times"], "<f8").tolist() == [0.0, 0.25, 1.0]
    np.testing.assert_array_equal(numbers(table["columns"][0], "<f4"), first.astype("f4"))
    np.testing.assert_array_equal(numbers(table["columns"][1], "<f4"), second.astype("f4"))


@pytest.mark.parametrize("budget", [20_000, 300_000])
def test_too_much_is_thinned_into_the_budget_and_said(budget):
    times_s = np.arange(100_000) * 0.001
    lines = [Line(str(k), times_s, np.sin(times_s * k), "x") for k in range(1, 7)]
    short_s = np.arange(50) * 2.0
    short = Line("short", short_s, short_s, "y")
    found = payload(report(panels=(panel(*lines, short),)), budget)
    size = sum(len(table["times"]) + sum(map(len, table["columns"])) for table in found["tables"])
    assert budget * 0.8 < size <= budget * 1.02
    assert len(numbers(found["tables"][1]["times"], "<f8")) == 50
    [remark] = found["remarks"]
    assert "100000" in remark and "columns" in remark


def test_what_fits_is_whole_and_nothing_is_said():
    times_s = np.arange(1000.0)
    found = payload(report(panels=(panel(Line("a", times_s, times_s, "x")),)))
    assert len(numbers(found["tables"][0]["times"], "<f8")) == 1000
    assert found["remarks"] == []


def test_a_path_is_not_thinned_by_its_extremes():
    times_s = np.linspace(0, 100, 60_000)
    points = np.stack((np.cos(times_s * 700), np.sin(times_s * 700), times_s * 0), axis=1)
    found = payload(report(tracks=(Track("p", times_s, points, "blue"),)))
    north, east = (numbers(column, "<f4") for column in found["tables"][0]["columns"][:2])
    assert len(north) == 20_000
    assert np.allclose(np.hypot(north, east), 1.0, atol=1e-5)


def test_of_too_many_texts_the_gravest_stay():
    chatter = [Mark(float(k), "vehicle", "chatter", 6) for k in range(MARKS)]
    grave = [Mark(k + 0.5, "vehicle", "crash", 1) for k in range(10)]
    found = payload(report(marks=(*chatter, *grave)))
    assert len(found["marks"]) == MARKS
    assert sum(text == "crash" for _, _, text, _ in found["marks"]) == 10
    times_s = [time_s for time_s, *_ in found["marks"]]
    assert times_s == sorted(times_s)
    assert "10 texts are left out" in found["remarks"][0]


def test_a_limit_that_flickers_is_few_spans():
    spans = tuple(Span(k * 0.01, k * 0.01 + 0.005, "") for k in range(10_000))
    [lane] = payload(report(lanes=(Lane("tilt", spans, True),)))["lanes"]
    assert len(lane["spans"]) < 50
    assert (lane["spans"][0][0], lane["spans"][-1][1]) == (0.0, 99.995)


def test_what_float32_cannot_hold_is_no_error():
    times_s = np.array([0.0, 1.0])
    found = payload(report(panels=(panel(Line("a", times_s, np.array([1e300, -1e300]), "x")),)))
    json.dumps(found, allow_nan=False)
    assert np.isinf(numbers(found["tables"][0]["columns"][0], "<f4")).all()
