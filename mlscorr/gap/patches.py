"""Flat pieces of the cloud: small in space and in time, each with the plane that fits it.

The cloud is streamed; of each patch only its moments and a few points stay in memory.
"""

from dataclasses import dataclass, fields

import numpy as np

from mlscorr.gap.covariates import scanner_origin
from mlscorr.io.las import read_chunks

CELL = 1.0  # m: several hundred points of a scanner at street distances, flat for most of them
MOMENT = 1.0  # s: the POS error is one value over that time
BLOCK = 4  # cells: blocks of cells are kept or left together, so that neighbours stay neighbours
FEWEST = 24  # points of a plane: the variance about it is then known to a third
SAMPLES = 12  # pulses that stand for a patch
TRIMS = (2.0, 2.5, 3.0, 3.5)  # sigmas; the last one takes 0.05 % of normal noise
LEAST_SHARE = 0.9  # of the points of a cell that its plane must hold
ROUGHEST = 0.05  # m about the plane: no wall or road
LEAST_SPREAD = 0.12  # m, one sigma in the plane's narrow direction: else its normal is not known
SMALLEST = 1e-4  # m: less than any file resolves
GRAZING = 0.1  # cosine of incidence, below which a plane is not seen but skimmed
POOL = 6000  # patches in memory
LONGEST_MISS = 4.5  # pulses: of longer pauses a loss of 30 % makes 1 %
SAME_LINE = 20.5  # pulses: a longer pause is another scan line
REGULAR = 0.9  # of the pauses that must be whole pulses, for misses to be counted


