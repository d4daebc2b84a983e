"""Scanners on a moving vehicle: individual pulses, cast into the scene and measured with noise.

A line scanner turns one beam about its Z axis; a spinning one turns a fan of beams (rings), each
at its elevation out of the scan plane, and fires them in turn while it turns on.

Each source of noise draws from its own stream, for every fired pulse. Switching off one source, or
a pulse without a return, thus does not change the others. Later echoes of a pulse, which a wide
beam has, draw from separate streams.
"""

from collections.abc import Iterator
from concurrent.futures import wait
from copy import deepcopy
from dataclasses import dataclass, fields
from functools import partial

import numpy as np
from numpy.random import Generator

from mlscorr.compiled_loops import loop
from mlscorr.frames import from_polar
from mlscorr.simulate.scan.echoes import POWER, Hits, Surfaces
from mlscorr.simulate.scan.rays import Platform, Turn
from mlscorr.simulate.scan.replay import RecordedPulses
from mlscorr.simulate.scan.threads import Workspace, in_slices, pool
from mlscorr.simulate.scenario import ScannerScenario
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Mounting, Trajectory

FULL_SCALE = np.iinfo(np.uint16).max  # of intensity, as in LAS


@dataclass(frozen=True, repr=False)
class MeasuredPulses(RecordedPulses):
    """Measured returns in scan order, and their true hits: RecordedPulses with more fields.

    Parameters
    ----------
    return_number, number_of_returns : (n,) uint8 array
        Of the pulse, from 1.
    point : (n, 3) array
        True point in map coordinates, without noise. Units: m.
    triangle : (n,) int array
        Triangle of the scene that was hit; for a mixed return, the strongest.
    """

    return_number: np.ndarray
    number_of_returns: np.ndarray
    point: np.ndarray
    triangle: np.ndarray

    @property
    def scanner_xyz(self) -> np.ndarray:
        """X_L (n, 3) = range (cos e cos a, cos e sin a, sin e). Units: m."""
        return from_polar(self.range, self.angle, self.elevation)

    @property
    def scan_angle(self) -> np.ndarray:
        """Measured angle (n,) from -180 to 180 deg."""
        return np.degrees(np.mod(self.angle + np.pi, 2 * np.pi) - np.pi)


@dataclass(frozen=True)
class Shots:
    """One block of n fired pulses: a row for the first echo of each of them, then m later echoes.

    ``kept`` (n + m,) flags the rows that are returns, so that rows and random draws do not depend
    on lost returns. ``pulse`` (m,) is the pulse of each later echo. Other fields (n + m, ...) as in
    MeasuredPulses.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    elevation: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    incidence: np.ndarray
    point: np.ndarray
    triangle: np.ndarray
    kept: np.ndarray
    pulse: np.ndarray

    @property
    def fired(self) -> int:
        """Number n of pulses."""
        return len(self.kept) - len(self.pulse)

    def pulses(self) -> MeasuredPulses:
        """Return the MeasuredPulses in scan order, with echoes of a pulse numbered by range."""
        rows = np.flatnonzero(self.kept)
        number = count = np.ones(len(rows), np.uint8)
        if len(self.pulse):
            pulse = np.append(np.arange(self.fired), self.pulse)[rows]
            order = np.argsort(pulse, kind="stable")
            rows = rows[order]
            pulse = pulse[order]
            number = (np.arange(len(rows)) - np.searchsorted(pulse, pulse) + 1).astype(np.uint8)
            count = np.bincount(pulse, minlength=self.fired)[pulse].astype(np.uint8)
        names = [field.name for field in fields(MeasuredPulses) if hasattr(self, field.name)]
        taken = pool().map(lambda name: np.take(getattr(self, name), rows, axis=0), names)
        columns = dict(zip(names, taken, strict=True))
        return MeasuredPulses(**columns, return_number=number, number_of_returns=count)


def turn_of(scanner: ScannerScenario) -> Turn:
    """Make the Turn of a scanner: points_per_line steps, each of which fires all rings in sequence.

    Pulses outside the field of view are not fired.

    Parameters
    ----------
    scanner : ScannerScenario
    """
    rings = (0.0,) if scanner.kind == "line" else scanner.rings
    count = scanner.points_per_line * len(rings)
    turned = np.arange(count) / count
    low, high = scanner.field_of_view
    in_view = np.mod(360.0 * turned - low, 360.0) <= high - low
    return Turn(
        turned[in_view],
        2 * np.pi * turned[in_view],
        np.tile(np.radians(rings), scanner.points_per_line)[in_view],
        float(scanner.lines_per_second),
    )


def turns_of_a_pass(trajectory: Trajectory, scanner: ScannerScenario) -> int:
    """Number of whole turns of a scanner within a trajectory, without lead-in and lead-out.

    Parameters
    ----------
    trajectory : Trajectory
    scanner : ScannerScenario
    """
    duration = trajectory.gps_time[-1] - trajectory.gps_time[0] - 2 * SETTINGS.trajectory_margin
    return int(duration * scanner.lines_per_second + 1e-6)  # times are accurate to 1e-10 s


def pulses_of_a_pass(trajectory: Trajectory, scanner: ScannerScenario) -> int:
    """Number of pulses that a scanner fires along a trajectory.

    Parameters
    ----------
    trajectory : Trajectory
    scanner : ScannerScenario
    """
    return turns_of_a_pass(trajectory, scanner) * len(turn_of(scanner))


def _normal(stream, n, sigma, kind=float):
    noise = stream.standard_normal(n, dtype=kind)
    noise *= kind(sigma)
    return noise


def _chance(stream, n, _):
    return stream.random(n)


_coarse = partial(_normal, kind=np.float32)
DRAWS = {"range": _normal, "angle": _normal, "speckle": _coarse, "loss": _chance}


def noise_streams(rng: Generator) -> tuple[dict, ...]:
    """Make random streams of a scanner on one pass by source: for first and for later echoes.

    Parameters
    ----------
    rng : Generator
    """
    return tuple(dict(zip(DRAWS, rng.spawn(len(DRAWS)), strict=True)) for _ in range(2))


class ScannerNoise:
    """Random numbers of one block of n pulses, drawn in the background."""

    def __init__(self, scanner, streams, n):
        self._later = streams[1]
        size = {  # nothing is drawn for zeros
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
        """Wait until all are drawn, because the streams of the next block continue from here."""
        wait(self._first.values())

    def _of(self, source, more=0):
        """Numbers for the first echoes of all pulses, and for some later ones."""
        later = DRAWS[source](self._later[source], more, self._size[source])
        return np.append(self._first[source].result(), later)

    def angle(self, angle: np.ndarray) -> np.ndarray:
        """Return measured angles (n,). Units: rad.

        Parameters
        ----------
        angle : (n,) array
            True. Units: rad.
        """
        if "angle" in self._first:
            return angle + self._of("angle")
        return angle

    def range(self, hits: Hits) -> np.ndarray:
        """Return measured ranges (n + m,). Units: m.

        Parameters
        ----------
        hits : Hits
        """
        if "range" not in self._first:
            return hits.range
        return hits.range + self._of("range", len(hits.pulse))

    def kept(self, hits: Hits) -> np.ndarray:
        """Flag (n + m,) of received echoes: the share lost increases as strength decreases.

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
        """Return received intensities (n + m,) uint16, with speckle.

        Parameters
        ----------
        hits : Hits
        """
        intensity = np.empty(len(hits.range), np.uint16)
        rows = hits.strength, self._of("speckle", len(hits.pulse)), intensity
        in_slices(len(intensity), _receive, rows, ())
        return intensity


