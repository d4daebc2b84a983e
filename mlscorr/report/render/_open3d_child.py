"""Draw points with Open3D in a separate process that may fail: python open3d_child.py FOLDER.

The folder contains job.npz: in camera axes (right, up, toward the eye; m, with the focus at zero)
the points and colors of both sides, size in pixels, scale, the eye's distance, point size, and
optionally a file with a reference surface. before.npy and after.npy are written into it.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np


def main(folder: Path) -> None:
    """Draw both sides with one renderer, because a second one in a process would abort it."""
    import open3d

    o3d: Any = open3d

    rendering = o3d.visualization.rendering
    job = np.load(folder / "job.npz")
    width, height = (int(v) for v in job["size"])
    renderer = rendering.OffscreenRenderer(width, height)
    scene = renderer.scene
    scene.view.set_post_processing(False)  # colors remain exact, and frames repeat
    scene.set_background([1.0, 1.0, 1.0, 1.0])
    depths = [job[f"{side}_xyz"][:, 2] for side in ("before", "after") if len(job[f"{side}_xyz"])]
    # the clipping planes are one meter beyond the points
    low = min((float(d.min()) for d in depths), default=0.0) - 1.0
    high = max((float(d.max()) for d in depths), default=0.0) + 1.0
    _set_camera(rendering, scene.camera, job, low, high)
    material = rendering.MaterialRecord()
    material.shader = "defaultUnlit"
    material.point_size = float(job["point_size"])
    if str(job["reference"]):
        scene.add_geometry("reference", _reference(o3d, job), material)
    for side in ("before", "after"):
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(job[f"{side}_xyz"]))
        cloud.point.colors = o3d.core.Tensor(job[f"{side}_rgb"].astype(np.float32) / 255)
        if len(job[f"{side}_xyz"]):
            scene.add_geometry(side, cloud, material)
        np.save(folder / f"{side}.npy", np.asarray(renderer.render_to_image()))
        scene.remove_geometry(side)


def _set_camera(rendering, camera, job, low, high):
    (width, height), scale, distance = job["size"], float(job["scale"]), float(job["distance"])
    eye = distance if np.isfinite(distance) else high + 1.0
    camera.look_at([0.0, 0.0, 0.0], [0.0, 0.0, eye], [0.0, 1.0, 0.0])
    near = max(eye - high, 0.1)
    far = eye - low
    if np.isfinite(distance):
        angle = np.degrees(2 * np.arctan(width / scale / 2 / distance))
        camera.set_projection(angle, width / height, near, far, rendering.Camera.FovType.Horizontal)
    else:
        x = width / scale / 2
        y = height / scale / 2
        camera.set_projection(rendering.Camera.Projection.Ortho, -x, x, -y, y, near, far)


def _reference(o3d, job):
    """Reference surface in camera axes, gray, darker where it is turned away from the eye."""
    mesh = o3d.io.read_triangle_mesh(str(job["reference"]))
    local = (np.asarray(mesh.vertices) - job["focus"]) @ job["axes"].T * [1.0, 1.0, -1.0]
    corners = local[np.asarray(mesh.triangles)].reshape(-1, 3)
    normal = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
    facing = np.abs(normal[:, 2]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    shade = np.repeat(0.82 * (0.6 + 0.4 * facing), 3)
    rows = np.arange(len(corners)).reshape(-1, 3)
    # 2 cm behind the points on it
    surface = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(corners - [0.0, 0.0, 0.02]), o3d.utility.Vector3iVector(rows)
    )
    surface.vertex_colors = o3d.utility.Vector3dVector(np.repeat(shade[:, None], 3, axis=1))
    surface.compute_vertex_normals()  # without them the software renderer never ends
    return surface


if __name__ == "__main__":
    main(Path(sys.argv[1]))
