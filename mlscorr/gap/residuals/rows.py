"""Observed minus simulated as scalar rows, and the pulses that stand behind them."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from mlscorr.effects import Reference
from mlscorr.pos import stated_sigma
from mlscorr.survey import Columns, ControlPoints, Survey

METRIC = ("target", "surface", "shared")  # in m along a direction; the others have no unit


@dataclass(frozen=True, repr=False)
class SamplePulses(Columns):
    """A few pulses of each item, as recorded: what effects are applied to, with and without.

    Parameters
    ----------
    item : (k,) int array
    weight : (k,) array
        An item's shift is the weighted sum of its pulses' shifts: 1 / number for one patch or
        target; that of a shared plane's second patch is negative.
    gps_time : (k,) array
        Units: s.
    xyz : (k, 3) array
        On the map, georeferenced with what was recorded. Units: m.
    scanner_xyz : (k, 3) array
        In the scanner's frame; NaN where the mounting is not known. Units: m.
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
    """Observed minus simulated, one scalar a row.

    Rows of one item share time, place and pulses: the three of a target, patch and roughness.

    Parameters
    ----------
    channel : (m,) str array
        target, surface, shared, roughness or return_rate.
    item : (m,) int array
        Which observed thing: target and pass, patch, pair of patches.
    survey_item : (m,) int array
        Row of ``targets`` whose survey error this row has; -1 for none.
    gps_time, gps_time_2 : (m,) array
        When it was seen; for a plane that was seen twice the first and the second time, else NaN
        as the second. Units: s.
    position : (m, 3) array
        Where, as observed. Units: m.
    direction : (m, 3) array
        Unit vector on the map along which the residual is measured; zero for channels without a
        unit.
    residual : (m,) array
        Target and surface: observed - simulated along the direction (m), which is minus the
        misclosure. Shared: first - second along it (m). Roughness: log of the variance about the
        plane over the believed one. Return rate: difference of the shares that returned.
    noise : (m,) array
        Variance of what is each row's own: extraction, mean of a patch, as the points' scatter
        shows it, so that a noise that the simulator doesn't know is in it. In the residual's unit.
    survey : (m,) array
        Variance of the target's survey error along the direction. Units: m^2.
    survey_factor : (m, 3) array
        Of two rows of one survey_item, the survey error's covariance is the product of these
        vectors; ``survey`` is their squared length. Units: m.
    points : (m,) int array
        Number of returns that the row rests on.
    believed : (m,) array
        Variance about the plane (m^2) or share of returns that the simulator believes in; NaN for
        the others.
    partials, partials_2 : (m, 6) array
        Of the residual by the pose (position in m; rotation about map axes in rad) at each of the
        two times: direction . [I, -Phi(G)]; the second has its minus sign, and is zero without a
        second time.
    covariates : dict of (m,) arrays
        time (s from the start), location (m along the first pass), range (m), incidence (rad),
        scan_angle (rad), intensity (log10 counts), speed (m/s), turn_rate (rad/s, to the right),
        heading (rad), pass (from 1), axis (0, 1, 2: E, N, H, the direction's largest component;
        -1 without one). NaN where it is not known.
    pulses : SamplePulses
    targets : ControlPoints
        The surveyed targets, control and check together.
    reference : Reference
        What effects refer to.
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
    believed: np.ndarray
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
        """Which rows have a residual in m: (m,) bool."""
        return np.isin(self.channel, METRIC)

    @property
    def two_times(self) -> np.ndarray:
        """Which rows compare two times: (m,) bool."""
        return np.isfinite(self.gps_time_2)

    def select(self, rows: np.ndarray) -> "Rows":
        """Some rows with the pulses of their items; items keep their numbers.

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
        """All rows of parts of one survey; items are numbered anew from 0, part after part."""
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
        """U, sparse (m, 3 targets): U U^T is the covariance of the survey errors in the rows."""
        rows = np.flatnonzero(self.survey_item >= 0)
        column = 3 * self.survey_item[rows, None] + np.arange(3)
        entries = self.survey_factor[rows].ravel(), (np.repeat(rows, 3), column.ravel())
        return csr_array(entries, shape=(len(self), 3 * len(self.targets)))


def _arrays(rows):
    """Names of the fields that are arrays, of m rows each."""
    return [f.name for f in fields(rows) if isinstance(getattr(rows, f.name), np.ndarray)]


@dataclass(frozen=True)
class Background:
    """What the POS is believed to err by, in each row: one leg for each time that a row has.

    The error of row i is the sum over its legs of position . a(t) + attitude . b(t), with a and b
    (3,) processes of unit variance; the factor on each, the correlation times and the families
    are for the inference to choose, and where the stated sigma is raised a factor of its own. The
    position's error starts anew where the POS falls back.

    Parameters
    ----------
    row : (l,) int array
    gps_time : (l,) array
        Units: s.
    position, attitude : (l, 3) array
        Units: m.
    correlation_time : float
        As believed. Units: s.
    windows : tuple of (start, length, factor, shape)
        In which it is believed to be worse, see Pos.
    clock : (l,) array, optional
        The position's own time, which leaps where its error starts anew; gps_time by default.
        Units: s.
    raised : (l,) int array, optional
        Number of the stretch in which the stated sigma is raised, from 0; -1, as by default, where
        it isn't.
    """

    row: np.ndarray
    gps_time: np.ndarray
    position: np.ndarray
    attitude: np.ndarray
    correlation_time: float
    windows: tuple = ()
    clock: np.ndarray | None = None
    raised: np.ndarray | None = None


def background(rows: Rows, survey: Survey) -> Background:
    """Background of the metric rows, from the POS's own sigmas or those of survey.toml.

    Parameters
    ----------
    rows : Rows
    survey : Survey
        Of which they are.
    """
    first = np.flatnonzero(rows.metric)
    second = np.flatnonzero(rows.two_times)
    row = np.append(first, second)
    gps_time = np.append(rows.gps_time[first], rows.gps_time_2[second])
    partials = np.vstack([rows.partials[first], rows.partials_2[second]])
    sigma = stated_sigma(survey.trajectory, survey.pos, gps_time)
    return Background(
        row,
        gps_time,
        partials[:, :3] * sigma.position,
        np.einsum("li,lij->lj", partials[:, 3:], sigma.attitude),
        survey.pos.correlation_time,
        survey.pos.windows,
        sigma.clock,
        sigma.history.raised(gps_time),
    )


def reference_of(survey: Survey) -> Reference:
    """What a survey's effects refer to: its trajectory's span, the mean of all its targets.

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
