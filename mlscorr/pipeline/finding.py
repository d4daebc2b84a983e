"""From cloud files to matched targets: read, fit, match.

``find_targets`` and ``match_targets`` are stages of ``correct`` that a script may call by itself.
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
SHOWN = 5  # refusals that an overview names: it fits a screen


class RefusedTarget(NamedTuple):
    """A surveyed point without an observation.

    Attributes
    ----------
    name : str
        Of the surveyed point.
    reason : str
        Why no target in the cloud has its name, in a sentence.
    """

    name: str
    reason: str


@dataclass(frozen=True, repr=False)
class MatchedTargets(Summary):
    """Targets of a survey with the names of the surveyed points that they are.

    Parameters
    ----------
    survey : Survey
    matches : Matches
    candidates : Candidates
        The points on all targets, with their passes, and those without a pose.
    fitted : dict
        Each FittedTarget by (pass number, gps_time), for its figure.
    scanned : frozenset of str
        Names of the surveyed points that have points of the cloud about them.
    warnings : tuple of str
        On cloud files whose beams can't have been measured so.
    uncovered : tuple of str
        On cloud files with points outside the trajectory.
    excluded : TargetObservations, optional
        Of control points that the user keeps out of the estimate.
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
        """Observations with the surveyed points that they are, control and check points."""
        return Matched.by_name(self.matches.matched, self.survey.surveyed)

    @property
    def control(self) -> Matched:
        """Observed control points."""
        return self.matches.by_role(self.survey)[0]

    @property
    def check(self) -> Matched:
        """Observed check points, which take part in no estimate."""
        return self.matches.by_role(self.survey)[1]

    @property
    def kept_out(self) -> Matched:
        """Observed control points that the user keeps out of the estimate."""
        if self.excluded is None:
            return Matched.none()
        return Matched.by_name(self.excluded, self.survey.excluded)

    @property
    def refused(self) -> tuple[RefusedTarget, ...]:
        """Surveyed points without an observation, with the reason."""
        return tuple(RefusedTarget(row.name, row.reason) for row in self.matches.refusals)

    @property
    def scanners(self) -> dict[int, int]:
        """Number of the scanner of each pass."""
        numbers = self.survey.scanner_numbers
        return {number: int(numbers[key[0]]) for key, number in self.candidates.passes.items()}

    def as_scanned(self, survey: Survey) -> Survey:
        """The survey, with a trajectory that knows the seconds in which points lie.

        Parameters
        ----------
        survey : Survey
        """
        trajectory = survey.trajectory.scanned_at(self.candidates.seconds)
        return replace(survey, trajectory=trajectory)

    def to_frame(self) -> pandas.DataFrame:
        """A row for each matched observation, misclosures in m; pandas is needed for it."""
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
        """Misclosures (surveyed - observed) over time, with one sigma."""
        from mlscorr.report import misclosure_figure

        return misclosure_figure(self.control, self.check, self.survey.trajectory)

    def to_open3d(self, origin: np.ndarray | None = None) -> Any:
        """Lines from each observed center to its surveyed place.

        Parameters
        ----------
        origin : (3,) array, optional
            As of ``PointCloud.to_open3d``.

        Returns
        -------
        open3d.t.geometry.LineSet
            Control points black, check points red.
        """
        from mlscorr.report import misclosure_lines

        return misclosure_lines(self.control, self.check, origin)

    def _overview(self):
        """Counts, the median misclosure, and the first refusals."""
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

    ``targets[rows]`` are some of them, as a data frame's or an array's condition chooses.

    Parameters
    ----------
    survey : Survey
    targets : tuple of (pass number, FittedTarget)
        In order of pass and time.
    candidates : Candidates
        The passes of the clouds, and points without a pose.
    near : NearPoints
    features : TieFeatures, optional
        Planes, poles and paint that may tie passes, where these were collected.
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
        """Centres with covariances, kinds and sizes, a row for each target and pass."""
        return as_observations(self.targets)

    @property
    def cloud(self) -> PointCloud:
        """Points on all targets."""
        return PointCloud.concatenate([NO_POINTS, *(target.cloud for _, target in self.targets)])

    @property
    def score(self) -> np.ndarray:
        """How target-like each is (n,), 0 to 1."""
        return np.array([target.score for _, target in self.targets])

    def to_frame(self) -> pandas.DataFrame:
        """A row for each target and pass; pandas is needed for it."""
        return self.observations.to_frame().drop(columns="name").assign(score=self.score)

    def plot(self) -> Figure:
        """The targets one by one, each with the points on it and the outline that was fitted."""
        from mlscorr.report import targets_figure

        return targets_figure(self.targets)

    def to_open3d(self, origin: np.ndarray | None = None, enlarged: float = 100.0) -> Any:
        """Outlines of the targets, and about each center the ellipsoid of one sigma.

        Parameters
        ----------
        origin : (3,) array, optional
            As of ``PointCloud.to_open3d``.
        enlarged : float
            Factor by which ellipsoids are drawn larger than they are.

        Returns
        -------
        open3d.t.geometry.LineSet
        """
        from mlscorr.report import target_lines

        return target_lines(self.observations, origin, enlarged)

    def _overview(self):
        """Counts by kind and pass."""
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
    """Points near surveyed points that were looked at: their number and intensities.

    Attributes
    ----------
    beams : BeamCheck
    is_scanned : (b,) bool array
        Which surveyed points have points about them.
    is_present : (65536,) bool array
        Which intensities they have.
    points : int
    of_file : dict
        The survey of each CloudFile about which something was asked, with the place of its scanner.

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
        """The darkest and the brightest, in words."""
        present = np.flatnonzero(self.is_present)
        return f"intensity {present[0]} to {present[-1]}"

    @property
    def scanned(self) -> frozenset[str]:
        """Names of the surveyed points that have points about them."""
        names = self.survey.surveyed.name
        return frozenset(names[i] for i in np.flatnonzero(self.is_scanned))

    def survey_of(self, file: CloudFile) -> Survey:
        """The survey of the scanner that wrote a file, with the scanner's place.

        Parameters
        ----------
        file : CloudFile
        """
        if file not in self.of_file:
            self.of_file[file] = with_beam_origin(self.survey.of(file), file)
        return self.of_file[file]

    def warnings(self) -> Iterator[str]:
        """Sentences on files whose beams can't have been measured so, or come from nowhere."""
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
        """Count more of them.

        Parameters
        ----------
        cloud : PointCloud
        """
        self.points += len(cloud)
        self.is_present[cloud.intensity.astype(np.uint16)] = True

    def add_ball(self, index: int, cloud: PointCloud) -> None:
        """Look whether any of the points of a surveyed point, from there (m), lies about it."""
        some = cloud.xyz[:: SETTINGS.scanned_stride]
        self.is_scanned[index] |= (np.linalg.norm(some, axis=1) < SETTINGS.scanned_radius).any()

    def warn_of_intensity(self) -> None:
        """Warn where bright targets are surveyed and the intensity can't tell them."""
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
    """Find the targets of a survey that has control points, and some of these among them.

    Parameters
    ----------
    survey, rng, progress, read
        As of ``fit_while_reading``, progress without a title.

    Raises
    ------
    ValueError
        As match_targets does, and when no control point was surveyed or found.
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
    """Refuse matches without a control point, by which nothing is corrected.

    Parameters
    ----------
    matches : MatchedTargets

    Raises
    ------
    ValueError
        Where check points alone are matched.
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

    The clouds are read once, in chunks, whatever their size.

    Parameters
    ----------
    survey : Survey
    rng : numpy.random.Generator, optional
        For the random samples of flat patches; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    with_ties : bool
        Whether the features that may tie passes are collected in the same reading; the result's
        ``features`` go into ``find_ties`` or ``estimate_pos_error``.

    Returns
    -------
    FoundTargets
        None where no target is there; ``match_targets`` says why.

    Raises
    ------
    OSError
        When reading fails.

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
    """Find the targets where there are any: a diagnosis can do without.

    Parameters
    ----------
    survey, read, settle
        As of ``fit_while_reading``; the clouds are read to their ends in any case.
    progress, rng
        As of ``find_targets``.

    Returns
    -------
    matches : MatchedTargets
        Empty where nothing was surveyed or found.
    notes : tuple of str
        The sentence that says so.
    """
    stage = progress or silent
    reading = stage(READING, survey.points)
    targets = fit_while_reading(survey, read, rng, reading, settle)
    stage(MATCHING)
    return match_if_any(targets, survey)


