"""Observations as factors of one equation, l = A x + B s + n  (Mao et al. 2015, Eq. 7-12).

A factor is n observations of one kind, with r rows each:

- target: surveyed - observed position, at one pose;
- re-acquisition: a step of the recorded path, which no vehicle drives, between two poses;
- tie: an object observed in two passes, along its normal, at two poses;
- prior: knowledge of an unknown other than the POS error, without any pose. For every kind, B
follows from the partial derivatives by the poses, and A from these and from the columns of unknowns
such as mountings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.collocation import Noise
from mlscorr.estimate.settings import SETTINGS
from mlscorr.frames import mounting_partials, partials_by_scanner, pose_partials
from mlscorr.pos import PosErrors, StatedSigma, Steps
from mlscorr.survey import SEARCH_RADIUS, Matched, Mounting, Summary, Ties, Trajectory

KINDS = TARGET, REACQUISITION, TIE, PRIOR = "target", "re-acquisition", "tie", "prior"
SIGNS = np.array([1.0, -1.0])  # of the corrections at the first and the second view of a tie


@dataclass(frozen=True, repr=False)
class Factor(Summary):
    """Observations of one kind: n of them, of r rows each, that depend on e poses.

    Parameters
    ----------
    kind : str
        One of KINDS.
    name : (n,) array of str
        Observations of one name are tested and excluded together.
    gps_time : (n, e) array
        Of the poses. Units: s.
    misclosure : (n, r) array
        Misclosures that the correction should explain. Units: m.
    noise : Noise
        Eq. 19.
    partials : (n, e, r, 6) array
        B by position and rotation of each pose (Eq. 7-9).
    stated : StatedSigma, optional
        Of the POS at the n e poses; None without a pose.
    columns : (n, r, u) array, optional
        Partial derivatives by the first u unknowns other than the POS error (Eq. 16-18).
    weight : (n,) array, optional
        Robust weights by which the noise's variance is divided.
    """

    kind: str
    name: np.ndarray
    gps_time: np.ndarray
    misclosure: np.ndarray
    noise: Noise
    partials: np.ndarray
    stated: StatedSigma | None = None
    columns: np.ndarray | None = None
    weight: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.misclosure)

    @property
    def variance(self) -> np.ndarray:
        """Variance (n, r) of each row's own noise, without weights. Units: m^2."""
        return np.einsum("nii->ni", self.noise.own)

    @property
    def weighed_noise(self) -> Noise:
        """The noise divided by the weights."""
        if self.weight is None:
            return self.noise
        return replace(self.noise, own=self.noise.own / self.weight[:, None, None])

    def select(self, rows: np.ndarray | slice) -> Factor:
        """Some of the observations.

        Parameters
        ----------
        rows : (n,) bool or (k,) int array, or slice
        """
        numbers = np.arange(len(self))[rows]
        stated = self.stated
        if stated is not None:
            poses = np.arange(self.gps_time.size).reshape(self.gps_time.shape)
            stated = stated.at(poses[numbers].ravel())
        columns = self.columns
        if columns is not None:
            columns = columns[numbers]
        weight = self.weight
        if weight is not None:
            weight = weight[numbers]
        return replace(
            self,
            name=self.name[numbers],
            gps_time=self.gps_time[numbers],
            misclosure=self.misclosure[numbers],
            noise=self.noise.select(numbers),
            partials=self.partials[numbers],
            stated=stated,
            columns=columns,
            weight=weight,
        )

    def with_starts(self, starts: np.ndarray) -> Factor:
        """The same with drift that grows from other times on.

        Parameters
        ----------
        starts : (k,) array
            Units: s.
        """
        if self.stated is None:
            return self
        return replace(self, stated=replace(self.stated, starts=starts))

    def with_columns(self, columns: np.ndarray) -> Factor:
        """The same with more unknowns, after the existing ones.

        Parameters
        ----------
        columns : (n, r, k) array
        """
        if self.columns is not None:
            columns = np.concatenate([self.columns, columns], axis=2)
        return replace(self, columns=columns)

    def scaled(self, factor: float) -> Factor:
        """The same without weights and with a factor on the variance of the noise.

        Parameters
        ----------
        factor : float
        """
        return replace(self, noise=replace(self.noise, own=factor * self.noise.own), weight=None)


def target_factor(errors: PosErrors, matched: Matched) -> Factor:
    """Matched targets, three rows each: surveyed - observed (Eq. 7-9).

    The noise is that of extraction, of the survey, which all passes of a target share, and of the
    step of the path that contains it (Eq. 19).

    Parameters
    ----------
    errors : PosErrors
    matched : Matched
    """
    times = matched.gps_time
    partials = pose_partials(errors.trajectory, matched.observations.position, times)
    return Factor(
        kind=TARGET,
        name=np.array(matched.name),
        gps_time=times[:, None],
        misclosure=matched.misclosure,
        noise=_target_noise(matched, errors.history.steps),
        partials=partials[:, None],
        stated=errors.at(times),
    )


def _target_noise(matched, steps):
    number = matched.point_number
    times = matched.gps_time[:, None]
    shared = matched.surveyed.sigma[np.unique(number, return_index=True)[1]]
    inside = ((times >= steps.before) & (times <= steps.after)).astype(float)
    stepped = np.einsum("ns,si,sj->nij", inside, steps.size, steps.size)
    return Noise(matched.observations.covariance + stepped, number, shared)


