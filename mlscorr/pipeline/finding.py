"""From cloud files to matched targets."""

import numpy as np

from mlscorr.io.las import read_chunks
from mlscorr.matching import match
from mlscorr.targets.candidates import collect, search_radius
from mlscorr.targets.extract import extract_targets

SEED = 0  # of the random samples in the plane fit: the same survey gives the same result


def find_targets(survey, rng=None, progress=None):
    """Find the surveyed targets in the cloud and match them: (Matches, Candidates).

    Raises ValueError when no target is found, or none of those found matches.
    """
    surveyed = survey.control + survey.check
    progress = progress or silent
    done = progress("Reading the cloud", sum(file.points for file in survey.clouds))
    candidates = collect(survey.clouds, survey.trajectory, surveyed, read_chunks, done)
    rng = np.random.default_rng(SEED) if rng is None else rng
    found = extract_targets(
        candidates, surveyed, survey.trajectory, survey.scanner, rng, survey.mounting
    )
    if len(found) == 0:
        raise ValueError(_nothing_found(survey, candidates))
    matches = match(found, surveyed, survey.trajectory)
    if len(matches.matched) == 0:
        reasons = " ".join(refusal.reason for refusal in matches.refusals[:3])
        raise ValueError(
            f"{len(found)} targets were found, and none of them matches one of the "
            f"{len(surveyed)} surveyed points. {reasons} Are control and cloud in the same CRS?"
        )
    return matches, candidates


def find_control(survey, rng=None, progress=None):
    """Find the targets and tell them apart by role: (control, check, refusals, candidates).

    control and check are TargetObservations. Raises ValueError as find_targets does, and when no
    control point was surveyed or found.
    """
    if len(survey.control) == 0:
        raise ValueError(
            f"{survey.path} names {len(survey.check)} check points and no control point: check "
            "points never enter an estimate. Give some of them the role control."
        )
    matches, candidates = find_targets(survey, rng, progress)
    is_control = np.array([name in survey.control.name for name in matches.matched.name])
    control, check = matches.matched[is_control], matches.matched[~is_control]
    if len(control) == 0:
        raise ValueError(
            f"None of the {len(survey.control)} control points was found in the cloud, only "
            f"{len(check)} check points, which must not take part in the estimate."
        )
    return control, check, matches.refusals, candidates


def silent(title, total):
    """A progress that tells nobody."""
    return lambda points: None


def _nothing_found(survey, candidates):
    """The sentence for a cloud in which no target was found."""
    surveyed = survey.control + survey.check
    radius = search_radius(survey.trajectory, surveyed).max()
    intensity = candidates.cloud.intensity
    if len(candidates.unplaced) > len(candidates.cloud):
        return (
            f"No target was found: {len(candidates.unplaced)} of the points near surveyed points "
            "were measured in gaps of the trajectory or outside it. Export the whole trajectory."
        )
    if len(intensity) == 0:
        return (
            f"No point of the cloud lies within {radius:.1f} m of any of the {len(surveyed)} "
            "surveyed points. Are control and cloud in the same CRS and of the same street?"
        )
    return (
        f"None of the {len(surveyed)} surveyed targets was found among {len(intensity)} points "
        f"within {radius:.1f} m of them (intensity {intensity.min():.0f} to "
        f"{intensity.max():.0f}). Targets are circles or squares of the surveyed size, brighter "
        "than what surrounds them: check kind and size in the control file, and the intensity."
    )
