"""The file with the signing key: who may read it, and what it holds."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from mavquad.drivers.key_file import key_of, read_key
from mavquad.errors import ConfigError
from mavquad.protocol.link import LinkParams
from mavquad.protocol.signing import key_of_passphrase

KEY = key_of_passphrase("a secret")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "signing.key"
    path.touch(mode=0o600)
    path.write_text(KEY.hex() + "\n")
    return path


def test_the_key_is_read(path: Path) -> None:
    assert read_key(path) == KEY
    assert key_of(LinkParams(signing_key_file=str(path))) == KEY
    assert key_of(LinkParams()) is None


@pytest.mark.skipif(os.name != "posix", reason="permissions as Unix has them")
@pytest.mark.parametrize("mode", [0o640, 0o620, 0o604, 0o602, 0o610, 0o777])
def test_a_file_that_others_may_read_or_change_is_refused(path: Path, mode: int) -> None:
    path.chmod(mode)
    with pytest.raises(ConfigError) as caught:
        read_key(path)
    assert "others may read or change it" in caught.value.message
    assert "chmod 600" in caught.value.hint


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", KEY, KEY.hex()[:-1].encode(), b"z" * 64, KEY.hex().encode() * 2])
def test_what_is_no_key_is_refused_without_showing_it(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        read_key(path)
    assert "64 hexadecimal digits" in caught.value.message
    assert KEY.hex()[:16] not in caught.value.message + caught.value.hint


@pytest.mark.parametrize("name", ["missing.key", "."])
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_key(tmp_path / name)
    assert str(tmp_path / name) in caught.value.message
