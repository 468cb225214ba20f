"""How the fields of a message lie in its payload, as functions written for each kind of message.

pymavlink's message classes say all that is needed (struct format, order on the wire, lengths of arrays, text fields).
pymavlink itself reads them anew for every message, field by field; here they are read once, the first time that a kind is
met, and written out as straight code: one call of struct and one assignment a field. Our messages are of subclasses of
pymavlink's that work out what goes beyond the fields (header, CRC, bytes) when it is asked for: hardly anybody asks.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, NamedTuple

from mavquad.protocol.codec.dialect import Message, pymavlink
from mavquad.protocol.codec.frame import (
    HEADER_V1,
    MAGIC_V1,
    SIGNATURE_LENGTH,
    frame_sequence,
    frame_source,
    is_signed,
)


class Layout(NamedTuple):
    """One kind of message."""

    number: int
    crc_extra: bytes
    size: int
    """Of the whole payload."""
    base_size: int
    """Of the payload without extension fields: all that MAVLink 1 knows."""
    pack: Callable[[Message], bytes]
    """The whole payload of a message."""
    unpack: Callable[[bytes, bytes, int], Message]
    """(frame, buffer, at): the message of a frame, its whole payload being in this buffer from there on."""
    kind: type[Message]
    """The class of our messages."""


class Light:
    """What a message knows beside its fields. The methods are pymavlink's own, from its class for this kind of message."""

    _frame: bytes | None = None
    """What it was decoded from."""
    _signed = False
    _link_id = None
    _instances = None

    @cached_property
    def _header(self) -> Any:
        frame = self._frame
        if frame is None:
            return pymavlink.MAVLink_header(self.get_msgId())
        system_id, component_id = frame_source(frame)
        flags = (0, 0) if frame[0] == MAGIC_V1 else (frame[2], frame[3])
        return pymavlink.MAVLink_header(
            self.get_msgId(), *flags, frame[1], frame_sequence(frame), system_id, component_id
        )

    @cached_property
    def _msgbuf(self) -> bytearray:
        return bytearray(self._frame or b"")

    @cached_property
    def _payload(self) -> bytearray | None:
        """As pymavlink cuts it: from the end of a version 1 header on, whatever the version."""
        return None if self._frame is None else bytearray(self._frame[HEADER_V1 : _crc_at(self._frame)])

    @cached_property
    def _crc(self) -> int | None:
        if self._frame is None:
            return None
        return int.from_bytes(self._frame[_crc_at(self._frame) :][:2], "little")

    def get_msgId(self) -> int:  # noqa: N802 - pymavlink's name
        """The message id; not `self.id`, which some messages have as a field."""
        return int(type(self).id)  # type: ignore[attr-defined]


def _crc_at(frame: bytes) -> int:
    return len(frame) - 2 - (SIGNATURE_LENGTH if is_signed(frame) else 0)


def layout_of(kind: type[Message]) -> Layout:
    """Read one of pymavlink's message classes."""
    light = type(
        kind.__name__,
        (Light, kind),
        {
            "__module__": kind.__module__,
            "__doc__": kind.__doc__,
            "__init__": _written_out(_constructor(kind), "__init__", {}),
            "_fieldnames": kind.fieldnames,
            "_type": kind.msgname,
            "_instance_field": kind.instance_field,
            "_instance_offset": kind.instance_offset,
        },
    )
    return Layout(
        number=kind.id,
        crc_extra=bytes((kind.crc_extra,)),
        size=kind.unpacker.size,
        base_size=_base_size(kind),
        pack=_written_out(_packing(kind), "pack", {"bound": kind.unpacker.pack}),
        unpack=_written_out(
            _unpacking(kind), "unpack", {"bound": kind.unpacker.unpack_from, "new": light.__new__, "kind": light}
        ),
        kind=light,
    )


