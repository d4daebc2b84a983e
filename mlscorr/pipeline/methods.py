"""The methods that ``compare`` compares, in the order of their freedom."""

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from difflib import get_close_matches
from functools import partial

from mlscorr.baselines import (
    RAW,
    Undetermined,
    fit_affine,
    fit_gaussian_process,
    fit_horizontal_and_height,
    fit_linear,
    fit_literal,
    fit_pchip,
    fit_polynomial,
    fit_rigid,
    fit_shift,
)
from mlscorr.estimate import estimate_correction
from mlscorr.pipeline.settings import SETTINGS


@dataclass(frozen=True)
class Method:
    """A way to correct a cloud.

    Parameters
    ----------
    name, kind, about : str
        As compare.json has them.
    fit : function
        ``fit(survey, matched, candidates)`` gives what has ``apply(cloud)``, and details of it as
        a dict; it raises Undetermined where the control points don't suffice.
    """

    name: str
    kind: str
    about: str
    fit: Callable = field(repr=False)


def _of_pairs(fit):
    """A fit that needs no more than pairs of places."""
    return lambda _survey, matched, _: (fit(matched), {})


def load_open3d() -> str | None:
    """Why Open3D can't be loaded, or None."""
    try:
        import mlscorr.baselines.registration  # noqa: F401
    except (ImportError, OSError) as error:  # OSError: a system library of Open3D is missing
        return f"Open3D can't be loaded ({error}). Run mlscorr doctor to see what is missing."
    return None


def _icp(_survey, matched, candidates):
    problem = load_open3d()
    if problem is not None:
        raise Undetermined(problem)
    from mlscorr.baselines.registration import fit_icp

    registration = fit_icp(matched, candidates.cloud, candidates.pass_number)
    names = ("variant", "fitness", "inlier_rmse", "control_before", "control_after")
    return registration, {name: getattr(registration, name) for name in names}


def _over_time(fit):
    """A fit that needs the trajectory and the control points."""
    return lambda survey, matched, _: (fit(survey.trajectory, matched), {})


def _polynomial(order):
    def fit(survey, matched, _):
        return fit_polynomial(survey.trajectory, matched, order), {}

    about = f"Polynomials of time of order {order}, one for each axis, by least squares."
    return Method(f"ls-{order}", "over time", about, fit)


def _literal(order):
    def fit(survey, matched, _):
        return fit_literal(survey.trajectory, matched, survey.pos, order)

    about = (
        f"Collocation as the paper prints it: order {order}, variances that the POS states, a "
        "correlation time of 4 control intervals."
    )
    return Method(f"lsc-{order}", "collocation", about, fit)


def _lsc(survey, matched, _):
    estimate = estimate_correction(survey.trajectory, matched, survey.pos)
    for sentence in estimate.warnings:
        warnings.warn(sentence, stacklevel=2)
    details = asdict(estimate.parameters) | {
        "order": estimate.order,
        "outliers": [outlier.name for outlier in estimate.outliers],
    }
    return estimate.correction, details


METHODS = (
    Method("raw", "none", "The cloud as it was recorded.", _of_pairs(lambda *_: RAW)),
    Method("shift", "one move", "One shift of the whole cloud.", _of_pairs(fit_shift)),
    Method(
        "transformation",
        "one move",
        "Plan and height solved apart: shift, turn and scale in plan, an inclined plane in height.",
        _of_pairs(fit_horizontal_and_height),
    ),
    Method("rigid", "one move", "One shift and one turn in space.", _of_pairs(fit_rigid)),
    Method(
        "affine", "one move", "Shift, turn, scale and shear: 12 parameters.", _of_pairs(fit_affine)
    ),
    Method(
        "icp", "one move", "Iterative closest points: targets laid on their surveyed faces.", _icp
    ),
    *(_polynomial(order) for order in SETTINGS.orders),
    Method("linear", "over time", "Straight lines between control points.", _over_time(fit_linear)),
    Method("pchip", "over time", "Monotone cubics between control points.", _over_time(fit_pchip)),
    Method(
        "linear-steps",
        "over time",
        "Straight lines between control points, apart on both sides of each step of the path.",
        _over_time(partial(fit_linear, cut=True)),
    ),
    Method(
        "gp",
        "over time",
        "A Gaussian process of scikit-learn: Matern 3/2 and white noise, by likelihood.",
        _over_time(fit_gaussian_process),
    ),
    *(_literal(order) for order in SETTINGS.orders),
    Method(
        "lsc",
        "collocation",
        "Collocation with parameters that the control points themselves make likely.",
        _lsc,
    ),
)


def method_named(name: str) -> Method:
    """The method of a name.

    Raises
    ------
    ValueError
        For another one, with the nearest there is.
    """
    known = {method.name: method for method in METHODS}
    if name not in known:
        near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
        raise ValueError(
            f"There is no method '{name}'. The nearest is '{near}'; all are {', '.join(known)}."
        )
    return known[name]
