"""Collocation of rows that link epochs: ties between passes, targets observed in several passes.

``collocate`` is exact to 1e-9, but takes only rows of one epoch each. With H the partial
derivatives of the rows by the states at knots (and by shared errors), R their noise and L0 the
information of the prior,

    L = L0 + H^T R^-1 H,   V^-1 = R^-1 - R^-1 H L^-1 H^T R^-1,   |V| = |R| |L| / |L0|

and S = A^T V^-1 A and the rest is least squares of the trend (``solve_trend``). L is factored in
blocks. L^-1 is computed where rows, and epochs between knots, need it, so sigmas, leave-one-out
residuals and redundancy numbers are exact. The work is linear in rows and knots, whichever epochs a
row links.

The interpolation error r of a signal between knots is treated as independent noise of each row,
though adjacent rows share it. It does no harm while it is small compared with the uncertainty that
all rows between two knots leave in the signal, sigma / sqrt(n). A signal below the noise needs
about one knot per correlation time, one far above it dozens.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, combinations, product

import numpy as np

from mlscorr.collocation._block_cholesky import factorise, invert_in_place, solve_in_place
from mlscorr.collocation._knots import SHARE, Knots, add_prior, knot_step, prior_roots
from mlscorr.collocation._pattern import Pattern, diagonal
from mlscorr.collocation._states import Layout
from mlscorr.collocation.covariance import Covariance
from mlscorr.collocation.interpolation import CHUNK, interpolate_knots, predictor_by
from mlscorr.collocation.model import LARGEST_ERROR, SMALLEST_INFORMATION, Collocation, solve_trend
from mlscorr.collocation.sparse_rows import (
    Sides,
    SparseRows,
    add_information,
    check_same,
    observe,
    row_covariances,
)

LARGEST_SHARE = 0.3  # of a signal's sigma; beyond it Q_11 is no longer a power of the step


def collocate_by_knots(
    rows: Sequence[SparseRows],
    like: InformationSolver | None = None,
    tolerance: float = 0.0,
    prior_rows: np.ndarray | None = None,
) -> Collocation:
    r"""Separate the misclosures of sparse rows into trend, signal and noise.

    Solves l = A x + B s + n as ``collocate`` does, to 1e-5 m and 1 % of sigma for signals with a
    sigma of a few meters. Work and memory are linear in rows and knots, and a shared error costs no
    more than a knot. Observations sorted by time are solved twice as fast.

    Parameters
    ----------
    rows : sequence of SparseRows
        With the same signals and trend: control, ties, steps.
    like : InformationSolver, optional
        Solver of the same epochs, whose knots and order of elimination are used again. A likelihood
        is smooth in the signals' parameters only if the knots do not change.
    tolerance : float
        Allowed ratio of the interpolation error between two knots to the uncertainty that the
        observations between them leave; a larger one needs fewer knots.
    prior_rows : (k, p + 1) array, optional
        Prior of the trend; see Collocation.

    Returns
    -------
    solved : Collocation
        Its rows are those of all observations, one after the other.

    Raises
    ------
    ValueError
        See ``collocate``; also if knots are so close that only rounding errors remain.

    Examples
    --------
    A step of 0.3 m that a tie observes between two passes, the first constrained to 1 mm:

    >>> from mlscorr.collocation import Noise, Signal, SparseRows, collocate_by_knots
    >>> from mlscorr.collocation.covariance import Covariance
    >>> drift, none = Covariance("matern32", 30.0), np.zeros((1, 1, 0))
    >>> noise, unit = Noise(np.full((1, 1, 1), 1e-6)), np.ones((1, 1, 1))
    >>> held = SparseRows(np.array([[0.0]]), np.zeros((1, 1)), noise, none, [Signal(unit, drift)])
    >>> sides = Signal(np.array([-1.0, 1.0])[:, None, None], drift)
    >>> tie = SparseRows(np.array([[0.0, 900.0]]), np.full((1, 1), 0.3), noise, none, [sides])
    >>> solved = collocate_by_knots([held, tie])
    >>> mean, covariance = solved.predict(np.array([900.0]), none, [unit])
    >>> mean.round(4), np.sqrt(covariance).round(4)
    (array([[0.3]]), array([[[0.0014]]]))
    """
    return _solve(InformationSolver.of(rows, like, tolerance), prior_rows)


def reweight(solved: Collocation, weights: Sequence[np.ndarray]) -> Collocation:
    """Solve the same rows with the variance of their own noise divided by weights.

    Knots and order of elimination are kept, only numbers are recomputed. Used for robust
    estimation, which changes weights in each iteration.

    Parameters
    ----------
    solved : Collocation
        Solved by ``collocate_by_knots``.
    weights : sequence of (n,) arrays
        Weights of the observations of each SparseRows, positive; one for their stated noise.

    Raises
    ------
    ValueError
        If a weight is not positive.
    """
    return _solve(solved.solver.reweighted(weights), solved.prior_rows)


def _solve(solver, prior_rows):
    return solve_trend(solver, solver.columns[:, -1], solver.columns[:, :-1], prior_rows)


@dataclass(frozen=True)
class LeftOut:
    """Leave-one-out prediction of each of n observations of r rows from all others.

    Parameters
    ----------
    residual : (n, r) array
        l minus its prediction from all others.
    covariance : (n, r, r) array
        Of the residual, with the observation's own noise.
    redundancy : (n, r) array
        Share of an error in a row that appears in its residual. Their sum is the redundancy of the
        solution, m - p minus the part absorbed by the signals.
    """

    residual: np.ndarray
    covariance: np.ndarray
    redundancy: np.ndarray


def leave_each_out(solved: Collocation) -> list[LeftOut]:
    """Leave-one-out prediction of every observation, with a LeftOut for each SparseRows.

    NaN if the others do not determine the trend. ``Collocation.leave_out`` omits passes of a target
    that share its survey together.

    Parameters
    ----------
    solved : Collocation
        Solved by ``collocate_by_knots``.
    """
    solver = solved.solver
    projected = solver.by_rows(solved.projected)
    weights = solver.by_rows(solved.weights[:, None])
    left_out = []
    for sides, block, part, weight in zip(
        solver.sides, solver.blocks, projected, weights, strict=True
    ):
        information = block - part @ part.swapaxes(1, 2)
        root = np.linalg.inv(sides.white)
        redundancy = np.einsum("nij,nkj,nki->ni", root, root, information)
        information[(redundancy < SMALLEST_INFORMATION).any(axis=1)] = np.nan
        covariance = np.linalg.inv(information)
        left_out.append(LeftOut((covariance @ weight)[:, :, 0], covariance, redundancy))
    return left_out


@dataclass(frozen=True)
class InformationSolver:
    """Solver of V of sparse rows by means of L.

    Parameters
    ----------
    rows : tuple of SparseRows
    layout : Layout
    knots : Knots
    pattern : Pattern
    sides : tuple of Sides
        Sides of each SparseRows, with nodes in the order of elimination.
    """

    rows: tuple[SparseRows, ...]
    layout: Layout
    knots: Knots
    pattern: Pattern
    sides: tuple[Sides, ...]

    @classmethod
    def of(
        cls, rows: Sequence[SparseRows], like: InformationSolver | None, tolerance: float = 0.0
    ) -> InformationSolver:
        """Make the solver of rows; see ``collocate_by_knots``."""
        signals = rows[0].signals
        layout = Layout.of(signals)
        if like is None:
            times, clocks = zip(*(part.epochs for part in rows), strict=True)
            epochs = np.concatenate(times), np.concatenate(clocks)
            knots = Knots.of(*epochs, sufficient_steps(rows, tolerance))
        else:
            knots = like.knots
        processes = np.bincount(layout.signal, minlength=len(signals))
        sizes = np.repeat(processes * layout.states, np.diff(knots.first))
        sides = []
        for part in rows:
            sides.append(Sides.of(part, layout, knots, len(sizes)))
            shared = np.full(len(part.noise.repeated), part.misclosure.shape[1])
            sizes = np.concatenate([sizes, shared])
        if like is None:
            pattern = Pattern.of(sizes, information_edges(layout, knots, sides))
        else:
            pattern = like.pattern
        placed = tuple(part.placed(pattern.place) for part in sides)
        if like is not None:
            check_same(sizes, like.pattern, placed, like.sides)
        return cls(tuple(rows), layout, knots, pattern, placed)

    def reweighted(self, weights: Sequence[np.ndarray]) -> InformationSolver:
        """Return the solver with other weights; see ``reweight``."""
        sides = []
        for side, part, weight in zip(self.sides, self.rows, weights, strict=True):
            if not (weight > 0).all():
                raise ValueError(
                    f"{np.sum(~(weight > 0))} of {len(weight)} weights are not positive. Remove "
                    "these observations, or give them a weight of 1e-6."
                )
            sides.append(side.whitened(self.layout, part.noise.separate / weight[:, None, None]))
        return replace(self, sides=tuple(sides))

    def by_rows(self, columns: np.ndarray) -> list[np.ndarray]:
        """Split columns (m, c) into parts (n, r, c), one for each SparseRows.

        Parameters
        ----------
        columns : (m, c) array
        """
        shapes = [part.sigma.shape for part in self.sides]
        ends = np.cumsum([n * r for n, r in shapes])[:-1]
        parts = zip(np.split(columns, ends), shapes, strict=True)
        return [part.reshape(*shape, columns.shape[1]) for part, shape in parts]

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """Whiten columns to few triangular rows with W^T W = c^T V^-1 c."""
        states, residuals = self._solved(columns)
        parts = chain(residuals, self._prior_steps(states))
        triangles = [np.linalg.qr(p.reshape(-1, columns.shape[1]), mode="r") for p in parts]
        return np.asarray(np.linalg.qr(np.concatenate(triangles), mode="r"))

    @property
    def log_determinant(self) -> float:
        """Log determinant of V."""
        processes = np.bincount(self.layout.signal, minlength=len(self.layout.states))
        roots = np.einsum("kii->ki", self._prior[0])
        roots = np.log(np.where(roots > 0, roots, 1.0)).sum(axis=1)  # unused states excluded
        total = np.log(diagonal(self.pattern, self._factor)).sum()
        total -= roots @ np.repeat(processes, np.diff(self.knots.first))
        total -= sum(np.log(np.einsum("nii->ni", part.white)).sum() for part in self.sides)
        return float(2 * total)

    def solve(self, columns: np.ndarray) -> np.ndarray:
        """V^-1 c."""
        if columns.shape[1] == 0:
            return columns
        parts = zip(self.sides, self._solved(columns)[1], strict=True)
        weights = [side.white.swapaxes(1, 2) @ residual for side, residual in parts]
        return np.concatenate([part.reshape(-1, part.shape[2]) for part in weights])

    def precision(self, rows: np.ndarray) -> np.ndarray:
        """Return a block of V^-1, for one observation from the selected inverse."""
        ends = np.cumsum([part.sigma.size for part in self.sides])
        of_part = np.searchsorted(ends, rows, side="right")
        number, row = np.divmod(rows - ends[of_part], self._heights[of_part])  # from the end
        known = self.sides[of_part[0]]
        is_one = (of_part == of_part[0]) & (number == number[0])
        if is_one.all() and known.unknown[number[0]] < 0:
            block = self._own_precision(Sides(*(values[number[:1]] for values in known)))
            return block[0][np.ix_(row, row)]
        table = self.layout, self.pattern, self._cells
        x = np.zeros((self.pattern.states, len(rows)))
        parts = []
        for k, sides in enumerate(self.sides):
            asked = np.unique(number[of_part == k])
            part = Sides(*(values[asked] for values in sides))
            places = asked[:, None] * self._heights[k] + np.arange(self._heights[k]) + ends[k]
            unit = np.ascontiguousarray(part.white @ (places[:, :, None] == rows))
            observe(*table, part, x, unit, True)
            parts.append((part, unit))
        solve_in_place(self.pattern, self._factor, x)
        left = ((unit, self._left(part, unit, x)) for part, unit in parts)
        return sum(np.einsum("nri,nrj->ij", *both) for both in left)

    @cached_property
    def blocks(self) -> list[np.ndarray]:
        """Blocks (n, r, r) of V^-1 of each observation, for each SparseRows."""
        return [self._own_precision(part) for part in self.sides]

    def _own_precision(self, sides):
        """Blocks (n, r, r) of V^-1 of observations."""
        table = (self.layout, self.pattern, self._cells)
        white = sides.white
        known = row_covariances(*table, sides, self._inverse)
        return white.swapaxes(1, 2) @ (np.eye(white.shape[1]) - known) @ white

    def predictor(self, _: np.ndarray, trend: np.ndarray, trend_root: np.ndarray) -> Callable:
        """Make the predictor of the rows' own columns; the argument is ignored."""
        states = self._own_solution[0].copy()
        states[:, -1] -= states[:, :-1] @ trend
        inverse = np.empty(0) if trend_root is None else self._inverse
        table = self.layout, self.knots, self.pattern, self._cells, states, inverse
        return predictor_by(partial(interpolate_knots, *table), self.layout, trend, trend_root)

    @property
    def _heights(self):
        """Number of rows of an observation, for each SparseRows."""
        return np.array([part.sigma.shape[1] for part in self.sides])

    @cached_property
    def _cells(self):
        """Knots.cells in the order of elimination."""
        return np.append(self.pattern.place, -1)[self.knots.cells]  # -1 is kept

    @cached_property
    def _prior(self):
        return prior_roots(self.layout, self.knots)

    def information(self) -> np.ndarray:
        """Values of L."""
        values = self.pattern.zeros
        add_prior(self.layout, self.knots, self.pattern, *self._prior, values)
        for sides in self.sides:
            add_information(self.layout, self.pattern, self._cells, sides, values)
        return values

    @cached_property
    def _factor(self):
        """Values of the factor of L."""
        pattern = self.pattern
        values = self.information()
        before = diagonal(pattern, values)
        state = factorise(pattern, values)
        error = np.zeros(pattern.states)
        if state >= 0:
            error[state] = np.inf
        else:
            error = np.finfo(float).eps * before / diagonal(pattern, values) ** 2
        if error.sum() > LARGEST_ERROR:
            self._refuse(error)
        return values

    @cached_property
    def _inverse(self):
        """Values of the selected inverse of L, in the place of its factor.

        If both are needed, the factor is computed again, because it takes most of the memory.
        """
        values = self._factor
        _ = self._own_solution
        del self.__dict__["_factor"]
        invert_in_place(self.pattern, values)
        return values

    @cached_property
    def columns(self) -> np.ndarray:
        """Columns (m, p + 1) of the rows themselves, [A, l]."""
        width = self.rows[0].design.shape[2] + 1
        parts = [np.dstack([part.design, part.misclosure]) for part in self.rows]
        return np.concatenate([part.reshape(-1, width) for part in parts])

    @cached_property
    def _own_solution(self):
        """States and residuals by these columns, which are kept longer than the factor."""
        return self._estimate(self.columns)

    def _refuse(self, error):
        """Report knots that are too close, by the error of each state's pivot."""
        place = np.searchsorted(self.pattern.first, np.argmax(error), side="right") - 1
        node = np.flatnonzero(self.pattern.place == place)[0]
        where = "of a shared error"
        if node < len(self.knots.clock):
            s = np.searchsorted(self.knots.first, node, side="right") - 1
            signal = self.rows[0].signals[s].covariance
            clock = self.knots.clock
            if node > self.knots.first[s]:
                step = clock[node] - clock[node - 1]
            else:
                step = np.inf
            where = (
                f"of signal {s + 1} ({signal.family}, {signal.correlation_time:g} s) at a knot "
                f"{step:.3g} s after the one before"
            )
        raise np.linalg.LinAlgError(
            f"Rounding makes the log-likelihood of {len(error)} states wrong by "
            f"{error.sum():.1g} (limit {LARGEST_ERROR:g}), most of it {where}. The knots come "
            "from a solution with shorter correlation times, or the noise is negligible next to "
            "the signals. Let the solver place its own knots, and give each observation its "
            "actual sigma."
        )

    def _solved(self, columns):
        """States and residuals by columns."""
        is_own = np.array_equal(columns, self.columns)
        if is_own:
            return self._own_solution
        return self._estimate(columns)

    def _estimate(self, columns):
        """States x = L^-1 H^T R^-1 c (states, c), and residuals W (c - H x) in parts (n, r, c)."""
        parts = zip(self.sides, self.by_rows(columns), strict=True)
        white = [np.ascontiguousarray(side.white @ part) for side, part in parts]
        x = np.zeros((self.pattern.states, columns.shape[1]))
        for sides, part in zip(self.sides, white, strict=True):
            observe(self.layout, self.pattern, self._cells, sides, x, part, True)
        solve_in_place(self.pattern, self._factor, x)
        pairs = zip(self.sides, white, strict=True)
        return x, [self._left(sides, part, x) for sides, part in pairs]

    def _left(self, sides, white, x):
        left = white.copy()
        observe(self.layout, self.pattern, self._cells, sides, -x, left, False)
        return left

    def _prior_steps(self, x):
        """Steps of the states from knot to knot, whitened by their prior, and shared errors."""
        first = self.knots.first
        place = self.pattern.place
        for s, d in enumerate(self.layout.states):
            local = np.arange(d * np.sum(self.layout.signal == s))
            for begin in range(first[s], first[s + 1], CHUNK):
                knots = np.arange(begin, min(begin + CHUNK, first[s + 1]))
                before = np.maximum(knots - 1, first[s])  # no transition to the first knot
                roots, carried = (part[knots, None, :d, :d] for part in self._prior)
                here, there = (
                    self.pattern.first[place[k]][:, None] + local for k in (knots, before)
                )
                shape = (len(knots), -1, d, x.shape[1])
                yield roots @ x[here].reshape(shape) - carried @ x[there].reshape(shape)
        is_shared = np.zeros(len(place), dtype=bool)
        is_shared[place[first[-1] :]] = True
        yield x[np.repeat(is_shared, np.diff(self.pattern.first))]


