"""Observed minus simulated as scalar rows, with POS errors and covariates."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from mlscorr.effects import Reference
from mlscorr.frames import angles_from_attitude, pose_partials, scanner_position, to_scanner
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.pos import PosErrors
from mlscorr.survey import Columns, ControlPoints, Survey, Trajectory

METRIC = ("target", "surface", "shared")  # in m along a direction; the others have no unit


@dataclass(frozen=True, repr=False)
class SamplePulses(Columns):
    """A few recorded pulses of each item, to which effects are applied.

    Parameters
    ----------
    item : (k,) int array
    weight : (k,) array
        An item's shift is the weighted sum of its pulses' shifts: 1 / number for one patch or
        target; that of a shared plane's second patch is negative.
    gps_time : (k,) array
        Units: s.
    xyz : (k, 3) array
        Map coordinates, georeferenced with the recorded data. Units: m.
    scanner_xyz : (k, 3) array
        In the scanner's frame; NaN if the mounting is unknown. Units: m.
    intensity : (k,) array
        Counts of 16 bits.
    normal : (k, 3) array
        Of the surface.
    incidence : (k,) array
        Cosine of the angle between beam and surface normal.
    """

    item: np.ndarray
    weight: np.ndarray
    gps_time: np.ndarray
    xyz: np.ndarray
    scanner_xyz: np.ndarray
    intensity: np.ndarray
    normal: np.ndarray
    incidence: np.ndarray


@dataclass(frozen=True)
class Rows:
    """Observed minus simulated, one scalar per row.

    Rows of one item share time, place and pulses: the three of a target, patch and roughness.

    Parameters
    ----------
    channel : (m,) str array
        target, surface, shared, roughness or return_rate.
    item : (m,) int array
        Index of the observed item: target and pass, patch, pair of patches.
    survey_item : (m,) int array
        Row of ``targets`` whose survey error this row has; -1 for none.
    gps_time, gps_time_2 : (m,) array
        Time of the observation; for a plane in an overlap the first and the second time, otherwise
        NaN as the second. Units: s.
    position : (m, 3) array
        Observed position. Units: m.
    direction : (m, 3) array
        Unit vector on the map along which the residual is measured; zero for channels without a
        unit.
    residual : (m,) array
        Target and surface: observed - simulated along the direction (m), which is minus the
        misclosure. Shared: first - second along it (m). Roughness: log of the variance about the
        plane over the assumed one. Return rate: difference of the shares that returned.
    noise : (m,) array
        Variance of each row's own noise: extraction, or mean of a patch, from the points' scatter,
        so that it includes noise unknown to the simulator. In the residual's unit.
    survey : (m,) array
        Variance of the target's survey error along the direction. Units: m^2.
    survey_factor : (m, 3) array
        For two rows of one survey_item, the survey error's covariance is the product of these
        vectors; ``survey`` is their squared length. Units: m.
    points : (m,) int array
        Number of returns behind the row.
    assumed : (m,) array
        Variance about the plane (m^2) or share of returns assumed by the simulator; NaN for the
        others.
    partials, partials_2 : (m, 6) array
        Of the residual by the pose (position in m; rotation about map axes in rad) at each of the
        two times: direction . [I, -Phi(G)]; the second has its minus sign, and is zero without a
        second time.
    covariates : dict of (m,) arrays
        time (s from the start), location (m along the first pass), range (m), incidence (rad),
        scan_angle (rad), intensity (log10 counts), speed (m/s), turn_rate (rad/s, to the right),
        heading (rad), pass (from 1), axis (0, 1, 2: E, N, H, the direction's largest component; -1
        without one). NaN if unknown.
    pulses : SamplePulses
    targets : ControlPoints
        All surveyed targets, control and check.
    reference : Reference
        Reference of effects.
    """

    channel: np.ndarray
    item: np.ndarray
    survey_item: np.ndarray
    gps_time: np.ndarray
    gps_time_2: np.ndarray
    position: np.ndarray
    direction: np.ndarray
    residual: np.ndarray
    noise: np.ndarray
    survey: np.ndarray
    survey_factor: np.ndarray
    points: np.ndarray
    assumed: np.ndarray
    partials: np.ndarray
    partials_2: np.ndarray
    covariates: dict[str, np.ndarray]
    pulses: SamplePulses
    targets: ControlPoints
    reference: Reference

    def __len__(self):
        return len(self.item)

    @property
    def metric(self) -> np.ndarray:
        """Flag (m,) of rows with a residual in m."""
        return np.isin(self.channel, METRIC)

    @property
    def two_times(self) -> np.ndarray:
        """Flag (m,) of rows that compare two times."""
        return np.isfinite(self.gps_time_2)

    def select(self, rows: np.ndarray) -> "Rows":
        """Select some rows with the pulses of their items; items keep their indices.

        Parameters
        ----------
        rows : (m,) bool array, or (k,) int array
        """
        arrays = {name: getattr(self, name)[rows] for name in _arrays(self)}
        return replace(
            self,
            **arrays,
            covariates={name: values[rows] for name, values in self.covariates.items()},
            pulses=self.pulses[np.isin(self.pulses.item, arrays["item"])],
        )

    @classmethod
    def concatenate(cls, subsets: Iterable["Rows"]) -> "Rows":
        """Concatenate rows of one survey; items are renumbered from 0, part by part."""
        parts = []
        first = 0
        for rows in subsets:
            known = np.unique(np.append(rows.item, rows.pulses.item))
            pulses = replace(rows.pulses, item=first + np.searchsorted(known, rows.pulses.item))
            item = first + np.searchsorted(known, rows.item)
            parts.append(replace(rows, item=item, pulses=pulses))
            first += len(known)
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(rows, name) for rows in parts])
            for name in _arrays(parts[0])
        }
        return replace(
            parts[0],
            **columns,
            covariates={
                name: np.concatenate([rows.covariates[name] for rows in parts])
                for name in parts[0].covariates
            },
            pulses=SamplePulses.concatenate([rows.pulses for rows in parts]),
        )

    def survey_design(self) -> csr_array:
        """Sparse U (m, 3 targets), with U U^T the covariance of the survey errors in the rows."""
        rows = np.flatnonzero(self.survey_item >= 0)
        column = 3 * self.survey_item[rows, None] + np.arange(3)
        entries = self.survey_factor[rows].ravel(), (np.repeat(rows, 3), column.ravel())
        return csr_array(entries, shape=(len(self), 3 * len(self.targets)))


def _arrays(rows):
    """Names of the fields that are arrays with m rows each."""
    return [f.name for f in fields(rows) if isinstance(getattr(rows, f.name), np.ndarray)]


@dataclass(frozen=True)
class Background:
    """Assumed POS errors of each row, with one leg for each time of a row.

    The error of row i is the sum over its legs of position . a(t) + attitude . b(t), with a and b
    (3,) processes of unit variance; the factor on each, the correlation times and the families are
    chosen by the inference, with a separate factor where the stated sigma is increased. The
    position error restarts at GNSS re-acquisition.

    Parameters
    ----------
    row : (l,) int array
    gps_time : (l,) array
        Units: s.
    position, attitude : (l, 3) array
        Units: m.
    correlation_time : float
        Prior correlation time. Units: s.
    windows : tuple of (start, length, factor, shape)
        Intervals in which it is assumed to be worse; see Pos.
    clock : (l,) array, optional
        Clock of the position error, which jumps where it restarts; gps_time by default. Units: s.
    increased : (l,) int array, optional
        Index of the interval with increased stated sigma, from 0; -1, the default, outside.
    """

    row: np.ndarray
    gps_time: np.ndarray
    position: np.ndarray
    attitude: np.ndarray
    correlation_time: float
    windows: tuple = ()
    clock: np.ndarray | None = None
    increased: np.ndarray | None = None


def background(rows: Rows, survey: Survey) -> Background:
    """Make the Background of the metric rows, from the POS's own sigmas or those of survey.toml.

    Parameters
    ----------
    rows : Rows
    survey : Survey
        Survey of the rows.
    """
    first = np.flatnonzero(rows.metric)
    second = np.flatnonzero(rows.two_times)
    row = np.append(first, second)
    gps_time = np.append(rows.gps_time[first], rows.gps_time_2[second])
    partials = np.vstack([rows.partials[first], rows.partials_2[second]])
    sigma = PosErrors.stated(survey.trajectory, survey.pos).at(gps_time)
    return Background(
        row,
        gps_time,
        partials[:, :3] * sigma.position,
        np.einsum("li,lij->lj", partials[:, 3:], sigma.attitude),
        survey.pos.correlation_time,
        survey.pos.windows,
        sigma.clock,
        sigma.history.increase(gps_time),
    )


def _reference_of(survey: Survey) -> Reference:
    """Reference of a survey's effects: its trajectory's time span, the mean of all its targets.

    Parameters
    ----------
    survey : Survey
    """
    start, end = survey.trajectory.gps_time[[0, -1]]
    targets = survey.surveyed
    if len(targets):
        place = targets.position
    else:
        place = survey.trajectory.position
    return Reference(float(start), float(end), place.mean(axis=0))


def scanner_origin(survey: Survey, gps_time: np.ndarray) -> np.ndarray:
    """Position of the scanner, or of the navigation center if the mounting is unknown.

    Parameters
    ----------
    survey : Survey
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n, 3) array
        Units: m.
    """
    return scanner_position(survey.trajectory, survey.mounting, gps_time)


def to_scanner_or_nan(survey: Survey, xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """Scanner coordinates of map points; NaN if the mounting is unknown.

    Parameters
    ----------
    survey : Survey
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n, 3) array
        Units: m.
    """
    if survey.mounting is None:
        return np.full_like(xyz, np.nan)
    return to_scanner(survey.trajectory, survey.mounting, xyz, gps_time)


def covariates(
    survey: Survey,
    gps_time: np.ndarray,
    position: np.ndarray,
    pulses: SamplePulses,
    item: np.ndarray,
    pass_number: np.ndarray,
    direction: np.ndarray,
) -> dict[str, np.ndarray]:
    """Compute covariates (m,) of items or rows by name; see Rows.

    Parameters
    ----------
    survey : Survey
    gps_time, position, item, pass_number, direction : (m, ...) arrays
    pulses : SamplePulses
        Range, incidence, scan angle and intensity are their means over each item.
    """
    trajectory = survey.trajectory
    speed, turn_rate, heading = _motion(trajectory, gps_time)
    away = np.linalg.norm(pulses.xyz - scanner_origin(survey, pulses.gps_time), axis=1)
    angle = np.arctan2(pulses.scanner_xyz[:, 1], pulses.scanner_xyz[:, 0])
    mean = _mean_of(pulses.item, item)
    counts = np.log10(np.maximum(pulses.intensity, 1.0))
    largest = np.argmax(np.abs(direction), axis=1)
    return {
        "time": gps_time - trajectory.gps_time[0],
        "location": _location(trajectory, gps_time, position),
        "range": mean(away),
        "incidence": np.arccos(np.clip(mean(pulses.incidence), 0.0, 1.0)),
        "scan_angle": np.arctan2(mean(np.sin(angle)), mean(np.cos(angle))),
        "intensity": mean(counts),
        "speed": speed,
        "turn_rate": turn_rate,
        "heading": heading,
        "pass": pass_number.astype(float),
        "axis": np.where(direction.any(axis=1), largest, -1).astype(float),
    }


def _mean_of(pulse_item, item):
    """Function that returns an item's mean (m,) of values (k,) of the pulses."""
    known, row = np.unique(pulse_item, return_inverse=True)
    count = np.bincount(row)
    place = np.searchsorted(known, item)

    def mean(values):
        return (np.bincount(row, values) / count)[place]

    return mean


