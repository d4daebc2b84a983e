"""Scanners on a moving vehicle: pulses one by one, cast into the scene.

A line scanner turns one beam about its Z axis; a spinning one turns a fan of beams (rings), each
at its elevation out of the scan plane, and fires them in turn while it turns on.
"""

from copy import deepcopy
from dataclasses import dataclass, fields

import numpy as np

from mlscorr.simulate.rays import Platform
from mlscorr.simulate.scenario import LEAD

RAYS = 1 << 17  # cast at a time: few enough that the arrays of a block stay in cache
SPECKLE = 0.08  # relative, one sigma: some 150 speckles a footprint, averaged on the receiver
WEAK = 0.01  # of full strength, where a scenario states the share of returns that are lost
FULL_SCALE = 65535
SOURCES = ("range", "angle", "speckle", "loss")  # of noise, each with its own random streams


@dataclass(frozen=True)
class Pulses:
    """Measured returns in scan order, and what they truly hit.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    angle, elevation, range : (n,) array
        As measured: from the zero beam, out of the scan plane, and along the beam. Units: rad, m.
    intensity : (n,) uint16 array
    incidence : (n,) array
        Cosine of the angle between beam and surface normal.
    return_number, number_of_returns : (n,) uint8 array
        Of the pulse, from 1.
    point : (n, 3) array
        True point in map coordinates: where no noise would have put it. Units: m.
    triangle : (n,) int array
        Triangle of the scene that was hit; of a mixed return, the strongest.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    elevation: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    incidence: np.ndarray
    return_number: np.ndarray
    number_of_returns: np.ndarray
    point: np.ndarray
    triangle: np.ndarray

    def __len__(self):
        return len(self.gps_time)

    @classmethod
    def concatenate(cls, blocks):
        """All pulses of some blocks, in their order."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(block, name) for block in blocks]) for name in names))

    @property
    def scanner_xyz(self):
        """X_L (n, 3) = range (cos e cos a, cos e sin a, sin e). Units: m."""
        flat = self.range * np.cos(self.elevation)
        return np.column_stack(
            [
                flat * np.cos(self.angle),
                flat * np.sin(self.angle),
                self.range * np.sin(self.elevation),
            ]
        )

    @property
    def scan_angle(self):
        """Measured angle (n,) from -180 to 180 deg."""
        return np.degrees(np.mod(self.angle + np.pi, 2 * np.pi) - np.pi)


