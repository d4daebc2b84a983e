"""Pairing of observations with their simulation, as Rows."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from mlscorr.correction import Correction
from mlscorr.gap.residuals._surfaces import (
    OnReference,
    on_reference,
    patch_pulses,
    shared_rows,
    spread,
)
from mlscorr.gap.residuals.channels import return_rate, roughness
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import (
    Rows,
    SamplePulses,
    assemble,
    sample_pulses,
    scanner_origin,
)
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import Matched, Survey, TargetObservations
from mlscorr.targets import SETTINGS as TARGETS
from mlscorr.targets import Candidates

NO_INTENSITY = (
    "Intensity is not compared: neither survey.toml nor a reference surface states the expected "
    "values."
)


@dataclass(frozen=True)
class Pairing:
    """Survey compared with its simulation.

    Parameters
    ----------
    rows : Rows
        Rows for the diagnosis.
    check : Rows
        Check points, never used in an estimate, only for the final test.
    notes : tuple of str
        Items that could not be compared, with reasons.
    """

    rows: Rows
    check: Rows
    notes: tuple[str, ...]


def build_rows(
    survey: Survey,
    matched: TargetObservations,
    candidates: Candidates,
    patches: Patches | None,
    limit: int = SETTINGS.patches,
    correction: Correction | None = None,
) -> Pairing:
    """Compare a survey with its simulator's assumptions: targets, surfaces, channels.

    The simulation has targets at their surveyed positions, surfaces on the reference, and planes of
    two passes on each other. Check points go to ``check``.

    Parameters
    ----------
    survey : Survey
    matched : TargetObservations
        Matched observations of control and check points.
    candidates : Candidates
        Points near targets, from find_targets.
    patches : Patches or None
        Patches of its clouds, from find_patches.
    limit : int
        Largest number of patches on surfaces, and of those in shared planes; the choice is
        reproducible.
    correction : Correction, optional
        Used to pair patches if drift of meters would pair them wrongly. Recorded positions are
        compared.

    Raises
    ------
    ValueError
        If the reference surface is unusable, or there is nothing to compare.

    >>> import numpy as np, tempfile
    >>> from mlscorr.gap.residuals.patches import find_patches
    >>> from mlscorr.io.surveys.survey_file import read_survey
    >>> from mlscorr.pipeline import find_targets, match_targets
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 5.0},
    ...     targets={"control": 3, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = read_survey(folder)
    >>> found = match_targets(find_targets(survey), survey)
    >>> patches = find_patches(survey)
    >>> pairing = build_rows(survey, found.matches.matched, found.candidates, patches)
    >>> sorted(set(pairing.rows.channel.tolist()))
    ['return_rate', 'roughness', 'target']
    """
    is_check = np.array([name in survey.check.name for name in matched.name], dtype=bool)
    parts = [target_rows(survey, matched[~is_check], candidates)]
    check = target_rows(survey, matched[is_check], candidates)
    notes = [NO_INTENSITY]
    if patches is not None:
        parts += _patch_rows(survey, patches, limit, correction, notes)
    else:
        notes.append("The cloud has no flat patch: surfaces and channels are not compared.")
    rows = Rows.concatenate(parts)
    if len(rows) == 0:
        raise ValueError(
            f"There is nothing to compare: {len(matched)} targets were matched, none of them a "
            "control point, and no flat patch was scanned twice or is on the reference surface. "
            "Survey targets, or set scene.reference."
        )
    return Pairing(rows, check, tuple(notes))


def target_rows(survey: Survey, matched: TargetObservations, candidates: Candidates) -> Rows:
    """Make rows of matched targets, three each, along the axes of the extraction's covariance.

    Their noise is then independent; for a diagonal covariance the axes are E, N and H. The item is
    the observation's row; its pulses are points within the target's outline.

    Parameters
    ----------
    survey : Survey
    matched : TargetObservations
    candidates : Candidates
        Points on the targets.
    """
    pairs = Matched.by_name(matched, survey.surveyed)
    axes, variance = _axes(matched.covariance)
    residual = np.einsum("nij,nj->ni", axes, -pairs.misclosure)
    factor = axes * pairs.surveyed.sigma[:, None, :]
    item = np.arange(len(matched))
    near = _near(matched, candidates)
    pulses = [_target_pulses(survey, matched, i, candidates.cloud[near[i]]) for i in item]
    return assemble(
        survey,
        "target",
        np.repeat(item, 3),
        np.repeat(matched.gps_time, 3),
        np.repeat(matched.position, 3, axis=0),
        axes.reshape(-1, 3),
        residual.ravel(),
        variance.ravel(),
        np.repeat(matched.points, 3),
        SamplePulses.concatenate([_no_pulses(), *pulses]),
        np.repeat(matched.pass_number, 3),
        survey_item=np.repeat(survey.surveyed.rows(matched.name), 3),
        survey_factor=factor.reshape(-1, 3),
    )


def _axes(covariance):
    """Unit axes (n, 3, 3), in rows, of covariances (n, 3, 3), and the variances (n, 3) along them.

    Each row is the axis nearest to E, N or H, with positive direction.
    """
    variance, axes = np.linalg.eigh(covariance)
    axes = axes.swapaxes(1, 2)
    for i in range(len(axes)):
        _, order = linear_sum_assignment(-np.abs(axes[i].T))
        axes[i] = axes[i][order]
        variance[i] = variance[i][order]
        axes[i] *= np.sign(np.diag(axes[i]))[:, None] + (np.diag(axes[i]) == 0)[:, None]
    return axes, variance


def _near(matched, candidates):
    """Rows of the candidates on each observed target, in order of time; a list of n arrays."""
    cloud = candidates.cloud
    near = cKDTree(cloud.xyz).query_ball_point(matched.position, SETTINGS.on_target * matched.size)
    targets = []
    for i, on_target in enumerate(near):
        rows = np.array(on_target, dtype=int)
        on = candidates.pass_number[rows] == matched.pass_number[i]
        on &= np.abs(cloud.gps_time[rows] - matched.gps_time[i]) <= MATCHING.visit_gap
        off = np.abs((cloud.xyz[rows] - matched.position[i]) @ matched.normal[i])
        on &= off <= TARGETS.thickness
        targets.append(rows[on][np.argsort(cloud.gps_time[rows[on]])])
    return targets


def _target_pulses(survey, matched, i, cloud):
    """Pulses on one observed target, evenly sampled; only its center if no point is near."""
    if len(cloud) == 0:
        xyz = matched.position[[i]]
        time = matched.gps_time[[i]]
        intensity = np.ones(1)
    else:
        samples = SETTINGS.samples
        taken = cloud[((np.arange(samples) + 0.5) * len(cloud) / samples).astype(int)]
        xyz = taken.xyz
        time = taken.gps_time
        intensity = taken.intensity
    k = len(xyz)
    normal = np.broadcast_to(matched.normal[i], (k, 3))
    return sample_pulses(survey, np.full(k, i), np.full(k, 1 / k), xyz, time, intensity, normal)


def _no_pulses():
    none = np.empty(0)
    place = np.empty((0, 3))
    return SamplePulses(none.astype(int), none, none, place, place, none, place, none)


def _patch_rows(survey, patches, limit, correction, notes):
    """Parts of the Rows from patches; adds notes on what is missing."""
    parts = []
    rng = np.random.default_rng(0)
    shared = shared_rows(survey, patches, rng, limit, correction)
    if shared is None:
        notes.append("No plane was scanned twice: passes are not compared with each other.")
    else:
        parts.append(shared)
    if survey.reference is None:
        notes.append("No [scene] reference is given: surfaces are not compared with one.")
        patches = patches[spread(_covered(survey, patches), limit, rng)]
        surface = None
    else:
        surface = on_reference(survey, patches, correction)
        kept = spread(_covered(survey, patches[surface.patch]), limit, rng)
        patches = patches[surface.patch[kept]]
        surface = surface[kept]
    parts.append(patch_rows(survey, patches, surface))
    if "return_rate" not in parts[-1].channel:
        notes.append(
            "The return rate is unknown: the time stamps have no regular step, or the cloud was "
            "thinned."
        )
    return parts


def _covered(survey, patches):
    """Columns (p,) over which a choice of patches is spread."""
    counts = np.log10(np.maximum(patches.intensity.mean(axis=1), 1.0))
    away = np.linalg.norm(patches.centre - scanner_origin(survey, patches.gps_time), axis=1)
    return [patches.gps_time, *patches.normal.T, counts, np.log(away)]


def patch_rows(survey: Survey, patches: Patches, surface: OnReference | None = None) -> Rows:
    """Make rows of patches: distance from the reference if given, roughness, return rate.

    The item is the patch's index, shared by its rows.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    surface : OnReference, optional
        Of all of them.
    """
    rough, rough_noise, assumed, flat = roughness(survey, patches)
    lost, lost_noise, counted = return_rate(patches)
    flat = np.flatnonzero(flat)
    counted = np.flatnonzero(counted)
    p = len(patches)
    if surface is None:
        surface = OnReference(np.empty(0, int), np.empty((0, 3)), *np.empty((2, 0)))
    on = np.arange(len(surface))
    item = np.concatenate([on, flat, counted])
    direction = np.zeros((len(item), 3))
    direction[: len(on)] = surface.direction
    channel = ["surface"] * len(on) + ["roughness"] * len(flat) + ["return_rate"] * len(counted)
    points = [patches.points[on], patches.points[flat], patches.fired[counted]]
    return assemble(
        survey,
        channel,
        item,
        patches.gps_time[item],
        patches.centre[item],
        direction,
        np.concatenate([surface.residual, rough[flat], lost[counted]]),
        np.concatenate([surface.noise, rough_noise[flat], lost_noise[counted]]),
        np.concatenate(points),
        patch_pulses(survey, patches, np.arange(p)),
        patches.pass_number[item],
        assumed=np.concatenate([np.full(len(on), np.nan), assumed[flat], np.ones(len(counted))]),
    )
