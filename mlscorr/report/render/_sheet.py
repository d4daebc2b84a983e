"""Sheet: one view, drawn before and after while the cloud is streamed.

Open3D can draw it, too, in a child process whose crash does not affect this one.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.report.render._zbuffer import Canvas
from mlscorr.report.render.picture import Picture
from mlscorr.report.render.quantities import GHOST, PAIRS, CloudPair, colour_scale, paint, rgb
from mlscorr.report.render.view import View
from mlscorr.report.settings import SETTINGS

CHILD = Path(__file__).with_name("_open3d_child.py")


@dataclass(frozen=True)
class Sheet:
    """View with its two canvases."""

    view: View
    canvases: tuple[Canvas, Canvas]

    @classmethod
    def blank(cls, view: View) -> Sheet:
        """Make an empty sheet. Before a cut its points may be anywhere."""
        depth = view.half_depth
        if view.is_cut:
            depth = np.inf
        before = Canvas.blank(view.camera, depth)
        return cls(view, (before, Canvas.blank(view.camera, view.half_depth)))

    def add(self, pair: CloudPair, values: tuple[np.ndarray, np.ndarray]) -> None:
        """Draw a chunk of the cloud with its values before and after."""
        clouds = [pair.before.xyz, pair.after.xyz]
        if self.view.is_cut:
            rows = self.canvases[1].holds(clouds[1])
            clouds = [xyz[rows] for xyz in clouds]
            values = [v[rows] for v in values]
        for canvas, xyz, value in zip(self.canvases, clouds, values, strict=True):
            canvas.draw(xyz, value)

    def finished(self, by_open3d: bool = False, reference: str | Path | None = None) -> Picture:
        """Return the Picture, by Open3D or the z-buffer.

        Parameters
        ----------
        by_open3d : bool
        reference : path, optional
            Surface that Open3D draws behind the points.

        Raises
        ------
        RuntimeError
            If Open3D fails.
        """
        view = self.view
        radius = max(canvas.radius for canvas in self.canvases)
        if view.is_cut:  # only a few points in a row are visible
            radius = max(radius, 0.004 * view.camera.size[0])
        pair = [canvas.grown(radius) for canvas in self.canvases]
        scale = colour_scale(view.colour, *(canvas.value for canvas in pair))
        if by_open3d:
            colours = [paint(view.colour, canvas.value, scale) for canvas in self.canvases]
            surface = reference if np.isinf(view.half_depth) else None  # it would hide a slice
            before, after = draw_pair(self.canvases, colours, 2 * radius + 1, surface)
        else:
            before, after = (_side(view, pair[k], pair[1 - k], scale) for k in (0, 1))
        return Picture(view, before, after, scale)


def _side(view, canvas, other, scale):
    """RGB (h, w, 3) of a canvas on white paper."""
    pixels = np.full((*canvas.pixels.shape, 3), 255, np.uint8)
    if view.colour == "state":
        pixels[other.drawn] = rgb(GHOST)[0]
    drawn = canvas.drawn
    colours = paint(view.colour, canvas.value[drawn], scale)
    if np.isinf(view.half_depth) and view.colour not in PAIRS:  # in a thin slice edges of single
        colours = np.round(colours * canvas.light[drawn][:, None]).astype(np.uint8)  # points: noise
    pixels[drawn] = colours
    return pixels


def draw_pair(
    canvases: tuple[Canvas, Canvas],
    colours: list[np.ndarray],
    point_size: float,
    reference: str | Path | None = None,
    timeout: float = SETTINGS.open3d_timeout,
) -> tuple[np.ndarray, ...]:
    """Draw the contents of two canvases as two RGB arrays (h, w, 3) uint8.

    Only points nearest to the eye are sent, at most one per pixel, so that time and memory do not
    grow with the cloud.

    Parameters
    ----------
    canvases : pair of Canvas
        Without enlarged points.
    colours : pair of (h, w, 3) uint8 arrays
    point_size : float
        Diameter in pixels.
    reference : path, optional
        Mesh drawn behind the points.
    timeout : float
        Units: s.

    Raises
    ------
    RuntimeError
        With the reason, if the child fails.
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