def information_edges(layout: Layout, knots: Knots, sides: Sequence[Sides]) -> np.ndarray:
    """Pairs (h, 2) of nodes.

    All knots adjacent to an interval are linked, so that the inverse is available for any epoch,
    and so are all nodes of an observation.

    Parameters
    ----------
    layout : Layout
    knots : Knots
    sides : sequence of Sides
        With nodes numbered as the knots, not in the order of elimination.
    """
    about = list(knots.cells.reshape(len(knots.cells), -1).T)
    pairs = [_distinct(combinations(about, 2))]
    for part in sides:
        groups = [[part.unknown]]
        groups += [list(_visible(layout, knots, part, e)) for e in range(part.cell.shape[1])]
        for left, right in combinations(groups, 2):
            pairs.append(_distinct(product(left, right)))
    return np.concatenate(pairs)


def _visible(layout, knots, sides, e):
    """Nodes (n,) that side e of each observation depends on, two for each signal; -1 for none."""
    for s, d in enumerate(layout.states):
        before, after = knots.cells[sides.cell[:, e], s].T
        yield before
        is_between = sides.gains[:, e, s, 1 : 2 * d].any(axis=1)  # not at the knot before
        yield np.where(is_between, after, -1)


def _distinct(pairs):
    """Distinct pairs (h, 2) of valid nodes from pairs of arrays."""
    bits = 32
    codes = [np.zeros(0, dtype=np.int64)]
    codes += [(a << bits | b)[(a >= 0) & (b >= 0)] for a, b in pairs]
    codes = np.sort(np.concatenate(codes))
    codes = codes[np.diff(codes, prepend=-1) > 0]  # faster than np.unique, which builds a table
    return np.column_stack([codes >> bits, codes & ((1 << bits) - 1)])


