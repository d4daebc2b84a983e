"""Settings of the effects and their words, each with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Settings of this package.

    Parameters
    ----------
    grazing_cosine : float
        Cosine of incidence at which a bias by incidence stops growing. A footprint of 0.35 mrad is
        then ten times as long as wide (84 deg), and the returning pulse has no edge. Units: 1.
    certain_sigmas : float
        Distance from zero at which a component of a vector is mentioned and others are omitted: 95
        % of a normal distribution. Units: sigma.
    """

    grazing_cosine: float = 0.1
    certain_sigmas: float = 2.0


SETTINGS = Settings()