@loop
def _receive(strength, speckle, intensity):
    for p in range(strength.size):
        received = FULL_SCALE * strength[p] * max(1.0 + speckle[p], 0.0)
        intensity[p] = np.uint16(min(received, FULL_SCALE))


def shoot(
    surfaces: Surfaces,
    origin: np.ndarray,
    trajectory: Trajectory,
    mounting: Mounting,
    scanner: ScannerScenario,
    streams: tuple,
    divergence: float | None = None,
    block: int | None = None,
) -> Iterator[Shots]:
    """Yield blocks of Shots of one pass, in order of time, with the scanner's noise.

    Parameters
    ----------
    surfaces : Surfaces
        Surfaces of the scene, relative to its local origin.
    origin : (3,) array
        Map coordinates of the local origin. Units: m.
    trajectory : Trajectory
        True trajectory, without gaps.
    mounting : Mounting
        True mounting of this scanner.
    scanner : ScannerScenario
    streams : tuple of dict
        From noise_streams; copies are used, so that the call can be repeated.
    divergence : float, optional
        Full angle of the beam; by default the scanner's. Units: rad.
    block : int, optional
        Rays in memory at a time; does not affect the result.

    Yields
    ------
    Shots
        Valid until the next one.
    """
    block = block or SETTINGS.block_rays
    if divergence is None:
        divergence = 1e-3 * scanner.beam_divergence
    streams = deepcopy(streams)
    platform = Platform.of(trajectory, mounting, origin)
    turn = turn_of(scanner)
    total = turns_of_a_pass(trajectory, scanner) * len(turn)
    start = trajectory.gps_time[0] + SETTINGS.trajectory_margin
    step = block if divergence == 0 else max(1, block // len(POWER))
    sizes = [min(step, total - first) for first in range(0, total, step)]
    room = Workspace()
    if sizes:
        ahead = ScannerNoise(scanner, streams, sizes[0])
    else:
        ahead = None
    for i, size in enumerate(sizes):
        rays = platform.aim(np.arange(i * step, i * step + size), turn, start, room, divergence > 0)
        hits = surfaces.hits(rays, origin, divergence, scanner.max_range, room)
        # the next block's noise is drawn while this one is used
        noise = ahead
        noise.wait()
        if i + 1 < len(sizes):
            ahead = ScannerNoise(scanner, streams, sizes[i + 1])
        else:
            ahead = None
        yield _measure(rays, hits, noise)


def _measure(rays, hits, noise):
    """Measure hits with noise as Shots. All echoes of a pulse share its measured angle."""

    def all_rows(values):
        if len(hits.pulse):
            return np.append(values, values[hits.pulse])
        return values

    return Shots(
        gps_time=all_rows(rays.gps_time),
        angle=all_rows(noise.angle(rays.angle)),
        elevation=all_rows(rays.elevation),
        range=noise.range(hits),
        intensity=noise.intensity(hits),
        incidence=hits.incidence,
        point=hits.point,
        triangle=hits.triangle,
        kept=noise.kept(hits),
        pulse=hits.pulse,
    )