@dataclass(frozen=True)
class Patches:
    """Flat pieces of the cloud, in no order.

    Parameters
    ----------
    pass_number : (p,) int array
    gps_time : (p,) array
        Mean of the points. Units: s.
    centre : (p, 3) array
        Mean of the points on the plane. Units: m.
    normal : (p, 3) array
        Towards the scanner.
    variance : (p,) array
        About the plane, with the plane's three parameters reckoned. Units: m^2.
    spread : (p,) array
        One sigma of the points along the plane's narrow direction. Units: m.
    ripple : (p,) array
        Variance about the plane over that between points which follow each other: about 1 for
        noise, more for what is curved.
    points : (p,) int array
        On the plane.
    fired, returned : (p,) int array
        Pulses between the first and the last return of each scan line on it; zeros where the time
        stamps have no regular step.
    block : (p,) array
        Random number from 0 to 1, the same for neighbours.
    xyz : (p, 12, 3), time, intensity : (p, 12) arrays
        Points of each patch, evenly taken in time.
    """

    pass_number: np.ndarray
    gps_time: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    variance: np.ndarray
    spread: np.ndarray
    ripple: np.ndarray
    points: np.ndarray
    fired: np.ndarray
    returned: np.ndarray
    block: np.ndarray
    xyz: np.ndarray
    time: np.ndarray
    intensity: np.ndarray

    def __len__(self):
        return len(self.gps_time)

    def __getitem__(self, selection):
        return Patches(*(getattr(self, field.name)[selection] for field in fields(self)))

    @classmethod
    def concatenate(cls, several):
        """All patches of some, in their order."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(one, name) for one in several]) for name in names))


def find_patches(survey, progress=None, pool=POOL, chunks=read_chunks):
    """Stream all clouds of a survey and keep at most `pool` flat patches, spread over the place.

    Which blocks of the ground are kept is told by a hash of their place: the same in all passes.

    Parameters
    ----------
    survey : Survey
    progress : function of a number of points, optional
    pool : int
    chunks : function of a CloudFile
        Gives an iterator of PointCloud.

    Returns Patches, or None where the clouds hold no flat patch.
    """
    found, starts, share, read = [], {}, 1.0, 0
    whole = sum(file.points for file in survey.clouds)
    for number, file in enumerate(survey.clouds):
        for chunk in chunks(file):
            segment = survey.trajectory.segment(chunk.gps_time)
            for one in np.unique(segment[segment >= 0]):
                inside, key = segment == one, (number, int(one))
                starts[key] = min(starts.get(key, np.inf), chunk.gps_time[inside].min())
                patches = _patches_of(survey, chunk, inside, share)
                if patches is not None:
                    found.append((key, patches))
            read += len(chunk)
            while _in_the_end(found, whole, read) > pool:
                share /= 2
                found = [(key, patches[patches.block < share]) for key, patches in found]
            if progress is not None:
                progress(len(chunk))
    order = {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}
    parts = [_numbered(patches, order[key]) for key, patches in found if len(patches)]
    return Patches.concatenate(parts) if parts else None


def _in_the_end(found, whole, read):
    """How many patches there will be, going on like this: the fewer are kept, the less is done."""
    return sum(len(patches) for _, patches in found) * max(1.0, whole / max(read, 1))


def _numbered(patches, number):
    values = {field.name: getattr(patches, field.name) for field in fields(Patches)}
    return Patches(**{**values, "pass_number": np.full(len(patches), number)})


def _patches_of(survey, chunk, inside, share):
    """Patches of one chunk and pass, or None."""
    block = _chance(*np.floor(chunk.xyz[:, :2] / (BLOCK * CELL)).T.astype(np.int64))
    rows = np.flatnonzero(inside & (block < share))
    key = place_key(chunk.xyz[rows], chunk.gps_time[rows])
    order = np.argsort(key, kind="stable")
    rows, key = rows[order], key[order]
    first = np.flatnonzero(np.append(True, key[1:] != key[:-1])) if len(rows) else np.empty(0, int)
    count = np.diff(np.append(first, len(rows)))
    keep = count >= FEWEST
    if not keep.any():
        return None
    rows = rows[np.repeat(keep, count)]
    count = count[keep]
    return _fit(survey, chunk, rows, count, block)


def place_key(xyz, gps_time):
    """A number (n,) for the cell and moment of points: those of one patch have the same."""
    cell = np.floor(xyz / CELL).astype(np.int64)
    return _mix(*cell.T, np.floor(gps_time / MOMENT).astype(np.int64))


def _mix(*numbers):
    """One 64-bit number (n,) of several integers (n,), different for all that occur together."""
    mixed = np.zeros(len(numbers[0]), np.uint64)
    for number in numbers:
        mixed ^= number.astype(np.uint64)
        mixed *= np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio (Fibonacci hashing)
        mixed ^= mixed >> np.uint64(32)
    return mixed


def _chance(*numbers):
    """A number from 0 to 1 (n,) that depends on integers (n,) alone."""
    return (_mix(*numbers) >> np.uint64(11)) / float(1 << 53)


def _fit(survey, chunk, rows, count, block):
    """Planes through groups of points: rows (n,) of the chunk, count (g,) of each group."""
    first = np.cumsum(count) - count
    group = np.repeat(np.arange(len(count)), count)
    local = chunk.xyz[rows] - chunk.xyz[rows[first]][group]
    weight = np.ones(len(rows))
    for trim in TRIMS:
        mean, values, axes = moments(local, weight, first, group)
        away = np.abs(np.einsum("ni,ni->n", local - mean[group], axes[group, :, 0]))
        held = np.add.reduceat(weight, first)
        sigma = np.sqrt(values[:, 0] * held / np.maximum(held - 3, 1))
        weight = (away <= trim * np.maximum(sigma, 1e-4)[group]).astype(float)
    mean, values, axes = moments(local, weight, first, group)
    held = np.add.reduceat(weight, first)
    variance = values[:, 0] * held / np.maximum(held - 3, 1)
    good = (held >= np.maximum(FEWEST, LEAST_SHARE * count)) & (variance <= ROUGHEST**2)
    good &= values[:, 1] >= LEAST_SPREAD**2
    if not good.any():
        return None
    fired, returned = _misses(chunk.gps_time, rows, first, group)
    away = np.einsum("ni,ni->n", local - mean[group], axes[group, :, 0])
    between = _between(away, weight, first, group)
    taken = _taken(weight > 0, first, count)[good]
    sample = rows[taken]
    time = np.add.reduceat(weight * (chunk.gps_time[rows] - chunk.gps_time[rows[0]]), first) / held
    normal = axes[good, :, 0]
    slant = np.einsum("pi,pi->p", normal, _sight(survey, chunk, sample))
    patches = Patches(
        pass_number=np.zeros(good.sum(), int),
        gps_time=chunk.gps_time[rows[0]] + time[good],
        centre=chunk.xyz[rows[first]][good] + mean[good],
        normal=normal * np.sign(slant)[:, None],
        variance=variance[good],
        spread=np.sqrt(values[good, 1]),
        ripple=(variance / between)[good],
        points=held[good].astype(int),
        fired=fired[good],
        returned=returned[good],
        block=block[rows[first]][good],
        xyz=chunk.xyz[sample],
        time=chunk.gps_time[sample],
        intensity=chunk.intensity[sample].astype(float),
    )
    return patches[np.abs(slant) >= GRAZING]


def moments(local, weight, first, group):
    """Mean (g, 3), eigenvalues (g, 3) from the least and axes (g, 3, 3) of groups of points."""
    total = np.maximum(np.add.reduceat(weight, first), 1.0)
    mean = np.add.reduceat(weight[:, None] * local, first) / total[:, None]
    centred = local - mean[group]
    covariance = np.empty((len(first), 3, 3))
    for i in range(3):
        for j in range(i, 3):
            entry = np.add.reduceat(weight * centred[:, i] * centred[:, j], first) / total
            covariance[:, i, j] = covariance[:, j, i] = entry
    return mean, *np.linalg.eigh(covariance)


def _between(away, weight, first, group):
    """Half the mean square (g,) of differences of distances (n,) that follow each other. m^2."""
    both = weight * np.append(weight[1:] * (group[1:] == group[:-1]), 0.0)
    squares = both * np.diff(away, append=0.0) ** 2
    total = np.maximum(np.add.reduceat(both, first), 1.0)
    return np.maximum(np.add.reduceat(squares, first) / total / 2, SMALLEST**2)


def _taken(on_plane, first, count):
    """Places (g, 12) of points on each group's plane, evenly spread; repeated where few are."""
    held = np.add.reduceat(on_plane.astype(int), first)
    inliers = np.flatnonzero(on_plane)
    begin = np.cumsum(held) - held
    step = np.maximum(held, 1)[:, None] * (np.arange(SAMPLES) + 0.5) / SAMPLES
    return inliers[np.minimum(begin[:, None] + step.astype(int), len(inliers) - 1)]


