"""Clouds and results in one 3D view: Open3D's window, or a page without a display."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from mlscorr.io.store import as_path, is_there, output_file
from mlscorr.report.cloud import packed, thin_evenly
from mlscorr.report.pages import Page
from mlscorr.report.render import colour_table, percentiles
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import BLACK, BLUE, GREEN, ORANGE, SKY, VERMILLION
from mlscorr.survey import PointCloud, chosen_origin, geometry_columns, is_geometry, map_places
from mlscorr.wording import counted, thousands

PALETTE = (BLUE, VERMILLION, GREEN, ORANGE, SKY, BLACK)  # of items without their own colors
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")  # variables that name a display on Linux


@dataclass(frozen=True)
class Layer:
    """Points or lines in the map, with colors.

    Parameters
    ----------
    name : str
    xyz : (n, 3) array
        Units: m.
    pairs : (k, 2) int array or None
        Indices of the points that a line joins; None for a cloud.
    colors : (n, 3) or (k, 3) array or None
        Colors of the points or lines: uint8, uint16, or from 0 to 1.
    intensity : (n,) array or None
    gps_time : (n,) array or None
        Units: s.
    """

    name: str
    xyz: np.ndarray
    pairs: np.ndarray | None = None
    colors: np.ndarray | None = None
    intensity: np.ndarray | None = None
    gps_time: np.ndarray | None = None

    def __len__(self) -> int:
        """Number of points or lines."""
        if self.pairs is None:
            return len(self.xyz)
        return len(self.pairs)

    @cached_property
    def intensity_limits(self) -> np.ndarray | None:
        """Ends of the scale of intensities; None if these carry no information."""
        if self.intensity is None or len(self.intensity) == 0:
            return None
        low, high = percentiles(self.intensity)
        if high > low:
            return np.array([low, high])
        return None

    def painted(self, rows: np.ndarray | slice, color: str) -> np.ndarray:
        """Return colors (k, 3) uint8 of some points or lines.

        Parameters
        ----------
        rows : (k,) int array or slice
        color : str
            Color of all, if neither colors nor intensities are known.
        """
        if self.colors is not None:
            chosen = self.colors[rows]
            if chosen.dtype == np.uint8:
                return chosen
            if chosen.dtype == np.uint16:  # of a LAS file
                return (chosen >> 8).astype(np.uint8)
            return np.rint(255 * np.clip(chosen, 0.0, 1.0)).astype(np.uint8)
        if self.intensity is not None and self.intensity_limits is not None:
            low, high = self.intensity_limits
            share = np.clip((self.intensity[rows] - low) / (high - low), 0.0, 1.0)
            return colour_table("intensity")[np.rint(255 * share).astype(np.uint8)]
        shade = np.rint(255 * np.array(to_rgb(color))).astype(np.uint8)
        return np.tile(shade, (len(np.arange(len(self))[rows]), 1))

    def key(self, color: str) -> tuple[str, str]:
        """Return the color of a legend's mark, and the meaning of colors.

        Parameters
        ----------
        color : str
            See ``painted``.
        """
        if self.colors is not None:
            meaning = "own colors"
        elif self.intensity_limits is not None:
            meaning = "colored by intensity"
        else:
            return color, ""
        red, green, blue = np.median(self.painted(slice(None, None, 1000), color), axis=0)
        return f"rgb({red:.0f}, {green:.0f}, {blue:.0f})", meaning


def show(
    *what: Any,
    page: str | Path | None = None,
    title: str = "3D view",
    points: int = SETTINGS.shown_points,
    overwrite: bool = False,
    **named: Any,
) -> Path | None:
    """Show clouds, targets, trajectories and results together in 3D.

    With a display, Open3D's window opens and shows all points. Without one, or if a page is
    requested, one HTML file is written that needs neither a network nor a server.

    Parameters
    ----------
    *what : object
        PointCloud, Open3D clouds and line sets (with positions relative to their attribute
        ``origin``), any object with ``to_open3d``, and dicts of these by name.
    page : path, optional
        The HTML file; without a display, a new one among the temporary files by default.
    title : str
        Title of the window or page.
    points : int
        Total number of points on a page, thinned evenly in space; lines are complete.
    overwrite : bool
        True to replace a page of the same name.
    **named : object
        Further objects, by the names for the list.

    Returns
    -------
    Path or None
        The page; None once the window is closed.

    Raises
    ------
    ValueError
        If there is nothing to show, positions are not finite or too distant for one view, or the
        page exists without ``overwrite``.
    TypeError
        If an object cannot be shown.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.survey import PointCloud
    >>> rng = np.random.default_rng(1)
    >>> xyz = np.array([532_000.0, 3_374_000.0, 42.0]) + rng.uniform(0, 30, (1000, 3))
    >>> before = PointCloud.from_arrays(xyz, 357_700 + np.arange(1000) / 1000)
    >>> after = PointCloud.from_arrays(xyz + 0.2, before.gps_time)
    >>> page = mlscorr.show(before=before, after=after, page=f"{tempfile.mkdtemp()}/pair.html")
    >>> page.name
    'pair.html'
    """
    layers = _distinct([*_layers(what, {}), *_layers((), named)])
    origin = _common_origin(layers)
    if points < 1:
        raise ValueError(f"points = {points} shows nothing: give 1 or more.")
    if page is None and _has_display():
        _open_window(layers, origin, title)
        return None
    if page is None:
        path = Path(tempfile.mkdtemp(prefix="mlscorr-")) / "show.html"
    else:
        path = as_path(page)
        if is_there(path) and not overwrite:
            raise ValueError(f"{path} already exists. Give another name, or overwrite=True.")
    content = _page_content(layers, origin, title, points)
    with output_file(path) as part:
        Page(
            title=title,
            summary="show-summary.html",
            sections={"view": "3D view"},
            content=content,
            prefix="show-",
            scripts=("view.js", "show.js"),
        ).write(part)
    return path


def _layers(what, named) -> Iterator[Layer]:
    """Yield layers of unnamed and of named values."""
    for value in what:
        if isinstance(value, Mapping):
            yield from _layers((), value)
        else:
            yield from _layers_of(value, _spoken(value))
    for name, value in named.items():
        if isinstance(value, Mapping):
            yield from _layers((), {f"{name}: {key}": part for key, part in value.items()})
        else:
            yield from _layers_of(value, str(name))


def _layers_of(value, name) -> Iterator[Layer]:
    """Yield layers of one value; results with several geometries have several."""
    if isinstance(value, PointCloud):
        colors = value.attributes.get("colors")
        yield Layer(name, value.xyz, None, colors, value.intensity, value.gps_time)
    elif is_geometry(value):
        yield _geometry_layer(value, name)
    elif hasattr(value, "to_open3d"):
        geometry = value.to_open3d()
        if isinstance(geometry, Mapping):
            yield from _layers((), {name: geometry})
        else:
            yield _geometry_layer(geometry, name)
    else:
        raise TypeError(
            f"{name}: a {type(value).__name__} can't be shown. Give a PointCloud, a point cloud "
            "or line set of Open3D, or a result that has to_open3d()."
        )


def _geometry_layer(geometry, name):
    """Layer of an Open3D geometry, including legacy ones."""
    import open3d

    if isinstance(geometry, open3d.geometry.PointCloud):
        double = open3d.core.float64
        geometry = open3d.t.geometry.PointCloud.from_legacy(geometry, double)
    elif isinstance(geometry, open3d.geometry.LineSet):
        geometry = open3d.t.geometry.LineSet.from_legacy(geometry, open3d.core.float64)
    if isinstance(geometry, open3d.t.geometry.PointCloud):
        xyz, attributes = geometry_columns(geometry, None)
        further = (attributes.get(key) for key in ("colors", "intensity", "gps_time"))
        return Layer(name, xyz, None, *further)
    if isinstance(geometry, open3d.t.geometry.LineSet):
        pairs = np.empty((0, 2), int)
        colors = None
        if "indices" in geometry.line:
            pairs = geometry.line["indices"].cpu().numpy()
        if "colors" in geometry.line:
            colors = geometry.line["colors"].cpu().numpy()
        return Layer(name, map_places(geometry), pairs, colors)
    raise TypeError(
        f"{name}: Open3D's {type(geometry).__name__} can't be shown here. Give point clouds and "
        "line sets; open3d.visualization.draw shows others."
    )


def _spoken(value):
    """Name of a value's class in words: FoundTargets as Found targets."""
    words = re.findall(r"[A-Z]+[a-z0-9]*|[a-z0-9]+", type(value).__name__)
    return " ".join(words).capitalize()


