"""A reference surface that was cut off is not taken for a smaller one."""

import numpy as np
import pytest

from mlscorr.io.clouds import write_ply
from mlscorr.simulate.scene.mesh import _read_ply
from tests.faults.sizes import tries


def test_no_cut_of_a_mesh_goes_unseen(tmp_path, record_property):
    "Wherever the file ends, within vertices or faces: refused, or nothing is left of it"
    path = tmp_path / "reference.ply"
    write_ply(path, np.random.default_rng(1).normal(size=(200, 3, 3)))
    whole = path.read_bytes()
    assert len(_read_ply(path)[1]) == 200
    start = whole.index(b"end_header\n") + 11
    sizes = np.linspace(start, len(whole) - 1, tries(25, 150)).astype(int)
    for size in sizes:
        path.write_bytes(whole[:size])
        try:
            _, triangles = _read_ply(path)
        except ValueError as error:
            assert "is cut off" in str(error) and "of the" in str(error)
        else:
            assert not len(triangles)  # refused by who asked for a mesh
    record_property("cuts of a mesh", len(sizes))
    path.write_bytes(whole[:-1])
    with pytest.raises(ValueError, match="199 of the 200 faces"):
        _read_ply(path)
