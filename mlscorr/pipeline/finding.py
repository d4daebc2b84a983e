"""From cloud files to matched targets: read, fit, match.

``find_targets`` and ``match_targets`` are stages of ``correct`` that a script may call separately.
"""

from __future__ import annotations

import logging
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.evaluate import BeamCheck
from mlscorr.io.clouds import read_chunks
from mlscorr.matching import Matches, match
from mlscorr.pipeline.beams import with_beam_origin
from mlscorr.pipeline.control_checks import check_control
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.pipeline.wording import CHOICES
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import (
    CloudFile,
    Matched,
    PointCloud,
    Statement,
    Summary,
    Survey,
    TargetObservations,
    TieFeatures,
    check_rng,
    check_survey,
    columns_frame,
)
from mlscorr.targets import (
    BY_EDGES,
    NO_POINTS,
    Candidates,
    FittedTarget,
    PassTarget,
    as_observations,
    collect,
    distinct,
    fit_near_control,
    search_radius,
    why_useless,
)
from mlscorr.wording import counted

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

READING = "Reading the cloud and finding targets"  # stages
MATCHING = "Matching targets with surveyed points"
COLLECTING = "Collecting planes, poles and paint"
LOG = logging.getLogger(__name__)
SHOWN = 5  # refusals listed in an overview: it fits a screen


class RefusedTarget(NamedTuple):
    """Surveyed point without an observation.

    Attributes
    ----------
    name : str
        Name of the surveyed point.
    reason : str
        Reason why no target in the cloud has its name, in a sentence.
    """

    name: str
    reason: str


