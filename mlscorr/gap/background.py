"""What the simulator expects the residuals to be when nothing is wrong: their covariance V.

V = drift, jitter and attitude of the POS + survey errors + noise of each row, by the recursion of
the collocation. Residuals of one drive are not white: without V every clean survey is "explained"
by some effect, and with one fixed V nearly half of those whose drift merely has another shape.
So V is a family of Settings with prior weights, to be averaged over.
"""

from dataclasses import dataclass, replace

import numpy as np

FREE = 1.0  # m: sigma of the unknown height of a plane that was seen twice, as good as free
PAIRS = 120  # two-time rows that the inference uses; each costs a column of shared error
SCALES = (0.4, 0.7, 1.2, 2.0)  # of the POS's sigma; more is a cause of its own: capped
SCALE_SPREAD = 0.45  # of log scale: sigmas of POS are rarely wrong by more than half
NOISES = (1.0, 1.6)  # factor on sigma of the rows' own noise
NOISE_WEIGHTS = (0.7, 0.3)
SHAPES = (  # family, factor on the correlation time, correlation time of jitter (s), weight
    ("matern32", 0.1, 1.0, 0.15),
    ("matern32", 0.3, 2.0, 0.25),
    ("exponential", 1.0, 3.0, 0.20),
    ("matern32", 1.0, 5.0, 0.25),
    ("matern32", 3.0, 15.0, 0.15),
)


@dataclass(frozen=True)
class Setting:
    """One covariance V: factors on what is believed, and what is added to it.

    Parameters
    ----------
    scale : float
        On the sigmas of drift, jitter and attitude.
    family : str
        Of drift and attitude.
    time : float
        On their correlation time.
    jitter_time : float
        Units: s.
    noise : float
        On the sigma of each row's own noise.
    fixes : float
        Sigma of noise of GNSS fixes, in E, N and H. Units: m.
    weight : float
        Prior probability.
    bursts : tuple of (start, length, factor, shape)
        Windows (s) in which the POS has a further error, whose sigma is at most the stated one
        of the position times a factor. It rises with time or has its largest value in the middle.
    """

    scale: float = 1.0
    family: str = "matern32"
    time: float = 1.0
    jitter_time: float = 5.0
    noise: float = 1.0
    fixes: float = 0.0
    weight: float = 1.0
    bursts: tuple[tuple[float, float, float, str], ...] = ()

    def growth(self, gps_time):
        """Factor (n, 1) of what the bursts add at times (n,), on the sigma of position."""
        factor = np.zeros(len(gps_time))
        for start, length, largest, shape in self.bursts:
            part = (gps_time - start) / length
            inside = (part >= 0) & (part < 1)
            grown = part if shape == "rise" else 4 * part * (1 - part)
            factor[inside] = largest * grown[inside]
        return factor[:, None]


BELIEVED = Setting()
BURST_TIME = 100.0  # s: without GNSS a velocity stays wrong, for longer than most outages last


def settings(scales=SCALES):
    """Settings within the belief, with prior weights that sum to one."""
    scales = np.asarray(scales)
    share = np.exp(-0.5 * (np.log(scales) / SCALE_SPREAD) ** 2)
    share /= share.sum()
    return tuple(
        Setting(float(scale), family, time, jitter, noise, 0.0, float(s * shape_weight * w))
        for family, time, jitter, shape_weight in SHAPES
        for scale, s in zip(scales, share, strict=True)
        for noise, w in zip(NOISES, NOISE_WEIGHTS, strict=True)
    )


def nearby(setting):
    """Settings about one: the steps between SCALES and SHAPES are wider than data may leave."""
    factors = (0.8, 1.0, 1.25), (0.7, 1.0, 1.4), (0.9, 1.0, 1.15)
    limit = max(SCALES) * 1.1
    return tuple(
        replace(
            setting,
            scale=setting.scale * a,
            time=setting.time * b,
            noise=setting.noise * c,
            weight=setting.weight / 27,
        )
        for a in factors[0]
        for b in factors[1]
        for c in factors[2]
        if setting.scale * a <= limit
    )


