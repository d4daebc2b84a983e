"""The views: what each picture looks at, from where, and what is drawn over the points."""

from dataclasses import dataclass

import numpy as np

from mlscorr.report import tables
from mlscorr.report.plan import nice
from mlscorr.report.render.camera import PLAN, Camera
from mlscorr.report.render.section import find_place
from mlscorr.report.render.zbuffer import REACH

VIEWS = ("overview", "targets", "section")
OBLIQUE = 45.0  # deg, elevation of an overview of one street
SPREAD = 250.0  # m; a larger area is seen from straight above, where its streets don't overlap
LONG = 1.8  # width over height of a street whose pictures stand one above the other
MARGIN = 1.12  # of the overview about what it shows
ARROW_SHARE = 0.16  # the longest arrow of an overview, as a share of the picture
ASIDE = 50.0  # deg, how far at most a target is looked at from aside to see all of its misclosure
VISIBLE = 0.01  # m, a misclosure worth looking at from aside
CORNERS = 96  # of the outline of a disc
SLAB = 0.2  # half the thickness of a cross-section over half its width
SLABS = 0.25, 0.5  # m, the least and largest half thickness
LEAST, MOST = 1.0, 6.0  # m, half the width of a cross-section
ROOM = 4.0  # times the misfit beside the wall


@dataclass(frozen=True)
class Mark:
    """A line, an arrow, a symbol or a name over the points.

    ``kind`` is one of ``surveyed`` (an outline), ``offset`` and ``residual`` (arrows),
    ``control``, ``check`` and ``unused`` (symbols). ``points`` (n, 3) are map coordinates.
    """

    kind: str
    points: np.ndarray
    text: str = ""


@dataclass(frozen=True)
class View:
    """One pair of pictures: what it shows, from where, and its marks before and after.

    Points farther than half_depth (m) before or behind the focus are left out; in a cut that is
    decided after the correction, so that both sides show the same points.
    """

    name: str
    title: str
    note: str
    camera: Camera
    colour: str
    half_depth: float = REACH
    is_cut: bool = False
    split: float | None = None
    marks: tuple[tuple[Mark, ...], tuple[Mark, ...]] = ((), ())


@dataclass(frozen=True)
class Look:
    """What the user asked of the camera; None and 0 leave it to the view.

    size is that of each picture in pixels, wide that of the overview of a long street.
    """

    size: tuple[int, int]
    wide: tuple[int, int] | None = None
    colour: str | None = None
    azimuth: float | None = None
    elevation: float | None = None
    view_angle: float = 0.0

    def camera(self, focus, azimuth, elevation, scale, size=None):
        """The camera of a view that would look this way by itself."""
        size = self.size if size is None else size
        azimuth = azimuth if self.azimuth is None else self.azimuth
        elevation = elevation if self.elevation is None else self.elevation
        return Camera.towards(focus, azimuth, elevation, scale, size, self.view_angle)


def overview(scouted, rows, look):
    """The whole survey with the misclosures as enlarged arrows."""
    xyz = scouted.before.xyz
    low, high = np.percentile(xyz, [0.5, 99.5], axis=0)
    focus = np.append((low + high)[:2] / 2, np.median(xyz[:, 2]))
    extent = np.ptp(np.stack([low, high]), axis=0)[:2]
    elevation = PLAN if extent.min() > SPREAD else OBLIQUE
    azimuth = 0.0 if elevation == PLAN else _along(xyz[:, :2])
    unit = look.camera(focus, azimuth, elevation, 1.0)
    inside = xyz[((xyz >= low) & (xyz <= high)).all(axis=1)]
    flat = (unit.axes[:2] @ (inside - focus).T).T
    ends = np.stack([flat.min(axis=0), flat.max(axis=0)])
    focus = focus + ends.mean(axis=0) @ unit.axes[:2]
    across, up = np.ptp(ends, axis=0)
    size = look.wide if look.wide and across > LONG * up else look.size
    scale = float(min(size[0] / across, size[1] / up) / MARGIN)
    residuals = [np.linalg.norm(r[k]) for r in rows for k in ("before", "after")]
    room = ARROW_SHARE * np.sqrt(size[0] * size[1]) / scale
    times = nice(room / max(residuals)) if rows and max(residuals) > 0 else 0.0
    marks = tuple(tuple(_symbols(rows, key, times)) for key in ("before", "after"))
    return View(
        "overview",
        _overview_title(rows),
        "",
        look.camera(focus, azimuth, elevation, scale, size),
        look.colour or "correction",
        marks=marks,
    )


def _along(plan):
    """The azimuth that lets a street of points (n, 2) run from left to right, north up."""
    east, north = np.linalg.eigh(np.cov((plan - plan[0]).T))[1][:, 1]
    azimuth = np.degrees(np.arctan2(east, north)) - 90.0
    return float(np.round((azimuth + 90.0) % 180.0 - 90.0))  # whole degrees, in [-90, 90]


def _overview_title(rows):
    """How far off the independent targets were and are."""
    role = "check" if any(row["role"] == "check" for row in rows) else "control"
    some = [row for row in rows if row["role"] == role]
    if not some:
        return "The whole survey; no target was seen"
    before, after = (
        np.sqrt(np.mean([np.sum(np.square(row[key])) for row in some]))
        for key in ("before", "after")
    )
    points = len({row["name"] for row in some})
    often = "" if points == len(some) else f", seen {len(some)} times"
    return (
        f"{points} {role} points{often}: {before:.2f} m off before, {after:.2f} m after (3D RMSE)"
    )