def _fields(kind: type[Message]) -> Iterator[tuple[str, int, bool]]:
    """Name, length (0: no array) and whether it is a text, in the order on the wire."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    for name, length, text_length in zip(kind.ordered_fieldnames, kind.lengths, kind.array_lengths, strict=True):
        is_text = types[name] == "char"
        yield name, 0 if is_text or not text_length else length, is_text


def _base_size(kind: type[Message]) -> int:
    """Extension fields are the last ones on the wire; pymavlink's constructors have defaults for them alone."""
    extensions = len(kind.__init__.__defaults__ or ())
    tokens = re.findall(r"\d*[a-zA-Z]", kind.unpacker.format)
    return struct.calcsize("<" + "".join(tokens[: len(tokens) - extensions]))


_SHOWN = "raw.split(b'\\0', 1)[0].decode('ascii', errors='replace')"
"""A text as pymavlink shows it: what follows a zero is not there."""


def _constructor(kind: type[Message]) -> list[str]:
    """As pymavlink's, with its defaults."""
    defaults = kind.__init__.__defaults__ or ()
    given = [f"={default!r}" for default in defaults]
    marks = [""] * (len(kind.fieldnames) - len(given)) + given
    lines = [f"def __init__(self, {', '.join(map(str.__add__, kind.fieldnames, marks))}):"]
    texts = {name for name, _, is_text in _fields(kind) if is_text}
    for name in kind.fieldnames:
        if name in texts:
            lines += [f"    self._{name}_raw = raw = {name}", f"    self.{name} = {_SHOWN}"]
        else:
            lines.append(f"    self.{name} = {name}")
    return lines


def _packing(kind: type[Message]) -> list[str]:
    values = [
        f"m._{name}_raw" if is_text else f"*m.{name}[:{length}]" if length else f"m.{name}"
        for name, length, is_text in _fields(kind)
    ]
    return ["def pack(m):", f"    return bound({', '.join(values)})"]


def _unpacking(kind: type[Message]) -> list[str]:
    """As pymavlink's parser and constructors: texts lose their zeros at the end, and what follows a zero is not shown."""
    places: list[str] = []
    lines: list[str] = []
    for name, length, is_text in _fields(kind):
        if is_text:
            places.append(f"{name}_raw")
            lines += [f"    m._{name}_raw = raw = {name}_raw.rstrip(b'\\0')", f"    m.{name} = {_SHOWN}"]
        elif length:
            parts = [f"{name}_{i}" for i in range(length)]
            places += parts
            lines.append(f"    m.{name} = [{', '.join(parts)}]")
        else:
            places.append(f"m.{name}")
    head = ["def unpack(frame, buffer, at):", "    m = new(kind)", "    m._frame = frame"]
    return [*head, f"    {', '.join(places)}, = bound(buffer, at)", *lines, "    return m"]


def _written_out(lines: list[str], name: str, scope: dict[str, Any]) -> Callable[..., Any]:
    exec("\n".join(lines), scope)
    written: Callable[..., Any] = scope[name]
    return written


class _ByNumber(dict[int, Layout | None]):
    """By message id; None for one that the dialect does not know."""

    def __missing__(self, number: int) -> Layout | None:
        kind = pymavlink.mavlink_map.get(number)
        found = self[number] = None if kind is None else layout_of(kind)
        return found


class _ByKind(dict[type[Message], Layout]):
    """By the class of a message, pymavlink's own or one of a decoded message."""

    def __missing__(self, kind: type[Message]) -> Layout:
        found = BY_NUMBER[kind.id]
        assert found is not None
        self[kind] = found
        return found


BY_NUMBER = _ByNumber()
BY_KIND = _ByKind()


class Dialect:
    """All that pymavlink's dialect has, with our messages in place of its own."""

    def __getattr__(self, name: str) -> Any:
        found: Any = getattr(pymavlink, name)
        if getattr(found, "id", None) in pymavlink.mavlink_map:
            found = BY_KIND[found].kind
        setattr(self, name, found)
        return found


mavlink: Any = Dialect()
