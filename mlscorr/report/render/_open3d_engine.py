"""Open3D as another way to draw: in a child process, which cannot take this one down with it."""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from mlscorr.report.render._zbuffer import Canvas
from mlscorr.report.settings import SETTINGS

CHILD = Path(__file__).with_name("open3d_child.py")


def draw_pair(
    canvases: tuple[Canvas, Canvas],
    colours: list[np.ndarray],
    point_size: float,
    reference: str | Path | None = None,
    timeout: float = SETTINGS.open3d_timeout,
) -> tuple[np.ndarray, ...]:
    """Draw what two canvases show: two RGB arrays (h, w, 3) uint8.

    Only points that are nearest to the eye are sent, one for each pixel at most, so that time
    and memory don't grow with the cloud.

    Parameters
    ----------
    canvases : pair of Canvas
        Not grown.
    colours : pair of (h, w, 3) uint8 arrays
    point_size : float
        Diameter in pixels.
    reference : path, optional
        A mesh that is drawn behind the points.
    timeout : float
        Units: s.

    Raises
    ------
    RuntimeError
        With what happened, when the child fails.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        np.savez(
            folder / "job.npz",
            before_xyz=canvases[0].points,
            after_xyz=canvases[1].points,
            before_rgb=colours[0][canvases[0].drawn],
            after_rgb=colours[1][canvases[1].drawn],
            point_size=point_size,
            reference=str(reference or ""),
            **vars(canvases[0].camera),
        )
        _run(folder, timeout)
        return tuple(np.load(folder / f"{side}.npy")[..., :3] for side in ("before", "after"))


def _run(folder, timeout):
    command = [sys.executable, str(CHILD), str(folder)]
    try:
        child = subprocess.run(command, capture_output=True, timeout=timeout, check=False)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"Open3D drew no picture within {timeout:.0f} s") from None
    if child.returncode:
        last = child.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
        raise RuntimeError(f"Open3D failed with exit code {child.returncode} ({last[0]})")
    if not (folder / "after.npy").exists():
        raise RuntimeError("Open3D ended without a picture")
