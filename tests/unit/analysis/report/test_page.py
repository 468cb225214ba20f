"""The page is one file that asks for nothing and runs nothing but its own script, whatever a log says."""

import base64
import hashlib
import html
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from mavquad.analysis.report.model import Line, Mark, Panel, Report
from mavquad.analysis.report.page import page

EVIL = "</script><script>evil()</script><img src=x onerror=evil()>&lt;\u2028 'quoted\""


def report(text="", rows=3):
    times_s = np.arange(rows) * 0.01
    return Report(
        title=f"title {text}",
        subtitle=f"subtitle {text}",
        start_us=0,
        duration_s=10.0,
        view_s=(0.0, 10.0),
        facts=((f"fact {text}", text),),
        summary={text: text},
        table=((text, text),),
        panels=(Panel("k", f"panel {text}", text, (Line(text, times_s, np.sin(times_s), "x"),)),),
        marks=(Mark(1.0, "vehicle", text, 1),),
        remarks=(text,),
        config_text=text,
    )


class Elements(HTMLParser):
    """Names and attributes of all elements, and what stands in scripts."""

    def __init__(self, text):
        super().__init__()
        self.found, self.scripts, self.in_script = [], [], False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self.in_script = tag == "script"

    def handle_data(self, data):
        if self.in_script:
            self.scripts.append(data)

    def handle_endtag(self, tag):
        self.in_script = False


def test_texts_stay_texts():
    plain, evil = Elements(page(report("plain"))), Elements(page(report(EVIL)))
    assert [tag for tag, _ in evil.found] == [tag for tag, _ in plain.found]
    assert json.loads(evil.scripts[0])["marks"][0][2] == EVIL
    assert evil.scripts[1:] == plain.scripts[1:]
    assert not set("<>&\u2028") & set(evil.scripts[0])


def test_nothing_is_asked_for():
    elements = Elements(page(report("plain")))
    assert len(elements.found) > 30
    for _, attributes in elements.found:
        assert not {"src", "srcset", "action", "data"} & set(attributes)
        assert attributes.get("href", "data:,") == "data:,"
        assert not [name for name in attributes if name.startswith("on")]
    style = re.search(r"<style>(.*?)</style>", page(report()), re.S)[1]
    assert "url(" not in style and "@import" not in style


def test_only_its_own_script_may_run():
    elements = Elements(page(report(EVIL)))
    policies = [a["content"] for tag, a in elements.found if a.get("http-equiv") == "Content-Security-Policy"]
    digest = base64.b64encode(hashlib.sha256(elements.scripts[1].encode()).digest()).decode()
    [policy] = policies
    assert "default-src 'none'" in policy
    assert f"script-src 'sha256-{digest}'" in policy
    assert len(elements.scripts) == 2


def test_the_licence_of_what_it_brings_along_is_in_it():
    text = html.unescape(page(report()))
    assert "Copyright (c) 2022 Leon Sorokin" in text
    assert "The above copyright notice and this permission notice shall be included" in text


@pytest.mark.parametrize("rows", [10, 2_000_000])
def test_it_stays_below_5_mb(rows):
    assert len(page(report("x", rows)).encode()) < 5_000_000


def test_the_same_report_is_the_same_bytes():
    assert page(report("a")) == page(report("a"))


def test_a_summary_of_anything_is_shown():
    made = report()
    table = (("a", None), ("b", True), ("c", 1.23456789), ("d", [1, 2]), ("e", "<i>"), ("f", float("nan")))
    text = page(Report(**{name: getattr(made, name) for name in made.__slots__ if name != "table"}, table=table))
    for words in (">–<", ">yes<", ">1.23457<", ">1, 2<", ">&lt;i&gt;<", ">nan<"):
        assert words in text
