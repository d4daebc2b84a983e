"""Where one more control point helps most.

A target tells of the POS when it is observed, whatever its misclosure will be: the covariances of a
collocation hold no misclosure. So candidates are put into the equations, each as it would be seen,
and what they leave of the variance along the drive is worked out before anybody surveys them.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.collocation import Noise
from mlscorr.collocation.covariance import FAMILIES
from mlscorr.estimate.assembly import position_equations
from mlscorr.estimate.inputs import checked_inputs
from mlscorr.estimate.orders import affordable_order
from mlscorr.estimate.pos_error import Estimate
from mlscorr.estimate.posterior import Objective
from mlscorr.estimate.prediction import predict_under
from mlscorr.estimate.prior import position_prior
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.tied import sample
from mlscorr.pos import stated_sigma
from mlscorr.survey import Matched, Pos, Trajectory

PLACES = 3  # that are named: what one more visit to the site can survey
CANDIDATES = 20  # epochs that are tried, of even shares of the variance; twice as many gain < 1 %
EPOCHS = 200  # at which the drive's variance is worked out; twice as many give the same places
LIMIT = 2.0  # times the sigma beside control points: what counts as good along the drive


@dataclass(frozen=True)
class NextControl:
    """A place where one more control point helps, those before it in place.

    Parameters
    ----------
    gps_time : float
        When the drive passes it. Units: s.
    easting, northing : float
        Where the vehicle is then; the target belongs beside it. Units: m.
    sigma_before, sigma_after : float
        Of the corrected position there, 3D. Units: m.
    drive_before, drive_after : float
        Root mean square of that sigma along the drive. Units: m.
    share_before, share_after : float
        Of the drive, where the sigma is below the limit.
    limit : float
        Twice the sigma beside control points. Units: m.
    passes : int
        That come by and would see it.
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
    """What a correction will reach along a drive, before it is driven.

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
    """The places where one more control point each would help an estimate most, the best first.

    Parameters
    ----------
    estimate : Estimate
        Without control nobody knows how far away a target would be seen, and none is named.
    """
    if len(estimate.equations.names) == 0:
        return ()
    sigma = estimate.correction.corrected.position_sigma
    return _places(estimate.equations, estimate.families, np.linalg.norm(sigma, axis=1))


def predict_accuracy(trajectory: Trajectory, matched: Matched, pos: Pos) -> PlannedAccuracy:
    """Sigma of a correction along a planned drive, by the believed POS and the planned control.

    Parameters
    ----------
    trajectory : Trajectory
    matched : Matched
        Control points as they will be observed; their misclosures don't matter.
    pos : Pos

    Raises
    ------
    ValueError
        As ``estimate_correction`` does.
    """
    filled, _ = checked_inputs(trajectory, matched, pos, SETTINGS.order)
    equations = position_equations(filled, matched, pos, SETTINGS.order, position_prior)
    equations = equations.with_order(affordable_order(SETTINGS.order, equations))
    objective = Objective.of(equations)
    families = [
        (objective.parameters(family, objective.initial), 1 / len(FAMILIES)) for family in FAMILIES
    ]
    rows = _even_rows(filled)
    sigma = np.sqrt(_variance(equations, families, rows))
    along = np.interp(filled.gps_time, filled.gps_time[rows], sigma)
    return PlannedAccuracy(filled.gps_time[rows], sigma, _places(equations, families, along))


def _places(equations, families, sigma):
    """NextControl, at most PLACES, by the 3D sigma (n,) at all epochs of the trajectory."""
    families = [family for family in families if family[1] > SETTINGS.smallest_share]
    equations = _with_fewer_ties(equations)
    trajectory, regular = equations.trajectory, _even_rows(equations.trajectory)
    candidates = np.unique(_candidate_rows(regular, sigma))
    rows = np.union1d(regular, candidates)
    is_even, at = np.isin(rows, regular), np.searchsorted(rows, candidates)
    sights = [_passing(trajectory, equations, row) for row in candidates]
    complete, numbers = _with_candidates(equations, candidates, sights)
    chosen, places, n = np.arange(len(equations.names)), [], len(equations.names)
    square = sigma[rows] ** 2
    limit = LIMIT * float(np.median(np.interp(equations.observed, trajectory.gps_time, sigma)))
    gains = np.full(len(candidates), np.inf)
    for _ in range(min(PLACES, len(candidates))):
        now = _variance(complete.select(chosen), families, rows)
        best = _best(complete, families[:1], regular, chosen, [n + row for row in numbers], gains)
        chosen = np.append(chosen, n + numbers[best])
        after = square * _variance(complete.select(chosen), families, rows) / now
        roots = [np.sqrt(values) for values in (square, after)]
        drive = [float(np.sqrt(np.mean(root[is_even] ** 2))) for root in roots]
        share = [float(np.mean(root[is_even] < limit)) for root in roots]
        there = [float(root[at[best]]) for root in roots]
        row, passes = candidates[best], len(sights[best])
        why = _reason(complete.select(chosen[: -len(numbers[best])]), trajectory.gps_time[row],
                      drive, share, limit, passes)  # fmt: skip
        place = trajectory.position[row, :2].tolist()
        time = float(trajectory.gps_time[row])
        places.append(NextControl(time, *place, *there, *drive, *share, limit, passes, why))
        square = after
    return tuple(places)


def _with_fewer_ties(equations):
    """The equations with some of the ties, each as precise as all those that it stands for."""
    if equations.ties is None:
        return equations
    some = sample(equations)
    share = len(some.ties) / len(equations.ties)
    return replace(some, ties=replace(some.ties, variance=share * some.ties.variance))


def _best(complete, families, rows, chosen, candidates, gains):
    """Number of the candidate that lowers the variance along the drive most.

    What a candidate gains falls with those already chosen. So gains (c,) of the round before,
    which are replaced, are upper limits, and only the largest are worked out anew (Minoux 1978).
    """
    before = _variance(complete.select(chosen), families, rows).mean()
    is_new = np.zeros(len(candidates), bool)
    while not is_new[best := int(np.argmax(gains))]:
        kept = complete.select(np.append(chosen, candidates[best]))
        gains[best] = before - _variance(kept, families, rows).mean()
        is_new[best] = True
    return best


def _reason(equations, time, drive, share, limit, passes):
    """Why a target belongs at a time, in words."""
    order = np.argsort(equations.observed, kind="stable")
    times, names = equations.observed[order], equations.names[order]
    after = int(np.searchsorted(times, time))
    if 0 < after < len(times):
        where = (
            f"Between {names[after - 1]} ({time - times[after - 1]:.0f} s before) and "
            f"{names[after]} ({times[after] - time:.0f} s after)"
        )
    else:
        side, near = ("Before the first", 0) if after == 0 else ("After the last", -1)
        where = f"{side} control point, {names[near]}, by {abs(time - times[near]):.0f} s"
    often = f", seen by {passes} passes" if passes > 1 else ""
    return (
        f"{where}{often}: along the drive the 3D sigma falls from {1e3 * drive[0]:.1f} to "
        f"{1e3 * drive[1]:.1f} mm (RMS), and {100 * share[1]:.0f} % of it instead of "
        f"{100 * share[0]:.0f} % are below {1e3 * limit:.1f} mm."
    )


def _even_rows(trajectory):
    """Epochs, evenly over what was recorded."""
    number = min(len(trajectory), EPOCHS)
    return np.unique(np.linspace(0, len(trajectory) - 1, number).round().astype(int))


def _candidate_rows(regular, sigma):
    """Epochs at even shares of the variance along the drive: where it is large they are dense."""
    total = np.cumsum(sigma[regular] ** 2)
    shares = (np.arange(CANDIDATES) + 0.5) / CANDIDATES * total[-1]
    return np.interp(shares, total, regular).round().astype(int)


def _variance(equations, families, rows):
    """3D variance (k,) of the corrected position at epochs, averaged over the families. m^2."""
    total = sum(weight for _, weight in families)
    return sum(
        weight / total * np.einsum("qii->q", predict_under(equations, chosen, rows)[1][:, :3, :3])
        for chosen, weight in families
    )


def _passing(trajectory, equations, row):
    """Epochs at which a target beside one of them is passed, no farther than control was seen."""
    arms = equations.partials[: len(equations.names), :, 3:]
    sight = np.sqrt((arms**2).sum(axis=(1, 2)) / 2).max()  # |G|, by Phi(G)
    away = np.linalg.norm(trajectory.position - trajectory.position[row], axis=1)
    near = np.flatnonzero(away <= sight)
    is_new = (np.diff(near) > 1) | np.isin(near[:-1], _last_rows(trajectory))
    parts = np.split(near, np.flatnonzero(is_new) + 1)
    return [int(part[np.argmin(away[part])]) for part in parts]


def _last_rows(trajectory):
    return np.searchsorted(trajectory.gps_time, trajectory.passes[:, 1])


def _with_candidates(equations, candidates, sights):
    """Equations in which all candidates are observed, and each one's numbers among their rows.

    Each is as far and as well observed and surveyed as the median control point, on its side.
    """
    trajectory, n, noise = equations.trajectory, len(equations.names), equations.noise
    rows = np.concatenate(sights)
    number = np.repeat(np.arange(len(candidates)), [len(sight) for sight in sights])
    at = np.insert(np.arange(len(equations.gps_time)), n, np.zeros(len(rows), int))
    is_new = np.zeros(len(at), bool)
    is_new[n : n + len(rows)] = True
    turned = stated_sigma(trajectory, equations.pos, equations.observed).rotation.as_matrix()
    arm = np.median(turned.swapaxes(1, 2) @ equations.partials[:n, :, 3:] @ turned, axis=0)
    attitude = trajectory.attitude[rows].as_matrix()
    partials = np.concatenate(
        [np.tile(np.eye(3), (len(rows), 1, 1)), attitude @ arm @ attitude.swapaxes(1, 2)], axis=2
    )
    new = {
        "gps_time": trajectory.gps_time[rows],
        "misclosure": np.zeros((len(rows), 3)),
        "partials": partials,
    }
    if equations.mounting is not None:  # the first scanner's: the others lack something beside it
        new["mounting"] = np.zeros((len(rows), *equations.mounting.shape[1:]))
    columns = {name: np.insert(getattr(equations, name), n, new[name], axis=0) for name in new}
    own, group = noise.own[at], noise.group[at]
    # of the variances alone: medians of whole matrices, element by element, can be no covariance
    own[is_new] = np.diag(np.median(np.diagonal(noise.own[:n], axis1=1, axis2=2), axis=0))
    usual = np.median(noise.shared[noise.group[:n]], axis=0)
    group[is_new] = len(noise.shared) + number
    shared = np.vstack([noise.shared, np.tile(usual, (len(candidates), 1))])
    stated, beside = equations.stated.at(at), equations.stated_epochs.at(rows)
    for name in ("gps_time", "position", "angles"):
        getattr(stated, name)[is_new] = getattr(beside, name)
    order = np.arange(len(at))
    order[is_new] = len(at) + np.arange(len(rows))
    rotation = Rotation.concatenate([stated.rotation, beside.rotation])[order]
    complete = replace(
        equations,
        **columns,
        names=np.append(equations.names, [f"place {i + 1}" for i in number]),
        noise=Noise(own, group, shared),
        stated=replace(stated, rotation=rotation),
    )
    return complete, [np.flatnonzero(number == i) for i in range(len(candidates))]
