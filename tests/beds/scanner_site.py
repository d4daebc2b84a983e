"""A calibration site as two scanners of a vehicle see it, both mounted wrong."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.estimate.calibration import corrected_mountings
from mlscorr.frames import georeference, to_scanner
from mlscorr.survey import Matched, Mounting, Ties, Trajectory
from tests.beds import tied_site as site
from tests.beds.discs import observed_discs, surveyed_discs
from tests.beds.tied_passes import ties_of_planes

RECORDED = tuple(
    Mounting(np.array([side, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, turn], degrees=True))
    for side, turn in ((-0.3, 35), (0.3, -35))
)
LACKS = np.array(  # m, deg: of the left and the right scanner
    [[0.03, -0.02, 0.01, 0.3, -0.3, 0.4], [-0.02, 0.01, 0.02, -0.4, 0.2, -0.1]]
) * np.repeat([1.0, np.radians(1.0)], 3)


@dataclass(frozen=True)
class ScannerSite:
    "Recorded Trajectory, Matched control and Ties of both scanners"

    trajectory: Trajectory
    matched: Matched
    ties: Ties

    def of(self, number):
        "Observations of one scanner, as if it were the only one"
        own = self.matched[self.matched.scanner == number]
        ties = self.ties[(self.ties.scanner == number).all(axis=1)]
        matched = replace(own, scanner=np.zeros(len(own), int))
        return matched, replace(ties, scanner=np.zeros_like(ties.scanner))


def scanner_site(seed, targets=6, number=60, between=60, share=True, drift=1.0):
    """ScannerSite: each scanner sees control points and planes on both passes, and planes of each
    pass within 2 s of the other. Without share no control point is seen by both. A drift of 1 is
    the one of tied_site, and what the POS states of it.
    """
    rng = np.random.default_rng(seed)
    true = site.drive()
    phase = rng.uniform(0, 2 * np.pi, 3)
    turns = 2 * np.pi * (true.gps_time - site.START)[:, None] / [60.0, 85.0, 110.0] + phase
    recorded = Trajectory(
        true.gps_time,
        true.position + drift * site.POSITION * np.sin(turns),
        true.attitude,
        np.full((len(true), 3), drift * site.POSITION),
        np.tile(drift * site.ATTITUDE, (len(true), 1)),
    )
    mountings = corrected_mountings(RECORDED, LACKS.ravel())

    def look(when, place, scanner):
        xyz = np.empty_like(place)
        for i, pair in enumerate(zip(mountings, RECORDED, strict=True)):
            its = scanner == i
            seen = to_scanner(true, pair[0], place[its], when[its])
            xyz[its] = georeference(recorded, pair[1], seen, when[its])
        return xyz

    matched = _control(true, targets, look, rng, share)
    own = [_ties(true, number, look, rng, (i, i), site.places) for i in (0, 1)]
    both = _ties(true, between, look, rng, (0, 1), _soon)
    return ScannerSite(recorded, matched, Ties.concatenate([*own, both]))


def _soon(true, first, rng):
    "Places to both sides of the way at times (n,), and when the other scanner sees them"
    place, _ = site.places(true, first, rng)
    return place, first + rng.uniform(0.5, 2.0, len(first))


def _control(true, targets, look, rng, share):
    "Matched of targets on both passes by both scanners, each by one where none is shared"
    first = np.linspace(6.0, site.LENGTH - 6.0, targets)
    place, second = site.places(true, first, rng)
    names = tuple(f"T{i}" for i in range(targets))
    surveyed = place + site.SURVEYED * rng.standard_normal(place.shape)
    control = surveyed_discs(names, surveyed, site.SURVEYED)
    rows, passes, scanner = (
        values.ravel() for values in np.meshgrid(range(targets), [0, 1], [0, 1], indexing="ij")
    )
    if not share:
        seen = rows % 2 == scanner
        rows = rows[seen]
        passes = passes[seen]
        scanner = scanner[seen]
    times = site.START + np.where(passes == 0, first[rows], second[rows]) + 0.7 * scanner
    xyz = look(times, place[rows], scanner) + site.NOISE * rng.standard_normal((len(rows), 3))
    named = tuple(names[row] for row in rows)
    observed = observed_discs(named, times, xyz, site.NOISE, pass_number=1 + 2 * passes + scanner)
    return replace(Matched.by_name(observed, control), scanner=scanner)


def _ties(true, number, look, rng, scanners, places):
    "Ties of planes at all azimuths and slopes by two scanners, or by one on both passes"
    first = rng.uniform(4.0, site.LENGTH - 6.0, number)
    place, second = places(true, first, rng)
    azimuth = rng.uniform(0, 2 * np.pi, number)
    normal = np.column_stack([np.sin(azimuth), np.cos(azimuth), 0 * azimuth])
    normal[::4] = [0.0, 0.0, 1.0]  # road and pavement
    noise = site.TIE_NOISE / np.sqrt(2) * rng.standard_normal((2, number, 1)) * normal
    times = site.START + np.column_stack([first, second])
    views = [look(times[:, i], place, np.full(number, scanners[i])) + noise[i] for i in (0, 1)]
    ties = ties_of_planes(times, np.stack(views, axis=1), normal, site.TIE_NOISE)
    return replace(ties, scanner=np.tile(scanners, (number, 1)))
