"""The rows that a survey will have, from its geometry alone: before anyone drives."""

import numpy as np

from mlscorr.gap.assemble import assemble, sample_pulses
from mlscorr.gap.background import BELIEVED
from mlscorr.gap.estimate import DETECTABLE
from mlscorr.gap.patches import GRAZING
from mlscorr.gap.rows import Rows
from mlscorr.gap.surfaces import REFERENCE_SIGMA
from mlscorr.gap.whitening import whitener
from mlscorr.simulate.mesh_scene import read_mesh
from mlscorr.simulate.scenario import Scenario, SceneScenario
from mlscorr.simulate.shapes import ray_caster, sees

REACH = 40.0  # m from the scanner: farther, a target of 0.6 m has too few points
FACETS = 400  # of a reference surface, at most
STEP = 0.1  # s between the epochs at which the scan plane is looked at
EXTRACTION = 0.002  # m, one sigma of a target's centre: python benchmarks/target_study.py
POINTS = 80  # of a patch of a reference surface: several hundred in a street
INTENSITY = 20000.0  # counts of 16 bits: bright, as targets are
TOWARDS = 0.05  # m before a facet, where nothing may stand in the way


def planned_rows(survey, rng=None):
    """Rows of targets, and of a reference surface where there is one, as they will be seen.

    Each is seen once a pass, when the scan plane sweeps over it within REACH; the residuals are
    zero. The cloud isn't read.

    Parameters
    ----------
    survey : Survey
        With a mounting, and a planned or recorded trajectory.
    rng : numpy.random.Generator, optional
        Chooses among the facets of the reference.

    Raises ValueError without a mounting, or when nothing will be seen.
    """
    if survey.mounting is None:
        raise ValueError(
            f"{survey.path} has no [mounting]: without it nobody knows where the scanner looks. "
            "Give lever_arm and boresight as they are planned."
        )
    targets = survey.control + survey.check
    parts = []
    if len(targets):
        parts.append(_targets(survey, targets))
    if survey.reference is not None:
        parts.append(_facets(survey, np.random.default_rng(0) if rng is None else rng))
    rows = Rows.concatenate([part for part in parts if len(part)]) if any(map(len, parts)) else None
    if rows is None:
        raise ValueError(
            f"None of {len(targets)} targets will come within {REACH:.0f} m before the scanner on "
            f"this trajectory, and {'the' if survey.reference else 'no'} [scene] reference "
            f"{'is out of its sight' if survey.reference else 'is given'}. Are control and "
            "trajectory in the same CRS?"
        )
    return rows


def _targets(survey, targets):
    which, time, number = sweeps(survey, targets.position)
    n, item = len(which), np.arange(len(which))
    place = targets.position[which]
    normal = np.where(np.isfinite(targets.normal[which]), targets.normal[which], _facing(
        survey, place, time))  # fmt: skip
    pulses = sample_pulses(survey, item, np.ones(n), place, time, np.full(n, INTENSITY), normal)
    return assemble(
        survey, "target", np.repeat(item, 3), np.repeat(time, 3), np.repeat(place, 3, axis=0),
        np.tile(np.eye(3), (n, 1)), np.zeros(3 * n), np.full(3 * n, EXTRACTION**2),
        np.full(3 * n, POINTS), pulses, np.repeat(number, 3), survey_item=np.repeat(which, 3),
        survey_factor=(targets.sigma[which][:, :, None] * np.eye(3)).reshape(-1, 3),
    )  # fmt: skip


