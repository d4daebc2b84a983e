"""Pulses behind the rows, for replay in rerun."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mlscorr.gap.closure.surroundings import SightedTarget, Surroundings, sightings_of
from mlscorr.gap.residuals import Patches, Rows
from mlscorr.simulate import SceneScenario, scan
from mlscorr.simulate.scene import read_mesh
from mlscorr.surfaces import place_key
from mlscorr.survey import PointCloud, Survey


@dataclass(frozen=True)
class Beams:
    """Pulses of a survey by views: one for each patch or target; two for a shared plane.

    Parameters
    ----------
    pulses : RecordedPulses
        n of them, view after view.
    view : (n,) int array
    item : (l,) int array
        Of Rows, for each view.
    gps_time : (l,) array
        Time of the item's rows, which identifies rows of another survey. Units: s.
    second : (l,) bool array
        True for a shared plane's second view.
    target : (l,) int array
        Index of the board of a view of a target; -1 for patches.
    point, normal : (l, 3) array
        Plane of a patch, relative to the origin (m), and its unit normal toward the scanner.
    boards : Boards
        Targets as observed, one for each view of them.
    beyond, behind : (n,) array
        Range beyond a target's plane (m), and intensity, of the background of a pulse near a
        target; NaN without a background, and for patches.
    reference : MeshWorld or None
        The reference surface, about the origin.
    facet : (n,) int array
        Its triangle that the recorded beam meets; -1 for none.
    origin : (3,) array
        Units: m.
    """

    pulses: scan.RecordedPulses
    view: np.ndarray
    item: np.ndarray
    gps_time: np.ndarray
    second: np.ndarray
    target: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    boards: scan.Boards
    beyond: np.ndarray
    behind: np.ndarray
    reference: scan.MeshWorld | None
    facet: np.ndarray
    origin: np.ndarray

    def __len__(self):
        return len(self.item)


@dataclass(frozen=True)
class _Patch:
    """Patch behind rows: their item, flag of the second view, normal and points."""

    item: int
    second: bool
    normal: np.ndarray
    cloud: PointCloud


def collect_beams(
    survey: Survey, rows: Rows, finding: Any, patches: Patches | None, surroundings: Surroundings
) -> Beams:
    """Collect the Beams of the pulses behind rows.

    Parameters
    ----------
    survey : Survey
    rows : Rows
        From build_rows.
    finding : Finding
        Finding of the same survey, with its fitted targets.
    patches : Patches or None
        Patches of the rows.
    surroundings : Surroundings
        Surroundings of the surveyed targets, after all clouds were read.

    Rows whose pulses are not found have none in Beams.

    Raises
    ------
    ValueError
        If rows belong to another survey.
    """
    origin = np.round(rows.position.mean(axis=0))
    platform = scan.recorded_platform(survey, origin)
    about = [(s, surroundings.about(platform, s, origin)) for s in sightings_of(rows, finding)]
    targets = [(s, SightedTarget.join(s, parts)) for s, parts in about if parts]
    return _beams(survey, rows, platform, origin, _patches_behind(rows, patches), targets)


def _patches_behind(rows, patches):
    """Patches behind rows, identified by their sample pulses, in order of their cells."""
    pulses = rows.pulses[~np.isin(rows.pulses.item, rows.item[rows.channel == "target"])]
    if len(pulses) == 0 or patches is None:
        return []
    samples = zip(patches.time.ravel(), *patches.xyz.reshape(-1, 3).T, strict=True)
    known = {sample: i // patches.time.shape[1] for i, sample in enumerate(samples)}
    pulses = pulses[np.unique(2 * pulses.item + (pulses.weight < 0), return_index=True)[1]]
    second = pulses.weight < 0
    behind = []
    for i in np.argsort(place_key(pulses.xyz, pulses.gps_time), kind="stable"):
        number = known.get((pulses.gps_time[i], *pulses.xyz[i]))
        if number is not None:
            cloud = patches.cloud[number]
            behind.append(_Patch(pulses.item[i], bool(second[i]), pulses.normal[i], cloud))
    return behind


def _beams(survey, rows, platform, origin, patches, targets):
    """Beams of _Patches and pairs (Sighting, SightedTarget)."""
    pulses, count = _joined(platform, origin, patches, targets)
    if len(count) == 0:
        raise ValueError(
            f"None of the pulses behind {len(rows)} residuals is in the clouds of {survey.path}: "
            "they belong to another survey, or the files have changed."
        )
    view = np.repeat(np.arange(len(count)), count)
    item = np.array([part.item for part in [*patches, *(sighting for sighting, _ in targets)]])
    second = np.array([patch.second for patch in patches] + [False] * len(targets))
    normal = np.array([patch.normal for patch in patches] + [np.zeros(3)] * len(targets))
    start, direction = scan.aim(platform, pulses.gps_time, pulses.angle, pulses.elevation)
    point = _middle(start + pulses.range[:, None] * direction, view, len(count))
    known, row = np.unique(rows.item, return_index=True)
    nothing = np.full(int(count[: len(patches)].sum()), np.nan)
    reference = _reference(survey, rows, origin)
    facet = np.full(len(view), -1)
    if reference is not None:
        on = np.isin(item, rows.item[rows.channel == "surface"])[view]
        facet[on] = reference.cast(start[on], direction[on])
    return Beams(
        pulses=pulses,
        view=view,
        item=item,
        gps_time=rows.gps_time[row[np.searchsorted(known, item)]],
        second=second,
        target=np.append(np.full(len(patches), -1), np.arange(len(targets))).astype(int),
        point=point,
        normal=normal,
        boards=scan.Boards.concatenate([about.board for _, about in targets]),
        beyond=np.concatenate([nothing, *(about.beyond for _, about in targets)]),
        behind=np.concatenate([nothing, *(about.behind for _, about in targets)]),
        reference=reference,
        facet=facet,
        origin=origin,
    )


def _joined(platform, origin, patches, targets):
    """RecordedPulses of all views, patches first, and the number (l,) of each view."""
    count = [len(patch.cloud) for patch in patches] + [len(about.pulses) for _, about in targets]
    parts = [about.pulses for _, about in targets]
    if patches:
        cloud = PointCloud.concatenate([patch.cloud for patch in patches])
        normals = np.repeat([patch.normal for patch in patches], count[: len(patches)], axis=0)
        parts.insert(0, scan.recorded_pulses(platform, cloud, origin, normals))
    pulses = None
    if parts:
        pulses = scan.RecordedPulses.concatenate(parts)
    return pulses, np.array(count)


def _middle(xyz, view, count):
    """Mean (l, 3) of the points of each view."""
    number = np.bincount(view, minlength=count)
    return np.column_stack([np.bincount(view, axis, count) / number for axis in xyz.T])


def _reference(survey, rows, origin):
    """Reference surface relative to the origin, if there are rows on it."""
    if survey.reference is None or not (rows.channel == "surface").any():
        return None
    return scan.MeshWorld(read_mesh(SceneScenario(kind="mesh", file=survey.reference), origin))
