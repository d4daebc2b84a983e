"""Rows of a planned survey, from its geometry only."""

from collections.abc import Iterable

import numpy as np

from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.gap.evidence import Observations
from mlscorr.gap.plan._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import Rows, assemble, sample_pulses, scanner_origin
from mlscorr.gap.signatures import SETTINGS as SIGNATURES
from mlscorr.gap.signatures import Signature
from mlscorr.simulate import SceneScenario
from mlscorr.simulate.scene import read_mesh, sees
from mlscorr.survey import Survey, SurveyFileError
from mlscorr.targets import SETTINGS as TARGETS


def planned_rows(survey: Survey) -> Rows:
    """Make the expected rows of targets, and of a reference surface if there is one.

    Each is observed once per pass, when the scan plane sweeps over it close enough; residuals are
    zero. The cloud is not read.

    Parameters
    ----------
    survey : Survey
        With a mounting, and a planned or recorded trajectory.

    Raises
    ------
    ValueError
        If there is no mounting, or nothing will be observed.
    """
    if survey.mounting is None:
        raise SurveyFileError(
            f"{survey.path} has no [mounting], so the directions of the beams are unknown. Set "
            "lever_arm and boresight as planned."
        )
    targets = survey.surveyed
    parts = [_targets(survey, targets)]
    if survey.reference is not None:
        parts.append(_facets(survey, np.random.default_rng(0)))
    parts = [part for part in parts if len(part)]
    if not parts and not len(targets) and survey.reference is None:
        is_named = any(file.what == "control" for file in survey.inputs)
        raise (ValueError if is_named else SurveyFileError)(
            f"{survey.path} has neither targets nor a [scene] reference, so there is nothing to "
            "plan with. Add [control] with the points as planned."
        )
    if not parts:
        raise ValueError(
            f"None of {len(targets)} targets comes within {SETTINGS.farthest_target:.0f} m of "
            f"the scanner on this trajectory, and {'the' if survey.reference else 'no'} [scene] "
            f"reference {'is out of sight' if survey.reference else 'is given'}. Check that "
            "control and trajectory are in the same CRS."
        )
    return Rows.concatenate(parts)


def _targets(survey, targets):
    which, time, number = _sweeps(survey, targets.position)
    n = len(which)
    item = np.arange(len(which))
    place = targets.position[which]
    sight = scanner_origin(survey, time) - place
    facing = sight / np.linalg.norm(sight, axis=1, keepdims=True)
    normal = np.where(np.isfinite(targets.normal[which]), targets.normal[which], facing)
    brightness = np.full(n, SETTINGS.brightness)
    pulses = sample_pulses(survey, item, np.ones(n), place, time, brightness, normal)
    return assemble(
        survey,
        "target",
        np.repeat(item, 3),
        np.repeat(time, 3),
        np.repeat(place, 3, axis=0),
        np.tile(np.eye(3), (n, 1)),
        np.zeros(3 * n),
        np.full(3 * n, SETTINGS.centre_sigma**2),
        np.full(3 * n, SETTINGS.facet_points),
        pulses,
        np.repeat(number, 3),
        survey_item=np.repeat(which, 3),
        survey_factor=(targets.sigma[which][:, :, None] * np.eye(3)).reshape(-1, 3),
    )


def _facets(survey, rng):
    """Rows of visible facets of the reference, sampled by area."""
    origin = np.round(survey.trajectory.position.mean(axis=0))
    mesh = read_mesh(SceneScenario(kind="mesh", file=survey.reference), origin)
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(area), 4 * SETTINGS.facets, p=area / area.sum())
    u, v = np.sort(rng.random((2, len(chosen))), axis=0)
    place = u[:, None] * a[chosen] + (v - u)[:, None] * b[chosen] + (1 - v)[:, None] * c[chosen]
    which, time, number = _sweeps(survey, place + origin)
    place = place[which] + origin
    normal = (cross / area[:, None])[chosen][which]
    sight = scanner_origin(survey, time) - place
    away = np.linalg.norm(sight, axis=1)
    slant = np.einsum("ni,ni->n", normal, sight) / away
    start = place + sight / away[:, None] * OBSERVE.roughest
    visible = sees(mesh.caster, start - origin, start + sight * 0.99 - origin)
    visible &= np.abs(slant) >= TARGETS.least_crossing_sine
    rows = np.flatnonzero(visible)[: SETTINGS.facets]
    n = len(rows)
    item = np.arange(len(rows))
    normal = normal[rows] * np.sign(slant[rows])[:, None]
    noise = OBSERVE.surface_sigma**2 + survey.scanner.range_noise**2 / SETTINGS.facet_points
    place = place[rows]
    time = time[rows]
    brightness = np.full(n, SETTINGS.brightness)
    pulses = sample_pulses(survey, item, np.ones(n), place, time, brightness, normal)
    return assemble(
        survey,
        "surface",
        item,
        time,
        place,
        normal,
        np.zeros(n),
        np.full(n, noise),
        np.full(n, SETTINGS.facet_points),
        pulses,
        number[rows],
    )


def _sweeps(survey, place):
    """Index, time and pass, (n,) each, of the scan plane's nearest sweep over positions (k, 3).

    Index, time and pass, (n,) each.
    """
    trajectory = survey.trajectory
    times = []
    origin = trajectory.position.mean(axis=0)
    for number, span in enumerate(trajectory.passes, start=1):
        time = np.linspace(*span, max(2, int((span[1] - span[0]) / SIGNATURES.epoch_step)))
        pose = trajectory.at(time)
        axis = pose.attitude.apply(survey.mounting.boresight.apply([0.0, 0.0, 1.0]))
        scanner = pose.position + pose.attitude.apply(survey.mounting.lever_arm) - origin
        local = place - origin
        out = local @ axis.T - np.einsum("ei,ei->e", axis, scanner)
        square = (local**2).sum(1)[:, None] - 2 * local @ scanner.T + (scanner**2).sum(1)
        crossed = (out[:, :-1] * out[:, 1:] <= 0) & (square[:, :-1] <= SETTINGS.farthest_target**2)
        nearest = np.argmin(np.where(crossed, square[:, :-1], np.inf), axis=1)
        k = np.flatnonzero(crossed[np.arange(len(place)), nearest])
        i = nearest[k]
        a = out[k, i]
        b = out[k, i + 1]
        share = np.where(a != b, a / np.where(a != b, a - b, 1.0), 0.0)
        times.append((k, time[i] + share * (time[i + 1] - time[i]), np.full(len(k), number)))
    return tuple(np.concatenate(parts) for parts in zip(*times, strict=True))


def event_sizes(
    observed: Observations, signs: Iterable[Signature]
) -> dict[str, tuple[tuple[str, ...], tuple[str, ...], np.ndarray]]:
    """Minimal detectable biases of events, as the median over their bank.

    Those of other effects are in Separability.

    Parameters
    ----------
    observed : Observations
    signs : iterable of Signature

    Returns
    -------
    dict of (names of p parameters, units, (p,) array)
        By name of the event.
    """
    whitener = observed.whitener()
    events = {}
    for sign in signs:
        if sign.is_noise or not (sign.kind.moment() or sign.kind.is_on_target()):
            continue
        information = whitener.whiten(observed.columns(sign.jacobian)).squares
        size = INFERENCE.detectable / np.sqrt(np.maximum(information, 1e-300))
        events.setdefault(sign.name, (sign.parameters, sign.units, []))[2].append(size)
    return {name: (p, u, np.median(sizes, axis=0)) for name, (p, u, sizes) in events.items()}
