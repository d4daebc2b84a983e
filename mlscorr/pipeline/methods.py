"""The methods that ``compare`` compares, in the order of their freedom."""

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from difflib import get_close_matches

from mlscorr.baselines import (
    RAW,
    Undetermined,
    fit_affine,
    fit_horizontal_and_height,
    fit_literal,
    fit_polynomial,
    fit_rigid,
    fit_shift,
)
from mlscorr.correction import estimate_correction


@dataclass(frozen=True)
class Method:
    """A way to correct a cloud.

    ``fit(survey, observations, candidates)`` gives what has ``apply(cloud)``, and what is worth
    knowing of it as a dict; it raises Undetermined where the control points don't suffice.
    """

    name: str
    kind: str
    about: str
    fit: Callable = field(repr=False)


def _as_one(fit):
    """A fit that needs no more than pairs of places."""
    return lambda survey, observations, _: (fit(observations, survey.control), {})


def load_open3d():
    """Why Open3D can't be loaded, or None."""
    try:
        import mlscorr.baselines.registration  # noqa: F401
    except (ImportError, OSError) as error:  # OSError: a system library of Open3D is missing
        return f"Open3D can't be loaded ({error}). Run mlscorr doctor to see what is missing."


def _icp(survey, observations, candidates):
    problem = load_open3d()
    if problem is not None:
        raise Undetermined(problem)
    from mlscorr.baselines.registration import fit_icp

    found = fit_icp(observations, survey.control, candidates.cloud, candidates.pass_number)
    names = ("variant", "fitness", "inlier_rmse", "control_before", "control_after")
    return found, {name: getattr(found, name) for name in names}


def _polynomial(order):
    def fit(survey, observations, _):
        return fit_polynomial(survey.trajectory, observations, survey.control, order), {}

    about = f"Polynomials of time of order {order}, one for each axis, by least squares."
    return Method(f"ls-{order}", "over time", about, fit)


def _literal(order):
    def fit(survey, observations, _):
        return fit_literal(survey.trajectory, observations, survey.control, survey.pos, order)

    about = (
        f"Collocation as the paper prints it: order {order}, variances that the POS states, a "
        "correlation time of 4 control intervals."
    )
    return Method(f"lsc-{order}", "collocation", about, fit)


def _lsc(survey, observations, _):
    estimate = estimate_correction(survey.trajectory, observations, survey.control, survey.pos)
    for sentence in estimate.warnings:
        warnings.warn(sentence, stacklevel=2)
    details = asdict(estimate.parameters) | {
        "order": estimate.order,
        "outliers": [outlier.name for outlier in estimate.outliers],
    }
    return estimate.correction, details


ORDERS = (2, 3, 4, 5)  # Table 1 of the paper
METHODS = (
    Method("raw", "none", "The cloud as it was recorded.", _as_one(lambda *_: RAW)),
    Method("shift", "one move", "One shift of the whole cloud.", _as_one(fit_shift)),
    Method(
        "transformation",
        "one move",
        "Plan and height solved apart: shift, turn and scale in plan, an inclined plane in height.",
        _as_one(fit_horizontal_and_height),
    ),
    Method("rigid", "one move", "One shift and one turn in space.", _as_one(fit_rigid)),
    Method(
        "affine", "one move", "Shift, turn, scale and shear: 12 parameters.", _as_one(fit_affine)
    ),
    Method(
        "icp", "one move", "Iterative closest points: targets laid on their surveyed faces.", _icp
    ),
    *(_polynomial(order) for order in ORDERS),
    *(_literal(order) for order in ORDERS),
    Method(
        "lsc",
        "collocation",
        "Collocation with parameters that the control points themselves make likely.",
        _lsc,
    ),
)


def method_named(name):
    """The method of a name. Raises ValueError, with the nearest there is, for another one."""
    known = {method.name: method for method in METHODS}
    if name not in known:
        near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
        raise ValueError(
            f"There is no method '{name}'. The nearest is '{near}'; all are {', '.join(known)}."
        )
    return known[name]
