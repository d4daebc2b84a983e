"""Which drives are estimated together: those that ties join."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mlscorr.estimate import Estimate
from mlscorr.pipeline.correction import estimate_together
from mlscorr.pipeline.project.joint import FoundDrive, JointDrives, join_drives


@dataclass(frozen=True)
class JointEstimate:
    """Drives that ties hold together, and the estimate of all of them.

    Parameters
    ----------
    joint : JointDrives
        With drives beside these, which nothing ties to them.
    estimate : Estimate
        Of all of the joint drives.
    names : set of str
        Of the drives that hold together.
    """

    joint: JointDrives
    estimate: Estimate
    names: set[str]


def estimate_group(
    group: Sequence[FoundDrive], order: int, origin: np.ndarray, with_ties: bool
) -> list[JointEstimate]:
    """The POS errors of drives near each other, of those together that ties join.

    Where ties part them, those with all of the control keep their estimate, which the others have
    not moved. These are estimated anew, without a shift in common with control that isn't theirs.

    Parameters
    ----------
    group : sequence of FoundDrive
    order : int
        Of the trend of a drive by itself; drives together have a shift in common.
    origin : (3,) array
        Of planes and poles. Units: m.
    with_ties : bool
    """
    joint = join_drives(group)
    features = joint.features(origin) if with_ties else None
    least = order if len(group) == 1 else min(order, 0)
    estimate = estimate_together(joint.survey, joint.control(), features, least)
    parts = _tied(joint, estimate)
    results = []
    owner = np.repeat([d.survey.name for d in joint.drives], [len(d.control) for d in joint.drives])
    controlled = set(owner[estimate.used].tolist())
    for part in parts:
        names = {drive.survey.name for drive in part}
        if len(parts) == 1 or (len(part) > 1 and controlled and controlled <= names):
            results.append(JointEstimate(joint, estimate, names))
        else:
            results += estimate_group(part, order, origin, with_ties)
    return results


def _tied(joint, estimate):
    """Lists of the drives that used ties join."""
    number = len(joint.drives)
    pairs = np.empty((2, 0), int)
    if estimate.ties is not None:
        pairs = joint.drive_numbers(estimate.ties.ties.pass_number[estimate.ties.used]).T
    graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(number, number))
    return _grouped(joint.drives, connected_components(graph, directed=False)[1])


def near_drives(drives: Sequence[FoundDrive]) -> list[list[FoundDrive]]:
    """Lists of drives whose planes and poles lie within the search radius, or about so.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    radius = max(drive.survey.search_radius for drive in drives)
    rows = [np.empty(0, int)]
    cells = [np.empty((0, 2), int)]
    for number, drive in enumerate(drives):
        own = np.unique(np.floor(drive.features.centre[:, :2] / radius).astype(int), axis=0)
        wide = np.concatenate([own + np.array([i, j]) for i in (0, 1) for j in (0, 1)])
        rows.append(np.full(len(wide), number))
        cells.append(wide)
    cell = np.unique(np.concatenate(cells), axis=0, return_inverse=True)[1].ravel()
    size = len(drives) + cell.max(initial=-1) + 1
    edges = np.concatenate(rows), len(drives) + cell
    graph = coo_array((np.ones(len(cell), bool), edges), shape=(size, size))
    return _grouped(drives, connected_components(graph, directed=False)[1][: len(drives)])


def _grouped(drives, labels):
    """Lists of drives of one label each, in the order of their first."""
    groups = [np.flatnonzero(labels == label) for label in dict.fromkeys(labels.tolist())]
    return [[drives[number] for number in group] for group in groups]