def poses_about(
    trajectory: Trajectory, gps_time: np.ndarray, lag: float
) -> tuple[Trajectory, Trajectory]:
    """Interpolate poses shortly before and after times (k,), within their passes.

    Parameters
    ----------
    trajectory : Trajectory
    gps_time : (k,) array
        Units: s.
    lag : float
        Units: s.
    """
    start, end = trajectory.passes[trajectory.segment(gps_time)].T
    before = np.maximum(gps_time - lag, start)
    after = np.minimum(gps_time + lag, end)
    return trajectory.at(before), trajectory.at(after)


def _motion(trajectory, gps_time):
    """Speed (m/s), rate of heading to the right (rad/s) and heading (rad) at times (m,)."""
    before, after = poses_about(trajectory, gps_time, SETTINGS.motion_step)
    duration = after.gps_time - before.gps_time
    distance = np.linalg.norm(after.position - before.position, axis=1)
    turn = (after.attitude * before.attitude.inv()).as_rotvec()[:, 2]
    heading = angles_from_attitude(trajectory.at(gps_time).attitude)[2]
    return distance / duration, -turn / duration, heading


def _location(trajectory, gps_time, position):
    """Distance (m,) along the first pass, or along its own pass if that is far. Units: m.

    Units: m.
    """
    steps = np.linalg.norm(np.diff(trajectory.position, axis=0, prepend=np.nan), axis=1)
    segment = trajectory.segment(trajectory.gps_time)
    steps[np.append(True, np.diff(segment) != 0)] = 0.0
    chainage = np.cumsum(steps)
    chainage -= chainage[np.searchsorted(segment, segment)]
    first = np.flatnonzero(segment == 0)
    distance, nearest = cKDTree(trajectory.position[first]).query(position)
    own = np.interp(gps_time, trajectory.gps_time, chainage)
    return np.where(distance <= SETTINGS.location_reach, chainage[first][nearest], own)