@dataclass(frozen=True)
class Epochs:
    """Metric rows as scalar observations in the order of time, one for each look.

    A row of two times is two observations, half of it each, that share the unknown height of
    their plane.

    Parameters
    ----------
    rows : int
        Number of Rows, m.
    row : (n,) int array
        The row that each observation is of.
    gps_time, half, own : (n,) array
        Time (s), share of the row's value, variance of its noise (m^2).
    drift, jitter, attitude, place : (n, 3) array
        Mixings, in m; place is the derivative by the position.
    shared : (n, c) array
        Errors that several observations have in common. Units: m.
    correlation_time : float
        As believed. Units: s.
    second : (n,) bool array
        False for the first of two looks, which only defines the plane.
    growth : (n, 1) array
        Factor of what believed windows add, see Setting.
    """

    rows: int
    row: np.ndarray
    gps_time: np.ndarray
    half: np.ndarray
    own: np.ndarray
    drift: np.ndarray
    jitter: np.ndarray
    attitude: np.ndarray
    place: np.ndarray
    shared: np.ndarray
    correlation_time: float
    second: np.ndarray
    growth: np.ndarray

    def __len__(self):
        return len(self.row)

    def columns(self, values):
        """Columns (n, c) of values (m, c) of the rows."""
        return np.asarray(values, dtype=float)[self.row] * self.half[:, None]

    @property
    def sigma(self):
        """Stated sigma (m,) of the rows by the POS's position. Units: m."""
        own = (self.drift**2 + self.jitter**2).sum(axis=1)
        return np.sqrt(np.bincount(self.row, own, self.rows))

    def with_shared(self, columns):
        """The same with further errors in common (n, k): causes that are accepted, as nuisance."""
        return replace(self, shared=np.hstack([self.shared, columns]))

    def with_own(self, own):
        """The same with other variances (n,) of the observations' own noise."""
        return replace(self, own=own)


def epochs(rows, background):
    """Epochs of the metric rows; of more than PAIRS two-time rows some, evenly in time.

    Raises ValueError when no row has a unit of length.
    """
    if not rows.metric.any():
        raise ValueError(
            f"None of {len(rows)} rows has a residual in m: roughness and return rate alone can't "
            "say what is wrong. Survey targets, or give a [scene] reference."
        )
    twice = np.flatnonzero(rows.two_times)
    chosen = np.ones(len(rows), dtype=bool)
    if len(twice) > PAIRS:
        twice = twice[np.argsort(rows.gps_time[twice], kind="stable")]
        chosen[twice] = False
        chosen[twice[np.linspace(0, len(twice) - 1, PAIRS).astype(int)]] = True
    leg = np.flatnonzero(chosen[background.row])
    leg = leg[np.argsort(background.gps_time[leg], kind="stable")]
    row, time = background.row[leg], background.gps_time[leg]
    two = rows.two_times[row]
    first = two & (time == rows.gps_time[row])
    place = np.where(first[:, None] | ~two[:, None], rows.partials[row], rows.partials_2[row])
    survey = rows.survey_design()[row]
    often = np.diff(survey.tocsc().indptr) > 1  # columns
    own = np.where(two, 0.5, 1.0) * rows.noise[row]
    own += np.asarray(survey[:, np.flatnonzero(~often)].power(2).sum(axis=1)).ravel()
    shared = np.hstack([survey[:, np.flatnonzero(often)].toarray(), _planes(row, two, first)])
    return Epochs(
        rows=len(rows),
        row=row,
        gps_time=time,
        half=np.where(two, 0.5, 1.0),
        own=own,
        drift=background.drift[leg],
        jitter=background.jitter[leg],
        attitude=background.attitude[leg],
        place=place[:, :3],
        shared=shared,
        correlation_time=background.correlation_time,
        second=~first,
        growth=Setting(bursts=background.windows).growth(time),
    )


def _planes(row, two, first):
    """Heights of planes that were seen twice: (n, k), FREE at the first look, -FREE at the
    second."""
    known, number = np.unique(row[two], return_inverse=True)
    planes = np.zeros((len(row), len(known)))
    planes[np.flatnonzero(two), number] = np.where(first[two], FREE, -FREE)
    return planes