def _facets(survey, rng):
    """Rows of a sample of the reference's facets, by their areas, that nothing hides."""
    origin = np.round(survey.trajectory.position.mean(axis=0))
    scene = SceneScenario(kind="mesh", file=survey.reference)
    mesh = read_mesh(Scenario(scene=scene, origin=tuple(origin)))
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(area), 4 * FACETS, p=area / area.sum())
    u, v = np.sort(rng.random((2, len(chosen))), axis=0)
    place = u[:, None] * a[chosen] + (v - u)[:, None] * b[chosen] + (1 - v)[:, None] * c[chosen]
    which, time, number = sweeps(survey, place + origin)
    place, normal = place[which] + origin, (cross / area[:, None])[chosen][which]
    sight = _scanner(survey, time) - place
    away = np.linalg.norm(sight, axis=1)
    slant = np.einsum("ni,ni->n", normal, sight) / away
    start = place + sight / away[:, None] * TOWARDS
    seen = (np.abs(slant) >= GRAZING) & sees(
        ray_caster(mesh.triangles), start - origin, start + sight * 0.99 - origin
    )
    rows = np.flatnonzero(seen)[:FACETS]
    n, item, normal = len(rows), np.arange(len(rows)), normal[rows] * np.sign(slant[rows])[:, None]
    noise = REFERENCE_SIGMA**2 + survey.scanner.range_noise**2 / POINTS
    pulses = sample_pulses(
        survey, item, np.ones(n), place[rows], time[rows], np.full(n, INTENSITY), normal
    )
    return assemble(
        survey, "surface", item, time[rows], place[rows], normal, np.zeros(n), np.full(n, noise),
        np.full(n, POINTS), pulses, number[rows],
    )  # fmt: skip


def sweeps(survey, place):
    """When the scan plane sweeps over places (k, 3): index, time and pass, (n,) each.

    Once a pass: where the scanner is nearest.
    """
    trajectory, found = survey.trajectory, []
    origin = trajectory.position.mean(axis=0)
    segments = trajectory.segment(trajectory.gps_time)
    for number in range(len(trajectory.gaps) + 1):
        span = trajectory.gps_time[segments == number][[0, -1]]
        time = np.linspace(*span, max(2, int((span[1] - span[0]) / STEP)))
        pose = trajectory.at(time)
        axis = pose.attitude.apply(survey.mounting.boresight.apply([0.0, 0.0, 1.0]))
        scanner = pose.position + pose.attitude.apply(survey.mounting.lever_arm) - origin
        local = place - origin
        out = local @ axis.T - np.einsum("ei,ei->e", axis, scanner)
        square = (local**2).sum(1)[:, None] - 2 * local @ scanner.T + (scanner**2).sum(1)
        crossed = (out[:, :-1] * out[:, 1:] <= 0) & (square[:, :-1] <= REACH**2)
        nearest = np.argmin(np.where(crossed, square[:, :-1], np.inf), axis=1)
        k = np.flatnonzero(crossed[np.arange(len(place)), nearest])
        i = nearest[k]
        a, b = out[k, i], out[k, i + 1]
        share = np.where(a != b, a / np.where(a != b, a - b, 1.0), 0.0)
        found.append((k, time[i] + share * (time[i + 1] - time[i]), np.full(len(k), number + 1)))
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))


def _scanner(survey, time):
    pose = survey.trajectory.at(time)
    return pose.position + pose.attitude.apply(survey.mounting.lever_arm)


def _facing(survey, place, time):
    sight = _scanner(survey, time) - place
    return sight / np.linalg.norm(sight, axis=1, keepdims=True)


def event_sizes(observed, signatures):
    """Minimal detectable bias of events, the median over their bank: name -> (names, units, (p,)).

    The others are in Separability.
    """
    factor, found = whitener(observed, BELIEVED), {}
    for one in signatures:
        if one.is_noise or not ({"time", "target"} & set(one.fixed)):
            continue
        information = factor.whiten(observed.columns(one.jacobian)).squares
        size = DETECTABLE / np.sqrt(np.maximum(information, 1e-300))
        found.setdefault(one.name, (one.parameters, one.units, []))[2].append(size)
    return {name: (p, u, np.median(sizes, axis=0)) for name, (p, u, sizes) in found.items()}