def sufficient_steps(rows: Sequence[SparseRows], tolerance: float) -> list[float]:
    """Largest step of each signal between its knots, on its clock.

    Parameters
    ----------
    rows : sequence of SparseRows
    tolerance : float
        Largest sigma of r over that of the mean of the rows between two knots. With zero, r is
        ``SHARE`` of the signal's sigma regardless of the rows.
    """
    steps = []
    for number, signal in enumerate(rows[0].signals):
        covariance = signal.covariance
        parts = (_information(part, number) for part in rows)
        share = min([LARGEST_SHARE, *(_share(covariance, *part, tolerance) for part in parts)])
        steps.append(knot_step(covariance, max(share, SHARE)))
    return steps


def _information(rows, number):
    """Mean information of a view on a signal, and number of views per unit of its clock.

    The information is the squared sigma of the signal in a row over that of the row's noise.
    """
    signal = rows.signals[number]
    variance = np.einsum("nii->ni", rows.noise.separate)
    variance = np.maximum(variance, np.finfo(float).eps ** 2)  # zero noise is refused later
    n, r = variance.shape
    square = (signal.mixing**2).sum(axis=2).reshape(n, rows.gps_time.shape[1], r)
    ratio = (square / variance[:, None]).mean(axis=2).ravel()
    clock = rows.gps_time
    if signal.clock is not None:
        clock = signal.clock
    clock = np.ravel(clock)[ratio > 0]
    if len(clock) == 0:
        return 0.0, 0.0
    away = 1.0 / signal.covariance.rate  # beyond it views are independent
    covered = np.minimum(np.diff(np.unique(clock)), away).sum() + away
    return ratio.sum() / len(clock), len(clock) / covered


def _share(covariance: Covariance, information, density, tolerance):
    """Share s of sigma with s^2 information max(1, density step(s)) <= tolerance^2."""
    if information == 0.0:
        return LARGEST_SHARE
    largest = tolerance / np.sqrt(information)
    power = 1.0 / (2 * covariance.states - 1)  # step(s) = step(1) s^(2 power)
    of_all = tolerance**2 / (information * density * knot_step(covariance, 1.0))
    return min(largest, of_all ** (0.5 / (1.0 + power)))
