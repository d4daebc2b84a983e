"""What to measure next: which cheap addition to this survey tells the open causes apart.

Each addition is made of the survey's own geometry, turned, timed or placed anew, and judged by its
signatures alone: no data are needed.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.gap.assemble import assemble, sample_pulses
from mlscorr.gap.background import epochs
from mlscorr.gap.rows import Rows, background
from mlscorr.gap.separability import SAME, Separability, separability
from mlscorr.gap.signatures import signatures
from mlscorr.survey import ControlPoints, Trajectory

PAUSE = 60.0  # s between the passes
FASTER = 2.0  # times the speed
FARTHER = 2.0  # times the range
STOP = 60.0  # s
BESIDE = 8  # targets that a stop needs
WORTH = 0.05  # least fall of the squared correlation that makes an addition worth naming


@dataclass(frozen=True)
class Addition:
    """One addition: what to do, and the survey with it, whose residuals say nothing."""

    survey: str
    rows: Rows
    plan: object  # the Survey


@dataclass(frozen=True)
class NextData:
    """What to measure next, and why; squared correlations of the causes before and after."""

    survey: str
    why: str
    before: float
    after: float


def additions(rows, survey):
    """The cheap additions to a survey, as a tuple of Addition; those that it allows."""
    targets = np.flatnonzero(rows.channel == "target")
    made = [
        _another_pass("the same road in the opposite direction", rows, survey, backwards=True),
        _another_pass("the same road at twice the speed", rows, survey, faster=FASTER),
    ]
    if len(targets):
        items = np.unique(rows.item[targets])
        near = items[np.linspace(0, len(items) - 1, min(BESIDE, len(items))).astype(int)]
        made += [
            _more_targets("as many targets again, between the others", rows, survey, items),
            _more_targets(
                "as many targets again, at twice the distance", rows, survey, items, FARTHER
            ),
            _stop(f"a stop of {STOP:.0f} s beside {len(near)} targets", rows, survey, near),
        ]
    return tuple(made)


def next_data(rows, survey, kinds, effects, compared):
    """Which additions tell effects apart that this survey can't: a tuple of NextData, best first.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    kinds : iterable of Effect classes
        Those to consider.
    effects : tuple of str
        Open causes: the verdict's set, or a class. Events are no matter of geometry: left out.
    compared : Separability
        Of the survey as it is.
    """
    names = tuple(name for name in effects if name in compared.effects)
    if len(names) < 2:
        return ()
    wanted = [kind for kind in kinds if kind.name in names]
    before, found = alike(compared, names), []
    for one in additions(rows, survey):
        signs, _ = signatures(one.rows, one.plan, wanted)
        observed = epochs(one.rows, background(one.rows, one.plan))
        after = alike(separability(observed, signs), names)
        if before - after >= WORTH:
            why = (
                f"{' and '.join(names)}: squared correlation falls from {before:.2f} to "
                f"{after:.2f}" + ("." if after <= SAME else ", which is still one class.")
            )
            found.append(NextData(one.survey, why, before, after))
    return tuple(sorted(found, key=lambda one: one.after))


def alike(compared: Separability, names):
    """Largest squared correlation between parameters of different effects among names."""
    effects = np.array(compared.effects)
    mine = np.isin(effects, names)
    apart = mine[:, None] & mine & (effects[:, None] != effects)
    return float((compared.correlation[apart] ** 2).max(initial=0.0))


def _another_pass(name, rows, survey, backwards=False, faster=1.0):
    """All targets and surfaces once more, from the same places at other times."""
    once = rows.select(rows.metric & ~rows.two_times)
    trajectory = survey.trajectory
    first, last = trajectory.gps_time[[0, -1]]

    def again(time):
        elapsed = (last - time) if backwards else (time - first)
        return last + PAUSE + elapsed / faster

    turn = Rotation.from_euler("z", np.pi if backwards else 0.0)
    order = slice(None, None, -1 if backwards else 1)
    longer = _joined(
        trajectory,
        again(trajectory.gps_time)[order],
        trajectory.position[order],
        (trajectory.attitude * turn)[order],
        order,
    )
    wider = replace(survey, trajectory=longer)
    more = _placed(once, wider, again, lambda pulses: pulses.xyz, once.survey_item)
    return Addition(name, _both(rows, more), wider)


def _joined(trajectory, time, position, attitude, order):
    """A trajectory and epochs that follow it, with its own sigmas in an order."""
    sigmas = [
        None if values is None else np.vstack([values, values[order]])
        for values in (trajectory.position_sigma, trajectory.attitude_sigma)
    ]
    return Trajectory(
        np.append(trajectory.gps_time, time),
        np.vstack([trajectory.position, position]),
        Rotation.concatenate([trajectory.attitude, attitude]),
        *sigmas,
    )


def _more_targets(name, rows, survey, items, farther=1.0):
    """Targets like the items, half an interval later, seen under the same angles."""
    once = rows.select((rows.channel == "target") & np.isin(rows.item, items))
    trajectory = survey.trajectory
    seen = np.sort(np.unique(once.gps_time))
    later = 0.5 * np.median(np.diff(seen)) if len(seen) > 1 else 1.0

    def again(time):
        moved = time + later
        same = trajectory.segment(moved) == trajectory.segment(time)
        back = np.maximum(time - later, trajectory.gps_time[0])
        return np.where(same & (trajectory.segment(moved) >= 0), moved, back)

    return _new_targets(name, rows, survey, once, again, farther)


def _stop(name, rows, survey, items):
    """The items' targets set up around one place, where the vehicle stands."""
    trajectory = survey.trajectory
    once = rows.select((rows.channel == "target") & np.isin(rows.item, items))
    middle = trajectory.at(np.median(trajectory.gps_time[trajectory.segment(
        trajectory.gps_time) == 0]))  # fmt: skip
    step = np.median(np.diff(trajectory.gps_time))
    start = trajectory.gps_time[-1] + PAUSE
    time = start + np.arange(0.0, STOP, step)
    n = len(time)
    nearest = np.full(n, np.argmin(np.abs(trajectory.gps_time - middle.gps_time[0])))
    longer = _joined(
        trajectory, time, trajectory.position[nearest], trajectory.attitude[nearest], nearest
    )
    low, high = once.gps_time.min(), once.gps_time.max()

    def again(seen):
        share = (seen - low) / max(high - low, 1.0)  # pulses come before and after their target
        return start + np.clip(share, 0.0, 1.0) * (time[-1] - start)

    return _new_targets(name, rows, replace(survey, trajectory=longer), once, again, 1.0)


