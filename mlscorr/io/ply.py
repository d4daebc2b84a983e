"""Meshes in PLY files."""

import numpy as np

HEADER = """\
ply
format binary_little_endian 1.0
element vertex {}
property double x
property double y
property double z
element face {}
property list uchar int vertex_indices
end_header
"""


def write_ply(path, triangles):
    """Write triangles (n, 3, 3) in map coordinates (m) as a binary PLY of doubles.

    Corners at exactly the same place are one vertex.
    """
    vertices, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, corners.reshape(-1, 3)
    with open(path, "wb") as file:
        file.write(HEADER.format(len(vertices), len(faces)).encode("ascii"))
        file.write(vertices.astype("<f8").tobytes())
        file.write(faces.tobytes())