@dataclass(frozen=True, repr=False)
class MatchedTargets(Summary):
    """Targets of a survey with the names of their surveyed points.

    Parameters
    ----------
    survey : Survey
    matches : Matches
    candidates : Candidates
        Points on all targets, with their passes, and those without a pose.
    fitted : dict
        Each FittedTarget by (pass number, gps_time), for its figure.
    scanned : frozenset of str
        Names of the surveyed points with surrounding points of the cloud.
    warnings : tuple of str
        On cloud files with impossible beams.
    uncovered : tuple of str
        On cloud files with points outside the trajectory.
    excluded : TargetObservations, optional
        Observations of control points that the user excluded.
    """

    survey: Survey
    matches: Matches
    candidates: Candidates
    fitted: dict[tuple[int, float], FittedTarget]
    scanned: frozenset[str] = frozenset()
    warnings: tuple[str, ...] = ()
    uncovered: tuple[str, ...] = ()
    excluded: TargetObservations | None = None

    def __len__(self) -> int:
        return len(self.matches.matched)

    @property
    def matched(self) -> Matched:
        """Observations with their surveyed points, control and check points."""
        return Matched.by_name(self.matches.matched, self.survey.surveyed)

    @property
    def control(self) -> Matched:
        """Observed control points."""
        return self.matches.by_role(self.survey)[0]

    @property
    def check(self) -> Matched:
        """Observed check points, which are used in no estimate."""
        return self.matches.by_role(self.survey)[1]

    @property
    def kept_out(self) -> Matched:
        """Observed control points that the user excluded from the estimate."""
        if self.excluded is None:
            return Matched.none()
        return Matched.by_name(self.excluded, self.survey.excluded)

    @property
    def refused(self) -> tuple[RefusedTarget, ...]:
        """Surveyed points without an observation, with the reason."""
        return tuple(RefusedTarget(row.name, row.reason) for row in self.matches.refusals)

    @property
    def scanners(self) -> dict[int, int]:
        """Index of the scanner of each pass."""
        numbers = self.survey.scanner_numbers
        return {number: int(numbers[key[0]]) for key, number in self.candidates.passes.items()}

    def as_scanned(self, survey: Survey) -> Survey:
        """Return the survey with the seconds that contain points marked in its trajectory.

        Parameters
        ----------
        survey : Survey
        """
        trajectory = survey.trajectory.scanned_at(self.candidates.seconds)
        return replace(survey, trajectory=trajectory)

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row per matched observation, misclosures in m; requires
        pandas.
        """
        matched = self.matched
        observed = matched.observations
        is_check = np.isin(matched.name, self.survey.check.name)
        return columns_frame(
            {
                "name": matched.name,
                "role": np.where(is_check, "check", "control"),
                "pass": observed.pass_number,
                "gps_time": observed.gps_time,
                "kind": observed.kind,
                "surveyed": matched.surveyed.position,
                "observed": observed.position,
                "misclosure": matched.misclosure,
                "sigma": np.sqrt(matched.variance),
                "probability": self.matches.probability,
            }
        )

    def plot(self) -> Figure:
        """Plot misclosures (surveyed - observed) over time, with one sigma."""
        from mlscorr.report import misclosure_figure

        return misclosure_figure(self.control, self.check, self.survey.trajectory)

    def to_open3d(self, origin: np.ndarray | None = None) -> Any:
        """Lines from each observed center to its surveyed position.

        Parameters
        ----------
        origin : (3,) array, optional
            See ``PointCloud.to_open3d``.

        Returns
        -------
        open3d.t.geometry.LineSet
            Control points black, check points red.
        """
        from mlscorr.report import misclosure_lines

        return misclosure_lines(self.control, self.check, origin)

    def _overview(self):
        """Return counts, the median misclosure, and the first refusals."""
        rows = [
            ("control points", f"{len(set(self.control.name))} of {len(self.survey.control)}"),
            ("check points", f"{len(set(self.check.name))} of {len(self.survey.check)}"),
            ("observations", len(self)),
        ]
        if len(self):
            median = np.median(self.matched.misclosure, axis=0)
            words = ", ".join(f"{axis} {v:+.3f}" for axis, v in zip("ENH", median, strict=True))
            rows.append(("median misclosure (m)", words))
        rows += [(f"no observation of {name}", why) for name, why in self.refused[:SHOWN]]
        if len(self.refused) > SHOWN:
            rows.append((f"and {len(self.refused) - SHOWN} more without an observation",))
        return [(self.survey.name,), *rows]


@dataclass(frozen=True, repr=False)
class FoundTargets(Summary):
    """Targets found in the clouds of a survey, near its surveyed points, without names.

    ``targets[rows]`` selects some of them by a condition on a data frame or an array.

    Parameters
    ----------
    survey : Survey
    targets : tuple of (pass number, FittedTarget)
        Sorted by pass and time.
    candidates : Candidates
        Passes of the clouds, and points without a pose.
    near : NearPoints
    features : TieFeatures, optional
        Planes, poles and paint as possible ties, if these were collected.
    """

    survey: Survey
    targets: tuple[PassTarget, ...]
    candidates: Candidates
    near: NearPoints
    features: TieFeatures | None = None

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, rows: Any) -> FoundTargets:
        numbers = np.atleast_1d(np.arange(len(self))[rows])
        return replace(self, targets=tuple(self.targets[number] for number in numbers))

    @cached_property
    def observations(self) -> TargetObservations:
        """Centers with covariances, kinds and sizes, a row for each target and pass."""
        return as_observations(self.targets)

    @property
    def cloud(self) -> PointCloud:
        """Points on all targets."""
        return PointCloud.concatenate([NO_POINTS, *(target.cloud for _, target in self.targets)])

    @property
    def score(self) -> np.ndarray:
        """Likeness to a target (n,), 0 to 1."""
        return np.array([target.score for _, target in self.targets])

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row for each target and pass; requires pandas."""
        return self.observations.to_frame().drop(columns="name").assign(score=self.score)

    def plot(self) -> Figure:
        """Draw the targets one by one, with the points on each and the fitted outline."""
        from mlscorr.report import targets_figure

        return targets_figure(self.targets)

    def to_open3d(self, origin: np.ndarray | None = None, enlarged: float = 100.0) -> Any:
        """Outlines of the targets, with an ellipsoid of one sigma around each center.

        Parameters
        ----------
        origin : (3,) array, optional
            See ``PointCloud.to_open3d``.
        enlarged : float
            Magnification of ellipsoids.

        Returns
        -------
        open3d.t.geometry.LineSet
        """
        from mlscorr.report import target_lines

        return target_lines(self.observations, origin, enlarged)

    def _overview(self):
        """Return counts by kind and pass."""
        observed = self.observations
        kinds = ", ".join(f"{kind} {count}" for kind, count in Counter(observed.kind).items())
        rows = [
            ("targets", len(self)),
            ("kinds", kinds or "none"),
            ("passes", len(set(observed.pass_number.tolist()))),
            ("points on them", int(observed.points.sum())),
        ]
        if len(self):
            sigma = np.sqrt(np.einsum("nii->n", observed.covariance))
            rows.append(("median 3D sigma (m)", f"{np.median(sigma):.4f}"))
        if self.features is not None:
            rows.append(("tie features", len(self.features)))
        return [(self.survey.name,), *rows]


