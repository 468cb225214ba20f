"""Who is at the other end: one vehicle is found, then locked; what others send is counted and ignored."""

from __future__ import annotations

from collections import Counter

from pydantic import Field, field_validator

from mavquad.errors import EndpointError
from mavquad.protocol.codec import Encoder, Message, decode, frame_source, frame_version, mavlink, message_id
from mavquad.protocol.frame_order import FrameOrder, OutOfOrder
from mavquad.protocol.signing import Fault, Signing
from mavquad.schema import Section
from mavquad.url import MOCK, parse_url, speaks_first

HEARTBEAT_ID = 0
_NOT_A_VEHICLE = frozenset(
    (
        mavlink.MAV_TYPE_GCS,
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
        mavlink.MAV_TYPE_GIMBAL,
        mavlink.MAV_TYPE_ADSB,
        mavlink.MAV_TYPE_CAMERA,
        mavlink.MAV_TYPE_BATTERY,
        mavlink.MAV_TYPE_LOG,
    )
)


class LinkParams(Section):
    """The connection, and who we are on it."""

    url: str = "mock"
    """Where the vehicle is: "mock" starts the bundled one; else udpin:HOST:PORT (listen; udp: is the same),
    udpout:HOST:PORT (speak first), tcp:HOST:PORT, tcpin:HOST:PORT (be the server), /dev/ttyACM0,57600 or COM3,57600."""
    system_id: int = Field(default=245, ge=1, le=255)
    """Our own system id; 255 is what ground stations use."""
    component_id: int = Field(default=190, ge=1, le=255)
    """Our own component id. PX4 1.16 explains a refused mode change only to 190."""
    target_system: int = Field(default=0, ge=0, le=255)
    """The vehicle's system id; 0 takes the first autopilot heard and locks on it."""
    heartbeat_timeout_s: float = Field(default=3.5, gt=1.0, le=60.0)
    """The vehicle is lost when nothing of it was heard for this long."""
    signing_key_file: str = ""
    """A file with a key of MAVLink 2 signing, 64 hexadecimal digits, that nobody else may read (chmod 600). With it all
    that we send is signed, and what is not rightly signed is not taken. It is read at the start and kept nowhere."""
    signing_link_id: int = Field(default=0, ge=0, le=255)
    """Link id in our signatures: another one for each program that signs with this key."""

    @field_validator("url")
    @classmethod
    def _readable(cls, url: str) -> str:
        if url != MOCK:
            try:
                parse_url(url)
            except EndpointError as error:
                raise ValueError(f"{error.reason}; {error.hint}") from None
        return url

    @property
    def speaks_first(self) -> bool:
        """Whether we must send before we can be answered."""
        return speaks_first(self.url)


class Link:
    """Our end of the link: locks on one autopilot and lets only its frames pass; packs, and signs, what we send.

    Some frames that say they are the vehicle's are not: one of MAVLink 1 once the vehicle has spoken MAVLink 2 (it does
    not go back), and a HEARTBEAT of another type or autopilot. Forgers of both kinds were seen. A forger who does better
    can only be told by signatures: with a key, what is not rightly signed is not taken. Frames that come twice, and
    HEARTBEATs that come after a later one, are not taken either (`mavquad.protocol.frame_order`).

    Attributes:
        vehicle: (system id, component id) once locked.
        foreign: frames of anybody else since then.
        forged: frames that bear the vehicle's name and are not its own.
        out_of_order: frames of the vehicle not taken, by what was wrong with their order.
        rejected: frames not taken, by what was wrong with their signature.
        last_heard_us: when the vehicle was last heard.
    """

    def __init__(self, params: LinkParams, key: bytes | None = None) -> None:
        self._params = params
        self._encoder = Encoder(params.system_id, params.component_id)
        self._signing = None if key is None else Signing(key, params.signing_link_id)
        self._kind = (0, 0)
        self._is_v2 = False
        self._order = FrameOrder()
        self.vehicle: tuple[int, int] | None = None
        self.foreign = 0
        self.forged = 0
        self.out_of_order: Counter[OutOfOrder] = Counter()
        self.rejected: Counter[Fault] = Counter()
        self.last_heard_us = 0

    def encode(self, message: Message, now_us: int) -> bytes:
        """A message of ours as one frame, signed if there is a key."""
        if self._signing is None:
            return self._encoder.encode(message)
        return self._signing.sign(self._encoder.encode(message, signed=True), now_us)

    def accept(self, frame: bytes, now_us: int) -> bool:
        """Whether a frame is the vehicle's; the first autopilot heard becomes the vehicle."""
        if self._signing is not None and (fault := self._signing.check(frame, now_us)) is not None:
            self.rejected[fault] += 1
            return False
        source = frame_source(frame)
        if self.vehicle is None and message_id(frame) == HEARTBEAT_ID:
            self._try_lock(source, decode(frame))
        if source != self.vehicle:
            self.foreign += self.vehicle is not None
            return False
        if self._is_forged(frame):
            self.forged += 1
            return False
        if (disorder := self._order.fault(frame, message_id(frame) == HEARTBEAT_ID, now_us)) is not None:
            self.out_of_order[disorder] += 1
            return False
        self.last_heard_us = now_us
        return True

    def _try_lock(self, source: tuple[int, int], heartbeat: Message) -> None:
        wanted = self._params.target_system
        is_vehicle = heartbeat.autopilot != mavlink.MAV_AUTOPILOT_INVALID and heartbeat.type not in _NOT_A_VEHICLE
        ours = (self._params.system_id, self._params.component_id)
        if is_vehicle and wanted in (0, source[0]) and source != ours:
            self.vehicle = source
            self._kind = (heartbeat.type, heartbeat.autopilot)

    def _is_forged(self, frame: bytes) -> bool:
        if frame_version(frame) == 2:
            self._is_v2 = True
        elif self._is_v2:
            return True
        if message_id(frame) != HEARTBEAT_ID:
            return False
        heartbeat = decode(frame)
        return (heartbeat.type, heartbeat.autopilot) != self._kind


def heartbeat() -> Message:
    """Our own HEARTBEAT. As a ground station: PX4 sends STATUSTEXT only while it hears one."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )
