"""Sections: strict, frozen, no unknown keys; messages that name the key and what is allowed."""

from __future__ import annotations

import math

import pytest
from pydantic import Field, ValidationError

from mavquad.errors import ConfigError
from mavquad.schema import Section, parse_section


class Inner(Section):
    gain: float = Field(default=1.0, gt=0.0, le=10.0)
    pair: tuple[float, float] = (1.0, 2.0)


class Outer(Section):
    inner: Inner = Inner()
    name: str = "x"
    count: int = Field(default=1, ge=0)


def refused(table, prefix=""):
    with pytest.raises(ConfigError) as caught:
        parse_section(Outer, table, "file.toml", prefix)
    assert caught.value.path == "file.toml"
    return caught.value


def test_nothing_given_is_the_default():
    assert parse_section(Outer, {}, "file.toml") == Outer()


def test_values_are_taken():
    outer = parse_section(Outer, {"inner": {"gain": 2, "pair": [3, 4]}, "count": 5}, "file.toml")
    assert (outer.inner.gain, outer.inner.pair, outer.count) == (2.0, (3.0, 4.0), 5)


def test_an_unknown_key_is_named_in_full_with_what_is_allowed():
    error = refused({"inner": {"gian": 1.0}})
    assert error.key == "inner.gian"
    assert "unknown key" in error.reason
    assert "gain, pair" in error.reason + error.hint


def test_an_unknown_key_at_the_top():
    error = refused({"inners": {}})
    assert error.key == "inners"
    assert "count, inner, name" in error.reason + error.hint


def test_the_place_of_the_table_in_its_file():
    assert refused({"inner": {"gain": 0.0}}, "mock").key == "mock.inner.gain"


@pytest.mark.parametrize(
    ("table", "key", "words"),
    [
        ({"inner": {"gain": 0.0}}, "inner.gain", "greater than 0 (given: 0.0)"),
        ({"inner": {"gain": 11.0}}, "inner.gain", "less than or equal to 10 (given: 11.0)"),
        ({"inner": {"gain": "2"}}, "inner.gain", "valid number (given: '2')"),
        ({"inner": {"gain": True}}, "inner.gain", "valid number"),
        ({"inner": {"gain": math.nan}}, "inner.gain", "finite number"),
        ({"inner": {"gain": math.inf}}, "inner.gain", "finite number"),
        ({"inner": {"pair": [1.0]}}, "inner.pair.1", "required"),
        ({"inner": {"pair": [1.0, "a"]}}, "inner.pair.1", "valid number"),
        ({"inner": 5}, "inner", ""),
        ({"count": 1.5}, "count", "valid integer"),
        ({"count": -1}, "count", "greater than or equal to 0"),
        ({"name": 5}, "name", "valid string"),
    ],
)
def test_wrong_values(table, key, words):
    error = refused(table)
    assert error.key == key
    assert words in error.reason
    assert error.message.startswith(f"file.toml: {key}: ")


def test_sections_are_frozen():
    with pytest.raises(ValidationError, match="frozen"):
        Outer().count = 2
