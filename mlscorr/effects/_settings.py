"""The numbers that the effects and their words rest on, each with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Numbers of this room.

    Parameters
    ----------
    grazing_cosine : float
        Of the angle of incidence, from which on a bias by incidence grows no more. A footprint of
        0.35 mrad is as long as ten times its width there (84 deg), and no edge is left in a pulse
        that comes back. Units: 1.
    certain_sigmas : float
        From zero, from which on a part of a vector is worded while others are left out: 95 % of a
        normal distribution. Units: sigma.
    """

    grazing_cosine: float = 0.1
    certain_sigmas: float = 2.0


SETTINGS = Settings()
