"""The number of threads does not change the result."""

import numpy as np
import pytest

from mlscorr.simulate.scan.threads import Workspace, in_slices


@pytest.mark.parametrize("n", [0, 1, 3_999, 4_000, 50_001])
def test_slices_are_all_rows_in_their_order(n):
    "Whatever their number, each row is in one slice, whose first row is told"
    rows = np.arange(n), np.arange(n) * 2.0
    parts = in_slices(n, lambda a, b, factor: (a, factor * b), rows, (3.0,))
    starts = [start for start, _ in parts]
    assert starts[0] == 0 and starts == sorted(starts)
    np.testing.assert_array_equal(np.concatenate([a for _, (a, _) in parts]), rows[0])
    np.testing.assert_array_equal(np.concatenate([b for _, (_, b) in parts]), 3.0 * rows[1])
    assert all(len(a) == 0 or a[0] == start for start, (a, _) in parts)


def test_an_error_in_a_slice_reaches_the_caller():
    "A kernel that fails in one thread fails the call"

    def kernel(values):
        if values.max() > 10_000:
            raise ValueError("too large")

    with pytest.raises(ValueError, match="too large"):
        in_slices(20_000, kernel, (np.arange(20_000),), ())


def test_arrays_serve_again():
    "Smaller or equal ones share the memory of a name, larger ones and other names don't"
    space = Workspace()
    first = space.array("xyz", 100, 3)
    assert first.shape == (100, 3) and np.shares_memory(first, space.array("xyz", 50, 3))
    assert not np.shares_memory(first, space.array("time", 100, 3))
    assert not np.shares_memory(first, space.array("xyz", 200, 3))
    assert space.array("kept", 10, dtype=bool).dtype == bool
