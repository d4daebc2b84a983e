"""From cloud files to matched targets."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.io.las import read_chunks
from mlscorr.matching import Matches, match
from mlscorr.survey import PointCloud
from mlscorr.targets.candidates import NO_POINTS, Candidates, collect, search_radius
from mlscorr.targets.extract import as_observations, fit_near_control
from mlscorr.targets.fit import FittedTarget

SEED = 0  # of the random samples in the plane fit: the same survey gives the same result


@dataclass(frozen=True)
class Finding:
    """Targets of a survey: the matches; the points on all targets, with their passes, and those
    without a pose; and each target as fitted, by (pass number, gps_time), for its figure.
    """

    matches: Matches
    candidates: Candidates
    fitted: dict[tuple[int, float], FittedTarget]


def find_targets(survey, rng=None, progress=None):
    """Find the surveyed targets in the cloud and match them: a Finding.

    Raises ValueError when no target is found, or none of those found matches.
    """
    surveyed = survey.control + survey.check
    progress = progress or silent
    done = progress("Reading the cloud", sum(file.points for file in survey.clouds))
    found, candidates, near = fit_while_reading(survey, read_chunks, rng, done)
    if len(found) == 0:
        raise ValueError(nothing_found(survey, candidates, near))
    finding = matched(found, candidates, survey)
    if len(finding.matches.matched) == 0:
        reasons = " ".join(refusal.reason for refusal in finding.matches.refusals[:3])
        raise ValueError(
            f"{len(found)} targets were found, and none of them matches one of the "
            f"{len(surveyed)} surveyed points. {reasons} Are control and cloud in the same CRS?"
        )
    return finding


@dataclass
class Near:
    """Points near surveyed points that were looked at: their number and range of intensity."""

    points: int = 0
    darkest: float = np.inf
    brightest: float = -np.inf


def fit_while_reading(survey, read, rng=None, progress=None):
    """Fit targets near surveyed points while the clouds are read.

    Returns pairs (pass number, FittedTarget) in order of pass and time, the Candidates that are
    left, which hold the passes and the points without a pose, and Near.
    """
    surveyed = survey.control + survey.check
    rng = np.random.default_rng(SEED) if rng is None else rng
    seed = rng.integers(2**63)
    fitted, near = [], Near()

    def finished(file, cloud, segment):
        if len(cloud) == 0:
            return
        near.points += len(cloud)
        near.darkest = min(near.darkest, float(cloud.intensity.min()))
        near.brightest = max(near.brightest, float(cloud.intensity.max()))
        part = Candidates(cloud, segment, NO_POINTS, {})
        same = np.random.default_rng(seed)  # whatever was looked at before
        arguments = part, surveyed, survey.trajectory, survey.scanner, same, survey.mounting
        fitted.extend((file, segment, t) for segment, t in fit_near_control(*arguments))

    clouds, trajectory = survey.clouds, survey.trajectory
    candidates = collect(clouds, trajectory, surveyed, read, progress, finished)
    found = [(candidates.passes[file, segment], t) for file, segment, t in fitted]
    return sorted(found, key=lambda pair: (pair[0], pair[1].gps_time)), candidates, near


def matched(found, candidates, survey):
    """The Finding of pairs (pass number, FittedTarget)."""
    surveyed = survey.control + survey.check
    matches = match(as_observations(found), surveyed, survey.trajectory, survey.pos)
    numbers = np.repeat([n for n, _ in found], [len(t.cloud) for _, t in found]).astype(int)
    cloud = PointCloud.concatenate([NO_POINTS, *(t.cloud for _, t in found)])
    on_targets = replace(candidates, cloud=cloud, pass_number=numbers)
    return Finding(matches, on_targets, {(n, t.gps_time): t for n, t in found})


def find_control(survey, rng=None, progress=None):
    """Find the targets and tell them apart by role: (control, check, Finding).

    control and check are TargetObservations. Raises ValueError as find_targets does, and when no
    control point was surveyed or found.
    """
    if len(survey.control) + len(survey.check) == 0:
        raise ValueError(
            f"{survey.path} gives no control points: it has no section [control], or the file "
            "named there is empty. A correction needs surveyed points; mlscorr extract lists the "
            "targets of a cloud without them."
        )
    if len(survey.control) == 0:
        raise ValueError(
            f"{survey.path} names {len(survey.check)} check points and no control point: check "
            "points never enter an estimate. Give some of them the role control."
        )
    finding = find_targets(survey, rng, progress)
    observed = finding.matches.matched
    is_control = np.array([name in survey.control.name for name in observed.name])
    control, check = observed[is_control], observed[~is_control]
    if len(control) == 0:
        raise ValueError(
            f"None of the {len(survey.control)} control points was found in the cloud, only "
            f"{len(check)} check points, which must not take part in the estimate."
        )
    return control, check, finding


def found_or_nothing(survey, progress=None):
    """The Finding, empty where nothing was surveyed or found, and the sentence that says so."""
    nothing = "No target was surveyed: only surfaces are compared."
    if len(survey.control) + len(survey.check):
        try:
            return find_targets(survey, progress=progress), ()
        except ValueError as error:
            nothing = f"{error} Only surfaces are compared."
    none, empty = as_observations([]), Candidates(NO_POINTS, np.empty(0, int), NO_POINTS, {})
    return Finding(Matches(none, none, (), np.empty(0), ()), empty, {}), (nothing,)


def silent(title, total):
    """A progress that tells nobody."""
    return lambda points: None


def nothing_found(survey, candidates, near):
    """The sentence for a cloud in which no surveyed target was found."""
    surveyed = survey.control + survey.check
    radius = search_radius(survey.trajectory, surveyed).max()
    if len(candidates.unplaced) > near.points:
        return (
            f"No target was found: {len(candidates.unplaced)} of the points near surveyed points "
            "were measured in gaps of the trajectory or outside it. Export the whole trajectory."
        )
    if near.points == 0:
        return (
            f"No point of the cloud lies within {radius:.1f} m of any of the {len(surveyed)} "
            "surveyed points. Are control and cloud in the same CRS and of the same street?"
        )
    return (
        f"None of the {len(surveyed)} surveyed targets was found among {near.points} points "
        f"within {radius:.1f} m of them (intensity {near.darkest:.0f} to "
        f"{near.brightest:.0f}). Targets are circles or squares of the surveyed size, brighter "
        "than what surrounds them: check kind and size in the control file, and the intensity."
    )
