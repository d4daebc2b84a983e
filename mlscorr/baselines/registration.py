"""ICP of the targets' points to the surveyed surfaces, without names."""

import warnings
from dataclasses import dataclass, field

import numpy as np
import open3d
from scipy.spatial import cKDTree

from mlscorr.baselines._settings import SETTINGS
from mlscorr.baselines.pairs import CentredPairs
from mlscorr.baselines.transformation import Transformation
from mlscorr.survey import Matched, PointCloud
from mlscorr.wording import percent


@dataclass(frozen=True)
class Registration(Transformation):
    """Motion found by ICP, and its fit.

    Parameters
    ----------
    variant : str
        ``point-to-point`` or ``point-to-plane``, whichever has smaller residuals at the control
        points.
    fitness : float
        Share of the targets' points within 0.05 m of a surveyed surface.
    inlier_rmse : float
        RMS of their distances. Units: m.
    control_before, control_after : float
        3D RMSE of the control points' misclosures. Units: m.
    """

    variant: str = field(kw_only=True)
    fitness: float = field(kw_only=True)
    inlier_rmse: float = field(kw_only=True)
    control_before: float = field(kw_only=True)
    control_after: float = field(kw_only=True)


def fit_icp(matched: Matched, cloud: PointCloud, pass_number: np.ndarray) -> Registration:
    """Fit a rigid motion by iterative closest points, from targets' points to surveyed surfaces.

    A surveyed surface is a disc or plate of the target's kind and size at the surveyed center and
    normal (the observed one if none was surveyed). Partners are searched coarse to fine: first
    within twice the largest misclosure of a control point, then within half of that, down to 0.05
    m. Each distance starts from the motion of the previous one, by point-to-point, followed by
    point-to-plane. The motion with the smallest RMSE at the control points is returned, because
    with POS drift, a small distance fits only some of the targets.

    Parameters
    ----------
    matched : Matched
        Observed control points.
    cloud : PointCloud
        Points near the targets.
    pass_number : (n,) int array
        Pass of each point.

    Returns
    -------
    Registration
        Warns if few points fit, or if the control points fit worse than before.

    Raises
    ------
    Undetermined
        For fewer than 3 targets, or targets on one line.
    """
    pairs = CentredPairs.of(matched)
    pairs.require(2, 3, "The 6 parameters of ICP")
    source, surface = _surfaces(matched, cloud, pass_number, pairs.origin)
    misclosure = np.linalg.norm(pairs.misclosure, axis=1)
    largest = 2.0 * max(float(misclosure.max()), SETTINGS.inlier)
    motions = _motions(source, surface, largest)
    variant, matrix = min(motions, key=lambda motion: _control_rmse(pairs, motion[1]))
    evaluate = open3d.pipelines.registration.evaluate_registration
    score = evaluate(source, surface, SETTINGS.inlier, matrix)
    change = matrix[:3, :3] - np.eye(3)
    registration = Registration(
        pairs.origin,
        matrix[:3, 3].copy(),
        change,
        variant=variant,
        fitness=float(score.fitness),
        inlier_rmse=float(score.inlier_rmse),
        control_before=_control_rmse(pairs, np.eye(4)),
        control_after=_control_rmse(pairs, matrix),
    )
    _warn(registration)
    return registration


def _motions(source, surface, largest):
    """Yield variant and 4 x 4 matrix of each kind of ICP within each distance, coarse to fine."""
    motions = []
    point = np.eye(4)
    within = largest
    while True:
        point = _register(source, surface, within, point, "PointToPoint")
        plane = _register(source, surface, within, point, "PointToPlane")
        motions += [("point-to-point", point), ("point-to-plane", plane)]
        if within <= SETTINGS.inlier:
            return motions
        within = max(within / 2, SETTINGS.inlier)


def _control_rmse(pairs, matrix):
    """3D RMSE of the control points' misclosures after a motion. Units: m."""
    change = matrix[:3, :3] - np.eye(3)
    remaining = pairs.misclosure - matrix[:3, 3] - pairs.observed @ change.T
    return float(np.sqrt(np.mean(np.sum(remaining**2, axis=1))))


