"""The report as one HTML page that needs nothing else: no network, no other file; its script, its style and its numbers in it.

What a log says is text to this page and never markup: the numbers and texts stand in a JSON element in which no "<" is
left, the rest is escaped, and a content security policy lets only the page's own script run, by its hash.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any

from mavquad import __version__
from mavquad.analysis.report.model import Report
from mavquad.analysis.report.payload import DATA_BYTES, payload

_PLACEHOLDER = re.compile(r"%%([A-Z]+)%%")
_CONFIG_LENGTH = 100_000
_SUMMARY_ROWS = 400
_LONG_FACT = 18


def page(report: Report, data_bytes: int = DATA_BYTES) -> str:
    """The whole page. Deterministic: the same report gives the same bytes."""
    parts = {
        "TITLE": html.escape(report.title),
        "SUBTITLE": html.escape(report.subtitle),
        "POLICY": html.escape(_policy()),
        "STYLE": _asset("uPlot.min.css") + _asset("page.css"),
        "FACTS": _facts(report),
        "DETAILS": "".join(_details(report)),
        "FOOTER": _footer(),
        "DATA": _json(payload(report, data_bytes)),
        "SCRIPT": _script(),
    }
    return _PLACEHOLDER.sub(lambda found: parts[found[1]], _asset("page.html"))


@cache
def _asset(name: str) -> str:
    return (files("mavquad.analysis.report") / "assets" / name).read_text(encoding="utf-8")


@cache
def _script() -> str:
    return "\n".join(map(_asset, ("uPlot.iife.min.js", "paths.js", "page.js")))


@cache
def _policy() -> str:
    """Nothing is loaded from anywhere, and no script runs but this page's own."""
    digest = base64.b64encode(hashlib.sha256(_script().encode()).digest()).decode()
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"


def _json(value: Any) -> str:
    """JSON that no HTML parser sees an end of the element in; a number that is not finite would be our own fault."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _facts(report: Report) -> str:
    if not report.facts:
        return ""
    cells = (
        f"<div><dt>{html.escape(name)}</dt><dd{_long(value)}>{html.escape(value)}</dd></div>"
        for name, value in report.facts
    )
    return f'<dl class="facts">{"".join(cells)}</dl>'


def _long(value: str) -> str:
    return ' class="long"' if len(value) > _LONG_FACT else ""


def _details(report: Report) -> Iterator[str]:
    rows = report.table
    if rows:
        cells = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(_shown(value))}</td></tr>"
            for name, value in rows[:_SUMMARY_ROWS]
        )
        rest = f"<p>and {len(rows) - _SUMMARY_ROWS} more in summary.json</p>" if len(rows) > _SUMMARY_ROWS else ""
        table = f'<div class="columns"><table><tbody>{cells}</tbody></table></div>{rest}'
        yield f'<details class="card" open><summary>Summary</summary>{table}</details>'
    if report.config_text:
        text = html.escape(report.config_text[:_CONFIG_LENGTH])
        yield f'<details class="card"><summary>Configuration</summary><pre>{text}</pre></details>'


def _shown(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return ", ".join(map(_shown, value))
    return str(value)


def _footer() -> str:
    licence = html.escape(_asset("uPlot.LICENSE.txt"))
    return (
        f"mavquad {html.escape(__version__)}. This page is complete in itself and loads nothing. "
        "Charts by uPlot (MIT)."
        f"<details><summary>Licence of uPlot</summary><pre>{licence}</pre></details>"
    )