def match_if_any(targets: FoundTargets, survey: Survey) -> tuple[MatchedTargets, tuple[str, ...]]:
    """Match targets where there are any.

    Parameters
    ----------
    targets : FoundTargets
    survey : Survey

    Returns
    -------
    matches, notes
        As of find_or_compare_surfaces.
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

    Of fits that overlap the best is kept: the order of the surveyed points decides nothing.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Gives an iterator of PointCloud.
    rng, progress
        As of ``find_targets``, progress already with its title.
    settle : function, optional
        ``settle(fitted, since)`` is given the FittedTargets since its last call, and the time (s)
        before which none to come will have points.

    Warns where the intensity tells nothing.
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
        generator = np.random.default_rng(seed)  # whatever was looked at before
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
    """Give targets the names of the surveyed points that they are.

    All matches are decided together: misclosures change smoothly along the drive, and a target
    that fits no point, or several, gets no name.

    Parameters
    ----------
    targets : FoundTargets
    survey : Survey
        With all of its surveyed points, also where only some were looked at.

    Returns
    -------
    MatchedTargets

    Raises
    ------
    ValueError
        When no target is found, or none of those found matches.

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
    """Match targets; this decides for ``check`` and ``correct`` alike.

    Parameters
    ----------
    targets, survey
        As of match_targets.

    Raises
    ------
    ValueError
        As match_targets.
    """
    near = targets.near
    if len(targets) == 0:
        raise ValueError(nothing_found(survey, targets.candidates, near))
    matches = match_fitted(survey, targets.targets, targets.candidates)
    if len(matches) == 0:
        reasons = " ".join(refusal.reason for refusal in matches.matches.refusals[:3])
        places = len(np.unique(survey.surveyed.position, axis=0))
        is_twice = 2 * places <= len(survey.surveyed)  # and then the CRS isn't what is wrong
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
    """The sentence for a cloud in which no surveyed target was found.

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
    """A sentence where surveyed points lie farther above or below the drive than is searched."""
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
        Their passes and the points without a pose are kept.
    """
    matches = match(
        as_observations(targets),
        survey.surveyed,
        survey.trajectory,
        survey.pos,
        survey.search_radius,
    )
    # an excluded point has a residual, too, whatever matching says of it
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
    """Matches in which some points have the observations that were refused as theirs.

    Parameters
    ----------
    matches : Matches
    names : sequence of str
        Of the points that have an observation in any case.

    Returns
    -------
    matches : Matches
    warnings : tuple of (str, str)
        Name of each point that has one now, and a sentence on why it was refused.
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
        sentence = (
            f"{refusal.name} is used because include names it. Matching rejected it: "
            f"{refusal.reason}"
        )
        warned.append((refusal.name, sentence))
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
    """Matches without the points that are kept out of the estimate, and the observations of those.

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
    """Log which surveyed points were matched, and why others were not."""
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
    """Targets where there is nothing to match.

    Parameters
    ----------
    survey : Survey
    targets : sequence of (pass number, FittedTarget)
    candidates : Candidates
    reason : str
        Why none has a name.
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
    """A ``read_chunks`` that also adds each chunk to collectors, so that a cloud is decoded once.

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
    """Progress that is shown nowhere."""
    return lambda _points: None
