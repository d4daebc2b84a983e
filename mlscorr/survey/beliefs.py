"""What is believed of the instruments where their files don't say it."""

from dataclasses import dataclass, field

import numpy as np

SEARCH_RADIUS = 10.0  # m; a lone GNSS receiver errs by 8 m (GPS SPS 2020, 95 %)


@dataclass(frozen=True)
class Assumption:
    """An accuracy that nobody stated: a default stands in for it, and nothing is judged by it.

    Parameters
    ----------
    key : str
        By which survey.toml states it, as ``pos.position_sigma``.
    value : float or tuple of float
        The default.
    unit : str
        As survey.toml has it.
    """

    key: str
    value: float | tuple[float, ...]
    unit: str


@dataclass(frozen=True)
class Scanner:
    """What is believed of the scanner.

    Parameters
    ----------
    range_noise : float
        One sigma. Units: m.
    angle_noise : float
        One sigma. Units: rad.
    lines_per_second : float
    assumed : tuple of str
        Names of the noises that nobody stated.
    """

    range_noise: float = 0.005  # m, typical of mobile line scanners (RIEGL VQ-250 data sheet)
    angle_noise: float = np.radians(0.002)  # the paper's class of scanner
    lines_per_second: float = 100.0
    assumed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Pos:
    """What is believed of the POS where the trajectory has no sigma columns.

    Parameters
    ----------
    position_sigma : float
        Of each axis. Units: m.
    attitude_sigma : (3,) array
        Of roll, pitch, heading. Units: rad.
    correlation_time : float
        Units: s.
    windows : tuple of (start, length, factor, shape)
        Times (s) in which the position has a further error, as without GNSS, of at most factor
        sigmas; shape ``rise`` grows to the end, ``hump`` to the middle.
    assumed : tuple of str
        Names of those that nobody stated.
    """

    position_sigma: float = 0.02  # m, nominal for the paper's SPAN-FSAS in good GNSS
    attitude_sigma: np.ndarray = field(  # rad: roll, pitch, heading; the paper's section 3
        default_factory=lambda: np.array([1.1e-4, 1.1e-4, 2.45e-4])
    )
    correlation_time: float = 30.0  # s, the paper's section 3.1.1
    windows: tuple[tuple[float, float, float, str], ...] = ()
    assumed: tuple[str, ...] = ()
