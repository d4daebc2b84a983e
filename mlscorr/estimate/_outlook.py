"""What further targets would leave of the variance along a drive, by covariances alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.collocation import Noise, SparseRows, covariance_given
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters, pose_signals
from mlscorr.estimate.tied import sample
from mlscorr.pos import stated_sigma


@dataclass(frozen=True)
class Outlook:
    """The corrected position at some epochs, and targets that might be observed.

    Parameters
    ----------
    weights : (f,) array
        Of families of covariances; their sum is 1.
    covariances : (f, q, q) array
        Of what is left of the position at k epochs, 3 rows each, and of what targets show. Units:
        m^2.
    epochs : int
        k.
    targets : tuple of (r,) int array
        Rows of each target.
    noise : tuple of (r, r) array
        Covariance of its survey and extraction. Units: m^2.
    """

    weights: np.ndarray
    covariances: np.ndarray
    epochs: int
    targets: tuple[np.ndarray, ...]
    noise: tuple[np.ndarray, ...]

    @classmethod
    def of(
        cls,
        equations: Equations,
        families: list[tuple[SignalParameters, float]],
        rows: np.ndarray,
        sights: list[list[int]],
    ) -> Outlook:
        """Before any of them is observed.

        Parameters
        ----------
        equations : Equations
        families : list of (SignalParameters, weight)
        rows : (k,) int array
            Of the trajectory's epochs.
        sights : list of lists of int
            Epochs at which each target would be seen: as far and as well as the median control
            point, on its side.
        """
        thinned = with_fewer_rows(equations)
        at_target = np.concatenate(sights)
        still = np.tile(np.eye(3, 6), (len(rows), 1, 1))
        moved = np.concatenate([still, _target_partials(equations, at_target)])
        at = np.concatenate([rows, at_target])
        weights = np.array([weight for _, weight in families])
        shown = [_shown(equations, chosen, at, moved) for chosen, _ in families]
        covariances = np.stack(
            [
                covariance_given(thinned.rows(chosen), [part], thinned.believed(chosen))
                for (chosen, _), part in zip(families, shown, strict=True)
            ]
        )
        ends = 3 * (len(rows) + np.cumsum([len(sight) for sight in sights]))
        targets = [np.arange(end - 3 * len(s), end) for end, s in zip(ends, sights, strict=True)]
        noise = [_target_noise(equations.noise, len(equations.names), len(s)) for s in sights]
        return cls(weights / weights.sum(), covariances, len(rows), tuple(targets), tuple(noise))

    @property
    def variance(self) -> np.ndarray:
        """3D variance (k,) of the corrected position at the epochs. Units: m^2."""
        diagonal = np.einsum("f,fii->i", self.weights, self.covariances)
        return diagonal[: 3 * self.epochs].reshape(-1, 3).sum(axis=1)

    def with_target(self, number: int) -> Outlook:
        """The same with a target observed (Eq. 15, for one more observation).

        Parameters
        ----------
        number : int
            Of the target.
        """
        columns = self.covariances[:, :, self.targets[number]]
        known = np.linalg.solve(self._observed(number), columns.swapaxes(1, 2))
        return replace(self, covariances=self.covariances - columns @ known)

    def best(self, counted: np.ndarray) -> int:
        """Number of the target that lowers the variance most, by the first family.

        Parameters
        ----------
        counted : (k,) bool array
            Epochs that count.
        """
        rows = np.repeat(counted, 3).nonzero()[0]
        gains = []
        for number, columns in enumerate(self.targets):
            cross = self.covariances[0][np.ix_(rows, columns)]
            gains.append(np.sum(cross * np.linalg.solve(self._observed(number)[0], cross.T).T))
        return int(np.argmax(gains))

    def _observed(self, number):
        """Covariances (f, r, r) of a target's observations."""
        rows = self.targets[number]
        return self.covariances[:, rows[:, None], rows] + self.noise[number]


def with_fewer_rows(equations: Equations) -> Equations:
    """The equations with some of the ties and targets, each as precise as those it stands for.

    Parameters
    ----------
    equations : Equations
    """
    room = SETTINGS.dense_rows
    if equations.ties is not None:
        some = sample(equations)
        share = len(some.ties) / len(equations.ties)
        equations = replace(some, ties=replace(some.ties, variance=share * some.ties.variance))
        room -= len(equations.ties)
    step = -(-equations.misclosure.size // max(room, 1))
    if step == 1:
        return equations
    thinned = equations.select(np.arange(0, len(equations.names), step))
    noise = thinned.noise
    own = noise.own / step
    if noise.shared is None:
        shared = None
    else:
        shared = noise.shared / np.sqrt(step)
    return replace(thinned, noise=Noise(own, noise.group, shared))


def _shown(equations, parameters, rows, partials):
    """SparseRows of what is corrected of points with partials (n, 3, 6) at epochs."""
    times = equations.trajectory.gps_time[rows]
    n = len(rows)
    noise = Noise(np.zeros((n, 3, 3)))
    design = equations.pose_design(times)[:, :3]
    signals = pose_signals(equations.stated_epochs.at(rows), parameters, partials)
    return SparseRows(times[:, None], np.zeros((n, 3)), noise, design, signals)


def _target_partials(equations, rows):
    """Partials (n, 3, 6) of targets that are seen as the median control point, at epochs."""
    trajectory = equations.trajectory
    n = len(equations.names)
    turned = stated_sigma(trajectory, equations.pos, equations.observed).rotation.as_matrix()
    arm = np.median(turned.swapaxes(1, 2) @ equations.partials[:n, :, 3:] @ turned, axis=0)
    attitude = trajectory.attitude[rows].as_matrix()
    still = np.tile(np.eye(3), (len(rows), 1, 1))
    return np.concatenate([still, attitude @ arm @ attitude.swapaxes(1, 2)], axis=2)


def _target_noise(noise, n, sights):
    """Covariance of a target's observations at some sights, by medians of the n control points'.

    Of their variances alone: medians of whole matrices, element by element, can be no covariance.
    """
    own = np.diag(np.median(np.diagonal(noise.own[:n], axis1=1, axis2=2), axis=0))
    usual = np.zeros((1, 3))
    if noise.shared is not None:
        usual = np.median(noise.shared[noise.group[:n]], axis=0)[None]
    return Noise(np.tile(own, (sights, 1, 1)), np.zeros(sights, int), usual).matrix
