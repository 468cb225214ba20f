"""Signatures of MAVLink 2 on the vehicle's links."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mavquad.protocol.signing import key_of_hex, key_of_passphrase
from mavquad.schema import Section

SigningMode = Literal["off", "accept", "require"]


class SigningConfig(Section):
    """Signatures of MAVLink 2: what the vehicle asks for, and its key."""

    mode: SigningMode = "off"
    """"off": signatures are not looked at. "accept": wrong ones are rejected, unsigned frames are taken, and who signs gets
    signed answers. "require": only what is rightly signed is taken (and RADIO_STATUS), and all answers are signed."""
    passphrase: str = ""
    """The key, as MAVProxy and QGroundControl take it: a passphrase, whose SHA-256 it is; or give key_file."""
    key_file: str = ""
    """A file with the key as 64 hexadecimal digits."""
    link_id: Annotated[int, Field(ge=0, le=255)] = 0
    """Link id in the signatures of the first port; each further port has the next one."""

    @model_validator(mode="after")
    def _has_a_key(self) -> Self:
        if self.passphrase and self.key_file:
            raise ValueError("passphrase and key_file exclude each other")
        if self.mode != "off" and not (self.passphrase or self.key_file):
            raise ValueError(f'mode "{self.mode}" wants a passphrase or a key_file')
        if self.key_file:
            self.key()
        return self

    def key(self) -> bytes:
        """The key, 32 bytes.

        Raises:
            ValueError: the file cannot be read, or holds no key.
        """
        if not self.key_file:
            return key_of_passphrase(self.passphrase)
        try:
            text = Path(self.key_file).read_text(encoding="ascii")
        except OSError as error:
            raise ValueError(f"{self.key_file}: {error.strerror or error}") from None
        except UnicodeDecodeError:
            text = ""
        try:
            return key_of_hex(text.strip())
        except ValueError as error:
            raise ValueError(f"{self.key_file}: {error}") from None
