"""The pulses on which rows stand, read again from the clouds: to be fired again by rerun."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.about_targets import TargetLook, about_target, in_order, target_looks
from mlscorr.gap.patches import place_key
from mlscorr.io.las import read_chunks
from mlscorr.simulate.mesh_scene import read_mesh
from mlscorr.simulate.replay import RecordedPulses, aim, recorded_platform, recorded_pulses
from mlscorr.simulate.scenario import Scenario, SceneScenario
from mlscorr.simulate.worlds import Boards, MeshWorld
from mlscorr.survey import PointCloud

MOST = 400  # pulses of a patch, evenly taken: its mean is then known to a twentieth of the noise
INSIDE = 3.5  # sigmas from a patch's plane, as when it was found
LEAST_SIGMA = 0.5e-3  # m: what rounding to a millimetre leaves


@dataclass(frozen=True)
class Beams:
    """Pulses of a survey by looks: one of each patch or target; two of a shared plane.

    Parameters
    ----------
    pulses : RecordedPulses
        n of them, look after look.
    look : (n,) int array
    item : (l,) int array
        Of Rows, for each look.
    gps_time : (l,) array
        Of the item's rows: so that rows of another survey are told. Units: s.
    second : (l,) bool array
        Whether it is a shared plane's second look.
    target : (l,) int array
        Number of the board of a look at a target; -1 for patches.
    point, normal : (l, 3) array
        Plane of a patch, about the origin (m), and its unit normal towards the scanner.
    boards : Boards
        Targets as they were observed, one for each look at them.
    beyond, behind : (n,) array
        Range over that of a target's plane (m), and intensity, of what a pulse about a target
        meets without it; NaN where it meets nothing, and for patches.
    reference : MeshWorld or None
        The reference surface, about the origin.
    facet : (n,) int array
        Its triangle that the recorded beam meets; -1 for none.
    origin : (3,) array
        Units: m.
    """

    pulses: RecordedPulses
    look: np.ndarray
    item: np.ndarray
    gps_time: np.ndarray
    second: np.ndarray
    target: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    boards: Boards
    beyond: np.ndarray
    behind: np.ndarray
    reference: MeshWorld | None
    facet: np.ndarray
    origin: np.ndarray

    def __len__(self):
        return len(self.item)


@dataclass(frozen=True)
class _Patch:
    """A patch to look for: its item, one of its points, its normal, and a few of its points."""

    item: int
    second: bool
    xyz: np.ndarray
    time: float
    normal: np.ndarray
    samples: np.ndarray


def collect_beams(survey, rows, finding, progress=None):
    """Beams of the pulses on which rows stand, by one more reading of the clouds.

    Parameters
    ----------
    survey : Survey
    rows : Rows
        As build_rows gives them.
    finding : Finding
        Of the same survey: its targets as fitted.
    progress : function of a number of points, optional

    Memory is one chunk, and at most 400 pulses for each patch. Rows whose pulses are not found
    have none in Beams.
    """
    origin = np.round(rows.position.mean(axis=0))
    platform = recorded_platform(survey, origin)
    patches, looks = _patches(rows), target_looks(rows, finding)
    key = np.array([place_key(p.xyz[None], np.array([p.time]))[0] for p in patches], np.uint64)
    order = np.argsort(key, kind="stable")
    patches, key = [patches[i] for i in order], key[order]
    found, about = {}, {i: [] for i in range(len(looks))}
    for file in survey.clouds:
        for chunk in read_chunks(file):
            inside = chunk[survey.trajectory.segment(chunk.gps_time) >= 0]
            _take_patches(inside, patches, key, found)
            inside = in_order(inside)
            for i, look in enumerate(looks):
                about[i] += about_target(platform, inside, look, origin)
            if progress is not None:
                progress(len(chunk))
    parts = [(patches[i], found[i]) for i in sorted(found)]
    targets = [(look, TargetLook.join(look, about[i])) for i, look in enumerate(looks) if about[i]]
    return _beams(survey, rows, platform, origin, parts, targets)


def _patches(rows):
    """The patches behind rows, as their sample pulses tell them."""
    on_target = np.isin(rows.pulses.item, rows.item[rows.channel == "target"])
    pulses = rows.pulses[~on_target]
    second = pulses.weight < 0
    order = np.lexsort((pulses.gps_time, second, pulses.item))
    pulses, second = pulses[order], second[order]
    begins = np.flatnonzero((np.diff(pulses.item) != 0) | (np.diff(second) != 0)) + 1
    patches = []
    for part in np.split(np.arange(len(pulses)), begins) if len(pulses) else []:
        middle = part[len(part) // 2]
        place = pulses.xyz[middle], pulses.gps_time[middle], pulses.normal[middle]
        patches.append(_Patch(pulses.item[middle], bool(second[middle]), *place, pulses.xyz[part]))
    return patches


def _take_patches(chunk, patches, key, found):
    """Add to found, by the number of the patch, its points in a chunk: a PointCloud."""
    if len(patches) == 0 or len(chunk) == 0:
        return
    here = place_key(chunk.xyz, chunk.gps_time)
    place = np.minimum(np.searchsorted(key, here), len(key) - 1)
    rows = np.flatnonzero(key[place] == here)
    if len(rows) == 0:
        return
    rows = rows[np.argsort(place[rows], kind="stable")]
    place = place[rows]
    bounds = np.searchsorted(place, place[np.append(True, np.diff(place) != 0)[: len(place)]])
    for first, last in zip(bounds, [*bounds[1:], len(rows)], strict=True):
        points = chunk[rows[first:last]]
        number = place[first]  # of the first patch of this cell and moment
        while number < len(key) and key[number] == key[place[first]]:
            patch = patches[number]
            if ((points.gps_time == patch.time) & (points.xyz == patch.xyz).all(axis=1)).any():
                found[number] = _on_plane(points, patch)
            number += 1


def _on_plane(points, patch):
    """Points on a patch's plane, in order of time, at most MOST."""
    height = (points.xyz - patch.xyz) @ patch.normal
    sample = (patch.samples - patch.xyz) @ patch.normal
    middle, sigma = np.median(sample), max(sample.std(), LEAST_SIGMA)
    for _ in range(4):
        on = np.abs(height - middle) <= INSIDE * sigma
        middle, sigma = height[on].mean(), max(height[on].std(), LEAST_SIGMA)
    rows = np.flatnonzero(np.abs(height - middle) <= INSIDE * sigma)
    rows = rows[np.argsort(points.gps_time[rows], kind="stable")]
    if len(rows) > MOST:
        rows = rows[((np.arange(MOST) + 0.5) * len(rows) / MOST).astype(int)]
    return points[rows]


