"""Mutated inputs: read as they stand or refused in our own words, never a traceback or a hang.

``make faults`` tries thousands of them.
"""

import time
import warnings

import numpy as np
import pytest

from mlscorr.io.clouds import read_layout, sample_gps_times
from mlscorr.io.clouds.las import read_records
from mlscorr.io.store import read_toml
from mlscorr.io.surveys import SurveyFile
from mlscorr.io.tables import read_control
from mlscorr.io.trajectories import read_trajectory
from mlscorr.survey import CloudFile
from tests.beds.copies import write_corrected
from tests.faults.sizes import IS_FULL, tries
from tests.io.clouds.test_las import START, correction, write_street

LIMIT = 2.0  # s of the processor, for one file
POINTS = 100
CELLS = (
    *(b"nan", b"inf", b"1e999", b"1e-320", b"0x1", b"1_000", b"-0", b"1,5", b"9" * 400, b""),
    *(b'"', b"'", b"-", b"=", b"#", b";", b"[" * 200, b"\n", b"\r"),
    *(b"\xff", b"\0", b"\x1b[2J", b"\xc2\xa0"),
)


def flipped(data, rng):
    data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))


def overwritten(data, rng):
    start = rng.integers(len(data))
    size = int(rng.choice([1, 2, 4, 8]))
    data[start : start + size] = rng.choice([b"\0", b"\xff", rng.bytes(1)]) * size


def cut(data, rng):
    del data[rng.integers(len(data)) :]


def removed(data, rng):
    start = rng.integers(len(data))
    del data[start : start + rng.integers(1, 20)]


def doubled(data, rng):
    start = rng.integers(len(data))
    data[start:start] = data[start : start + rng.integers(1, 200)]


def replaced(data, rng):
    "Another cell for one between commas or line ends"
    start = rng.integers(len(data))
    ends = [i for i in (data.find(b",", start), data.find(b"\n", start)) if i >= 0]
    data[start : min(ends, default=start)] = CELLS[rng.integers(len(CELLS))]


BYTES = (flipped, overwritten, cut, removed, doubled)
TEXT = (*BYTES, replaced, replaced, replaced)


def mutated(whole, rng, ways):
    "A file changed in one to three ways"
    data = bytearray(whole)
    for _ in range(rng.integers(1, 4)):
        if data:
            ways[rng.integers(len(ways))](data, rng)
    return bytes(data)


def outcome(path, read):
    "Result of a reader, or None if it refuses the file in time with a message of the package"
    start = time.process_time()
    try:
        with warnings.catch_warnings(action="ignore"):
            return read(path)
    except ValueError as error:
        assert path.name in str(error), error
        assert len(str(error)) < 1500 and "\x1b" not in str(error)
    finally:
        assert not IS_FULL or time.process_time() - start < LIMIT
    return None


def records(path):
    return b"".join(chunk.tobytes() for chunk in read_records(read_layout(path), 1000))


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("point_format", [1, 6])
def test_mutated_clouds_are_copied_or_refused(suffix, point_format, tmp_path, record_property):
    "A copy by a correction of zero has the records of its input, whatever the input is"
    whole = write_street(tmp_path / f"in{suffix}", point_format, POINTS).read_bytes()
    path = tmp_path / f"bad{suffix}"
    target = tmp_path / f"out{suffix}"
    zero = correction(START + np.linspace(-1.0, 21.0, 50))
    rng = np.random.default_rng(18)

    def copy(bad):
        points = sample_gps_times(bad)[0]
        write_corrected(CloudFile(bad, points, 0.0, "week"), target, zero)
        return records(bad), records(target)

    refused = 0
    number = tries(20, 3750)
    for _ in range(number):
        path.write_bytes(mutated(whole, rng, BYTES))
        pair = outcome(path, copy)
        refused += pair is None
        assert pair is None or pair[0] == pair[1]
    assert 0 < refused < number
    record_property("mutated clouds", f"{refused} of {number} refused")


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("control.csv", read_control),
        ("trajectory.csv", read_trajectory),
        ("survey.toml", lambda path: read_toml(path, SurveyFile, "it")),
    ],
)
def test_mutated_texts_are_read_or_refused(name, read, street, tmp_path, record_property):
    "Tables and survey.toml: no exception but a sentence that names the file"
    whole = b"".join((street / name).read_bytes().splitlines(keepends=True)[:60])
    path = tmp_path / name
    rng = np.random.default_rng(18)
    refused = 0
    number = tries(80, 2000)
    for _ in range(number):
        path.write_bytes(mutated(whole, rng, TEXT))
        refused += outcome(path, read) is None
    assert 0 < refused < number
    record_property(f"mutated {name}", f"{refused} of {number} refused")
