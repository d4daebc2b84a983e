"""A reference surface that was cut off is not taken for a smaller one."""

import numpy as np
import pytest

from mlscorr.io.clouds import write_ply
from mlscorr.simulate import SceneScenario
from mlscorr.simulate.scene import read_mesh
from tests.faults.sizes import tries


def test_no_cut_of_a_mesh_goes_unseen(tmp_path, record_property):
    "Wherever the file ends, within vertices or faces, it is refused"
    path = tmp_path / "reference.ply"
    write_ply(path, np.random.default_rng(1).normal(size=(200, 3, 3)))
    whole = path.read_bytes()
    scene = SceneScenario(kind="mesh", file=str(path))
    assert len(read_mesh(scene, np.zeros(3))) == 200
    start = whole.index(b"end_header\n") + 11
    sizes = np.linspace(start, len(whole) - 1, tries(25, 150)).astype(int)
    for size in sizes:
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=r"is truncated.* of the|but no triangles"):
            read_mesh(scene, np.zeros(3))
    record_property("cuts of a mesh", len(sizes))
    path.write_bytes(whole[:-1])
    with pytest.raises(ValueError, match="199 of the 200 faces"):
        read_mesh(scene, np.zeros(3))
