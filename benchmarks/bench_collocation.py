"""Speed of collocation by recursion compared with other libraries, all measured in this run.

    python benchmarks/bench_collocation.py

Processor time of one thread: competitors run in turn on a busy machine, and the best of three
counts. celerite2 (pip install celerite2) is no dependency; without it its column is marked so.
"""

import argparse
from time import thread_time

import numpy as np
from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from mlscorr.collocation import (
    FAMILIES,
    Covariance,
    Noise,
    Signal,
    SparseRows,
    collocate,
    collocate_rows_dense,
)

try:
    import celerite2
except ImportError:
    celerite2 = None

START = 413_200.0  # s of week
INTERVAL = 10.0  # s between observations, as targets along a street
# m, m, s
SIGMA = 0.2
NOISE = 0.01
TIME = 40.0
CONSOLE = Console()


def best(work, repeats=3):
    """Shortest processor time of a function in s, and its result."""
    times = []
    for _ in range(repeats):
        begin = thread_time()
        result = work()
        times.append(thread_time() - begin)
    return min(times), result


class Component:
    """One component: a signal observed at n random times and predicted at q epochs."""

    def __init__(self, n, q, family="matern32"):
        rng = np.random.default_rng(1)
        self.covariance = Covariance(family, TIME)
        self.time = START + np.sort(rng.uniform(0, INTERVAL * n, n))
        self.values = SIGMA * rng.normal(size=n)
        self.asked = START + np.linspace(-TIME, INTERVAL * n + TIME, q)

    def solve(self, collocate=collocate):
        n = len(self.time)
        return collocate(
            self.time,
            self.values[:, None],
            Noise(np.full((n, 1, 1), NOISE**2)),
            np.zeros((n, 1, 0)),
            [Signal(np.full((n, 1, 1), SIGMA), self.covariance)],
        )

    def predict(self, solved):
        q = len(self.asked)
        mixing = np.broadcast_to(np.full((1, 1, 1), SIGMA), (q, 1, 1))
        return solved.predict(self.asked, np.zeros((q, 1, 0)), [mixing])

    def both(self, collocate=collocate):
        return self.predict(self.solve(collocate))


class Pose:
    """Six components as in a correction: drift, jitter and attitude of three axes each."""

    def __init__(self, n, q, order=1):
        rng = np.random.default_rng(1)
        length = INTERVAL * n / 3
        times = START + np.sort(rng.uniform(0, length, n)), START + np.linspace(0, length, q)
        self.time, self.asked = times
        self.misclosure = SIGMA * rng.normal(size=(n, 3))
        self.noise = Noise(np.broadcast_to(NOISE**2 * np.eye(3), (n, 3, 3)))
        turned = rng.normal(scale=5e-4, size=(n, 3, 3))
        drift = Covariance("matern32", TIME)
        jitter = Covariance("exponential", TIME / 4)
        self.covariances = drift, jitter, drift
        eye = np.eye(3)
        parts = rng.uniform(0.1, SIGMA, (n, 1, 1)) * eye, np.tile(0.02 * eye, (n, 1, 1)), turned
        self.signals = [Signal(m, c) for m, c in zip(parts, self.covariances, strict=True)]
        bases = [
            np.polynomial.legendre.legvander(2 * (t - START) / length - 1, order) for t in times
        ]
        designs = [np.einsum("qi,jk->qjik", b, eye).reshape(len(b), 3, -1) for b in bases]
        self.design = designs[0]
        self.asked_design = np.concatenate([designs[1], np.zeros_like(designs[1])], axis=1)
        self.mixings = [np.zeros((q, 6, 3)) for _ in range(3)]
        self.mixings[0][:, :3] = SIGMA * eye
        self.mixings[1][:, :3] = 0.02 * eye
        self.mixings[2][:, 3:] = rng.normal(scale=1e-4, size=(q, 3, 3))

    def solve(self, collocate=collocate):
        return collocate(self.time, self.misclosure, self.noise, self.design, self.signals)

    def predict(self, solved, part=slice(None)):
        mixings = [mixing[part] for mixing in self.mixings]
        return solved.predict(self.asked[part], self.asked_design[part], mixings)


def growth():
    """Print time against the number of observations, and of epochs."""
    table = Table("observations", "epochs", "s", "times the row before", title="Growth, Matern 3/2")
    for sizes in (
        [(n, 10_000) for n in (1_000, 10_000, 100_000)],
        [(1_000, q) for q in (10_000, 100_000, 1_000_000, 10_000_000)],
    ):
        before = None
        for n, q in sizes:
            seconds, _ = best(Component(n, q).both)
            ratio = "" if before is None else f"{seconds / before:.1f}"
            table.add_row(f"{n}", f"{q}", f"{seconds:.4f}", ratio)
            before = seconds
        table.add_section()
    CONSOLE.print(table)


