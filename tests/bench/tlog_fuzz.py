"""Fuzzes the log reader: `python tests/bench/tlog_fuzz.py [--seconds N] [--seed N]`, or `--atheris` if that is installed.

Random logs, torn, cut, doubled, with other bytes in between and cut into pieces, go through the scanner and through the
slow oracle of tests/tlog_oracle.py: the same frames, stamps and bad ranges must come of both. Whole records with other
bytes between them must all be found; the columns must have every frame; the survey must stand. With --atheris the
bytes are led by what code they reach (https://github.com/google/atheris).
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

if "--atheris" in sys.argv:
    import atheris

    with atheris.instrument_imports(include=["mavquad.tlog"]):
        import mavquad.tlog  # noqa: F401 - only what is imported here is watched

from mavquad import tlog
from mavquad.analysis.survey import survey
from mavquad.errors import LogError
from mavquad.tlog import Scanner, pack_record
from tests.tlog_mutations import T0_US, known_frame, log, mutated, pieces_of
from tests.tlog_oracle import Oracle

FOLDER = Path(tempfile.mkdtemp(prefix="tlog-fuzz-"))


def check(data: bytes, pieces: list[bytes]) -> None:
    """Raises AssertionError where the reader is wrong."""
    oracle, scanner = Oracle(data), Scanner()
    parts = [scanner.push(piece) for piece in pieces]
    parts.append(scanner.finish())
    columns = ((part.stamps.tolist(), part.starts.tolist(), part.ends.tolist()) for part in parts)
    found = [row for column in columns for row in zip(*column, strict=True)]
    assert found == oracle.found, "frames"
    assert scanner.bad_ranges == oracle.bad_ranges, "bad ranges"
    assert scanner.unknown_frames == oracle.unknown_frames, "unknown frames"
    assert scanner.repaired_stamps == oracle.repaired_stamps, "repaired stamps"


def check_columns(data: bytes) -> None:
    """The doors of the library."""
    path = FOLDER / "log"
    path.write_bytes(data)
    try:
        found = tlog.read(path)
    except LogError:
        return
    assert sum(map(len, found.tables.values())) == found.frames, "columns"
    for table in found.tables.values():
        assert all(len(column) == len(table) for column in table.columns().values()), "rows"
    contents = tlog.read_records(path)
    assert list(tlog.records(path)) == list(contents), "records"
    survey(contents).to_json()


def check_untouched(draw: random.Random) -> None:
    """Whole records with other bytes between them, but no marker in these: each is found with its stamp."""
    parts = [pack_record(T0_US + 4000 * i, known_frame(draw), False) for i in range(draw.randrange(12))]
    noise = [draw.randbytes(draw.randrange(30)).translate(None, b"\xfd\xfe") for _ in parts]
    data = b"".join(a + b for a, b in zip(noise, parts, strict=True))
    found = [pack_record(record.stamp_us, record.frame, False) for record in tlog.scan(data)]
    assert found == parts, "a good record was lost"


def run(seconds: float, seed: int) -> None:
    until, count = time.monotonic() + seconds, 0
    while time.monotonic() < until:
        draw = random.Random(seed + count)
        data = mutated(draw, log(draw, draw.randrange(14)))
        try:
            check(data, pieces_of(draw, data))
            check_columns(data)
            check_untouched(draw)
        except Exception:
            print(f"seed {seed + count}")
            raise
        count += 1
    print(f"{count} logs, no difference")


def run_atheris(seconds: float) -> None:
    def one(data: bytes) -> None:
        cut = data[0] if data else 0
        check(data[1:], [data[1 : 1 + cut], data[1 + cut :]])
        check_columns(data[1:])

    corpus = FOLDER / "corpus"
    corpus.mkdir()
    for seed in range(200):
        draw = random.Random(seed)
        (corpus / str(seed)).write_bytes(b"\x40" + mutated(draw, log(draw, draw.randrange(6))))
    atheris.Setup([sys.argv[0], str(corpus), f"-max_total_time={seconds:.0f}", "-max_len=2000"], one)
    atheris.Fuzz()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--atheris", action="store_true")
    options = parser.parse_args()
    if options.atheris:
        run_atheris(options.seconds)
    else:
        run(options.seconds, options.seed)


if __name__ == "__main__":
    main()
