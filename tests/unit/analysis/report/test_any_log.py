"""Whatever the messages of a log hold, there is a page of it."""

import json
import math

from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.analysis.report.of_log import read_log, report_of_log
from mavquad.analysis.report.of_run import MESSAGES
from mavquad.analysis.report.page import page
from mavquad.analysis.report.payload import payload
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.tlog import pack_record

KINDS = {kind.msgname: kind for kind in mavlink.mavlink_map.values()}
NAMES = [name for name in MESSAGES if name in KINDS]
BITS = {
    "uint8_t": 8,
    "uint16_t": 16,
    "uint32_t": 32,
    "uint64_t": 64,
    "int8_t": 7,
    "int16_t": 15,
    "int32_t": 31,
    "int64_t": 63,
}
FLOATS = st.floats(width=32) | st.sampled_from([0.0, 1.0, -1.0, math.nan, math.inf])


def values(kind: str, length: int):
    if kind == "char":
        return st.binary(max_size=length)
    low = 0 if kind.startswith("u") else -(2 ** BITS.get(kind, 0))
    one = FLOATS if kind == "float" else st.integers(low, 2 ** BITS[kind] - 1) | st.integers(0, 20)
    return st.lists(one, min_size=length, max_size=length) if length else one


@st.composite
def messages(draw):
    kind = KINDS[draw(st.sampled_from(NAMES))]
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return kind(**{name: draw(values(types[name], lengths[name])) for name in kind.fieldnames})


records = st.lists(
    st.tuples(
        messages(),
        st.integers(0, 2**51).map(lambda us: us // 4 * 4)
        | st.integers(0, 10_000).map(lambda ms: 1_600_000_000_000_000 + ms * 1000),
        st.sampled_from([(1, 1), (2, 1), (255, 190)]),
    ),
    min_size=1,
    max_size=30,
)


@settings(max_examples=60)
@given(records)
def test_any_messages_at_any_time_make_a_page(tmp_path_factory, given_records):
    path = tmp_path_factory.getbasetemp() / "any.tlog"
    encoders = {}
    data = b""
    for message, stamp_us, sender in given_records:
        encoder = encoders.setdefault(sender, Encoder(*sender))
        data += pack_record(stamp_us, encoder.encode(message), outbound=sender[0] == 255)
    path.write_bytes(data)
    report = report_of_log(read_log(path))
    json.dumps(report.summary, allow_nan=False)
    json.dumps(payload(report), allow_nan=False)
    low_s, high_s = report.view_s
    assert 0 <= low_s < high_s <= report.duration_s
    assert page(report).endswith("</html>\n")
