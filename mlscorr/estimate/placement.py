"""Best positions of additional control points.

A target informs about the POS at the time of its observation, whatever its misclosure will be: the
covariances of a collocation do not depend on misclosures. So each candidate is treated as observed,
and the remaining variance along the drive is computed before the target is surveyed.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.collocation import FAMILIES, Noise, SparseRows, covariance_given
from mlscorr.estimate._prediction import predict_under
from mlscorr.estimate.adjustment import Adjustment, position_adjustment
from mlscorr.estimate.factors import TIE
from mlscorr.estimate.inputs import checked_inputs
from mlscorr.estimate.pos_error import Estimate
from mlscorr.estimate.posterior import Objective, position_prior
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.tied import sample
from mlscorr.pos import SignalParameters, pose_signals
from mlscorr.survey import Matched, Pos, Trajectory
from mlscorr.wording import percent

PLACES = 3  # number of named places: enough for one more visit to the site
CANDIDATES = 20  # epochs that are tried, of even shares of the variance; twice as many gain < 1 %
EPOCHS = 200  # at which the drive's variance is computed; twice as many give the same places
LIMIT = 2.0  # times the sigma near control points: limit of a good sigma along the drive


@dataclass(frozen=True)
class NextControl:
    """Proposed position of one more control point, given those before it.

    Parameters
    ----------
    gps_time : float
        Time at which the drive passes it. Units: s.
    easting, northing : float
        Position of the vehicle then; the target belongs next to it. Units: m.
    sigma_before, sigma_after : float
        Of the corrected position there, 3D. Units: m.
    drive_before, drive_after : float
        Root mean square of that sigma along the drive. Units: m.
    share_before, share_after : float
        Fraction of the drive with a sigma below the limit.
    limit : float
        Twice the sigma near control points. Units: m.
    passes : int
        Number of passes that would observe it.
    why : str
    """

    gps_time: float
    easting: float
    northing: float
    sigma_before: float
    sigma_after: float
    drive_before: float
    drive_after: float
    share_before: float
    share_after: float
    limit: float
    passes: int
    why: str

    def document(self) -> dict:
        """The entry of ``next_control[]``."""
        return asdict(self)


@dataclass(frozen=True)
class PlannedAccuracy:
    """Predicted accuracy of a correction along a planned drive.

    Parameters
    ----------
    gps_time : (k,) array
        Units: s.
    sigma : (k,) array
        Of the corrected position, 3D. Units: m.
    next_control : tuple of NextControl
    """

    gps_time: np.ndarray
    sigma: np.ndarray
    next_control: tuple[NextControl, ...]


def place_control(estimate: Estimate) -> tuple[NextControl, ...]:
    """Places at which one more control point each would improve an estimate most, best first.

    Parameters
    ----------
    estimate : Estimate
        Without control the distance to targets is unknown, and the result is empty.
    """
    if len(estimate.adjustment.names) == 0:
        return ()
    sigma = estimate.correction.corrected.position_sigma
    return _places(estimate.adjustment, estimate.families, np.linalg.norm(sigma, axis=1))


def predict_accuracy(trajectory: Trajectory, matched: Matched, pos: Pos) -> PlannedAccuracy:
    """Predict sigmas of a correction along a planned drive from the assumed POS and control.

    Parameters
    ----------
    trajectory : Trajectory
    matched : Matched
        Control points as they will be observed; their misclosures don't matter.
    pos : Pos

    Raises
    ------
    ValueError
        See ``estimate_correction``.
    """
    filled, _ = checked_inputs(trajectory, matched, pos, SETTINGS.order)
    adjustment = position_adjustment(filled, matched, pos, SETTINGS.order, position_prior)
    objective = Objective.of(adjustment)
    families = [
        (objective.parameters(family, objective.initial), 1 / len(FAMILIES)) for family in FAMILIES
    ]
    rows = _even_rows(filled)
    sigma = np.sqrt(_variance(adjustment, families, rows))
    along = np.interp(filled.gps_time, filled.gps_time[rows], sigma)
    return PlannedAccuracy(filled.gps_time[rows], sigma, _places(adjustment, families, along))


@threadpool_limits.wrap(limits=1, user_api="blas")  # more threads would change the last digits
def _places(adjustment, families, sigma):
    """NextControl, at most PLACES, by the 3D sigma (n,) at all epochs of the trajectory."""
    families = [family for family in families if family[1] > SETTINGS.smallest_share]
    trajectory = adjustment.trajectory
    regular = _even_rows(adjustment.trajectory)
    candidates = np.unique(_candidate_rows(trajectory, regular, sigma))
    rows = np.union1d(regular, candidates)
    is_even = np.isin(rows, regular)
    at = np.searchsorted(rows, candidates)
    sights = [_passing(trajectory, adjustment, row) for row in candidates]
    outlook = Outlook.of(adjustment, families, rows, sights)
    observed = adjustment.observed
    names = adjustment.names
    places = []
    taken: list[int] = []
    square = sigma[rows] ** 2
    limit = LIMIT * float(np.median(np.interp(observed, trajectory.gps_time, sigma)))
    for number in range(1, min(PLACES, len(candidates)) + 1):
        best = outlook.best(is_even)
        taken.append(best)
        observed = np.append(observed, trajectory.gps_time[sights[best]])
        span = float(observed.min()), float(observed.max())
        if span == adjustment.span:
            chosen = outlook.with_target(best)
        else:  # the trend of a correction with that target extends as far
            adjustment = replace(adjustment, trend_span=span)
            chosen = Outlook.of(adjustment, families, rows, sights)
            for target in taken:
                chosen = chosen.with_target(target)
        after = square * chosen.variance / outlook.variance
        roots = [np.sqrt(values) for values in (square, after)]
        drive = [float(np.sqrt(np.mean(root[is_even] ** 2))) for root in roots]
        share = [float(np.mean(root[is_even] < limit)) for root in roots]
        there = [float(root[at[best]]) for root in roots]
        row = candidates[best]
        passes = len(sights[best])
        place = trajectory.position[row, :2].tolist()
        time = float(trajectory.gps_time[row])
        why = _reason(observed[:-passes], names, time, drive, share, limit, passes)
        places.append(NextControl(time, *place, *there, *drive, *share, limit, passes, why))
        names = np.append(names, [f"place {number}"] * passes)
        square = after
        outlook = chosen
    return tuple(places)


def _reason(observed, names, time, drive, share, limit, passes):
    """Reason for a target at a time, in words, given the observed targets' names."""
    order = np.argsort(observed, kind="stable")
    times = observed[order]
    names = names[order]
    after = int(np.searchsorted(times, time))
    if 0 < after < len(times):
        where = (
            f"Between {names[after - 1]} ({time - times[after - 1]:.0f} s before) and "
            f"{names[after]} ({times[after] - time:.0f} s after)"
        )
    elif after == 0:
        where = f"Before the first control point, {names[0]}, by {times[0] - time:.0f} s"
    else:
        where = f"After the last control point, {names[-1]}, by {time - times[-1]:.0f} s"
    often = f", seen by {passes} passes" if passes > 1 else ""
    if share[0] == share[1]:
        before = "as before"
    else:
        before = f"up from {percent(share[0], 1)}"
    return (
        f"{where}{often}: the 3D sigma along the drive decreases from {1e3 * drive[0]:.1f} to "
        f"{1e3 * drive[1]:.1f} mm (RMS). {percent(share[1], 1)} of the drive, {before}, then has "
        f"less than {1e3 * limit:.1f} mm."
    )