def reacquisition_factor(errors: PosErrors, steps: Steps) -> Factor:
    """Steps of the recorded path, at which the error moves by as much as the position.

    Steps longer than SEARCH_RADIUS are not errors of a POS.

    Parameters
    ----------
    errors : PosErrors
    steps : Steps
    """
    steps = steps[np.linalg.norm(steps.size, axis=1) < SEARCH_RADIUS]
    n = len(steps)
    times = np.column_stack([steps.before, steps.after])
    position = np.eye(3, 6)
    return Factor(
        kind=REACQUISITION,
        name=np.array([f"{time:.3f}" for time in steps.middle], dtype=str),
        gps_time=times,
        misclosure=steps.size,
        noise=Noise(steps.sigma[:, None, None] ** 2 * np.eye(3)),
        partials=np.tile(np.stack([position, -position]), (n, 1, 1, 1)),
        stated=errors.at(times.ravel()),
    )


def tie_factor(
    errors: PosErrors, ties: Ties, mountings: Mapping[int, Mounting] | None = None
) -> Factor:
    """Ties, a row each: n . (c(t1) - c(t2)) at the places of both views is the misclosure.

    A mounting is common to both views: its columns are the differences between them.

    Parameters
    ----------
    errors : PosErrors
    ties : Ties
    mountings : dict, optional
        Mountings used to georeference the ties, with unknown errors, by the number of their
        scanner.
    """
    trajectory = errors.trajectory
    times = ties.gps_time.ravel()
    along = along_ties(ties.direction, pose_partials(trajectory, ties.place.reshape(-1, 3), times))
    epochs = _shared_epochs(times, errors.history)
    columns = None
    if mountings:
        columns = mounting_columns(trajectory, mountings, ties)[:, None]
    return Factor(
        kind=TIE,
        name=np.asarray(ties.kind),
        gps_time=epochs.reshape(-1, 2),
        misclosure=ties.misclosure[:, None],
        noise=Noise(ties.variance[:, None, None]),
        partials=along[:, :, None],
        stated=errors.at(epochs),
        columns=columns,
    )


def prior_factor(mean: np.ndarray, sigma: np.ndarray) -> Factor:
    """Prior of unknowns other than the POS error: the value and one sigma of each.

    Parameters
    ----------
    mean, sigma : (u,) array
        In the unit of each.
    """
    u = len(sigma)
    return Factor(
        kind=PRIOR,
        name=np.array([str(number) for number in range(u)]),
        gps_time=np.zeros((u, 0)),
        misclosure=np.asarray(mean, dtype=float)[:, None],
        noise=Noise(np.asarray(sigma, dtype=float)[:, None, None] ** 2),
        partials=np.zeros((u, 0, 1, 6)),
        columns=np.eye(u)[:, None],
    )


def target_columns(
    trajectory: Trajectory, mountings: Sequence[Mounting], matched: Matched
) -> np.ndarray:
    """Partial derivatives (n, 3, 6 k) of targets by the errors of k mountings  (Eq. 16-18).

    Parameters
    ----------
    trajectory : Trajectory
    mountings : sequence of Mounting
        Of each scanner.
    matched : Matched
    """
    return partials_by_scanner(
        mounting_partials,
        trajectory,
        dict(enumerate(mountings)),
        matched.observations.position,
        matched.gps_time,
        matched.scanner,
    )


def mounting_columns(
    trajectory: Trajectory, mountings: Mapping[int, Mounting], ties: Ties
) -> np.ndarray:
    """Partial derivatives (n, 6 k) of ties by the errors of k mountings  (Eq. 16-18).

    Parameters
    ----------
    trajectory : Trajectory
    mountings : dict
        By the number of their scanner.
    ties : Ties
    """
    views = ties.place.reshape(-1, 3), ties.gps_time.ravel(), ties.scanner.ravel()
    partials = partials_by_scanner(mounting_partials, trajectory, mountings, *views)
    return along_ties(ties.direction, partials).sum(axis=1)


def along_ties(direction: np.ndarray, partials: np.ndarray) -> np.ndarray:
    """Partial derivatives (n, 2, j) of ties by what moves both views, the second negative.

    Parameters
    ----------
    direction : (n, 3) array
    partials : (2 n, 3, j) array
        Of the places of both views, one after the other.
    """
    by_view = partials.reshape(len(direction), 2, 3, partials.shape[2])
    return SIGNS[:, None] * np.einsum("ni,nvij->nvj", direction, by_view)


def _shared_epochs(gps_time, history):
    """Mean time (q,) of the views in each short interval of a segment. Units: s.

    Each epoch is an unknown of the noise of GNSS: with those of all views a survey of two scanners
    takes 17 times as long to solve.
    """
    since = gps_time - gps_time.min(initial=np.inf)
    interval = np.floor(since / SETTINGS.tie_epoch)
    keys = np.column_stack([history.segment(gps_time), interval])
    number = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    mean = np.bincount(number, since) / np.bincount(number)
    return (gps_time - since) + mean[number]
