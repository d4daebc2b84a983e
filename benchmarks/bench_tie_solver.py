"""Cost of solving for control and ties between passes, compared with SuperLU and the dense formula.

    python benchmarks/bench_tie_solver.py [knots ...]

Two opposite passes of one street, a signal of six components with twelve states at each knot, ten
ties a knot, and a control point every 100 s that both passes see. Each size runs in a separate
process, which reports its memory; seconds are processor time.
"""

import argparse
import resource
import subprocess
import sys
from time import thread_time

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

from mlscorr.collocation import (
    Covariance,
    Noise,
    Signal,
    SparseRows,
    collocate_by_knots,
    leave_each_out,
)
from mlscorr.collocation._block_cholesky import factorise, invert_in_place, solve_in_place
from mlscorr.collocation._knots import knot_step

START = 413_200.0  # s of week
DRIFT = Covariance("matern32", 60.0)
SIGMA = np.repeat([0.3, 5e-4], 3)  # m, rad
# m
TIE = 0.01
CONTROL = 0.005
SURVEY = 0.005
CONTROL_INTERVAL = 100.0  # s
CONSOLE = Console(width=110)


class Street:
    "Rows of two passes, the second back along the first, with approximately this number of knots"

    def __init__(self, knots, ties_per_knot=10):
        self.rng = rng = np.random.default_rng(1)
        self.length = knots * knot_step(DRIFT) / 2  # of a pass, s
        n = knots * ties_per_knot
        first = np.sort(rng.uniform(0.0, self.length, n))  # as they are found
        second = 2 * self.length - first + rng.normal(scale=0.1, size=n)  # a beam looks sideways
        times = START + np.column_stack([first, np.clip(second, self.length, 2 * self.length)])
        normals = rng.normal(size=(n, 1, 3))
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        mixing = np.stack([self.seen(normals), -self.seen(normals)], axis=1)
        self.ties = SparseRows(
            times,
            TIE * rng.normal(size=(n, 1)),
            Noise(np.full((n, 1, 1), TIE**2)),
            np.zeros((n, 1, 3)),
            [Signal(mixing.reshape(-1, 1, 6), DRIFT)],
        )
        at = np.arange(0.5, max(self.length / CONTROL_INTERVAL, 3)) * CONTROL_INTERVAL
        at = np.minimum(at, self.length)
        c = 2 * len(at)
        axes = np.tile(np.eye(3), (c, 1, 1))
        self.control = SparseRows(
            START + np.append(at, 2 * self.length - at)[:, None],
            CONTROL * rng.normal(size=(c, 3)),
            Noise(CONTROL**2 * axes, np.tile(np.arange(c // 2), 2), np.full((c // 2, 3), SURVEY)),
            axes,
            [Signal(self.seen(axes), DRIFT)],
        )
        self.asked = START + np.linspace(0.0, 2 * self.length, knots)

    def seen(self, rows):
        "Design matrix of rows (n, r, 3) for position and rotation, at a point some meters away"
        lever = self.rng.uniform(-15.0, 15.0, (len(rows), 1, 3))
        return np.concatenate([rows, np.cross(lever, rows)], axis=2) * SIGMA

    def solve(self):
        return collocate_by_knots([self.control, self.ties])

    def predict(self, solved):
        q = len(self.asked)
        design = np.broadcast_to(np.eye(6, 3), (q, 6, 3))
        return solved.predict(self.asked, design, [np.broadcast_to(np.diag(SIGMA), (q, 6, 6))])


def timed(work):
    "Processor time of a function in s, and its result"
    begin = thread_time()
    result = work()
    return thread_time() - begin, result


def memory():
    "Peak memory of this process so far in MB"
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def run(knots):
    "Print knots, seconds of each step, and memory before and after, all compiled or loaded before"
    warm = Street(200)
    solved = warm.solve()
    leave_each_out(solved)
    warm.predict(solved)
    street = Street(knots)
    before = memory()
    solving, solved = timed(street.solve)
    leaving = timed(lambda: leave_each_out(solved))[0]
    predicting = timed(lambda: street.predict(solved))[0]
    print(len(solved.solver.knots.clock), solving, leaving, predicting, before, memory())


def growth(sizes):
    "Run each size in a separate process"
    table = Table(
        "knots",
        "ties",
        "solve, s",
        "leave each out",
        "sigmas of the pose",
        "all, s",
        "times the row before",
        "memory, MB",
        "of it before",
        title="Control and ties of two passes, 12 states, Matern 3/2",
    )
    last = None
    for size in sizes:
        command = [sys.executable, __file__, "run", str(size)]
        words = subprocess.check_output(command, text=True).split()
        knots, *seconds, before, largest = map(float, words)
        total = sum(seconds)
        ratio = "" if last is None else f"{total / last:.1f}"
        cells = [f"{s:.2f}" for s in (*seconds, total)]
        table.add_row(
            f"{knots:.0f}", f"{10 * size}", *cells, ratio, f"{largest:.0f}", f"{before:.0f}"
        )
        last = total
    CONSOLE.print(table)


def sparse_matrix(solver):
    "L of a solver, as SuperLU takes it"
    pattern = solver.pattern
    values = solver.information()
    rows = []
    columns = []
    elements = []
    for j in range(len(pattern.start) - 1):
        begin, end = pattern.node[j : j + 2]
        nodes = [*range(begin, end), *pattern.row[pattern.column[j] : pattern.column[j + 1]]]
        states = np.concatenate([np.arange(*pattern.first[k : k + 2]) for k in nodes])
        own = np.arange(pattern.first[begin], pattern.first[end])
        rows.append(np.repeat(states, len(own)))
        columns.append(np.tile(own, len(states)))
        elements.append(values[pattern.start[j] : pattern.start[j + 1]])
    row, column, element = (np.concatenate(p) for p in (rows, columns, elements))
    lower = (row > column) & (element != 0)
    diagonal = row == column
    row, column, element = (
        np.concatenate([a[lower], b[lower], a[diagonal]])
        for a, b in ((row, column), (column, row), (element, element))
    )
    return csc_array((element, (row, column)), shape=(pattern.states,) * 2)


def beside_superlu(sizes):
    "Compare factorization and solution of four columns by SuperLU, which has no inverse"
    table = Table(
        "knots",
        "states",
        "factor, s",
        "solve",
        "inverse",
        "SuperLU factor",
        "solve",
        "difference",
        title="Beside scipy's splu on the same matrix: seconds (times ours)",
    )
    for size in sizes:
        solver = Street(size).solve().solver
        matrix = sparse_matrix(solver)
        values = solver.information()
        factoring, _ = timed(lambda p=solver.pattern, v=values: factorise(p, v))
        columns = np.random.default_rng(1).normal(size=(solver.pattern.states, 4))
        x = columns.copy()
        solving, _ = timed(lambda p=solver.pattern, v=values, x=x: solve_in_place(p, v, x))
        inverting, _ = timed(lambda p=solver.pattern, v=values: invert_in_place(p, v))
        theirs, factor = timed(
            lambda m=matrix: splu(
                m, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        )
        answering, there = timed(lambda f=factor, c=columns: f.solve(c))
        error = np.abs(there - x).max() / np.abs(x).max()
        table.add_row(
            f"{size}",
            f"{solver.pattern.states}",
            f"{factoring:.3f}",
            f"{solving:.3f}",
            f"{inverting:.3f}",
            f"{theirs:.3f} ({theirs / factoring:.1f} x)",
            f"{answering:.3f} ({answering / solving:.1f} x)",
            f"{error:.0e}",
        )
    CONSOLE.print(table)


def beside_the_dense_formula(sizes):
    "Compare with the dense V of all rows, factored and inverted, at the largest feasible size"
    table = Table(
        "ties",
        "sparse, s",
        "dense",
        "difference of the log-likelihood",
        title="Solve and leave each out, beside the dense formula: seconds (times ours)",
    )
    for size in sizes:
        street = Street(size)
        seconds, solved = timed(lambda s=street: _both(s))
        theirs, likelihood = timed(lambda s=street: _dense(s))
        table.add_row(
            f"{10 * size}",
            f"{seconds:.3f}",
            f"{theirs:.2f} ({theirs / seconds:.0f} x)",
            f"{abs(solved.log_likelihood - likelihood):.0e}",
        )
    CONSOLE.print(table)


def _both(street):
    solved = street.solve()
    leave_each_out(solved)
    return solved


def _dense(street):
    control = street.control
    ties = street.ties
    seen = np.concatenate([p.signals[0].mixing.reshape(-1, 6) for p in (control, ties)])
    times = np.concatenate([np.repeat(control.gps_time[:, 0], 3), ties.gps_time.ravel()])
    c = control.misclosure.size
    views = (seen @ seen.T) * DRIFT(times[:, None] - times)
    columns = views[:, :c], views[:, c::2] + views[:, c + 1 :: 2]
    half = np.hstack(columns)
    total = np.vstack([half[:c], half[c::2] + half[c + 1 :: 2]])
    total[:c, :c] += control.noise.matrix
    total[np.arange(c, len(total)), np.arange(c, len(total))] += TIE**2
    misclosure = np.append(control.misclosure, ties.misclosure)
    design = np.vstack([control.design.reshape(-1, 3), ties.design[:, 0]])
    inverse = np.linalg.inv(total)
    normal = design.T @ inverse @ design
    residual = misclosure - design @ np.linalg.solve(normal, design.T @ inverse @ misclosure)
    determinants = np.linalg.slogdet(total)[1] + np.linalg.slogdet(normal)[1]
    constant = (len(total) - 3) * np.log(2 * np.pi)
    return -0.5 * (residual @ inverse @ residual + determinants + constant)


if __name__ == "__main__":
    with threadpool_limits(1):
        if sys.argv[1:2] == ["run"]:
            run(int(sys.argv[2]))
        else:
            parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
            sizes = [1_000, 10_000, 100_000]
            parser.add_argument("knots", nargs="*", type=int, default=sizes)
            numbers = parser.parse_args().knots
            growth(numbers)
            beside_superlu([n for n in numbers if n <= 10_000])
            beside_the_dense_formula([30, 100, 300])