def _distinct(layers):
    """Give layers distinct names: the second of a name gets a number."""
    known: dict[str, int] = {}
    distinct = []
    for layer in layers:
        known[layer.name] = known.get(layer.name, 0) + 1
        name = layer.name
        if known[name] > 1:
            name = f"{name} {known[name]}"
        distinct.append(replace(layer, name=name))
    return distinct


def _common_origin(layers):
    """Whole meter near the middle of all layers (3,), which must fit one view. Units: m."""
    if not layers:
        raise ValueError(
            "Nothing was given to show: give a PointCloud, geometries of Open3D, or results."
        )
    there = [layer for layer in layers if len(layer)]
    if not there:
        names = ", ".join(layer.name for layer in layers)
        raise ValueError(f"There is nothing to show: {names} are empty.")
    for layer in there:
        bad = np.flatnonzero(~np.isfinite(layer.xyz).all(axis=1))
        if len(bad):
            raise ValueError(
                f"{layer.name}: {len(bad)} of {counted(len(layer.xyz), 'point')} have "
                f"coordinates that are not finite (first: point {bad[0]}). Remove them."
            )
    ends = np.array([[layer.xyz.min(axis=0), layer.xyz.max(axis=0)] for layer in there])
    middles = ends.mean(axis=1)
    distance = np.linalg.norm(middles[:, None] - middles[None], axis=2)
    extent = float(np.linalg.norm(ends.max(axis=(0, 1)) - ends.min(axis=(0, 1))))
    if extent > SETTINGS.shown_extent:
        first, second = np.unravel_index(distance.argmax(), distance.shape)
        raise ValueError(
            f"The layers extend over {extent / 1000:.0f} km; one view can show "
            f"{SETTINGS.shown_extent / 1000:.0f} km ({there[first].name} and "
            f"{there[second].name} are {distance.max() / 1000:.0f} km apart). One may be in "
            "another CRS or relative to a local origin: an Open3D geometry in map coordinates "
            "needs its attribute origin."
        )
    return chosen_origin(ends.reshape(-1, 3), None)


