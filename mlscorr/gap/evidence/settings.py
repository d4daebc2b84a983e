"""What the inference assumes where the survey says nothing, with the reason of each number."""

from dataclasses import dataclass

from scipy.special import ndtri

from mlscorr.pos import SETTINGS as POS


@dataclass(frozen=True)
class Settings:
    """Priors, grids and limits of the inference.

    Where no source is named, it is python benchmarks/gap_study.py with seeds 5000, 6000 and 7000,
    which the studies of the docs don't use.
    """

    confidence: float = 0.95
    # share; of intervals, bands, and the set of labels: geodetic usage
    detectable: float = 4.13
    # sigmas; minimal detectable bias of power 80 % and significance 0.1 %, 3.29 + 0.84
    # (Baarda 1968, A testing procedure for use in geodetic networks)
    same: float = 0.9
    # squared correlation above which no survey tells two signatures apart: blind check
    replicas: int = 100
    # surveys in which nothing acts: a band of 95 % to a sixth of its width

    # The error model of the POS and of what is observed.
    noise_scales: tuple[tuple[float, float], ...] = ((1.0, 0.7), (1.6, 0.3))
    # ratio to the rows' own sigma, and its prior: extraction errors have tails
    window_time: float = 100.0
    # s; without GNSS a velocity stays wrong for longer than most outages last
    fix_correlation_time: float = 0.9
    # s; noise of GNSS fixes, one a second, has lost 1 / e of its correlation then
    free_sigma: float = 0.3
    # m; prior of what is accepted or absorbed: as good as free beside centimetres
    double_rows: int = 120
    # rows of two times that are used: each costs a column of shared error
    shortlist: int = 8
    # error models and windows that are worked out in full
    negligible: float = 1e-3
    # share of the best error model's weight below which one doesn't count, nor is drawn

    # Effects and what is unknown.
    amplitudes: tuple[float, ...] = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
    # m; induced rms, from the best extraction to a datum or an event of a metre
    changed: float = 0.1
    # ratio to a column's largest value, above which a row counts as changed
    unknown_drift: float = 0.2
    # prior share of unknown errors of the position in time, while the library has events
    outlier: float = 4.0
    # sigmas of a survey below which a target is no outlier
    knots: float = 10.0
    # s between the knots of what comes and goes with time: GNSS errors last longer
    knots_place: float = 40.0
    # m between the knots of what depends on the place: a few targets apart
    functions: int = 24
    # of one block at most
    prior: tuple[tuple[str, float], ...] = (
        *(("none", 0.92), ("noise", 0.03), ("effect", 0.04), ("unknown", 0.01)),
    )
    # of kinds of labels: a wrong alarm costs more than a small effect that is missed
    prior_beside: tuple[tuple[str, float], ...] = (
        *(("noise", 0.03), ("effect", 0.05), ("unknown", 0.03)),
    )
    # the same, given one cause
    refinement: float = 3.0
    # log evidence from which on an event or a window is refined
    event_cell: float = 3.0
    # refined, an event fills a third of its cell of the bank
    event_steps: tuple[float, float] = (0.5, 0.125)
    # widths of an event, and half of its log width: a search by halves from one to the other
    window_steps: tuple[float, ...] = (0.25, 0.12, 0.06)
    # lengths of a window: a search by halves
    window_lengths: tuple[float, ...] = (10.0, 20.0, 40.0, 80.0)
    # s; from an underpass to a tunnel or a street of high houses
    window_factors: tuple[float, ...] = (4.0, 12.0, 36.0)
    # ratio to sigma; more than a belief's scale, up to metres of a cheap IMU

    # Noise.
    noise_sizes: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 5.0, 12.0)
    # ratio to a random effect's usual size
    noise_steps: int = 4
    # from each of these sizes to the next, where only channels are looked at: these are sharper
    drift_sizes: tuple[float, ...] = (3.3, 5.0, 8.0)
    # ratio to the POS's sigma, beyond what process_scales of a POS believe
    fix_sizes: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0)
    # ratio to position_noise's usual size
    roughness: tuple[tuple[float, float], ...] = ((0.0, 0.5), (0.1, 0.3), (0.3, 0.2))
    # sigma of log variance between patches, and its prior: surfaces are no planes
    roughness_common: tuple[tuple[float, float], ...] = ((0.05, 0.5), (0.3, 0.5))
    # the same, of all patches together
    odd_span: float = 6.0
    # log variance ratio, from a flat patch's to that of 5 cm about the plane
    lost: float = 0.005
    # share by which the believed return rate may be off everywhere
    odd_shares: tuple[float, float, float] = (0.002, 0.02, 0.3)
    # of odd patches: least, first guess, most; more is no exception
    tail: float = 3.5
    # sigmas from what all other rows say, beyond which a row is odd
    tail_left: float = 3.0
    # sigmas that an odd row keeps: less, or it would still draw
    tail_rows: float = 0.05
    # share of the rows at most; more are no tail but an effect

    # What is said.
    listed_causes: int = 6
    # causes that are reported at least, best first: a page of them
    listed: float = 0.005
    # probability from which on others are, too
    bins: int = 8
    # of a continuous split, with as many rows each
    plain: float = 1.3
    # times its share of the rows, from which on a bin's share of the gap is worth a sentence

    @property
    def quantile(self) -> float:
        """Two-sided normal quantile of the confidence."""
        return float(ndtri(0.5 + 0.5 * self.confidence))

    @property
    def band(self) -> tuple[float, float]:
        """Percentiles that hold the confidence."""
        return 50 * (1 - self.confidence), 50 * (1 + self.confidence)

    @property
    def scale_limit(self) -> float:
        """Largest ratio to the POS's sigma that is still believed, ten percent above the grid's."""
        return 1.1 * max(POS.process_scales)


SETTINGS = Settings()