def _symbols(rows, key, times):
    """Arrows first, then a symbol for each target over them."""
    for row in rows:
        place = np.array(row["surveyed"])
        yield Mark("residual", np.stack([place, place + times * row[key]]), f"{times:,.0f}")
    for row in rows:
        yield Mark(tables.group(row), np.array([row["surveyed"]]), row["name"])


def target(rows, normal, points, trajectory, look):
    """A target close up, turned so that its misclosure is seen at full length.

    Parameters
    ----------
    rows : list of dict
        Of this target, one for each pass, as report.json has them.
    normal : (3,) array
        Of the target, either sign; NaN where it isn't known.
    points : ControlPoints
        Among them the target.
    trajectory : Trajectory
    look : Look
    """
    row = max(rows, key=lambda row: np.linalg.norm(row["before"]))  # the pass that is worst off
    surveyed, observed = np.array(row["surveyed"]), np.array(row["observed"])
    k = points.name.index(row["name"])
    size = points.size[k]
    facing = _facing(normal, trajectory.at(row["gps_time"]).position[0] - observed)
    seen_from = _aside(facing, row["before"])
    azimuth = np.degrees(np.arctan2(-seen_from[0], -seen_from[1]))
    elevation = np.degrees(np.arcsin(seen_from[2]))
    if elevation > PLAN - 1.0:
        azimuth = 0.0  # north is up
    half = np.linalg.norm(row["before"]) / 2 + 1.1 * size
    outline = Mark("surveyed", surveyed + _outline(points.kind[k], size, facing))
    marks = tuple(
        (outline, *(Mark("offset", np.stack([surveyed - r[key], surveyed])) for r in rows))
        for key in ("before", "after")
    )
    scale = min(look.size) / 2 / half
    return View(
        f"target-{row['name']}",
        _target_title(rows),
        f"{points.kind[k].capitalize()} of {size:g} m.",
        look.camera((surveyed + observed) / 2, azimuth, elevation, scale),
        look.colour or "intensity",
        half_depth=2 * half,
        marks=marks,
    )


def _target_title(rows):
    """How far off the target was and is, at most where it was seen several times."""
    before, after = (max(np.linalg.norm(row[key]) for row in rows) for key in ("before", "after"))
    group = tables.group(rows[0])
    role = "not used" if group == "unused" else f"{group} point"
    often = f" in {len(rows)} passes" if len(rows) > 1 else ""
    made = " (the correction was made with it)" if group == "control" else ""
    most = " at most" if len(rows) > 1 else ""
    return (
        f"{rows[0]['name']}, {role}{often}:{most} {before:.2f} m off before, {after:.2f} m after"
        f"{made}"
    )


def _facing(normal, to_vehicle):
    """The side of a target that was scanned: its unit normal towards the vehicle."""
    if not np.isfinite(normal).all():
        return to_vehicle / np.linalg.norm(to_vehicle)
    return normal if normal @ to_vehicle >= 0 else -normal


def _aside(facing, misclosure):
    """Where to look from: across the misclosure, and as near to face on as that allows."""
    length = np.linalg.norm(misclosure)
    if length < VISIBLE:
        return facing
    along = misclosure / length
    across = facing - (facing @ along) * along
    if np.linalg.norm(across) < 1e-3:  # the target moves straight to the eye
        across = np.array([0.0, -1.0, 0.0]) if abs(facing[2]) > 0.7 else np.array([0.0, 0.0, 1.0])
        across = across - (across @ facing) * facing
    across /= np.linalg.norm(across)
    angle = min(np.arccos(np.clip(facing @ across, -1, 1)), np.radians(ASIDE))
    sideways = across - (across @ facing) * facing
    if np.linalg.norm(sideways) > 1e-9:
        sideways /= np.linalg.norm(sideways)
    direction = np.cos(angle) * facing + np.sin(angle) * sideways
    direction[2] = max(direction[2], 0.0)  # not from under the road
    return direction / np.linalg.norm(direction)


def _outline(kind, size, normal):
    """A disc's or an upright square's outline about the origin: (n, 3) in m."""
    up = np.array([0.0, 1.0, 0.0]) if abs(normal[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)
    if kind == "square":
        corners = size / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    else:
        angle = np.linspace(0, 2 * np.pi, CORNERS)
        corners = size / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    return corners @ np.stack([right, up])


def section(scouted, look):
    """A cut through the wall where the correction shows best; None where there is no wall."""
    place = find_place(scouted)
    if place is None:
        return None
    across = place.normal
    half = abs(place.shift @ across) + ROOM * place.moved
    half = float(np.clip(half, LEAST, MOST))
    azimuth = float(np.degrees(np.arctan2(across[1], -across[0])))  # along the wall
    scale = look.size[0] / 2 / half
    high = look.size[1] / scale  # m
    focus = place.focus - place.shift / 2
    base = place.ground if place.foot - place.ground < high / 2 else place.foot
    focus[2] = base - place.shift[2] / 2 + 0.35 * high
    if place.split is None:
        title = f"Cross-section of a wall: the correction moves it by {place.moved:.2f} m"
    else:
        title = (
            f"Cross-section of a wall scanned twice: {place.before:.2f} m apart before, "
            f"{place.after:.2f} m after"
        )
    slab = float(np.clip(SLAB * half, *SLABS))
    east, north = place.focus[:2]
    return View(
        "section",
        title,
        f"At {east:.0f} E, {north:.0f} N. The same points on both sides: {2 * slab:.1f} m of the "
        "wall, end on.",
        look.camera(focus, azimuth, 0.0, scale),
        look.colour or ("state" if place.split is None else "visit"),
        half_depth=slab,
        is_cut=True,
        split=place.split,
    )