def _has_display():
    """True if a window can be opened."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, DISPLAYS))


def _color_of(number):
    return PALETTE[number % len(PALETTE)]


def _open_window(layers, origin, title):
    """Show all points and lines in Open3D's viewer until it is closed."""
    import open3d

    place = f"map axes relative to {origin[0]:.0f} E, {origin[1]:.0f} N, {origin[2]:.0f} H"
    shown = [
        {"name": layer.name, "geometry": viewer_geometry(layer, origin, _color_of(number))}
        for number, layer in enumerate(layers)
        if len(layer)
    ]
    viewer: Any = open3d.visualization
    viewer.draw(
        shown,
        title=f"{title} ({place})",
        show_ui=True,
        show_skybox=False,
        bg_color=(1.0, 1.0, 1.0, 1.0),
        point_size=2,
        line_width=2,
    )


def viewer_geometry(layer: Layer, origin: np.ndarray, color: str) -> Any:
    """Convert a layer for Open3D's viewer: float32 about a nearby origin.

    Parameters
    ----------
    layer : Layer
    origin : (3,) array
        Units: m.
    color : str
        See ``Layer.painted``.

    Returns
    -------
    open3d.t.geometry.PointCloud or LineSet
    """
    import open3d

    tensor = open3d.core.Tensor.from_numpy
    places = tensor((layer.xyz - origin).astype(np.float32))
    colors = tensor(layer.painted(slice(None), color).astype(np.float32) / 255)
    if layer.pairs is None:
        cloud = open3d.t.geometry.PointCloud(places)
        cloud.point["colors"] = colors
        return cloud
    lines = open3d.t.geometry.LineSet()
    lines.point["positions"] = places
    lines.line["indices"] = tensor(np.ascontiguousarray(layer.pairs, np.int32))
    lines.line["colors"] = colors
    return lines


def _page_content(layers, origin, title, points):
    """Content of the templates."""
    rows = _thinned(layers, points)
    scene = []
    entries = []
    for number, layer in enumerate(layers):
        color = _color_of(number)
        mark, meaning = layer.key(color)
        if layer.pairs is None:
            chosen, spacing = rows[number]
            scene.append(
                {
                    "places": packed(layer.xyz[chosen] - origin),
                    "colours": packed(layer.painted(chosen, color), "u1"),
                    "spacing": spacing,
                }
            )
            size = f"{thousands(len(layer))} points"
            if len(chosen) < len(layer):
                size = f"{thousands(len(chosen))} of {size}"
        else:
            scene.append(
                {
                    "places": packed(layer.xyz - origin),
                    "colours": packed(layer.painted(slice(None), color), "u1"),
                    "pairs": packed(layer.pairs, "<u4"),
                }
            )
            size = f"{thousands(len(layer))} lines"
        words = ", ".join(filter(None, [size, meaning]))
        entries.append({"name": layer.name, "words": words, "mark": mark})
    clouds = [number for number, layer in enumerate(layers) if layer.pairs is None]
    return {
        "title": title,
        "entries": entries,
        "scene": {"layers": scene},
        "origin": origin,
        "shown": thousands(sum(len(rows[number][0]) for number in clouds)),
        "total": thousands(sum(len(layers[number]) for number in clouds)),
        "clouds": len(clouds),
    }


def _thinned(layers, points):
    """Pairs (rows, spacing in m) of each cloud by index; two states of a cloud keep the same
    rows.
    """
    clouds = [number for number, layer in enumerate(layers) if layer.pairs is None]
    chosen: dict[int, tuple[np.ndarray, float]] = {}
    limit = max(1, points // max(1, len(clouds)))
    for number in clouds:
        layer = layers[number]
        if len(layer) == 0:
            chosen[number] = (np.empty(0, int), 0.0)
            continue
        same = (k for k in chosen if _are_states(layers[k], layer))
        first = next(same, None)
        if first is None:
            rows, spacing = thin_evenly(layer.xyz, limit)
            if len(layer) <= limit:
                rows = np.arange(len(layer))
            chosen[number] = (rows, spacing)
        else:
            chosen[number] = chosen[first]
    return chosen


def _are_states(first, second):
    """True for two states of the same points, such as before and after."""
    if first.gps_time is None or second.gps_time is None:
        return False
    return np.array_equal(first.gps_time, second.gps_time)
