import numpy as np
import pytest

from mlscorr.collocation import Covariance, LiteralSignal, Noise, collocate_literal

START = 413_200.0  # s of week
SPAN = 186.0  # s, as the paper's first experiment


def legendre(gps_time, order):
    return np.polynomial.legendre.legvander(2 * (gps_time - START) / SPAN - 1, order)


class Drive:
    "A drive like the paper's: smooth error of three axes, 21 targets, order 5, and truth at 1 Hz"

    def __init__(self, seed=0, n=21, order=5):
        rng = np.random.default_rng(seed)
        self.gps_time = START + np.linspace(0, SPAN, n)
        self.epochs = START + np.arange(0.0, SPAN, 1.0)
        phase = rng.uniform(0, 2 * np.pi, (4, 3))
        waves = np.array([150.0, 70.0, 45.0, 25.0])[:, None]  # s

        def error(gps_time):
            turns = 2 * np.pi * (gps_time[:, None, None] - START) / waves + phase
            return (np.array([1.0, 0.5, 0.3, 0.1])[:, None] * np.sin(turns)).sum(axis=1)

        self.truth = error(self.epochs)
        self.misclosure = error(self.gps_time) + 0.01 * rng.normal(size=(n, 3))
        self.noise = Noise(np.broadcast_to(2 * 0.02**2 * np.eye(3), (n, 3, 3)))
        self.order = order
        self.partials = np.broadcast_to(np.eye(3), (n, 3, 3))

    def design(self, gps_time):
        basis = legendre(gps_time, self.order)
        return np.einsum("qi,jk->qjik", basis, np.eye(3)).reshape(len(basis), 3, -1)

    def solve(self, base, correlation_time=30.0, variance=0.09):
        signal = LiteralSignal(
            self.partials, np.full(3, variance), np.asarray(base), correlation_time
        )
        design = self.design(self.gps_time)
        return collocate_literal(self.gps_time, self.misclosure, self.noise, design, [signal])

    def predict(self, solved):
        partials = np.broadcast_to(np.eye(3), (len(self.epochs), 3, 3))
        mean, covariance = solved.predict(self.epochs, self.design(self.epochs), [partials])
        assert covariance is None
        return mean

    def rms(self, base):
        return np.sqrt(np.mean((self.predict(self.solve(base)) - self.truth) ** 2, axis=0))


@pytest.mark.parametrize("seed", range(5))
def test_squared_rms_is_a_parabola_in_c0_that_starts_at_least_squares(seed):
    """As in the paper's Table 3: exactly quadratic, LS at C0 = 0, and better than it between.

    LS is a polynomial fit to each axis by another library; 1e-9 m.
    """
    drive = Drive(seed)
    bases = np.array([0.0, 0.01, 0.07, 0.08, 0.09, 0.1, 0.11, 0.2])
    squares = np.array([drive.rms(np.full(3, base)) for base in bases]) ** 2
    for axis in range(3):
        parabola = np.polynomial.Polynomial.fit(bases, squares[:, axis], 2)
        assert np.abs(parabola(bases) - squares[:, axis]).max() < 1e-12 * squares.max()
        line = np.polynomial.Legendre.fit(
            drive.gps_time, drive.misclosure[:, axis], 5, domain=[START, START + SPAN]
        )
        left = np.sqrt(np.mean((line(drive.epochs) - drive.truth[:, axis]) ** 2))
        assert np.sqrt(squares[0, axis]) == pytest.approx(left, abs=1e-9)  # m
        assert squares[:, axis].min() < 0.8 * squares[0, axis]


def test_equals_the_printed_equations():
    "Trend and signal are Eq. 13 and 15 written out with inverses, two signals, to 1e-9"
    rng = np.random.default_rng(1)
    n = 9
    q = 20
    gps_time = START + rng.uniform(0, SPAN, n)
    asked = START + rng.uniform(0, SPAN, q)
    design = rng.normal(size=(n, 3, 6))
    asked_design = rng.normal(size=(q, 3, 6))
    partials = rng.normal(size=(2, n, 3, 3))
    asked_partials = rng.normal(size=(2, q, 3, 3))
    variance = rng.uniform(0.1, 1, (2, n, 3))
    base = rng.uniform(0, 1, (2, 3))
    times = (30.0, 80.0)
    misclosure = rng.normal(size=(n, 3))
    noise = Noise(np.broadcast_to(0.01 * np.eye(3), (n, 3, 3)))
    signals = [LiteralSignal(*row) for row in zip(partials, variance, base, times, strict=True)]
    solved = collocate_literal(gps_time, misclosure, noise, design, signals)
    mean, _ = solved.predict(asked, asked_design, list(asked_partials))

    b = np.zeros((3 * n, 2 * n * 3))  # B, D_Lambda and D_Lambda'Lambda of all variables
    for signal in range(2):
        for i in range(n):
            column = 3 * (signal * n + i)
            b[3 * i : 3 * i + 3, column : column + 3] = partials[signal, i]
    weight = np.linalg.inv(b @ np.diag(variance.ravel()) @ b.T + 0.01 * np.eye(3 * n))
    a = design.reshape(3 * n, 6)
    l_ = misclosure.ravel()
    trend = np.linalg.inv(a.T @ weight @ a) @ a.T @ weight @ l_  # Eq. 13
    assert np.abs(solved.trend - trend).max() < 1e-9
    for e in range(q):
        cross = [
            c0 * np.exp(-np.abs(asked[e] - gps_time) / time)[:, None] * np.ones(3)
            for c0, time in zip(base, times, strict=True)
        ]  # Eq. 20
        weighted = np.ravel(cross) * (b.T @ weight @ (l_ - a @ trend))  # Eq. 15
        expected = asked_design[e] @ trend
        expected = expected + sum(
            asked_partials[s, e] @ weighted.reshape(2, n, 3)[s].sum(axis=0) for s in range(2)
        )
        assert np.abs(mean[e] - expected).max() < 1e-9


def test_its_covariances_are_those_of_no_signal():
    """At the paper's spacing no signal has both: between two control points its error variance
    would be -2 C0, and the joint matrix has an eigenvalue of -C0"""
    control = np.arange(0.0, SPAN, 9.3)
    between = control[:-1] + 4.65
    correlation = Covariance("exponential", 30.0)
    cross = correlation(between[:, None] - control)
    joint = np.block([[np.eye(20), cross.T], [cross, correlation(between[:, None] - between)]])
    assert np.linalg.eigvalsh(joint)[0] < -0.8
    assert (1.0 - cross @ cross.T)[10, 10] < -1.5


def test_too_few_control_points_are_refused():
    "Five epochs don't determine a polynomial of order five"
    drive = Drive(3, n=5)
    with pytest.raises(ValueError, match="15 misclosures do not determine 18 trend"):
        drive.solve(np.zeros(3))
