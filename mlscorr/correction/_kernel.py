"""Fast kernel: the shift of each point from its own time stamp."""

import numpy as np

from mlscorr.compiled_loops import loop


def require_times(points: int, times: int) -> None:
    """Refuse points without a time each, because the kernel checks no index.

    Parameters
    ----------
    points, times : int
        Numbers of points and of times.

    Raises
    ------
    ValueError
    """
    if points != times:
        raise ValueError(f"{points} points came with {times} times. Give one time for each point.")


@loop
def locate(
    gps_time: np.ndarray, constant: float, epochs: np.ndarray, step: float, is_gap: np.ndarray
) -> np.ndarray:
    """Index i with epochs[i] <= time <= epochs[i + 1] for each point (n,); -1 outside and in gaps.

    The search tries the next epoch, then leaps of the usual step, each from the end of the last one
    (a gap costs one more), then bisection.

    Parameters
    ----------
    gps_time : (n,) array
        In the file's time system. Units: s.
    constant : float
        Added to gps_time to get the trajectory's time. Units: s.
    epochs : (k,) array
    step : float
        Usual step of the epochs. Units: s.
    is_gap : (k,) bool array
        True if the step after the epoch is a gap.
    """
    index = np.empty(gps_time.size, dtype=np.int32)
    last = epochs.size - 1
    i = 0
    for p in range(gps_time.size):
        time = gps_time[p] + constant
        if not (epochs[i] <= time <= epochs[i + 1]):
            if not (epochs[0] <= time <= epochs[last]):
                index[p] = -1
                continue
            for _ in range(4):
                i += int(np.floor((time - epochs[i]) / step))
                i = min(max(i, 0), last - 1)
                if epochs[i] <= time <= epochs[i + 1]:
                    break
            else:
                i = min(np.searchsorted(epochs, time, side="right") - 1, last - 1)
        index[p] = -1 if is_gap[i] and epochs[i] < time < epochs[i + 1] else i
    return index


@loop(inline="always")
def _increment(x, y, z, weight, a, b):
    """Shift + turn (x - T), interpolated between the table rows a and b."""
    v = 1.0 - weight
    dx = x - (v * a[0] + weight * b[0])
    dy = y - (v * a[1] + weight * b[1])
    dz = z - (v * a[2] + weight * b[2])
    ex = v * a[3] + weight * b[3] + (v * a[6] + weight * b[6]) * dx
    ex += (v * a[7] + weight * b[7]) * dy + (v * a[8] + weight * b[8]) * dz
    ey = v * a[4] + weight * b[4] + (v * a[9] + weight * b[9]) * dx
    ey += (v * a[10] + weight * b[10]) * dy + (v * a[11] + weight * b[11]) * dz
    ez = v * a[5] + weight * b[5] + (v * a[12] + weight * b[12]) * dx
    ez += (v * a[13] + weight * b[13]) * dy + (v * a[14] + weight * b[14]) * dz
    return ex, ey, ez


@loop
def fill_increments(
    gps_time: np.ndarray,
    xyz: np.ndarray,
    epochs: np.ndarray,
    step: float,
    is_gap: np.ndarray,
    table: np.ndarray,
    increments: np.ndarray,
    inside: np.ndarray,
) -> None:
    """Compute increments (n, 3) and inside (n,) of points in place.

    Parameters
    ----------
    gps_time, epochs, step, is_gap
        See ``locate``.
    xyz : (n, 3) array
        Relative to the correction's origin. Units: m.
    table : (k, 15) array
        Table of the Correction.
    increments, inside : (n, 3), (n,) array
        Output; unchanged for points without a pose.
    """
    index = locate(gps_time, 0.0, epochs, step, is_gap)
    for p in range(gps_time.size):
        i = index[p]
        if i < 0:
            continue
        weight = (gps_time[p] - epochs[i]) / (epochs[i + 1] - epochs[i])
        inside[p] = True
        increments[p, 0], increments[p, 1], increments[p, 2] = _increment(
            xyz[p, 0], xyz[p, 1], xyz[p, 2], weight, table[i], table[i + 1]
        )


@loop
def move_integers(
    xs: np.ndarray,
    ys: np.ndarray,
    zs: np.ndarray,
    scale: np.ndarray,
    offset: np.ndarray,
    gps_time: np.ndarray,
    constant: float,
    epochs: np.ndarray,
    step: float,
    is_gap: np.ndarray,
    table: np.ndarray,
    rest: np.ndarray,
) -> tuple[int, int]:
    """Move the scaled integers of points by integer increments, in place.

    Parameters
    ----------
    xs, ys, zs : (n,) int32 array
    scale, offset : (3,) array
        The offset is relative to the correction's origin. Units: m.
    gps_time, constant, epochs, step, is_gap, table
        See ``locate`` and ``fill_increments``.
    rest : (3,) array
        Added to points without a pose. Units: m.

    Returns
    -------
    outside, overflow : int
        Numbers of points without a pose, and of points that would not fit 32 bits and stay
        unchanged.
    """
    index = locate(gps_time, constant, epochs, step, is_gap)
    outside = 0
    overflow = 0
    limit = 2147483647.0
    for p in range(gps_time.size):
        i = index[p]
        if i < 0:
            outside += 1
            ex, ey, ez = rest
        else:
            weight = (gps_time[p] + constant - epochs[i]) / (epochs[i + 1] - epochs[i])
            ex, ey, ez = _increment(
                xs[p] * scale[0] + offset[0],
                ys[p] * scale[1] + offset[1],
                zs[p] * scale[2] + offset[2],
                weight,
                table[i],
                table[i + 1],
            )
        x = xs[p] + np.rint(ex / scale[0])
        y = ys[p] + np.rint(ey / scale[1])
        z = zs[p] + np.rint(ez / scale[2])
        if max(abs(x), abs(y), abs(z)) > limit:
            overflow += 1
            continue
        xs[p], ys[p], zs[p] = np.int32(x), np.int32(y), np.int32(z)
    return outside, overflow
