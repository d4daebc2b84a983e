"""Targets of one piece of cloud: what extraction near control and search without it both call."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import PointCloud
from mlscorr.targets.beams import Pulses
from mlscorr.targets.clusters import FEWEST_POINTS
from mlscorr.targets.intensity import why_useless
from mlscorr.targets.plane import centre_of
from mlscorr.targets.seeds import bright_seeds, hole_seeds, plate_seeds, spot_seeds
from mlscorr.targets.shapes import BY_EDGES, sides
from mlscorr.targets.stages import exact_fit, met_target, rough_fit

THICKNESS = 0.03  # m off a plane: less than a post's or a frame's depth
SETTLED = 0.93  # overlap of a rough fit that needs no second
SAME_PLACE = 0.1  # of the size, from a settled fit to a seed of another level of the same blob


@dataclass(frozen=True)
class TargetView:
    """What a figure of one target shows, in its plane; (u, v) from an arbitrary origin, in m.

    Parameters
    ----------
    points : (k, 2) array
        Where the beams near the target crossed its plane.
    state : (k,) int array
        1 bright, 0 dark, -1 went by it.
    bright : (k,) bool array
        Whether each tells that it is inside: bright, or on a plate, or through a hole.
    centre : (2,) array
    covariance : (2, 2) array
        Of the centre in the plane. Units: m^2.
    turn : float
        Of a square's edges against u. Units: rad.
    inner : float
        Diameter of a ring's inner disc over the outer one's, 0 for none.
    outline : float
        Fitted diameter or edge, larger than the size where the disc blooms. Units: m.
    axes : (2, 3) array
        Map directions of u and v.
    """

    points: np.ndarray
    state: np.ndarray
    bright: np.ndarray
    centre: np.ndarray
    covariance: np.ndarray
    turn: float
    inner: float
    outline: float
    axes: np.ndarray


@dataclass(frozen=True)
class FittedTarget:
    """One target in one piece of cloud: what a row of TargetObservations holds, and more.

    Parameters
    ----------
    gps_time : float
        When the scanner passed the centre. Units: s.
    duration : float
        Standard deviation of its points' times. Units: s.
    position, normal : (3,) array
        Centre (m), and unit normal towards the scanner.
    covariance : (3, 3) array
        Of the centre, without the motion of the POS error. Units: m^2.
    kind : str
    size, size_sigma : float
        As given (sigma 0), or estimated. Units: m.
    points : int
        Number of points on the target; about a hole, on the board around it.
    score : float
        How target-like it is, 0 to 1: overlap, support of the outline, contrast and flatness.
    cloud : PointCloud
        These points.
    view : TargetView
    """

    gps_time: float
    duration: float
    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    kind: str
    size: float
    size_sigma: float
    points: int
    score: float
    cloud: PointCloud
    view: TargetView


def fit_targets(cloud, sight, shapes, scanner, rng, spot=None):
    """Fit targets of the given shapes in one piece of cloud of one pass and visit.

    Parameters
    ----------
    cloud : PointCloud
        A few metres of cloud.
    sight : (n, 3) array
        Scanner to point. Units: m.
    shapes : sequence of (kind, size or None)
        What to look for; where the size (m) is None it is estimated.
    scanner : Scanner
        Noise that blurs the outline.
    rng : numpy.random.Generator
        For the random samples in which flat patches are looked for.
    spot : Spot, optional
        The one bright blob to look at.

    Returns a list of FittedTarget, best first; no two at the same place. Where the intensity is
    of no use, plates that stand free are found by their edges.
    """
    if len(cloud) < FEWEST_POINTS:
        return []
    order = np.argsort(cloud.gps_time, kind="stable")
    origin = cloud.xyz.mean(axis=0)
    xyz = cloud.xyz[order] - origin
    time, intensity = cloud.gps_time[order], cloud.intensity[order].astype(float)
    tolerance = max(THICKNESS, 4 * scanner.range_noise)
    pulses = Pulses(xyz, time, intensity, sight[order], cKDTree(xyz), tolerance)
    blind = why_useless(intensity) is not None
    roughly = []
    for kind, size in shapes:
        if spot is None or blind:
            seeds = _seeds(pulses, kind, size, blind, rng)
        else:
            seeds = spot_seeds(pulses, spot, origin, kind, size)
        for seed in seeds:
            if not any(_settled(fit, seed, kind, size) for fit in roughly):
                fit = rough_fit(pulses, seed, kind, size)
                roughly += [fit] if fit is not None else []
    exact = [exact_fit(pulses, fit, scanner) for fit in _best(roughly)]
    exact = _best([fit for fit in exact if fit is not None])
    return [_as_target(pulses, fit, origin) for fit in exact]


def _seeds(pulses, kind, size, blind, rng):
    if kind == "hole":
        return hole_seeds(pulses, size, rng)
    if kind in BY_EDGES or blind:
        return plate_seeds(pulses, kind, size, rng)
    return bright_seeds(pulses, kind, size)


def _settled(fit, seed, kind, size):
    """Whether a good fit of the same shape is where a seed is: another level tells nothing new."""
    if (fit.kind, fit.size) != (kind, size) or fit.outline.overlap < SETTLED:
        return False
    middle = seed.plane.origin + seed.middle @ seed.plane.axes[:2]
    return np.linalg.norm(fit.position - middle) < SAME_PLACE * fit.outline.size


def _best(fits):
    """The best fit at each place, best first: half a target apart or less is one place."""
    best = []
    for one in sorted(fits, key=lambda fit: -fit.verdict.rank):
        for other in best:
            apart = np.linalg.norm(one.position - other.position)
            if apart < max(one.outline.size, other.outline.size) / 2:
                break
        else:
            best.append(one)
    return best


def _as_target(pulses, fit, origin):
    """The fit in the map: centre, covariance, normal towards the scanner, time at the centre."""
    points, state, rows = fit.beams
    plane, outline = fit.seed.plane, fit.outline
    met = rows[met_target(fit) & (rows >= 0)]
    centre = centre_of(pulses, plane, outline, met)
    turned = -plane.axes[2] if centre.away else plane.axes[2]
    size = (outline.size, outline.size_sigma) if fit.size is None else (fit.size, 0.0)
    told = sides(state, fit.kind, fit.seed.by_edges) == 1
    view = TargetView(
        points,
        state,
        told,
        outline.centre,
        outline.covariance,
        outline.turn,
        outline.inner,
        outline.size,
        plane.axes[:2],
    )
    return FittedTarget(
        gps_time=centre.gps_time,
        duration=centre.duration,
        position=centre.position + origin,
        covariance=centre.covariance,
        normal=turned,
        kind=fit.kind,
        size=float(size[0]),
        size_sigma=float(size[1]),
        points=len(met),
        score=fit.verdict.score,
        cloud=PointCloud(pulses.xyz[met] + origin, pulses.gps_time[met], pulses.intensity[met]),
        view=view,
    )
