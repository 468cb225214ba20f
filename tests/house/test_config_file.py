"""The configuration that comes with the package is complete, commented, and says the defaults."""

import itertools
import json
import tomllib

from mavquad.config import Config, default_path, load
from sitl_mock.config import MockConfig

TEXT = default_path().read_text()


def keys(table: dict[str, object], prefix: str = "") -> set[str]:
    found: set[str] = set()
    for key, value in table.items():
        found |= keys(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}"}
    return found


def test_it_has_every_key_with_its_default_value() -> None:
    complete = {**Config().model_dump(mode="json"), "mock": MockConfig().model_dump(mode="json")}
    assert keys(tomllib.loads(TEXT)) == keys(complete)
    loaded = load(default_path())
    assert loaded.model_dump(exclude={"mock"}) == Config().model_dump(exclude={"mock"})
    assert MockConfig.model_validate_json(json.dumps(loaded.mock)) == MockConfig()


def test_every_key_and_table_has_a_comment_above_it() -> None:
    lines = TEXT.splitlines()
    for above, line in itertools.pairwise(lines):
        if line and not line.startswith("#"):
            assert above.startswith(("#", "[")), line