def rates():
    """Print epochs per second with variance."""
    table = Table("family", "million epochs/s", title="One component, 1000 observations")
    for family in FAMILIES:
        component = Component(1_000, 3_000_000, family)
        solved = component.solve()
        seconds, _ = best(lambda c=component, s=solved: c.predict(s))
        table.add_row(family, f"{3.0 / seconds:.1f}")
    CONSOLE.print(table)


def beside_others():
    """Compare with other libraries on the same surveys, by an exponential covariance."""
    table = Table(
        "observations",
        "epochs",
        "recursion, s",
        "dense",
        "scikit-learn",
        "celerite2",
        "difference, m",
        title="One component with variance: seconds (times the recursion)",
    )
    for n, q in ((300, 3_000), (1_000, 10_000), (3_000, 10_000)):
        component = Component(n, q, "exponential")
        ours, (mean, variance) = best(component.both)
        row = []
        worst = 0.0
        for way in (_dense, _sklearn, _celerite):
            if way is _celerite and celerite2 is None:
                row.append("absent")
                continue
            seconds, (theirs, spread) = best(lambda w=way, c=component: w(c), 1)
            row.append(f"{seconds:.3f} ({seconds / ours:.0f} x)")
            worst = max(worst, np.abs(theirs - mean[:, 0]).max())
            worst = max(worst, np.abs(np.sqrt(spread) - np.sqrt(variance[:, 0, 0])).max())
        table.add_row(f"{n}", f"{q}", f"{ours:.4f}", *row, f"{worst:.0e}")
    CONSOLE.print(table)


def _by_dense(gps_time, *given):
    return collocate_rows_dense([SparseRows(gps_time[:, None], *given)])


def _dense(component):
    mean, variance = component.both(_by_dense)
    return mean[:, 0], variance[:, 0, 0]


def _sklearn(component):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern

    kernel = ConstantKernel(SIGMA**2, "fixed") * Matern(TIME, "fixed", 0.5)
    process = GaussianProcessRegressor(kernel, alpha=NOISE**2, optimizer=None)
    process.fit((component.time - START)[:, None], component.values)
    mean, sigma = process.predict((component.asked - START)[:, None], return_std=True)
    return mean, sigma**2


def _celerite(component):
    term = celerite2.terms.RealTerm(a=SIGMA**2, c=1 / TIME)
    process = celerite2.GaussianProcess(term)
    process.compute(component.time - START, diag=np.full(len(component.time), NOISE**2))
    return process.predict(component.values, t=component.asked - START, return_var=True)


def likelihoods():
    """Time one evaluation of the likelihood, of which the parameter search needs hundreds."""
    table = Table(
        "observations",
        "recursion, s",
        "celerite2",
        title="Likelihood of one component: seconds (times the recursion)",
    )
    for n in (1_000, 10_000, 100_000):
        component = Component(n, 2, "exponential")
        ours, solved = best(component.solve)
        cell = "absent"
        if celerite2 is not None:
            theirs, value = best(lambda c=component: _celerite_likelihood(c))
            assert abs(value - solved.log_likelihood) < 1e-6 * abs(value)
            cell = f"{theirs:.4f} ({theirs / ours:.2f} x)"
        table.add_row(f"{n}", f"{ours:.4f}", cell)
    CONSOLE.print(table)


def _celerite_likelihood(component):
    process = celerite2.GaussianProcess(celerite2.terms.RealTerm(a=SIGMA**2, c=1 / TIME))
    process.compute(component.time - START, diag=np.full(len(component.time), NOISE**2))
    return process.log_likelihood(component.values)


def six_components():
    """Time position and attitude with full covariances at the epochs of a trajectory."""
    table = Table(
        "way",
        "solve, s",
        "predict, s",
        "epochs/s",
        title="Six components, 600 targets, 18 000 epochs",
    )
    pose = Pose(600, 18_000)
    results = []
    for name, way, repeats in (("recursion", collocate, 3), ("dense", _by_dense, 1)):
        solving, solved = best(lambda w=way: pose.solve(w), repeats)
        seconds, result = best(lambda s=solved: pose.predict(s), repeats)
        results.append(result)
        table.add_row(name, f"{solving:.3f}", f"{seconds:.3f}", f"{18_000 / seconds:.0f}")
    (mean, covariance), (theirs, spread) = results
    CONSOLE.print(table)
    CONSOLE.print(
        f"Largest difference: mean {np.abs(mean - theirs).max():.0e}, "
        f"covariance {np.abs(covariance - spread).max():.0e}."
    )


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    with threadpool_limits(1):
        Component(10, 10).both()  # compiled, or loaded
        growth()
        rates()
        beside_others()
        likelihoods()
        six_components()
