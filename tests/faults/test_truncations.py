"""Files that end too early: at every boundary of their structure, beside it, and anywhere."""

import os
import warnings
from collections import Counter

import lazrs
import numpy as np
import pytest

from mlscorr.io.clouds import read_layout
from mlscorr.io.store import read_toml
from mlscorr.io.surveys import SurveyFile
from mlscorr.io.tables import read_control
from mlscorr.io.trajectories import read_trajectory
from mlscorr.io.trajectories.sbet import read_sbet
from tests.faults.sizes import tries
from tests.faults.test_times_and_places import recorded
from tests.io.clouds.test_las import write_street

CLOUDS = (("a.las", 1), ("b.las", 6), ("c.laz", 1), ("d.laz", 6))  # and their point formats
TEXTS = (
    ("control.csv", read_control),
    ("trajectory.csv", read_trajectory),
    ("survey.toml", lambda path: read_toml(path, SurveyFile, "it")),
)


def fate(path, read):
    "Outcome of a file: refused or warned of with a message of the package, or read"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            read(path)
        except ValueError as error:
            assert path.name in str(error) and str(error)[-1] in ".?", error
            return "refused"
    if told:
        assert any(path.name in str(warning.message) for warning in told)
        return "warned of"
    return "read"


def cuts(size, boundaries, number, rng):
    "Sizes to cut to, falling: each boundary, a byte before and behind it, and random ones"
    beside = np.add.outer(np.unique(boundaries), [-1, 0, 1]).ravel()
    anywhere = rng.integers(0, size, number)
    return sorted({int(cut) for cut in (*beside, *anywhere) if 0 <= cut < size}, reverse=True)


def chunk_bounds(layout):
    "Bytes where the chunks of a LAZ file start, and its chunk table"
    with open(layout.path, "rb") as file:
        file.seek(len(layout.head))
        table = int.from_bytes(file.read(8), "little")
        file.seek(len(layout.head))
        chunks = lazrs.read_chunk_table(file, lazrs.LazVlr(layout.laszip))
    starts = len(layout.head) + 8 + np.cumsum([0] + [length for _, length in chunks])
    return [*starts, table, table + 4, table + 8]


def cloud_bounds(layout):
    "Bytes where header, VLRs, points or chunks, and EVLRs start"
    start = len(layout.head)
    step = layout.record_length
    bounds = [4, 96, 227, layout.field("H", 94)[0], *np.ravel(layout.vlrs), start]
    if layout.is_compressed:
        bounds += chunk_bounds(layout)
    else:
        bounds += [start + step, start + (layout.points - 1) * step, start + layout.points * step]
    if layout.version >= (1, 4):
        (evlrs,) = layout.field("Q", 235)
        bounds += [evlrs, evlrs + 20, evlrs + 60]
    return [*bounds, layout.size]


@pytest.mark.parametrize(("name", "point_format"), CLOUDS)
def test_no_cut_of_a_cloud_goes_unseen(name, point_format, tmp_path, record_property):
    "Header, VLRs, each chunk, chunk table, EVLRs: wherever it ends, the file is refused by name"
    path = write_street(tmp_path / name, point_format, points=110_000)
    layout = read_layout(path)
    rng = np.random.default_rng(18)
    fates = Counter()
    for size in cuts(layout.size, cloud_bounds(layout), tries(10, 150), rng):
        os.truncate(path, size)
        fates[fate(path, read_layout)] += 1
    assert set(fates) == {"refused"}, fates
    record_property(f"cuts of clouds, {name}", dict(fates))


@pytest.mark.parametrize(("name", "read"), TEXTS)
def test_a_cut_text_is_refused_warned_of_or_a_whole_one(
    name, read, street, tmp_path, record_property
):
    """Within a line a cut is found. At its end nothing of the file tells: what is read then are the
    lines that are left, whose number the first screen says
    """
    text = b"".join((street / name).read_bytes().splitlines(keepends=True)[:40])
    path = tmp_path / name
    rng = np.random.default_rng(18)
    fates = Counter()
    path.write_bytes(text)
    cells = [i for i, byte in enumerate(text) if byte in b",\n="]
    cells = [*rng.choice(cells, tries(10, len(cells)), replace=False), text.rindex(b"\n")]
    for size in cuts(len(text), cells, tries(10, 150), rng):
        os.truncate(path, size)
        what = fate(path, read)
        if what == "read":
            assert size == 0 or text[size - 1 : size] == b"\n", text[size - 20 : size]
            what = "a whole, shorter file"
        fates[what] += 1
    assert fates["warned of"] and fates["refused"]
    record_property(f"cuts of {name}", dict(fates))


@pytest.mark.parametrize("cut_file", ["a.sbet", "a.out"])
def test_a_cut_sbet_or_accuracy_is_refused(cut_file, tmp_path, record_property):
    """Within a record both are found. Between records an accuracy file ends before its SBET, and
    an SBET that ends earlier is that of a shorter drive
    """
    sbet, crs, accuracy = recorded(tmp_path, 0.0)
    path = tmp_path / cut_file
    width = {"a.sbet": 136, "a.out": 80}[cut_file]
    size = (tmp_path / cut_file).stat().st_size
    rng = np.random.default_rng(18)
    fates = Counter()
    bounds = width * np.array([0, 1, 2, 30, size // width - 4, size // width])
    for cut in cuts(size, bounds, tries(10, 100), rng):
        os.truncate(path, cut)
        what = fate(path, lambda _: read_sbet(sbet, crs, accuracy))
        if what == "read":
            assert cut_file == "a.sbet" and cut % width == 0
            what = "a whole, shorter file"
        fates[what] += 1
    record_property(f"cuts of {cut_file}", dict(fates))
