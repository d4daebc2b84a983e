"""Triangles come back from a PLY as they were."""

import numpy as np
import open3d

from mlscorr.io.clouds import write_ply

CORNER = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM


def test_another_library_reads_the_same_triangles(tmp_path):
    "To the last bit at UTM coordinates, in their order and turn"
    triangles = CORNER + np.random.default_rng(1).uniform(-50.0, 50.0, (40, 3, 3))
    write_ply(tmp_path / "mesh.ply", triangles)
    mesh = open3d.io.read_triangle_mesh(str(tmp_path / "mesh.ply"))
    back = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    np.testing.assert_array_equal(back, triangles)


def test_corners_at_one_place_are_one(tmp_path):
    "Two triangles of a square have four vertices"
    square = CORNER + np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    write_ply(tmp_path / "mesh.ply", square[[[0, 1, 2], [0, 2, 3]]])
    mesh = open3d.io.read_triangle_mesh(str(tmp_path / "mesh.ply"))
    assert len(mesh.vertices) == 4 and len(mesh.triangles) == 2
    assert mesh.get_surface_area() == 1.0


def test_the_same_triangles_give_the_same_bytes(tmp_path):
    "Nothing of time or place enters the file; a header of text stands before the numbers"
    triangles = CORNER + np.random.default_rng(2).uniform(0.0, 1.0, (5, 3, 3))
    for name in ("a.ply", "b.ply"):
        write_ply(tmp_path / name, triangles)
    first = (tmp_path / "a.ply").read_bytes()
    assert first == (tmp_path / "b.ply").read_bytes()
    assert first.startswith(b"ply\nformat binary_little_endian 1.0\nelement vertex 15\n")
