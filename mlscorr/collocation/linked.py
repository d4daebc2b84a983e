"""Collocation of rows that link epochs: ties between passes, targets seen in any number of them.

Beside ``collocate``, which is exact to 1e-9 and for rows of one epoch each. With H what the rows
see of the states at knots (and of errors that they share), R their noise and L0 the information of
the prior,

    L = L0 + H^T R^-1 H,   V^-1 = R^-1 - R^-1 H L^-1 H^T R^-1,   |V| = |R| |L| / |L0|

and S = A^T V^-1 A and the rest is least squares of the trend (``solve_trend``). L is factored in
blocks; L^-1 is known where rows, and epochs between knots, need it, so sigmas, leave-one-out
residuals and redundancy numbers are exact: linear in rows and knots, whatever epochs a row links.

What knots leave of a signal, r, is taken for noise that each row has alone, though rows near each
other share it. It does no harm while it is small beside what all rows between two knots together
leave open of the signal, sigma / sqrt(n): a signal below the noise needs knots a good part of its
correlation time apart, where one far above it needs dozens in that time.
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

LARGEST_SHARE = 0.3  # of a signal's sigma; for larger ones Q_11 is no power of the step any more


def collocate_by_knots(
    rows: Sequence[SparseRows],
    like: InformationSolver | None = None,
    tolerance: float = 0.0,
    believed: np.ndarray | None = None,
) -> Collocation:
    r"""Separate the misclosures of sparse rows into trend, signal and noise.

    Solves l = A x + B s + n as ``collocate`` does, to 1e-5 m and 1 % of sigma where signals have a
    sigma of some metres. Work and memory grow with rows and knots, and an error that passes share
    costs no more than a knot. Observations in the order of time are solved twice as fast as others.

    Parameters
    ----------
    rows : sequence of SparseRows
        With the same signals and trend: control, ties, steps.
    like : InformationSolver, optional
        Of the same epochs: its knots and order of elimination are used again. A likelihood is
        smooth in the signals' parameters only where knots stay.
    tolerance : float
        What knots may leave over what the observations of an interval between two of them leave
        open together: fewer knots, where those for all digits would only cost time.
    believed : (k, p + 1) array, optional
        Of the trend, as of a Collocation.

    Returns
    -------
    solved : Collocation
        Its rows are those of all observations, one after the other.

    Raises
    ------
    ValueError
        As ``collocate`` does, and where knots stand so close that rounding is all that is left.

    Examples
    --------
    A step of 0.3 m that a tie sees between two passes, of which the first is held to 1 mm:

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
    return _solve(InformationSolver.of(rows, like, tolerance), believed)


def reweight(solved: Collocation, weights: Sequence[np.ndarray]) -> Collocation:
    """The same rows with their own noise's variance divided by weights.

    Only numbers are worked out again, neither knots nor the order of elimination: for robust
    estimation, which changes weights in each round.

    Parameters
    ----------
    solved : Collocation
        By ``collocate_by_knots``.
    weights : sequence of (n,) arrays
        Of the observations of each SparseRows, positive; one for the noise they have.

    Raises
    ------
    ValueError
        Where a weight isn't positive.
    """
    return _solve(solved.solver.reweighted(weights), solved.believed)


def _solve(solver, believed):
    return solve_trend(solver, solver.columns[:, -1], solver.columns[:, :-1], believed)


@dataclass(frozen=True)
class LeftOut:
    """What the other observations say of each of n, of r rows.

    Parameters
    ----------
    residual : (n, r) array
        l less its prediction by all others.
    covariance : (n, r, r) array
        Of the residual, with the observation's own noise.
    redundancy : (n, r) array
        Share of an error in a row that its residual shows. All sum to the redundancy of the
        solution, m - p less what the signals take up.
    """

    residual: np.ndarray
    covariance: np.ndarray
    redundancy: np.ndarray


