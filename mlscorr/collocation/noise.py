"""Noise of observations, of which some share an error."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Noise:
    """Noise of n epochs with r observations each (Mao et al. 2015, Eq. 19).

    Parameters
    ----------
    own : (n, r, r) array
        Covariance of what each epoch has alone: the extraction. Units: m^2.
    group : (n,) int array, optional
        Which target each epoch has seen, as a row of ``shared``.
    shared : (g, r) array, optional
        Sigmas of the error that all epochs of a target have in common: its survey. Units: m.
    """

    own: np.ndarray
    group: np.ndarray | None = None
    shared: np.ndarray | None = None

    @cached_property
    def separate(self) -> np.ndarray:
        """Covariance (n, r, r) of each epoch's noise, without what it shares with others."""
        if self.group is None:
            return self.own
        is_single = ~np.isin(self.group, self.repeated)
        variance = np.where(is_single[:, None], self.shared[self.group] ** 2, 0.0)
        return self.own + variance[:, :, None] * np.eye(variance.shape[1])

    @cached_property
    def common(self) -> np.ndarray:
        """Columns (n r, c) of the errors shared by several epochs, each of unit variance."""
        n, r = self.own.shape[:2]
        if self.group is None:
            return np.zeros((n * r, 0))
        members = self.group[:, None] == self.repeated
        sigma = np.where(members[:, :, None], self.shared[self.repeated], 0.0)
        return np.einsum("ngk,jk->njgk", sigma, np.eye(r)).reshape(n * r, members.shape[1] * r)

    @property
    def repeated(self) -> np.ndarray:
        """Groups that have several epochs and an error to share."""
        if self.group is None:
            return np.zeros(0, dtype=np.int64)
        groups, count = np.unique(self.group, return_counts=True)
        return groups[(count > 1) & np.any(self.shared[groups] > 0, axis=1)]

    @property
    def matrix(self) -> np.ndarray:
        """All of it as one covariance matrix (n r, n r)."""
        return self.block(np.arange(self.own.shape[0] * self.own.shape[1]))

    def block(self, rows: np.ndarray) -> np.ndarray:
        """Covariance of some rows, numbered as in a Collocation."""
        epoch, row = np.divmod(np.asarray(rows, dtype=int), self.own.shape[1])
        separate = self.separate[epoch[:, None], row[:, None], row]
        common = self.common[rows]
        return np.where(epoch[:, None] == epoch, separate, 0.0) + common @ common.T

    def select(self, epochs: np.ndarray) -> Noise:
        """The noise of some epochs: their numbers, or an (n,) mask."""
        group = None if self.group is None else self.group[epochs]
        return Noise(self.own[epochs], group, self.shared)

    def insert(self, at: int, own: np.ndarray) -> Noise:
        """The same with epochs that share no error with others, before the one of a number.

        Parameters
        ----------
        at : int
        own : (k, r, r) array
            Units: m^2.
        """
        both = np.insert(self.own, at, own, axis=0)
        if self.group is None:
            return Noise(both)
        nothing = np.zeros((len(own), self.shared.shape[1]))
        group = np.insert(self.group, at, len(self.shared) + np.arange(len(own)))
        return Noise(both, group, np.vstack([self.shared, nothing]))

    def share(self, epochs: np.ndarray, number: np.ndarray, sigma: np.ndarray) -> Noise:
        """The same with errors that some epochs, which share none so far, have in common.

        Parameters
        ----------
        epochs : (k,) int array
        number : (k,) int array
            Of the error that each has, from 0.
        sigma : (r,) array
            Of each error. Units: m.
        """
        n, r = self.own.shape[:2]
        shared = np.zeros((n, r)) if self.group is None else self.shared
        if self.group is None:
            group = np.arange(n)
        else:
            group = self.group.copy()
        group[epochs] = len(shared) + number
        return Noise(self.own, group, np.vstack([shared, np.tile(sigma, (max(number) + 1, 1))]))
