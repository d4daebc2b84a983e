"""Next measurements: low-cost additions to this survey that separate the open causes.

Each addition is derived from the survey's own geometry, with other headings, times or positions,
and judged only by its signatures, without data.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects import Effect, lowered, titles
from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.gap.evidence import Observations, Separability, compare_signatures
from mlscorr.gap.plan._settings import SETTINGS
from mlscorr.gap.residuals import Rows, assemble, background, sample_pulses
from mlscorr.gap.signatures import signatures
from mlscorr.survey import ControlPoints, Survey, Trajectory


@dataclass(frozen=True)
class NextData:
    """Next measurement, and its reason.

    Parameters
    ----------
    survey, why : str
    before, after : float, optional
        Squared correlation of the causes that it separates.
    """

    survey: str
    why: str
    before: float | None = None
    after: float | None = None


def additions(rows: Rows, survey: Survey) -> dict[str, tuple[Rows, Survey]]:
    """Make the low-cost additions for a survey: description, and rows and survey with it.

    The residuals of these rows have no meaning.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    """
    targets = np.flatnonzero(rows.channel == "target")
    made = {
        "the same road in the opposite direction": _another_pass(rows, survey, backwards=True),
        "the same road at twice the speed": _another_pass(rows, survey, faster=SETTINGS.factor),
    }
    if len(targets):
        items = np.unique(rows.item[targets])
        count = min(SETTINGS.stop_targets, len(items))
        near = items[np.linspace(0, len(items) - 1, count).astype(int)]
        stop = f"a stop of {SETTINGS.pass_interval:.0f} s next to {len(near)} targets"
        far_targets = _more_targets(rows, survey, items, SETTINGS.factor)
        made |= {
            "twice as many targets, the new ones between the others": _more_targets(
                rows, survey, items
            ),
            "twice as many targets, the new ones at twice the distance": far_targets,
            stop: _stop(rows, survey, near),
        }
    return made


def next_data(
    rows: Rows,
    survey: Survey,
    kinds: Iterable[type[Effect]],
    effects: Iterable[str],
    compared: Separability,
) -> tuple[NextData, ...]:
    """Find additions that separate effects that this survey cannot separate, best first.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    kinds : iterable of Effect classes
        Classes to consider.
    effects : tuple of str
        Open causes: the verdict's set, or a class. Events do not depend on geometry and are
        omitted.
    compared : Separability
        Separability of the present survey.
    """
    names = tuple(name for name in effects if name in compared.effects)
    if len(names) < 2:
        return ()
    kinds = [kind for kind in kinds if kind.name in names]
    before = _largest(compared, names)
    data = []
    for name, added in additions(rows, survey).items():
        signs, _ = signatures(*added, kinds)
        observed = Observations.of(added[0], background(*added))
        after = _largest(compare_signatures(observed, signs), names)
        if before - after >= SETTINGS.smallest_fall:
            end = "."
            if after > INFERENCE.same:
                end = ", which is still not separable."
            why = (
                f"the squared correlation of {lowered(titles(names))} decreases from "
                f"{before:.2f} to {after:.2f}{end}"
            )
            data.append(NextData(name, why, before, after))
    return tuple(sorted(data, key=lambda planned: planned.after or 0.0))


def _largest(compared, names):
    """Largest squared correlation between parameters of different effects among names."""
    effects = np.array(compared.effects)
    named = np.isin(effects, names)
    is_other = named[:, None] & named & (effects[:, None] != effects)
    return float((compared.correlation[is_other] ** 2).max(initial=0.0))


def _another_pass(rows, survey, backwards=False, faster=1.0):
    """All targets and surfaces again, from the same positions at other times."""
    once = rows.select(rows.metric & ~rows.two_times)
    trajectory = survey.trajectory
    first, last = trajectory.gps_time[[0, -1]]

    def anew(time):
        elapsed = (last - time) if backwards else (time - first)
        return last + SETTINGS.pass_interval + elapsed / faster

    turn = Rotation.from_euler("z", np.pi if backwards else 0.0)
    order = slice(None, None, -1 if backwards else 1)
    time = anew(trajectory.gps_time)[order]
    attitude = (trajectory.attitude * turn)[order]
    longer = _followed(trajectory, order, time, attitude=attitude)
    wider = replace(survey, trajectory=longer)
    more = _placed(once, wider, anew, lambda pulses: pulses.xyz, once.survey_item)
    return _both(rows, more), wider


def _followed(trajectory, rows, time, **changed):
    """Trajectory with some of its epochs repeated at other times, in a separate session."""
    more = replace(trajectory.select(rows), gps_time=time, **changed)
    if more.session is not None:
        more = replace(more, session=trajectory.session.max() + 1 + more.session)
    return Trajectory.concatenate([trajectory, more])


def _more_targets(rows, survey, items, farther=1.0):
    """Targets like the items, half an interval later or earlier, observed at the same angles."""
    once = rows.select((rows.channel == "target") & np.isin(rows.item, items))
    trajectory = survey.trajectory
    visits = np.sort(np.unique(once.gps_time))
    if len(visits) > 1:
        later = 0.5 * np.median(np.diff(visits))
    else:
        later = 1.0

    def anew(time):
        moved = time
        own = trajectory.segment(time)
        for other in (time - later, time + later):
            moved = np.where(trajectory.segment(other) == own, other, moved)
        return moved

    return _new_targets(rows, survey, once, anew, farther)


def _stop(rows, survey, items):
    """Targets of the items set up around one position, where the vehicle stops."""
    trajectory = survey.trajectory
    once = rows.select((rows.channel == "target") & np.isin(rows.item, items))
    middle = trajectory.at(
        np.median(trajectory.gps_time[trajectory.segment(trajectory.gps_time) == 0])
    )
    step = np.median(np.diff(trajectory.gps_time))
    start = trajectory.gps_time[-1] + SETTINGS.pass_interval
    time = start + np.arange(0.0, SETTINGS.pass_interval, step)
    n = len(time)
    nearest = np.full(n, np.argmin(np.abs(trajectory.gps_time - middle.gps_time[0])))
    longer = _followed(trajectory, nearest, time)
    low = once.gps_time.min()
    high = once.gps_time.max()

    def anew(recorded):
        share = (recorded - low) / max(high - low, 1.0)  # pulses before and after their target
        return start + np.clip(share, 0.0, 1.0) * (time[-1] - start)

    return _new_targets(rows, replace(survey, trajectory=longer), once, anew, 1.0)


def _new_targets(rows, survey, once, anew, farther):
    """Rows of new targets, with the same geometry to the vehicle as those of `once`."""
    trajectory = survey.trajectory
    arm = np.zeros(3)
    if survey.mounting is not None:
        arm = survey.mounting.lever_arm

    def place(pulses):
        then = trajectory.at(pulses.gps_time)
        now = trajectory.at(anew(pulses.gps_time))
        body = then.attitude.inv().apply(pulses.xyz - then.position)
        return now.position + now.attitude.apply(arm + farther * (body - arm))

    items, number = np.unique(once.item, return_inverse=True)
    old = once.survey_item[np.unique(number, return_index=True)[1]]
    known = survey.surveyed
    targets = rows.targets
    added = ControlPoints(
        tuple(f"new {i + 1}" for i in range(len(items))),
        targets.position[old],
        targets.sigma[old],
        tuple(targets.kind[i] for i in old),
        targets.size[old],
        targets.normal[old],
    )
    wider = replace(survey, check=survey.check + added)
    more = _placed(once, wider, anew, place, len(known) + number)
    return _both(replace(rows, targets=wider.surveyed), more), wider


def _placed(once, survey, anew, place, survey_item):
    """Rows like those of `once` at other times, with pulses at other positions."""
    old = once.pulses
    pulses = sample_pulses(
        survey, old.item, old.weight, place(old), anew(old.gps_time), old.intensity, old.normal
    )
    item, number = np.unique(once.item, return_inverse=True)
    order = np.argsort(pulses.item, kind="stable")
    first = order[np.searchsorted(pulses.item[order], item)]
    time = anew(once.gps_time)
    factor = once.survey_factor
    return assemble(
        survey,
        once.channel,
        once.item,
        time,
        pulses.xyz[first][number],
        once.direction,
        np.zeros(len(once)),
        once.noise,
        once.points,
        pulses,
        survey.trajectory.segment(time) + 1,
        survey_item=survey_item,
        survey_factor=factor,
        assumed=once.assumed,
    )


def _both(rows, more):
    both = Rows.concatenate([replace(rows, targets=more.targets), more])
    return replace(both, reference=more.reference)