def _even_rows(trajectory):
    """Epochs, evenly spaced over the scanned times."""
    scanned = trajectory.scanned_rows
    number = min(len(scanned), EPOCHS)
    return scanned[np.unique(np.linspace(0, len(scanned) - 1, number).round().astype(int))]


def _candidate_rows(trajectory, regular, sigma):
    """Epochs at equal fractions of the variance along the drive, dense where it is large."""
    total = np.cumsum(sigma[regular] ** 2)
    shares = (np.arange(CANDIDATES) + 0.5) / CANDIDATES * total[-1]
    scanned = trajectory.scanned_rows
    return scanned[np.interp(shares, total, np.searchsorted(scanned, regular)).round().astype(int)]


def _variance(adjustment, families, rows):
    """3D variance (k,) of the corrected position at epochs, averaged over the families. m^2."""
    total = sum(weight for _, weight in families)
    return sum(
        weight / total * np.einsum("qii->q", predict_under(adjustment, chosen, rows)[1][:, :3, :3])
        for chosen, weight in families
    )


def _passing(trajectory, adjustment, row):
    """Epochs at which a target near one of them is passed, no farther than observed control."""
    arms = adjustment.targets.partials[:, 0, :, 3:]
    sight = np.sqrt((arms**2).sum(axis=(1, 2)) / 2).max()  # |G|, by Phi(G)
    away = np.linalg.norm(trajectory.position - trajectory.position[row], axis=1)
    scanned = trajectory.scanned_rows
    near = scanned[away[scanned] <= sight]
    ends = np.searchsorted(trajectory.gps_time, trajectory.passes[:, 1])
    is_new = (np.diff(near) > 1) | np.isin(near[:-1], ends)
    parts = np.split(near, np.flatnonzero(is_new) + 1)
    return [int(part[np.argmin(away[part])]) for part in parts]


