"""Settings of the inference, with the reason of each number."""

from dataclasses import dataclass

from scipy.special import ndtri

from mlscorr.pos import SETTINGS as POS


@dataclass(frozen=True)
class Settings:
    """Priors, grids and limits of the inference.

    If no source is given, it is python benchmarks/gap_study.py with seeds 5000, 6000 and 7000,
    which the studies in the docs do not use.
    """

    confidence: float = 0.95
    # share; of intervals, bands, and the set of labels: geodetic usage
    detectable: float = 4.13
    # sigmas; minimal detectable bias of power 80 % and significance 0.1 %, 3.29 + 0.84
    # (Baarda 1968, A testing procedure for use in geodetic networks)
    same: float = 0.9
    # squared correlation above which no survey separates two signatures: blind check
    replicas: int = 100
    # surveys without effects: a 95 % band to a sixth of its width

    # Error model of the POS and of observations.
    noise_scales: tuple[tuple[float, float], ...] = ((1.0, 0.7), (1.6, 0.3))
    # ratio to the rows' own sigma, and its prior: extraction errors have tails
    window_time: float = 100.0
    # s; without GNSS a velocity error lasts longer than most outages
    fix_correlation_time: float = 0.9
    # s; noise of GNSS fixes, one per second, has then lost 1 / e of its correlation
    free_sigma: float = 0.3
    # m; prior of accepted or absorbed parts: practically free compared with centimeters
    double_rows: int = 120
    # two-time rows that are used: each costs a column of shared error
    shortlist: int = 8
    # error models and windows that are computed in full
    negligible: float = 1e-3
    # share of the best error model's weight below which a model is ignored

    # Effects and unknown.
    amplitudes: tuple[float, ...] = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
    # m; induced RMS, from the best extraction to a datum or an event of one meter
    changed: float = 0.1
    # ratio to a column's largest value, above which a row counts as changed
    unknown_drift: float = 0.2
    # prior share of unknown position errors in time, because the library has events
    outlier: float = 4.0
    # sigmas of a survey below which a target is not an outlier
    knots: float = 10.0
    # s between the knots of temporary errors: GNSS errors last longer
    knots_place: float = 40.0
    # m between the knots of position-dependent errors: a few targets apart
    functions: int = 24
    # of one block at most
    prior: tuple[tuple[str, float], ...] = (
        *(("none", 0.92), ("noise", 0.03), ("effect", 0.04), ("unknown", 0.01)),
    )
    # of kinds of labels: a false alarm costs more than missing a small effect
    prior_beside: tuple[tuple[str, float], ...] = (
        *(("noise", 0.03), ("effect", 0.05), ("unknown", 0.03)),
    )
    # the same, given one cause
    refinement: float = 3.0
    # log evidence above which an event or a window is refined
    event_cell: float = 3.0
    # refined, an event fills a third of its cell of the bank
    event_steps: tuple[float, float] = (0.5, 0.125)
    # widths of an event, and half of its log width: a search by bisection from one to the other
    window_steps: tuple[float, ...] = (0.25, 0.12, 0.06)
    # lengths of a window: a search by bisection
    window_lengths: tuple[float, ...] = (10.0, 20.0, 40.0, 80.0)
    # s; from an underpass to a tunnel or a street of high houses
    window_factors: tuple[float, ...] = (4.0, 12.0, 36.0)
    # ratio to sigma; more than the prior scale, up to meters of a low-cost IMU

    # Noise.
    noise_sizes: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 5.0, 12.0)
    # ratio to a random effect's usual size
    noise_steps: int = 4
    # between consecutive sizes, if only channels are tested: these are sharper
    drift_sizes: tuple[float, ...] = (3.3, 5.0, 8.0)
    # ratio to the POS's sigma, beyond the process_scales of a POS
    fix_sizes: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0)
    # ratio to position_noise's usual size
    roughness: tuple[tuple[float, float], ...] = ((0.0, 0.5), (0.1, 0.3), (0.3, 0.2))
    # sigma of log variance between patches, and its prior: surfaces are not exact planes
    roughness_common: tuple[tuple[float, float], ...] = ((0.05, 0.5), (0.3, 0.5))
    # the same, for all patches together
    odd_span: float = 6.0
    # log variance ratio, from a flat patch to 5 cm about the plane
    lost: float = 0.005
    # share by which the assumed return rate may be wrong everywhere
    odd_shares: tuple[float, float, float] = (0.002, 0.02, 0.3)
    # of odd patches: smallest, first guess, largest; more are not exceptions
    tail: float = 3.5
    # sigmas from the prediction of all other rows, beyond which a row is odd
    tail_left: float = 3.0
    # sigmas that an odd row keeps: with less it would still pull
    tail_rows: float = 0.05
    # largest share of the rows; more are not a tail but an effect

    # Reporting.
    listed_causes: int = 6
    # smallest number of reported causes, best first: one page
    listed: float = 0.005
    # probability above which further ones are reported, too
    bins: int = 8
    # of a continuous split, with as many rows each
    plain: float = 1.3
    # times its share of the rows, above which a bin's share of the gap is mentioned

    @property
    def quantile(self) -> float:
        """Two-sided normal quantile of the confidence."""
        return float(ndtri(0.5 + 0.5 * self.confidence))

    @property
    def band(self) -> tuple[float, float]:
        """Percentiles that bound the confidence interval."""
        return 50 * (1 - self.confidence), 50 * (1 + self.confidence)

    @property
    def scale_limit(self) -> float:
        """Largest plausible ratio to the POS's sigma, ten percent above the grid's."""
        return 1.1 * max(POS.process_scales)


SETTINGS = Settings()
