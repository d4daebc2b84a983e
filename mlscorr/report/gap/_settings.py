"""The numbers that the pages of a diagnosis rest on: what is worth a reader's eye."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Numbers of this room: they choose what is drawn and written, and change no result.

    Parameters
    ----------
    ladder_rows, ladder_letters : int
        Labels on the ladder of evidence, and letters of each, at most: a page's height and half
        of its width.
    written_correlation : float
        From which on a squared correlation is written into its cell: half of the variance in
        common.
    least_share : float
        A bin's share of the gap is written where it is at least that, and so many times its share
        of the rows as the inference asks for: else it says nothing of where the gap lies.
    likely_probability : float
        From which on a cause is not folded away.
    stripe_sigmas : float
        Half of the stripe in which innovations are expected. Units: sigma.
    drawn_sigmas : tuple of float
        Least and largest end of the axis of innovations. Units: sigma.
    map_sigmas : float
        At the ends of the map's colours. Units: sigma.
    row_gap, row_gap_steps : float
        Without a row, from which on two passes are parted: so long, and so many times the usual
        step. Units: s, 1.
    panels : int
        Passes beside each other at most; more are drawn as one.
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