def _beams(survey, rows, platform, origin, patches, targets):
    """Beams of pairs (_Patch, PointCloud) and (Sighting, TargetLook)."""
    pulses, count = _joined(platform, origin, patches, targets)
    if len(count) == 0:
        raise ValueError(
            f"None of the pulses behind {len(rows)} rows is in the clouds of {survey.path}: the "
            "rows are of another survey, or the files have changed."
        )
    look = np.repeat(np.arange(len(count)), count)
    item = np.array([one.item for one, _ in [*patches, *targets]])
    second = np.array([one.second for one, _ in patches] + [False] * len(targets))
    normal = np.array([one.normal for one, _ in patches] + [np.zeros(3)] * len(targets))
    start, direction = aim(platform, pulses.gps_time, pulses.angle, pulses.elevation)
    point = _middle(start + pulses.range[:, None] * direction, look, len(count))
    known, row = np.unique(rows.item, return_index=True)
    nothing = np.full(int(count[: len(patches)].sum()), np.nan)
    reference = _reference(survey, rows, origin)
    facet = np.full(len(look), -1)
    if reference is not None:
        on = np.isin(item, rows.item[rows.channel == "surface"])[look]
        facet[on] = reference.cast(start[on], direction[on])
    boards = [about.board for _, about in targets]
    return Beams(
        pulses=pulses,
        look=look,
        item=item,
        gps_time=rows.gps_time[row[np.searchsorted(known, item)]],
        second=second,
        target=np.append(np.full(len(patches), -1), np.arange(len(targets))).astype(int),
        point=point,
        normal=normal,
        boards=Boards.concatenate(boards),
        beyond=np.concatenate([nothing, *(about.beyond for _, about in targets)]),
        behind=np.concatenate([nothing, *(about.behind for _, about in targets)]),
        reference=reference,
        facet=facet,
        origin=origin,
    )


def _joined(platform, origin, patches, targets):
    """RecordedPulses of all looks, patches first, and the number (l,) of each look."""
    count = [len(cloud) for _, cloud in patches] + [len(about.pulses) for _, about in targets]
    several = [about.pulses for _, about in targets]
    if patches:
        cloud = PointCloud.concatenate([cloud for _, cloud in patches])
        normals = np.repeat([patch.normal for patch, _ in patches], count[: len(patches)], axis=0)
        several.insert(0, recorded_pulses(platform, cloud, origin, normals))
    return RecordedPulses.concatenate(several) if several else None, np.array(count)


def _middle(xyz, look, count):
    """Mean (l, 3) of the points of each look."""
    number = np.bincount(look, minlength=count)
    return np.column_stack([np.bincount(look, axis, count) / number for axis in xyz.T])


def _reference(survey, rows, origin):
    """The reference surface about the origin, where there are rows on it."""
    if survey.reference is None or not (rows.channel == "surface").any():
        return None
    scene = SceneScenario(kind="mesh", file=survey.reference)
    return MeshWorld(read_mesh(Scenario(scene=scene, origin=tuple(origin))))
