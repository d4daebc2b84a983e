"""Arrays that grew block by block are read as if they had been whole."""

import numpy as np
import pytest

from mlscorr.io.store import NpzWriter


def test_blocks_become_one_array(tmp_path):
    "Of any number of rows, of vectors and of numbers, each of its own type"
    rng = np.random.default_rng(1)
    xyz = rng.normal(size=(1000, 3))
    number = rng.integers(0, 9, 1000).astype(np.int16)
    with NpzWriter(tmp_path / "truth.npz") as writer:
        for start, end in ((0, 1), (1, 1), (1, 700), (700, 1000)):
            writer.append("xyz", xyz[start:end])
            writer.append("number", number[start:end])
        assert writer.growing == xyz.nbytes + number.nbytes
        writer.put("unit", np.array("m"))
    with np.load(tmp_path / "truth.npz") as read:
        np.testing.assert_array_equal(read["xyz"], xyz)
        np.testing.assert_array_equal(read["number"], number)
        assert read["number"].dtype == np.int16 and read["unit"] == "m"
    assert [path.name for path in tmp_path.iterdir()] == ["truth.npz"]


@pytest.mark.parametrize("rows", [np.zeros((4, 2)), np.zeros((4, 3), np.float32), np.zeros(4)])
def test_rows_of_another_shape_or_type_are_refused(tmp_path, rows):
    "Both are named, and no file is left, not even a part"
    with (
        pytest.raises(ValueError, match=r"do not match the rows of float64 \(3,\)"),
        NpzWriter(tmp_path / "truth.npz") as writer,
    ):
        writer.append("xyz", np.zeros((5, 3)))
        writer.append("xyz", rows)
    assert not list(tmp_path.iterdir())


def test_what_is_copied_is_counted(tmp_path):
    "All bytes of growing arrays, so that progress ends at its total"
    steps = []
    with NpzWriter(tmp_path / "truth.npz") as writer:
        writer.watch = steps.append
        writer.append("a", np.zeros((1000, 3)))
        writer.append("b", np.zeros(7, np.uint8))
    assert sum(steps) == 24_007


def test_the_same_arrays_give_the_same_bytes(tmp_path):
    "No time of writing is in the file"
    for name in ("a.npz", "b.npz"):
        with NpzWriter(tmp_path / name) as writer:
            writer.append("time", np.arange(10.0))
            writer.put("seed", 3)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