class NearPoints:
    """Points near surveyed points: their number and intensities.

    Attributes
    ----------
    beams : BeamCheck
    is_scanned : (b,) bool array
        True for surveyed points with surrounding points.
    is_present : (65536,) bool array
        True for intensities that occur.
    points : int
    of_file : dict
        Survey of each requested CloudFile, with the position of its scanner.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self.beams = BeamCheck(survey)
        self.points = 0
        self.survey = survey
        self.of_file = {}
        self.is_scanned = np.zeros(len(survey.surveyed), bool)
        self.is_present = np.zeros(1 << 16, bool)

    @property
    def intensity_range(self) -> str:
        """Lowest and highest intensity, in words."""
        present = np.flatnonzero(self.is_present)
        return f"intensity {present[0]} to {present[-1]}"

    @property
    def scanned(self) -> frozenset[str]:
        """Names of the surveyed points with surrounding points."""
        names = self.survey.surveyed.name
        return frozenset(names[i] for i in np.flatnonzero(self.is_scanned))

    def survey_of(self, file: CloudFile) -> Survey:
        """Return the survey of the scanner that wrote a file, with the scanner's position.

        Parameters
        ----------
        file : CloudFile
        """
        if file not in self.of_file:
            self.of_file[file] = with_beam_origin(self.survey.of(file), file)
        return self.of_file[file]

    def warnings(self) -> Iterator[str]:
        """Yield sentences on files with impossible beams, or with beams of unknown origin."""
        yield from self.beams.warnings()
        for file, survey in self.of_file.items():
            if survey.mounting is None and survey.beam_origin is None:
                yield (
                    f"{survey.path} has no [mounting], and the beams of {file.name} do not show "
                    "the scanner position, so the navigation center is assumed. Free-standing "
                    "plates may be missed or found centimeters off: set lever_arm and boresight "
                    "under [mounting]."
                )

    def add(self, cloud: PointCloud) -> None:
        """Count further points.

        Parameters
        ----------
        cloud : PointCloud
        """
        self.points += len(cloud)
        self.is_present[cloud.intensity.astype(np.uint16)] = True

    def add_ball(self, index: int, cloud: PointCloud) -> None:
        """Check whether any points of a surveyed point, relative to it (m), surround it."""
        some = cloud.xyz[:: SETTINGS.scanned_stride]
        self.is_scanned[index] |= (np.linalg.norm(some, axis=1) < SETTINGS.scanned_radius).any()

    def warn_of_intensity(self) -> None:
        """Warn if bright targets are surveyed and the intensity cannot show them."""
        if self.points:
            reason = why_useless(np.flatnonzero(self.is_present))
        else:
            reason = None
        if reason is not None and not set(self.survey.surveyed.kind) <= set(BY_EDGES):
            warnings.warn(
                f"{reason} Without it, bright targets can't be detected: only free-standing plates "
                "are found, by their edges. Export the cloud with its intensity.",
                stacklevel=3,
            )


def find_control(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    read: Callable = read_chunks,
) -> MatchedTargets:
    """Find the targets of a survey with control points, including some of these.

    Parameters
    ----------
    survey, rng, progress, read
        See ``fit_while_reading``; progress without a title.

    Raises
    ------
    ValueError
        See match_targets; also if no control point was surveyed or found.
    """
    check_control(survey)
    stage = progress or silent
    reading = stage(READING, survey.points)
    targets = fit_while_reading(survey, read, rng, reading)
    stage(MATCHING)
    matches = match_targets(targets, survey)
    check_found_control(matches)
    return matches


def check_found_control(matches: MatchedTargets) -> None:
    """Refuse matches without a control point, which cannot correct anything.

    Parameters
    ----------
    matches : MatchedTargets

    Raises
    ------
    ValueError
        If only check points are matched.
    """
    survey = matches.survey
    if len(matches.control) == 0:
        raise ValueError(
            f"None of the {counted(len(survey.control), 'control point')} was found in the "
            f"cloud, only {counted(len(matches.check), 'check point')}, which must not be used "
            "in the estimate."
        )


def find_targets(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    with_ties: bool = False,
) -> FoundTargets:
    """Find targets in the clouds of a survey, near its surveyed points.

    The clouds are read once, in chunks, regardless of their size.

    Parameters
    ----------
    survey : Survey
    rng : numpy.random.Generator, optional
        For the random samples of flat patches; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    with_ties : bool
        True to collect possible tie features in the same pass over the files; the result's
        ``features`` are input of ``find_ties`` or ``estimate_pos_error``.

    Returns
    -------
    FoundTargets
        Empty without targets; ``match_targets`` then gives the reason.

    Raises
    ------
    OSError
        If reading fails.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> targets = mlscorr.find_targets(mlscorr.read_survey(folder))
    >>> len(targets)
    5
    """
    check_survey(survey)
    stage = progress or silent
    reading = stage(READING, survey.points)
    if not with_ties:
        return fit_while_reading(survey, read_chunks, rng, reading)
    collector = FeatureCollector(survey)
    targets = fit_while_reading(survey, read_into(collector.add), rng, reading)
    stage(COLLECTING)
    return replace(targets, features=collector.features())


def find_or_compare_surfaces(
    survey: Survey,
    read: Callable = read_chunks,
    settle: Callable | None = None,
    progress: Callable | None = None,
    rng: np.random.Generator | None = None,
) -> tuple[MatchedTargets, tuple[str, ...]]:
    """Find targets if there are any, because a diagnosis works without them.

    Parameters
    ----------
    survey, read, settle
        See ``fit_while_reading``; the clouds are read to their ends in any case.
    progress, rng
        See ``find_targets``.

    Returns
    -------
    matches : MatchedTargets
        Empty if nothing was surveyed or found.
    notes : tuple of str
        Sentence on missing targets.
    """
    stage = progress or silent
    reading = stage(READING, survey.points)
    targets = fit_while_reading(survey, read, rng, reading, settle)
    stage(MATCHING)
    return match_if_any(targets, survey)


def match_if_any(targets: FoundTargets, survey: Survey) -> tuple[MatchedTargets, tuple[str, ...]]:
    """Match targets if there are any.

    Parameters
    ----------
    targets : FoundTargets
    survey : Survey

    Returns
    -------
    matches, notes
        See find_or_compare_surfaces.
    """
    note = "No target was surveyed: only surfaces are compared."
    if len(survey.surveyed):
        try:
            return match_targets(targets, survey), ()
        except ValueError as error:
            note = f"{error} Only surfaces are compared."
    return unmatched(survey, [], Candidates()), (note,)


def fit_while_reading(
    survey: Survey,
    read: Callable,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    settle: Callable | None = None,
) -> FoundTargets:
    """Fit targets near surveyed points while the clouds are read.

    The best of overlapping fits is kept, independent of the order of the surveyed points.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Returns an iterator of PointCloud.
    rng, progress
        See ``find_targets``; progress already with its title.
    settle : function, optional
        ``settle(fitted, since)`` receives the FittedTargets since its last call, and the time (s)
        before which further ones have no points.

    Warns if the intensity carries no information.
    """
    if rng is None:
        rng = np.random.default_rng(SETTINGS.seed)
    check_rng(rng)
    seed = rng.integers(2**63)
    fits = []
    latest = []
    near = NearPoints(survey)

    def fit(file, index, cloud):
        near.add_ball(index, cloud)
        generator = np.random.default_rng(seed)  # independent of earlier searches
        targets = fit_near_control(index, cloud, near.survey_of(survey.clouds[file]), generator)
        latest.extend(target for _, target in targets)
        fits.extend((index, (file, number), target) for number, target in targets)

    def settled(since):
        if settle is not None:
            settle(distinct(latest), since)
        latest.clear()

    progress = progress or silent("", 0)
    candidates = collect(survey, near.beams.watched(read), fit, near.add, settled, progress)
    near.warn_of_intensity()
    of_pass = {number: [] for number in sorted(candidates.passes.values())}
    for _, key, target in sorted(fits, key=itemgetter(0)):  # not in the order of their points
        of_pass[candidates.passes[key]].append(target)
    targets = tuple((number, t) for number, some in of_pass.items() for t in distinct(some))
    LOG.info(
        "%d targets found in %d passes, of %d fits near %d surveyed points; %d points used",
        len(targets),
        len(of_pass),
        len(fits),
        len(survey.surveyed),
        near.points,
    )
    for number, target in targets:
        LOG.debug("target of pass %d at %.3f s: score %.2f", number, target.gps_time, target.score)
    return FoundTargets(survey, targets, candidates, near)


def match_targets(targets: FoundTargets, survey: Survey) -> MatchedTargets:
    """Give targets the names of their surveyed points.

    All matches are decided together: misclosures change smoothly along the drive, and a target that
    matches no point, or several, gets no name.

    Parameters
    ----------
    targets : FoundTargets
    survey : Survey
        With all of its surveyed points, even if only some were searched.

    Returns
    -------
    MatchedTargets

    Raises
    ------
    ValueError
        If no target is found, or none of those found matches.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = mlscorr.read_survey(folder)
    >>> matches = mlscorr.match_targets(mlscorr.find_targets(survey), survey)
    >>> len(matches.control), len(matches.check), matches.refused
    (4, 1, ())
    """
    on_beams = tuple(targets.near.warnings())
    for sentence in on_beams:
        warnings.warn(sentence, stacklevel=2)
    matches = match_silently(targets, survey)
    for sentence in matches.warnings:
        if sentence not in on_beams:
            warnings.warn(sentence, stacklevel=2)
    return matches


def match_silently(targets: FoundTargets, survey: Survey) -> MatchedTargets:
    """Match targets, in the same way for ``check`` and ``correct``.

    Parameters
    ----------
    targets, survey
        See match_targets.

    Raises
    ------
    ValueError
        See match_targets.
    """
    near = targets.near
    if len(targets) == 0:
        raise ValueError(nothing_found(survey, targets.candidates, near))
    matches = match_fitted(survey, targets.targets, targets.candidates)
    if len(matches) == 0:
        reasons = " ".join(refusal.reason for refusal in matches.matches.refusals[:3])
        places = len(np.unique(survey.surveyed.position, axis=0))
        is_twice = 2 * places <= len(survey.surveyed)  # and then the CRS is not the cause
        questions = (
            "Check that control and cloud are in the same CRS.",
            "Check whether each point is listed twice.",
        )
        raise ValueError(
            f"None of the {len(survey.surveyed)} surveyed targets is among the {len(targets)} "
            f"found ({near.intensity_range} there). {reasons} {questions[is_twice]}"
        )
    return replace(
        matches,
        scanned=near.scanned,
        warnings=(*near.warnings(), *matches.warnings),
        uncovered=tuple(near.beams.outside()),
    )


def nothing_found(survey: Survey, candidates: Candidates, near: NearPoints) -> str:
    """Sentence on a cloud without any surveyed target.

    Parameters
    ----------
    survey : Survey
    candidates : Candidates
    near : NearPoints
    """
    surveyed = survey.surveyed
    radius = search_radius(survey, surveyed).max()
    if len(candidates.unplaced) > near.points:
        return (
            f"No target was found: {len(candidates.unplaced)} of the points near surveyed points "
            "were measured outside the trajectory or in its gaps. Export the whole trajectory."
        )
    if near.points == 0:
        return (
            f"No point of the cloud is within {radius:.1f} m of any of the {len(surveyed)} "
            "surveyed points. Check that control and cloud are in the same CRS and from the "
            f"same street.{_other_heights(survey, radius)}"
        )
    return (
        f"None of the {len(surveyed)} surveyed targets was found among {near.points} points "
        f"within {radius:.1f} m of them ({near.intensity_range}). Targets must be circles or "
        "squares of the surveyed size, brighter than their surroundings: check kind and size in "
        "the control file, and the intensity."
    )


def _other_heights(survey, radius):
    """Sentence on surveyed points farther above or below the drive than the search radius."""
    place = survey.surveyed.position
    path = survey.trajectory.position
    nearest = cKDTree(path[:, :2]).query(place[:, :2])[1]
    above = float(np.median(place[:, 2] - path[nearest, 2]))
    if abs(above) < radius:
        return ""
    side = "above" if above > 0 else "below"
    return (
        f" The surveyed points are {abs(above):.1f} m {side} the trajectory (median): their "
        "heights may refer to another geoid or an ellipsoid, or be in feet."
    )


def match_fitted(
    survey: Survey, targets: Sequence[PassTarget], candidates: Candidates
) -> MatchedTargets:
    """Match fitted targets with the surveyed points.

    Parameters
    ----------
    survey : Survey
    targets : sequence of (pass number, FittedTarget)
    candidates : Candidates
        Passes and points without a pose are kept.
    """
    matches = match(
        as_observations(targets),
        survey.surveyed,
        survey.trajectory,
        survey.pos,
        survey.search_radius,
    )
    # an excluded point also has a residual, whatever the matching
    matches, doubts = with_included(matches, (*survey.included, *survey.excluded.name))
    doubts = tuple(text for name, text in doubts if name in survey.included)
    matches, excluded = without_excluded(matches, survey)
    _log_matches(matches, survey)
    numbers = np.repeat([n for n, _ in targets], [len(t.cloud) for _, t in targets]).astype(int)
    cloud = PointCloud.concatenate([NO_POINTS, *(t.cloud for _, t in targets)])
    on_targets = replace(candidates, cloud=cloud, pass_number=numbers)
    by_time = _by_pass_and_time(targets)
    return MatchedTargets(survey, matches, on_targets, by_time, warnings=doubts, excluded=excluded)


def with_included(
    matches: Matches, names: Sequence[str]
) -> tuple[Matches, tuple[tuple[str, str], ...]]:
    """Restore refused observations of some points in matches.

    Parameters
    ----------
    matches : Matches
    names : sequence of str
        Names of the points that must have an observation.

    Returns
    -------
    matches : Matches
    warnings : tuple of (str, str)
        Name of each restored point, and a sentence with the reason for its refusal.
    """
    left = matches.unmatched
    taken = {}
    warned = []
    for refusal in matches.refusals:
        if refusal.name not in names or refusal.gps_time is None:
            continue
        is_its = left.gps_time == refusal.gps_time
        if refusal.pass_number is not None:
            is_its &= left.pass_number == refusal.pass_number
        for row in np.flatnonzero(is_its):
            taken[int(row)] = refusal.name
        values = {"name": refusal.name, "reason": refusal.reason}
        refused = Statement("included, refused", "warning", values)
        warned.append((refusal.name, refused.sentence(CHOICES)))
    if not taken:
        return matches, tuple(warned)
    rows = list(taken)
    free = np.setdiff1d(np.arange(len(left)), rows)
    named = replace(left[rows], name=tuple(taken.values()))
    moved = matches.moved
    if moved is not None:
        moved = moved[~np.isin(np.array(moved.name, dtype=str), list(taken.values()))]
    changed = replace(
        matches,
        matched=TargetObservations.concatenate([matches.matched, named]),
        unmatched=left[free],
        refusals=tuple(row for row in matches.refusals if row.name not in taken.values()),
        probability=np.append(matches.probability, np.zeros(len(rows))),
        why=tuple(matches.why[row] for row in free),
        moved=moved,
    )
    return changed, tuple(warned)


def without_excluded(matches: Matches, survey: Survey) -> tuple[Matches, TargetObservations]:
    """Matches without the excluded points, and the observations of these.

    Parameters
    ----------
    matches : Matches
    survey : Survey
    """
    matched = matches.matched
    is_out = np.isin(np.array(matched.name, dtype=str), survey.excluded.name)
    kept = replace(matches, matched=matched[~is_out], probability=matches.probability[~is_out])
    return kept, matched[is_out]


def _log_matches(matches, survey):
    """Log which surveyed points were matched, and reasons for others."""
    matched = Matched.by_name(matches.matched, survey.surveyed)
    names = set(matched.name)
    LOG.info(
        "%d of %d control and %d of %d check points matched, by %d observations",
        len(names & set(survey.control.name)),
        len(survey.control),
        len(names & set(survey.check.name)),
        len(survey.check),
        len(matched),
    )
    for row in matches.refusals:
        LOG.info("not matched: %s: %s", row.name, row.reason)
    observations = matched.observations
    for name, time, misclosure, probability in zip(
        matched.name, observations.gps_time, matched.misclosure, matches.probability, strict=True
    ):
        LOG.debug(
            "%s at %.3f s: misclosure E %+.3f, N %+.3f, H %+.3f m, probability %.4f",
            name,
            time,
            *misclosure,
            probability,
        )


def unmatched(
    survey: Survey, targets: Sequence[PassTarget], candidates: Candidates, reason: str = ""
) -> MatchedTargets:
    """Make targets without matches.

    Parameters
    ----------
    survey : Survey
    targets : sequence of (pass number, FittedTarget)
    candidates : Candidates
    reason : str
        Reason why none has a name.
    """
    observations = as_observations(targets)
    nothing = observations[np.zeros(len(targets), bool)]
    why = (Statement("not matched", values={"why": reason}),) * len(targets)
    matches = Matches(nothing, observations, (), np.empty(0), why)
    return MatchedTargets(survey, matches, candidates, _by_pass_and_time(targets))


def _by_pass_and_time(targets):
    """Fitted targets by (pass number, gps_time)."""
    return {(number, target.gps_time): target for number, target in targets}


def read_into(*adds: Callable) -> Callable:
    """Make a ``read_chunks`` that also passes each chunk to collectors, to decode a cloud once.

    Parameters
    ----------
    *adds : function of CloudFile and PointCloud
    """

    def read(file):
        for chunk in read_chunks(file):
            for add in adds:
                add(file, chunk)
            yield chunk

    return read


def silent(_title: str, _total: int | None = None) -> Callable:
    """Return progress that is not displayed."""
    return lambda _points: None