def assemble(
    survey: Survey,
    channel: str | list[str] | np.ndarray,
    item: np.ndarray,
    gps_time: np.ndarray,
    position: np.ndarray,
    direction: np.ndarray,
    residual: np.ndarray,
    noise: np.ndarray,
    points: np.ndarray,
    pulses: SamplePulses,
    pass_number: np.ndarray,
    gps_time_2: np.ndarray | None = None,
    survey_item: np.ndarray | None = None,
    survey_factor: np.ndarray | None = None,
    assumed: np.ndarray | None = None,
) -> Rows:
    """Assemble rows of a survey, with partials and covariates.

    Parameters
    ----------
    survey : Survey
    channel, ..., believed : (m, ...) arrays
        See ``Rows``. Missing arguments mean one time, no survey error, no assumed value.
    pulses : SamplePulses
    pass_number : (m,) int array
        From 1.
    """
    m = len(item)
    if gps_time_2 is None:
        gps_time_2 = np.full(m, np.nan)
    if survey_factor is None:
        survey_factor = np.zeros((m, 3))
    second = np.isfinite(gps_time_2)
    partials_2 = np.zeros((m, 6))
    partials_2[second] = -_partials(survey, position[second], gps_time_2[second], direction[second])
    return Rows(
        channel=np.broadcast_to(np.asarray(channel, dtype="U11"), m).copy(),
        item=item,
        survey_item=np.full(m, -1) if survey_item is None else survey_item,
        gps_time=gps_time,
        gps_time_2=gps_time_2,
        position=position,
        direction=direction,
        residual=residual,
        noise=noise,
        survey=np.sum(survey_factor**2, axis=1),
        survey_factor=survey_factor,
        points=points,
        assumed=np.full(m, np.nan) if assumed is None else assumed,
        partials=_partials(survey, position, gps_time, direction),
        partials_2=partials_2,
        covariates=covariates(survey, gps_time, position, pulses, item, pass_number, direction),
        pulses=pulses,
        targets=survey.surveyed,
        reference=_reference_of(survey),
    )


def _partials(survey, position, gps_time, direction):
    """Partial derivatives (m, 6) along the directions with respect to the pose."""
    return np.einsum("mi,mij->mj", direction, pose_partials(survey.trajectory, position, gps_time))


def sample_pulses(
    survey: Survey,
    item: np.ndarray,
    weight: np.ndarray,
    xyz: np.ndarray,
    gps_time: np.ndarray,
    intensity: np.ndarray,
    normal: np.ndarray,
) -> SamplePulses:
    """Make the pulses behind points on surfaces.

    Parameters
    ----------
    survey : Survey
    item, weight, xyz, gps_time, intensity, normal : (k, ...) arrays
        See ``SamplePulses``.
    """
    beam = xyz - scanner_origin(survey, gps_time)
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    return SamplePulses(
        item=item,
        weight=weight,
        gps_time=gps_time,
        xyz=xyz,
        scanner_xyz=to_scanner_or_nan(survey, xyz, gps_time),
        intensity=intensity.astype(float),
        normal=normal,
        incidence=np.abs(np.einsum("ki,ki->k", beam, normal)),
    )