def _warn(registration):
    """Warn of a doubtful registration."""
    variant = registration.variant
    fitness = registration.fitness
    if fitness < SETTINGS.poor_fitness:
        warnings.warn(
            f"No rigid motion fits: ICP ({variant}) brings only {percent(fitness)} of the "
            f"targets' points within {SETTINGS.inlier} m of the surveyed surfaces (inlier RMSE "
            f"{registration.inlier_rmse:.4f} m).",
            stacklevel=3,
        )
    if registration.control_after > registration.control_before + SETTINGS.worsening:
        warnings.warn(
            f"ICP ({variant}) made the fit to the control worse: 3D RMSE "
            f"{registration.control_before:.4f} m before, {registration.control_after:.4f} m "
            f"after (fitness {fitness:.2f}, inlier RMSE {registration.inlier_rmse:.4f} m).",
            stacklevel=3,
        )


def _register(source, surface, largest, start, estimation):
    """4 x 4 matrix of one ICP; points farther than the largest distance are not paired."""
    icp = open3d.pipelines.registration
    return icp.registration_icp(
        source,
        surface,
        largest,
        start,
        getattr(icp, f"TransformationEstimation{estimation}")(),
        icp.ICPConvergenceCriteria(max_iteration=SETTINGS.icp_iterations),
    ).transformation


def _surfaces(matched, cloud, pass_number, origin):
    """Targets' points and surveyed surfaces relative to the origin, as Open3D clouds."""
    tree = cKDTree(cloud.xyz)
    source = []
    surface = []
    normals = []
    observations = matched.observations
    surveyed = matched.surveyed
    for i in range(len(matched)):
        axes = _axes(observations.normal[i])
        local = _points_on(observations, i, axes, tree, cloud, pass_number)
        source.append(local @ axes[:2] + observations.position[i] - origin)
        facing = surveyed.normal[i]
        if np.isfinite(facing).all():
            axes = _axes(facing * np.sign(facing @ axes[2] or 1.0))
        grid = _outline(surveyed.kind[i], surveyed.size[i], local)
        surface.append(grid @ axes[:2] + surveyed.position[i] - origin)
        normals.append(np.tile(axes[2], (len(grid), 1)))
    return _as_open3d(source).voxel_down_sample(SETTINGS.spacing), _as_open3d(surface, normals)


def _as_open3d(points, normals=None):
    cloud = open3d.geometry.PointCloud()
    cloud.points = open3d.utility.Vector3dVector(np.vstack(points))
    if normals is not None:
        cloud.normals = open3d.utility.Vector3dVector(np.vstack(normals))
    return cloud


def _axes(normal):
    """Two axes in a plane and its normal, as rows (3, 3); the first is horizontal if possible."""
    up = [0.0, 0.0, 1.0]
    if abs(normal[2]) >= 0.9:
        up = [0.0, 1.0, 0.0]
    horizontal = np.cross(up, normal)
    horizontal /= np.linalg.norm(horizontal)
    return np.array([horizontal, np.cross(normal, horizontal), normal])


def _points_on(observations, i, axes, tree, cloud, pass_number):
    """Bright points (n, 2) of one target in its plane, relative to its observed center. Units:
    m.
    """
    size = observations.size[i]
    radius = size / 2
    if observations.kind[i] != "circle":
        radius = size / np.sqrt(2)
    rows = np.array(tree.query_ball_point(observations.position[i], radius), dtype=int)
    rows = np.sort(rows[pass_number[rows] == observations.pass_number[i]])
    local = (cloud.xyz[rows] - observations.position[i]) @ axes.T
    on_plane = np.abs(local[:, 2]) < SETTINGS.plane_tolerance
    local = local[on_plane, :2]
    intensity = cloud.intensity[rows[on_plane]]
    core = np.linalg.norm(local, axis=1) < size / 3  # inside any outline
    return local[intensity >= 0.5 * (np.median(intensity[core]) if core.any() else 0.0)]


def _outline(kind, size, local):
    """Grid (n, 2) over a disc, or over a plate oriented like the target's points."""
    half = np.arange(0.0, size / 2 + 1e-9, SETTINGS.spacing)
    line = np.concatenate([-half[:0:-1], half])
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    if kind == "circle":
        return grid[np.linalg.norm(grid, axis=1) <= size / 2 + 1e-9]
    if len(local) < 3:
        return grid
    turn = np.radians(np.arange(0.0, 90.0, 1.0))
    directions = np.stack([np.cos(turn), np.sin(turn)])
    across = np.stack([-np.sin(turn), np.cos(turn)])
    area = np.ptp(local @ directions, axis=0) * np.ptp(local @ across, axis=0)
    best = int(np.argmin(area))  # smallest rectangle around the points
    return grid @ np.stack([directions[:, best], across[:, best]])