@dataclass(frozen=True)
class Shots:
    """One block of n fired pulses: a row for the first echo of each of them, then m later echoes.

    ``kept`` (n + m,) tells which rows are returns: so that rows, and with them random draws, don't
    depend on what is lost. ``pulse`` (m,) is which of the n each later echo belongs to. Other
    fields (n + m, ...) as in Pulses.
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
    def fired(self):
        """Number n of pulses."""
        return len(self.kept) - len(self.pulse)

    def pulses(self):
        """Pulses of the returns, in scan order, the echoes of a pulse numbered by range."""
        rows = np.flatnonzero(self.kept)
        number = count = np.ones(len(rows), np.uint8)
        if len(self.pulse):
            pulse = np.append(np.arange(self.fired), self.pulse)[rows]
            order = np.argsort(pulse, kind="stable")
            rows, pulse = rows[order], pulse[order]
            number = (np.arange(len(rows)) - np.searchsorted(pulse, pulse) + 1).astype(np.uint8)
            count = np.bincount(pulse, minlength=self.fired)[pulse].astype(np.uint8)
        taken = {
            field.name: np.take(getattr(self, field.name), rows, axis=0)
            for field in fields(Pulses)
            if field.name not in ("return_number", "number_of_returns")
        }
        return Pulses(**taken, return_number=number, number_of_returns=count)


def shots_of_a_turn(scanner):
    """Time (n,) in turns, angle and elevation (n,) in rad of the pulses that one turn fires.

    A turn has points_per_line steps, each of which fires all rings in turn; those outside the
    field of view are not fired.
    """
    rings = (0.0,) if scanner.kind == "line" else scanner.rings
    count = scanner.points_per_line * len(rings)
    turned = np.arange(count) / count
    low, high = scanner.field_of_view
    seen = np.mod(360.0 * turned - low, 360.0) <= high - low
    elevation = np.tile(np.radians(rings), scanner.points_per_line)
    return turned[seen], 2 * np.pi * turned[seen], elevation[seen]


def turns_of_a_pass(trajectory, scanner):
    """Whole turns of a scanner between the leads of a trajectory."""
    duration = trajectory.gps_time[-1] - trajectory.gps_time[0] - 2 * LEAD
    return int(duration * scanner.lines_per_second + 1e-6)  # times are known to 1e-10 s


def pulses_of_a_pass(trajectory, scanner):
    """Number of pulses that a scanner fires along a trajectory."""
    return turns_of_a_pass(trajectory, scanner) * len(shots_of_a_turn(scanner)[0])


def noise_streams(rng):
    """Random streams of a scanner on one pass: for first and later echoes, by source."""
    return tuple(dict(zip(SOURCES, rng.spawn(len(SOURCES)), strict=True)) for _ in range(2))


def scan(surfaces, origin, trajectory, mounting, scanner, streams, divergence=None, block=RAYS):
    """Blocks of Pulses of one pass, in time order, with the scanner's noise.

    Parameters
    ----------
    surfaces : Surfaces
        The scene, about its local origin.
    origin : (3,) array
        Map coordinates of the local origin. Units: m.
    trajectory : Trajectory
        Where the vehicle truly is, without gaps.
    mounting : Mounting
        Of this scanner, as it truly is.
    scanner : ScannerScenario
    streams : as noise_streams gives them; drawn from copies, so that it can be done again.
    divergence : float, optional
        Full angle of the beam, the scanner's when not given. Units: rad.
    block : int
        Rays in memory at a time; leaves no trace in the result.
    """
    for shots in shoot(surfaces, origin, trajectory, mounting, scanner, streams, divergence, block):
        yield shots.pulses()


def shoot(surfaces, origin, trajectory, mounting, scanner, streams, divergence=None, block=RAYS):
    """Blocks of Shots; parameters as of scan."""
    if divergence is None:
        divergence = 1e-3 * scanner.beam_divergence
    streams = deepcopy(streams)
    platform = Platform.of(trajectory, mounting, origin)
    turned, angles, elevations = shots_of_a_turn(scanner)
    beams = platform.beams(angles, elevations)
    total = turns_of_a_pass(trajectory, scanner) * len(turned)
    start = trajectory.gps_time[0] + LEAD
    step = block if divergence == 0 else max(1, block // 7)
    for first in range(0, total, step):
        turn, slot = np.divmod(np.arange(first, min(first + step, total)), len(turned))
        gps_time = start + (turn + turned[slot]) / scanner.lines_per_second
        rays = platform.aim(gps_time, slot, beams)
        hits = surfaces.hits(rays, origin, divergence, scanner.max_range)
        yield _measure(scanner, streams, gps_time, angles[slot], elevations[slot], hits)


def _measure(scanner, streams, gps_time, angle, elevation, hits):
    """Shots: what was hit, with noise. All echoes of a pulse share its measured angle."""
    fired, more = len(gps_time), len(hits.pulse)

    def draw(source, kind="standard_normal"):
        first, later = (getattr(stream[source], kind) for stream in streams)
        return np.append(first(fired), later(more)) if more else first(fired)

    def all_rows(values):
        return np.append(values, values[hits.pulse]) if more else values

    distance, kept = hits.range, hits.range > 0
    if scanner.range_noise > 0:
        distance = distance + scanner.range_noise * draw("range")
    if scanner.angle_noise > 0:
        noise = streams[0]["angle"].standard_normal(fired)
        angle = angle + np.radians(scanner.angle_noise) * noise
    if scanner.loss > 0:  # the share that is lost grows as strength falls
        kept &= draw("loss", "random") * hits.strength >= scanner.loss * WEAK
    strength = FULL_SCALE * hits.strength * (1 + SPECKLE * draw("speckle"))
    return Shots(
        gps_time=all_rows(gps_time),
        angle=all_rows(angle),
        elevation=all_rows(elevation),
        range=distance,
        intensity=np.clip(strength, 0, FULL_SCALE).astype(np.uint16),
        incidence=hits.incidence,
        point=hits.point,
        triangle=hits.triangle,
        kept=kept,
        pulse=hits.pulse,
    )