@dataclass(frozen=True)
class Outlook:
    """The corrected position at some epochs, and candidate targets.

    Parameters
    ----------
    weights : (f,) array
        Of families of covariances; their sum is 1.
    covariances : (f, q, q) array
        Of the residual position errors at k epochs, 3 rows each, and of target observations. Units:
        m^2.
    epochs : int
        k.
    targets : tuple of (r,) int array
        Rows of each target.
    noise : tuple of (r, r) array
        Covariance of its survey and extraction. Units: m^2.
    """

    weights: np.ndarray
    covariances: np.ndarray
    epochs: int
    targets: tuple[np.ndarray, ...]
    noise: tuple[np.ndarray, ...]

    @classmethod
    def of(
        cls,
        adjustment: Adjustment,
        families: list[tuple[SignalParameters, float]],
        rows: np.ndarray,
        sights: list[list[int]],
    ) -> Outlook:
        """Outlook before any candidate is observed.

        Parameters
        ----------
        adjustment : Adjustment
        families : list of (SignalParameters, weight)
        rows : (k,) int array
            Of the trajectory's epochs.
        sights : list of lists of int
            Epochs at which each target would be observed: at the distance, side and accuracy of the
            median control point.
        """
        thinned = with_fewer_rows(adjustment)
        at_target = np.concatenate(sights)
        still = np.tile(np.eye(3, 6), (len(rows), 1, 1))
        moved = np.concatenate([still, _target_partials(adjustment, at_target)])
        at = np.concatenate([rows, at_target])
        weights = np.array([weight for _, weight in families])
        shown = [_shown(adjustment, chosen, at, moved) for chosen, _ in families]
        covariances = np.stack(
            [
                covariance_given(thinned.rows(chosen), [part], thinned.prior_rows(chosen))
                for (chosen, _), part in zip(families, shown, strict=True)
            ]
        )
        ends = 3 * (len(rows) + np.cumsum([len(sight) for sight in sights]))
        targets = [np.arange(end - 3 * len(s), end) for end, s in zip(ends, sights, strict=True)]
        noise = [_target_noise(adjustment.targets.noise, len(s)) for s in sights]
        return cls(weights / weights.sum(), covariances, len(rows), tuple(targets), tuple(noise))

    @property
    def variance(self) -> np.ndarray:
        """3D variance (k,) of the corrected position at the epochs. Units: m^2."""
        diagonal = np.einsum("f,fii->i", self.weights, self.covariances)
        return diagonal[: 3 * self.epochs].reshape(-1, 3).sum(axis=1)

    def with_target(self, number: int) -> Outlook:
        """The same with a target observed (Eq. 15, for one more observation).

        Parameters
        ----------
        number : int
            Of the target.
        """
        columns = self.covariances[:, :, self.targets[number]]
        known = np.linalg.solve(self._observed(number), columns.swapaxes(1, 2))
        return replace(self, covariances=self.covariances - columns @ known)

    def best(self, counted: np.ndarray) -> int:
        """Number of the target that reduces the variance most, by the first family.

        Parameters
        ----------
        counted : (k,) bool array
            Epochs that count.
        """
        rows = np.repeat(counted, 3).nonzero()[0]
        gains = []
        for number, columns in enumerate(self.targets):
            cross = self.covariances[0][np.ix_(rows, columns)]
            gains.append(np.sum(cross * np.linalg.solve(self._observed(number)[0], cross.T).T))
        return int(np.argmax(gains))

    def _observed(self, number):
        """Covariances (f, r, r) of a target's observations."""
        rows = self.targets[number]
        return self.covariances[:, rows[:, None], rows] + self.noise[number]


