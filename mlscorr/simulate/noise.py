"""Noise of a scanner: each source draws from a stream of its own, for every pulse that is fired.

So a source that is switched off leaves all others as they are, and so does a pulse that nothing
returns. Later echoes of a pulse, which a wide beam has, draw from streams of their own.
"""

import numpy as np
from numba import njit

from mlscorr.simulate.parallel import in_slices, pool

FULL_SCALE = 65535  # of intensity
SPECKLE = 0.08  # relative, one sigma: some 150 speckles a footprint, averaged on the receiver
WEAK = 0.01  # of full strength, where a scenario states the share of returns that are lost
EVEN_BYTES, SUM_OF_FOUR = np.uint64(0x00FF00FF00FF00FF), np.uint64(0x0001000100010001)
BYTES_MEAN, BYTES_SIGMA = 8 * 127.5, np.sqrt(8 * (256**2 - 1) / 12)  # of the sum of eight


def _normal(stream, n, sigma):
    noise = stream.standard_normal(n)
    noise *= sigma
    return noise


def _bits(stream, n, _):
    return stream.integers(0, 2**64, n, dtype=np.uint64)


def _chance(stream, n, _):
    return stream.random(n)


DRAWS = {"range": _normal, "angle": _normal, "speckle": _bits, "loss": _chance}


def noise_streams(rng):
    """Random streams of a scanner on one pass by source: for first echoes, and for later ones."""
    return tuple(dict(zip(DRAWS, rng.spawn(len(DRAWS)), strict=True)) for _ in range(2))


class Noise:
    """The random numbers of one block of n pulses, drawn in the background."""

    def __init__(self, scanner, streams, n):
        self._later = streams[1]
        size = {  # nothing is drawn where it is zero
            "range": scanner.range_noise,
            "angle": np.radians(scanner.angle_noise),
            "speckle": SPECKLE,
            "loss": scanner.loss,
        }
        self._size = {source: value for source, value in size.items() if value > 0}
        self._first = {
            source: pool().submit(DRAWS[source], streams[0][source], n, value)
            for source, value in self._size.items()
        }

    def _of(self, source, more=0):
        """Numbers for the first echoes of all pulses, and for some later ones."""
        first = self._first[source].result()
        if more:
            later = DRAWS[source](self._later[source], more, self._size[source])
            return np.append(first, later)
        return first

    def angle(self, angle):
        """Angles (n,) as measured. Units: rad."""
        return angle + self._of("angle") if "angle" in self._first else angle

    def range(self, hits):
        """Ranges (n + m,) as measured. Units: m."""
        if "range" not in self._first:
            return hits.range
        return hits.range + self._of("range", len(hits.pulse))

    def kept(self, hits):
        """Which echoes (n + m,) are received: the share that is lost grows as strength falls."""
        kept = hits.range > 0
        if "loss" in self._first:
            chance = self._of("loss", len(hits.pulse))
            kept &= chance * hits.strength >= self._size["loss"] * WEAK
        return kept

    def intensity(self, hits):
        """Received intensities (n + m,) uint16, with speckle."""
        intensity = np.empty(len(hits.range), np.uint16)
        rows = hits.strength, self._of("speckle", len(hits.pulse)), intensity
        in_slices(len(intensity), _receive, rows, ())
        return intensity


@njit(cache=True, nogil=True)
def _receive(strength, bits, intensity):
    """Intensity with speckle: its bell is the sum of eight random bytes, true to four sigma, as
    normal numbers would take five times as long."""
    for p in range(strength.size):
        pairs = (bits[p] & EVEN_BYTES) + ((bits[p] >> np.uint64(8)) & EVEN_BYTES)
        total = (pairs * SUM_OF_FOUR) >> np.uint64(48)
        speckle = 1.0 + SPECKLE * (np.float64(total) - BYTES_MEAN) / BYTES_SIGMA
        intensity[p] = np.uint16(min(FULL_SCALE * strength[p] * speckle, FULL_SCALE))
