"""The key of MAVLink 2 signing, out of its file: nobody else may read it, and it goes nowhere but into the link."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from mavquad.errors import ConfigError
from mavquad.protocol.link import LinkParams
from mavquad.protocol.signing import key_of_hex

_KEY = "link.signing_key_file"
_HINT = "of a passphrase: (umask 077; printf %s 'PASSPHRASE' | sha256sum | cut -c1-64 > KEYFILE)"


def key_of(link: LinkParams) -> bytes | None:
    """The key of a link; None where nothing is signed.

    Raises:
        ConfigError: the file cannot be read, others may read it, or it holds no key. Its contents are not shown.
    """
    return read_key(Path(link.signing_key_file)) if link.signing_key_file else None


def read_key(path: Path) -> bytes:
    """The 32 bytes that a file holds as 64 hexadecimal digits. See `key_of`."""
    try:
        with path.open("rb") as stream:
            mode = os.fstat(stream.fileno()).st_mode
            text = stream.read(1000)
    except OSError as error:
        raise ConfigError(_KEY, "", f"{path}: {(error.strerror or str(error)).lower()}", _HINT) from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        reason = f"{path}: others may read or change it (mode {stat.S_IMODE(mode):o})"
        raise ConfigError(_KEY, "", reason, f"chmod 600 {path}, and make a new key if anybody has seen it")
    try:
        return key_of_hex(text.decode("ascii").strip())
    except (UnicodeDecodeError, ValueError):
        raise ConfigError(_KEY, "", f"{path}: holds no key: 64 hexadecimal digits", _HINT) from None