def _new_targets(name, rows, survey, once, again, farther):
    """Rows of new targets, which stand to the vehicle as those of `once` did."""
    trajectory, arm = survey.trajectory, np.zeros(3)
    if survey.mounting is not None:
        arm = survey.mounting.lever_arm

    def place(pulses):
        then, now = trajectory.at(pulses.gps_time), trajectory.at(again(pulses.gps_time))
        body = then.attitude.inv().apply(pulses.xyz - then.position)
        return now.position + now.attitude.apply(arm + farther * (body - arm))

    items, number = np.unique(once.item, return_inverse=True)
    old = once.survey_item[np.unique(number, return_index=True)[1]]
    known, targets = survey.control + survey.check, rows.targets
    added = ControlPoints(
        tuple(f"new {i + 1}" for i in range(len(items))),
        targets.position[old], targets.sigma[old], tuple(targets.kind[i] for i in old),
        targets.size[old], targets.normal[old],
    )  # fmt: skip
    wider = replace(survey, check=survey.check + added)
    more = _placed(once, wider, again, place, len(known) + number)
    return Addition(name, _both(replace(rows, targets=wider.control + wider.check), more), wider)


def _placed(once, survey, again, place, survey_item):
    """Rows like those of `once` at other times, with pulses at other places."""
    old = once.pulses
    pulses = sample_pulses(
        survey, old.item, old.weight, place(old), again(old.gps_time), old.intensity, old.normal
    )
    item, number = np.unique(once.item, return_inverse=True)
    order = np.argsort(pulses.item, kind="stable")
    first = order[np.searchsorted(pulses.item[order], item)]
    time = again(once.gps_time)
    factor = once.survey_factor
    return assemble(
        survey, once.channel, once.item, time, pulses.xyz[first][number], once.direction,
        np.zeros(len(once)), once.noise, once.points, pulses,
        survey.trajectory.segment(time) + 1, survey_item=survey_item, survey_factor=factor,
        believed=once.believed,
    )  # fmt: skip


def _both(rows, more):
    together = Rows.concatenate([replace(rows, targets=more.targets), more])
    return replace(together, reference=more.reference)
