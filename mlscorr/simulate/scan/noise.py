"""Noise of a scanner: each source draws from a stream of its own, for every pulse that is fired.

So a source that is switched off leaves all others as they are, and so does a pulse that nothing
returns. Later echoes of a pulse, which a wide beam has, draw from streams of their own.
"""

from concurrent.futures import wait
from functools import partial

import numpy as np
from numba import njit
from numpy.random import Generator

from mlscorr.simulate.scan.echoes import Hits
from mlscorr.simulate.scan.threads import in_slices, pool
from mlscorr.simulate.settings import SETTINGS

FULL_SCALE = np.iinfo(np.uint16).max  # of intensity, as LAS holds it


def _normal(stream, n, sigma, kind=float):
    noise = stream.standard_normal(n, dtype=kind)
    noise *= kind(sigma)
    return noise


def _chance(stream, n, _):
    return stream.random(n)


_coarse = partial(_normal, kind=np.float32)
DRAWS = {"range": _normal, "angle": _normal, "speckle": _coarse, "loss": _chance}


def noise_streams(rng: Generator) -> tuple[dict, ...]:
    """Random streams of a scanner on one pass by source: for first echoes, and for later ones.

    Parameters
    ----------
    rng : Generator
    """
    return tuple(dict(zip(DRAWS, rng.spawn(len(DRAWS)), strict=True)) for _ in range(2))


class ScannerNoise:
    """The random numbers of one block of n pulses, drawn in the background."""

    def __init__(self, scanner, streams, n):
        self._later = streams[1]
        size = {  # nothing is drawn where it is zero
            "range": scanner.range_noise,
            "angle": np.radians(scanner.angle_noise),
            "speckle": SETTINGS.speckle,
            "loss": scanner.loss,
        }
        self._size = {source: value for source, value in size.items() if value > 0}
        self._first = {
            source: pool().submit(DRAWS[source], streams[0][source], n, value)
            for source, value in self._size.items()
        }

    def wait(self) -> None:
        """Wait until all are drawn: streams of another block begin where these end."""
        wait(self._first.values())

    def _of(self, source, more=0):
        """Numbers for the first echoes of all pulses, and for some later ones."""
        later = DRAWS[source](self._later[source], more, self._size[source])
        return np.append(self._first[source].result(), later)

    def angle(self, angle: np.ndarray) -> np.ndarray:
        """Angles (n,) as measured. Units: rad.

        Parameters
        ----------
        angle : (n,) array
            True. Units: rad.
        """
        if "angle" in self._first:
            return angle + self._of("angle")
        return angle

    def range(self, hits: Hits) -> np.ndarray:
        """Ranges (n + m,) as measured. Units: m.

        Parameters
        ----------
        hits : Hits
        """
        if "range" not in self._first:
            return hits.range
        return hits.range + self._of("range", len(hits.pulse))

    def kept(self, hits: Hits) -> np.ndarray:
        """Which echoes (n + m,) are received: the share that is lost grows as strength falls.

        Parameters
        ----------
        hits : Hits
        """
        kept = hits.range > 0
        if "loss" in self._first:
            chance = self._of("loss", len(hits.pulse))
            kept &= chance * hits.strength >= self._size["loss"] * SETTINGS.weak
        return kept

    def intensity(self, hits: Hits) -> np.ndarray:
        """Received intensities (n + m,) uint16, with speckle.

        Parameters
        ----------
        hits : Hits
        """
        intensity = np.empty(len(hits.range), np.uint16)
        rows = hits.strength, self._of("speckle", len(hits.pulse)), intensity
        in_slices(len(intensity), _receive, rows, ())
        return intensity


@njit(cache=True, nogil=True)
def _receive(strength, speckle, intensity):
    for p in range(strength.size):
        received = FULL_SCALE * strength[p] * max(1.0 + speckle[p], 0.0)
        intensity[p] = np.uint16(min(received, FULL_SCALE))