def _sight(survey, chunk, sample):
    """Unit vector (p, 3) from each patch to the scanner."""
    middle = sample[:, SAMPLES // 2]
    away = scanner_origin(survey, chunk.gps_time[middle]) - chunk.xyz[middle]
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def _misses(gps_time, rows, first, group):
    """Pulses fired and returned within the scan lines of a group, their ends not counted.

    The step of pulses is the least one of the group. Nothing is counted where pauses are not whole
    multiples of it (jitter, another order), or too many are long (a cloud that was thinned there).
    """
    pause = np.diff(gps_time[rows], append=gps_time[rows[-1]])
    follows = np.append((np.diff(rows) == 1) & (np.diff(group) == 0), False) & (pause > 0)
    step = np.minimum.reduceat(np.where(follows, pause, np.finfo(float).max), first)
    pulses = np.where(follows, pause / step[group], np.finfo(float).max)
    near, longer = pulses <= LONGEST_MISS, (pulses > LONGEST_MISS) & (pulses <= SAME_LINE)
    pulses = np.where(near, pulses, 0.0)

    def count(which):
        return np.add.reduceat(which.astype(int), first)

    pauses, lines = count(near), count(near & ~np.append(False, near[:-1]))
    whole, many = count(near & (np.abs(pulses % 1 - 0.5) > 0.4)), count(longer)
    told = (whole >= REGULAR * pauses) & (many <= (1 - REGULAR) / 2 * pauses)
    # a line's first and last returns are there by choice: what lies between them counts
    fired = np.add.reduceat(np.round(pulses).astype(int), first) - lines
    return np.where(told, fired, 0), np.where(told, pauses - lines, 0)
