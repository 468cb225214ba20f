"""Logs, and what may happen to them: torn, cut, doubled, flipped, mixed, without stamps."""

from __future__ import annotations

import random

from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.tlog import pack_record

T0_US = 1_700_000_000_000_000
TEXTS = (b"", b"FD\xfd\xfe", b"a" * 50)


def unknown_frame(draw: random.Random) -> bytes:
    """A message that the dialect does not know."""
    payload = draw.randbytes(draw.randrange(1, 40))
    return bytes((0xFD, len(payload), 0, 0, draw.randrange(256), 1, 1, 0xEF, 0xCD, 0xAB)) + payload + b"\x11\x22"


def known_frame(draw: random.Random) -> bytes:
    """Of MAVLink 1 or 2, signed or not, of one of some senders, often with zeros at the end."""
    sender = dialect.MAVLink(None, srcSystem=draw.randrange(1, 4), srcComponent=1)
    sender.seq = draw.randrange(256)
    kind = draw.randrange(3)
    if kind == 2:
        sender.signing.secret_key = bytes(32)
        sender.signing.sign_outgoing = True
        sender.signing.timestamp = draw.randrange(2**40)
    floats = [draw.choice([0.0, -1.5, draw.uniform(-9, 9)]) for _ in range(6)]
    message = draw.choice(
        [
            dialect.MAVLink_attitude_message(draw.randrange(2**32), *floats),
            dialect.MAVLink_local_position_ned_message(draw.randrange(2**32), *floats),
            dialect.MAVLink_heartbeat_message(2, 12, draw.choice([0, 128]), 4 << 16, 4, 3),
            dialect.MAVLink_statustext_message(6, draw.choice(TEXTS)),
            dialect.MAVLink_ping_message(draw.randrange(2**62), 1, 0, 0),
        ]
    )
    return bytes(message.pack(sender, force_mavlink1=kind == 0))


def log(draw: random.Random, records: int) -> list[bytes]:
    """Records, mostly of known messages and with growing stamps."""
    stamp_us, parts = T0_US, []
    has_stamps = draw.random() < 0.8
    for _ in range(records):
        stamp_us += draw.choice([0, 4000, 4000, 4000, -8000, 3 * 86_400_000_000, 365 * 86_400_000_000])
        frame = unknown_frame(draw) if draw.random() < 0.15 else known_frame(draw)
        parts.append(pack_record(stamp_us, frame, draw.random() < 0.2) if has_stamps else frame)
    return parts


def mutated(draw: random.Random, parts: list[bytes]) -> bytes:
    """With some damage."""
    parts = list(parts)
    for _ in range(draw.choice([0, 0, 1, 2, 5])):
        index = draw.randrange(len(parts) + 1)
        parts.insert(index, draw.randbytes(draw.randrange(12)))
    data = bytearray(b"".join(parts))
    for _ in range(draw.choice([0, 0, 1, 3, 10])):
        if data:
            at = draw.randrange(len(data))
            action = draw.randrange(5)
            if action == 0:
                data[at] ^= 1 << draw.randrange(8)
            elif action == 1:
                data[at] = draw.choice([0xFD, 0xFE])
            elif action == 2:
                del data[at : at + draw.randrange(60)]
            elif action == 3:
                data[at:at] = data[at : at + draw.randrange(80)]
            else:
                data[at:at] = bytes(draw.randrange(40))
    return bytes(data)


def pieces_of(draw: random.Random, data: bytes) -> list[bytes]:
    """Cut anywhere."""
    cuts = sorted(draw.randrange(len(data) + 1) for _ in range(draw.choice([0, 1, 3, 20])))
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


def tunnel(inner: bytes) -> bytes:
    """A frame whose payload is another frame."""
    message = dialect.MAVLink_tunnel_message(1, 1, 0, len(inner), [*inner, *bytes(128 - len(inner))])
    return bytes(message.pack(dialect.MAVLink(None, srcSystem=1, srcComponent=1)))
