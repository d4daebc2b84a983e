"""Tie features of the street itself (planes, poles, paint), and ties between passes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.survey.columns import Columns

PAINTED = ("line", "dash")  # on the road
TIE_KINDS = ("plane", "pole", *PAINTED)  # of features
PAUSE = 10.0  # s between two visits of one pass; within it the POS error is nearly constant


@dataclass(frozen=True, eq=False, repr=False)
class TieFeatures(Columns):
    """Planes, poles and paint as observed in each pass; a row covers about a meter and a second.

    Parameters
    ----------
    pass_number : (n,) int array
        Passes are numbered from 1 in order of time.
    scanner : (n,) int array
        Index of the scanner, from 0.
    kind : (n,) str array
        Of TIE_KINDS.
    gps_time : (n,) array
        Mean of the points. Units: s.
    centre : (n, 3) array
        Mean of the points; of a dash, midway between its ends. Units: m.
    direction : (n, 3) array
        Unit normal of a plane, toward the scanner; axis of a pole, upward; horizontal, across a
        painted line or along a dash, with either sign.
    variance : (n,) array
        Of the center along the direction; for a pole, along any direction across the axis. Units:
        m^2.
    tilt : (n,) array
        Variance of the direction about each perpendicular axis. Units: rad^2.
    extent : (n,) array
        One sigma of the points along a plane's narrow side, or along a pole or paint. Units: m.
    points : (n,) int array
        For paint, the number of scan lines that cross it.
    sweep : (n, 3) array
        Gradient of the points' times over a plane or along a pole, because a moving line scanner
        reaches one end before the other. Units: s/m.
    """

    pass_number: np.ndarray
    scanner: np.ndarray
    kind: np.ndarray
    gps_time: np.ndarray
    centre: np.ndarray
    direction: np.ndarray
    variance: np.ndarray
    tilt: np.ndarray
    extent: np.ndarray
    points: np.ndarray
    sweep: np.ndarray

    def time_near(self, rows: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Times at which points near the centers of some features were measured. Units: s.

        Parameters
        ----------
        rows : int array
        offset : (*rows.shape, 3) array
            Offset of the points from each center. Units: m.

        Returns
        -------
        array of the rows' shape
            Limited to the times of the first and last feature of the pass.
        """
        low, high = (span[self.pass_number] for span in time_spans(self.pass_number, self.gps_time))
        times = self.gps_time[rows] + np.einsum("...i,...i->...", self.sweep[rows], offset)
        return np.clip(times, low[rows], high[rows])


@dataclass(frozen=True, eq=False, repr=False)
class Ties(Columns):
    """Ties: scalar observations of the difference in error between two views of a feature.

    n . (correction of place 1 at time 1 - correction of place 2 at time 2) = misclosure + noise. A
    plane gives one row along its normal, a pole two rows across its axis, paint one along its
    direction.

    Parameters
    ----------
    gps_time : (n, 2) array
        Times of the earlier and the later view. Units: s.
    place : (n, 2, 3) array
        Point of the feature at which both views are compared, as each recorded it. Units: m.
    direction : (n, 3) array
        Unit vector n along which both are compared.
    misclosure : (n,) array
        n . (place 2 - place 1), both as recorded. Units: m.
    variance : (n,) array
        Of the noise. Units: m^2.
    kind : (n,) str array
        Of TIE_KINDS.
    pass_number : (n, 2) int array
    scanner : (n, 2) int array
        Indices of the scanners, from 0.
    feature : (n, 2) int array
        Rows of both in the TieFeatures.
    """

    gps_time: np.ndarray
    place: np.ndarray
    direction: np.ndarray
    misclosure: np.ndarray
    variance: np.ndarray
    kind: np.ndarray
    pass_number: np.ndarray
    scanner: np.ndarray
    feature: np.ndarray

    @classmethod
    def between(
        cls,
        features: TieFeatures,
        pairs: np.ndarray,
        direction: np.ndarray,
        variance: np.ndarray,
        correction: np.ndarray | None = None,
    ) -> Ties:
        """Make the ties of pairs of features along directions.

        Parameters
        ----------
        features : TieFeatures
        pairs : (n, 2) int array
            Rows of the features; a pole's pair appears twice.
        direction : (n, 3) array
            Unit vectors.
        variance : (n,) array
            Units: m^2.
        correction : (m, 3) array, optional
            Correction at each feature. With it, both views are compared midway between their
            centers, at the times when each measured that point; otherwise each at its own center.
            Units: m.

        Returns
        -------
        Ties
            The earlier view comes first, regardless of the order in a pair.
        """
        late = features.gps_time[pairs[:, 0]] > features.gps_time[pairs[:, 1]]
        pairs = np.where(late[:, None], pairs[:, ::-1], pairs)
        place = features.centre[pairs]
        gps_time = features.gps_time[pairs]
        if correction is not None:
            offset = _midway(features, pairs, place + correction[pairs])
            place = place + offset
            gps_time = features.time_near(pairs, offset)
        return cls(
            gps_time=gps_time,
            place=place,
            direction=direction,
            misclosure=np.einsum("ni,ni->n", direction, place[:, 1] - place[:, 0]),
            variance=variance,
            kind=features.kind[pairs[:, 0]],
            pass_number=features.pass_number[pairs],
            scanner=features.scanner[pairs],
            feature=pairs,
        )

    @property
    def sigma(self) -> np.ndarray:
        """One sigma (n,) of the noise. Units: m."""
        return np.sqrt(self.variance)

    @property
    def is_of_visit(self) -> np.ndarray:
        """Flags (n,) of ties of one scanner within one visit, as of a rotating one."""
        first, second = self.gps_time.T
        return (np.abs(second - first) <= PAUSE) & (self.scanner[:, 0] == self.scanner[:, 1])


def _midway(features, pairs, place):
    """Vectors (n, 2, 3) from both positions, along their planes or poles, to the middle between
    them.
    """
    offset = place.mean(axis=1, keepdims=True) - place
    axis = features.direction[pairs]
    along = np.einsum("nvi,nvi->nv", axis, offset)[:, :, None] * axis
    return np.where((features.kind[pairs[:, :1]] == "pole")[:, :, None], along, offset - along)


def time_spans(number: np.ndarray, gps_time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last time (k,) of each number. Units: s.

    Parameters
    ----------
    number : (n,) int array
        From 0.
    gps_time : (n,) array
        Units: s.
    """
    first, last = np.multiply.outer([np.inf, -np.inf], np.ones(number.max(initial=-1) + 1))
    np.minimum.at(first, number, gps_time)
    np.maximum.at(last, number, gps_time)
    return first, last
