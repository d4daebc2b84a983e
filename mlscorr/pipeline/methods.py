"""Methods compared by ``compare``, in order of their freedom."""

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from difflib import get_close_matches
from functools import partial

from mlscorr import baselines
from mlscorr.estimate import SETTINGS as ESTIMATE
from mlscorr.estimate import estimate_correction
from mlscorr.pipeline.estimation import estimate_together
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import Survey, TieFeatures
from mlscorr.targets import Candidates


@dataclass(frozen=True)
class Observed:
    """Input of the methods besides the control points.

    Parameters
    ----------
    survey : Survey
    candidates : Candidates
        Points near the targets.
    features : TieFeatures or None
        Planes, poles and paint as possible ties; None if the survey excludes ties.
    """

    survey: Survey
    candidates: Candidates
    features: TieFeatures | None


@dataclass(frozen=True)
class Method:
    """Method of correcting a cloud.

    Parameters
    ----------
    name, kind, about : str
        As in compare.json.
    fit : function
        ``fit(observed, matched)`` returns an object with ``apply(cloud)``, and its details as a
        dict; it raises Undetermined if the control points are insufficient.
    """

    name: str
    kind: str
    about: str
    fit: Callable = field(repr=False)


def _one_move(name, about, fit):
    """Method whose fit needs only pairs of positions."""
    return Method(name, "one move", about, lambda _, matched: (fit(matched), {}))


def load_open3d() -> str | None:
    """Reason why Open3D cannot be loaded, or None."""
    try:
        import mlscorr.baselines.registration  # noqa: F401
    except (ImportError, OSError) as error:  # OSError: a system library of Open3D is missing
        return f"Open3D can't be loaded ({error}). Run mlscorr doctor to see what is missing."
    return None


def _icp(observed, matched):
    problem = load_open3d()
    if problem is not None:
        raise baselines.Undetermined(problem)
    from mlscorr.baselines import fit_icp

    candidates = observed.candidates
    registration = fit_icp(matched, candidates.cloud, candidates.pass_number)
    names = ("variant", "fitness", "inlier_rmse", "control_before", "control_after")
    return registration, {name: getattr(registration, name) for name in names}


def _over_time(name, about, fit):
    """Method whose fit needs the trajectory and the control points."""

    def of_survey(observed, matched):
        return fit(observed.survey.trajectory, matched), {}

    return Method(name, "over time", about, of_survey)


def _polynomial(order):
    about = f"Polynomials of order {order} over time, one per axis, by least squares."
    return _over_time(f"ls-{order}", about, partial(baselines.fit_polynomial, order=order))


def _literal(order):
    def fit(observed, matched):
        survey = observed.survey
        return baselines.fit_literal(survey.trajectory, matched, survey.pos, order)

    about = (
        f"Collocation as printed in the paper: order {order}, variances as stated by the POS, a "
        "correlation time of 4 control intervals."
    )
    return Method(f"lsc-{order}", "collocation", about, fit)


def _lsc(observed, matched):
    survey = observed.survey
    estimate = estimate_correction(survey.trajectory, matched, survey.pos)
    return _with_details(estimate)


def _correct(observed, matched):
    estimate = estimate_together(observed.survey, matched, observed.features, ESTIMATE.order)
    correction, details = _with_details(estimate)
    if estimate.ties is None:
        used = 0
    else:
        used = int(estimate.ties.used.sum())
    return correction, details | {"ties": used, "untied": estimate.untied or None}


def _with_details(estimate):
    """Correction of an Estimate and its details; its warnings are passed on."""
    for sentence in estimate.warnings:
        warnings.warn(sentence, stacklevel=2)
    details = asdict(estimate.parameters) | {
        "order": estimate.order,
        "outliers": [outlier.name for outlier in estimate.outliers],
    }
    return estimate.correction, details


METHODS = (
    Method("raw", "none", "The recorded cloud.", lambda *_: (baselines.RAW, {})),
    _one_move("shift", "One shift of the whole cloud.", baselines.fit_shift),
    _one_move(
        "transformation",
        "Plan and height separately: shift, rotation and scale in plan, an inclined plane in "
        "height.",
        baselines.fit_horizontal_and_height,
    ),
    _one_move("rigid", "One shift and one rotation in space.", baselines.fit_rigid),
    _one_move("affine", "Shift, rotation, scale and shear: 12 parameters.", baselines.fit_affine),
    Method(
        "icp",
        "one move",
        "Iterative closest points: targets aligned with their surveyed surfaces.",
        _icp,
    ),
    *(_polynomial(order) for order in SETTINGS.orders),
    _over_time("linear", "Straight lines between control points.", baselines.fit_linear),
    _over_time("pchip", "Monotone cubics between control points.", baselines.fit_pchip),
    _over_time(
        "linear-steps",
        "Linear interpolation between control points, separately on both sides of each step of "
        "the trajectory.",
        partial(baselines.fit_linear, cut=True),
    ),
    _over_time(
        "gp",
        "A Gaussian process of scikit-learn: Matern 3/2 and white noise, by maximum likelihood.",
        baselines.fit_gaussian_process,
    ),
    *(_literal(order) for order in SETTINGS.orders),
    Method(
        "lsc",
        "collocation",
        "Collocation with parameters estimated from the control points.",
        _lsc,
    ),
    Method(
        "correct",
        "collocation",
        "The method of mlscorr correct: lsc, with ties where passes overlap.",
        _correct,
    ),
)


def method_named(name: str) -> Method:
    """Return the method with a name.

    Raises
    ------
    ValueError
        If the name is unknown; the message has the most similar one.
    """
    known = {method.name: method for method in METHODS}
    if name not in known:
        near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
        raise ValueError(
            f"There is no method '{name}'. The nearest is '{near}'; available are "
            f"{', '.join(known)}."
        )
    return known[name]