def with_fewer_rows(adjustment: Adjustment) -> Adjustment:
    """The equations with some of the ties and targets, each weighted for those that it represents.

    Parameters
    ----------
    adjustment : Adjustment
    """
    room = SETTINGS.dense_rows
    if adjustment.ties is not None:
        ties = sample(adjustment).ties
        share = len(ties) / len(adjustment.ties)
        adjustment = adjustment.with_factor(ties.scaled(share))
        room -= len(ties)
    others = sum(f.misclosure.size for f in adjustment.observing if f.kind != TIE)
    step = -(-others // max(room, 1))
    if step == 1:
        return adjustment
    targets = adjustment.select(np.arange(0, len(adjustment.names), step)).targets
    noise = targets.noise
    thinned = Noise(noise.own / step, noise.group, noise.shared / np.sqrt(step))
    return adjustment.with_factor(replace(targets, noise=thinned))


def _shown(adjustment, parameters, rows, partials):
    """SparseRows of the corrected positions of points with partials (n, 3, 6) at epochs."""
    times = adjustment.trajectory.gps_time[rows]
    n = len(rows)
    noise = Noise(np.zeros((n, 3, 3)))
    design = adjustment.pose_design(times)[:, :3]
    signals = pose_signals(adjustment.errors.epochs.at(rows), parameters, partials)
    return SparseRows(times[:, None], np.zeros((n, 3)), noise, design, signals)


def _target_partials(adjustment, rows):
    """Partials (n, 3, 6) of targets observed like the median control point, at epochs."""
    targets = adjustment.targets
    turned = targets.stated.rotation.as_matrix()
    arms = turned.swapaxes(1, 2) @ targets.partials[:, 0, :, 3:] @ turned
    arm = np.median(arms, axis=0)
    attitude = adjustment.trajectory.attitude[rows].as_matrix()
    still = np.tile(np.eye(3), (len(rows), 1, 1))
    return np.concatenate([still, attitude @ arm @ attitude.swapaxes(1, 2)], axis=2)


def _target_noise(noise, sights):
    """Covariance of a target's observations at some sights, by medians of the control points'.

    Of their variances alone: element-wise medians of whole matrices may not be covariances.
    """
    own = np.diag(np.median(np.diagonal(noise.own, axis1=1, axis2=2), axis=0))
    usual = np.median(noise.shared[noise.group], axis=0)[None]
    return Noise(np.tile(own, (sights, 1, 1)), np.zeros(sights, int), usual).matrix
