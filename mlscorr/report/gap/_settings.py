"""Settings of the pages of a diagnosis: selection of displayed items."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Settings of this package: they select what is displayed, and change no result.

    Parameters
    ----------
    ladder_rows, ladder_letters : int
        Largest number of labels on the ladder of evidence, and of letters of each: a page's height
        and half of its width.
    written_correlation : float
        Smallest squared correlation written into its cell: half of the variance in common.
    least_share : float
        Smallest share of the gap written for a bin; it must also exceed the bin's share of the rows
        by the factor of the inference.
    likely_probability : float
        Smallest probability of a cause that is not collapsed.
    stripe_sigmas : float
        Half width of the stripe of expected innovations. Units: sigma.
    drawn_sigmas : tuple of float
        Smallest and largest end of the axis of innovations. Units: sigma.
    map_sigmas : float
        Value at the ends of the map's colors. Units: sigma.
    row_gap, row_gap_steps : float
        Smallest time without rows between two passes, absolute and relative to the usual step.
        Units: s, 1.
    panels : int
        Largest number of passes side by side; more are drawn as one.
    """

    ladder_rows: int = 26
    ladder_letters: int = 44
    written_correlation: float = 0.5
    least_share: float = 0.15
    likely_probability: float = 0.01
    stripe_sigmas: float = 2.0
    drawn_sigmas: tuple[float, float] = (3.0, 6.0)
    map_sigmas: float = 4.0
    row_gap: float = 15.0
    row_gap_steps: float = 20.0
    panels: int = 6


SETTINGS = Settings()