def leave_each_out(solved: Collocation) -> list[LeftOut]:
    """Leave each observation out in turn: of each SparseRows a LeftOut.

    Not a number where the others don't determine the trend. Passes of a target that share its
    survey are left out together by ``Collocation.leave_out``.

    Parameters
    ----------
    solved : Collocation
        By ``collocate_by_knots``.
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
    """V of sparse rows by L.

    Parameters
    ----------
    rows : tuple of SparseRows
    layout : Layout
    knots : Knots
    pattern : Pattern
    sides : tuple of Sides
        Of each SparseRows, with nodes in the order of elimination.
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
        """The solver of rows; see ``collocate_by_knots``."""
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
        """The same with other weights; see ``reweight``."""
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
        """Columns (m, c) in parts (n, r, c), one for each SparseRows.

        Parameters
        ----------
        columns : (m, c) array
        """
        shapes = [part.sigma.shape for part in self.sides]
        ends = np.cumsum([n * r for n, r in shapes])[:-1]
        parts = zip(np.split(columns, ends), shapes, strict=True)
        return [part.reshape(*shape, columns.shape[1]) for part, shape in parts]

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """Few rows, of which W^T W = c^T V^-1 c: residuals and steps of the prior, triangular."""
        states, residuals = self._solved(columns)
        parts = chain(residuals, self._prior_steps(states))
        triangles = [np.linalg.qr(p.reshape(-1, columns.shape[1]), mode="r") for p in parts]
        return np.asarray(np.linalg.qr(np.concatenate(triangles), mode="r"))

    @property
    def log_determinant(self) -> float:
        """Of V."""
        processes = np.bincount(self.layout.signal, minlength=len(self.layout.states))
        roots = np.einsum("kii->ki", self._prior[0])
        roots = np.log(np.where(roots > 0, roots, 1.0)).sum(axis=1)  # states that a signal has
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
        """A block of V^-1: of one observation by the selected inverse, else by solving."""
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
        """The predictor of the rows' own columns, whatever is given; see Collocation.predict."""
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
        return np.append(self.pattern.place, -1)[self.knots.cells]  # -1 stays

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

        Who needs both has the factor worked out again: it is most of the memory.
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
        """States and residuals by these columns, which outlast the factor."""
        return self._estimate(self.columns)

    def _refuse(self, error):
        """Say where knots stand too close, by the error of each state's pivot."""
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
                before = np.maximum(knots - 1, first[s])  # nothing is carried to the first
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

    All knots about a time are linked, so that the inverse knows what is needed at any epoch, and
    so are all that an observation sees.

    Parameters
    ----------
    layout : Layout
    knots : Knots
    sides : sequence of Sides
        Numbered as the knots are, and not in the order of elimination.
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
    """Nodes (n,) visible to side e of each observation, -1 for none: two for each signal."""
    for s, d in enumerate(layout.states):
        before, after = knots.cells[sides.cell[:, e], s].T
        yield before
        is_between = sides.gains[:, e, s, 1 : 2 * d].any(axis=1)  # not at the knot before
        yield np.where(is_between, after, -1)


def _distinct(pairs):
    """Distinct pairs (h, 2) of nodes of some pairs of arrays, where both are some."""
    bits = 32
    codes = [np.zeros(0, dtype=np.int64)]
    codes += [(a << bits | b)[(a >= 0) & (b >= 0)] for a, b in pairs]
    codes = np.sort(np.concatenate(codes))
    codes = codes[np.diff(codes, prepend=-1) > 0]  # sooner than np.unique, which fills a table
    return np.column_stack([codes >> bits, codes & ((1 << bits) - 1)])


def sufficient_steps(rows: Sequence[SparseRows], tolerance: float) -> list[float]:
    """Largest step of each signal between its knots, on its clock.

    Parameters
    ----------
    rows : sequence of SparseRows
    tolerance : float
        Largest sigma of r over that of the mean of the rows between two knots; of zero, r is
        ``SHARE`` of the signal's sigma whatever the rows tell.
    """
    steps = []
    for number, signal in enumerate(rows[0].signals):
        covariance = signal.covariance
        parts = (_information(part, number) for part in rows)
        share = min([LARGEST_SHARE, *(_share(covariance, *part, tolerance) for part in parts)])
        steps.append(knot_step(covariance, max(share, SHARE)))
    return steps


def _information(rows, number):
    """What a view tells of a signal on average, and how many views there are a unit of its clock.

    The first is the square of the signal's sigma in a row over that of the row's noise.
    """
    signal = rows.signals[number]
    variance = np.einsum("nii->ni", rows.noise.separate)
    variance = np.maximum(variance, np.finfo(float).eps ** 2)  # where there is none, others refuse
    n, r = variance.shape
    square = (signal.mixing**2).sum(axis=2).reshape(n, rows.gps_time.shape[1], r)
    ratio = (square / variance[:, None]).mean(axis=2).ravel()
    clock = rows.gps_time
    if signal.clock is not None:
        clock = signal.clock
    clock = np.ravel(clock)[ratio > 0]
    if len(clock) == 0:
        return 0.0, 0.0
    away = 1.0 / signal.covariance.rate  # beyond it views tell nothing of each other
    covered = np.minimum(np.diff(np.unique(clock)), away).sum() + away
    return ratio.sum() / len(clock), len(clock) / covered


def _share(covariance: Covariance, information, density, tolerance):
    """The share s of sigma with s^2 information max(1, density step(s)) <= tolerance^2."""
    if information == 0.0:
        return LARGEST_SHARE
    largest = tolerance / np.sqrt(information)
    power = 1.0 / (2 * covariance.states - 1)  # step(s) = step(1) s^(2 power)
    of_all = tolerance**2 / (information * density * knot_step(covariance, 1.0))
    return min(largest, of_all ** (0.5 / (1.0 + power)))
