"""Whether ties disagree as a wrong mounting makes them, rather than as a POS drifts.

Drift depends on time, a boresight's part on the direction of travel.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.special import chdtri
from threadpoolctl import threadpool_limits

from mlscorr.estimate._added_unknowns import AddedUnknowns
from mlscorr.estimate._tie_equations import mounting_columns
from mlscorr.estimate.mounting import prior_sigma
from mlscorr.estimate.mounting_estimate import MOUNTING_COMPONENTS
from mlscorr.estimate.pos_error import Estimate
from mlscorr.estimate.settings import SETTINGS
from mlscorr.frames import mounting_partials, partials_by_scanner
from mlscorr.survey import Matched, Mounting


def mounting_warnings(check: AddedUnknowns | None, scanners: int = 1) -> tuple[str, ...]:
    """A sentence where a wrong mounting is significant, and large enough to matter.

    Parameters
    ----------
    check : AddedUnknowns, optional
        Of find_mounting_error.
    scanners : int
        Number of scanners.
    """
    least = np.repeat(SETTINGS.determined_sigma, 3)
    if check is None or not check.is_wrong(least).any():
        return ()
    scale = np.repeat([1.0, np.degrees(1.0)], 3)
    sizes = np.column_stack([scale * check.correction, scale * check.sigma])
    words = ["{} {:.3f} ± {:.3f} m"] * 3 + ["{} {:.2f} ± {:.2f} deg"] * 3
    rows = zip(words, MOUNTING_COMPONENTS, sizes, check.is_wrong(least), strict=True)
    lacks = ", ".join(text.format(part, *size) for text, part, size, wrong in rows if wrong)
    which = "a wrong mounting makes them: it lacks"
    if scanners > 1:
        which = f"wrong mountings make them: each of the {scanners} scanners' lacks, alike,"
    return (
        "Passes disagree by their direction of travel (arrows of opposite passes are "
        f"opposite), as {which} {lacks} "
        f"(chi-squared {check.statistic:.0f}, critical {check.critical:.0f}). "
        "This correction takes that for drift. Run mlscorr calibrate --clouds first, and "
        "correct the survey that it writes.",
    )


@threadpool_limits.wrap(limits=1, user_api="blas")
def find_mounting_error(
    estimate: Estimate, matched: Matched, mountings: Sequence[Mounting]
) -> AddedUnknowns | None:
    """Test the recorded mountings by the ties of a correction; None without any.

    Lever arm (m) and boresight (rad) about right, forward, up are the unknowns, of all scanners
    alike: what one lacks beside another is in the estimate.

    Parameters
    ----------
    estimate : Estimate
        With ties.
    matched : Matched
        Its control points.
    mountings : sequence of Mounting
        Of all scanners, as recorded.
    """
    equations = estimate.equations
    residuals = estimate.ties
    if equations.ties is None or residuals is None:
        return None
    used = residuals.ties[residuals.used]
    targets = matched[estimate.used]
    trajectory = equations.trajectory
    numbered = dict(enumerate(mountings))
    ties = mounting_columns(trajectory, numbered, used)
    control = np.zeros((len(equations.gps_time), 3, ties.shape[1]))
    sightings = targets.observations.position, targets.gps_time, targets.scanner
    control[: len(targets)] = partials_by_scanner(
        mounting_partials, trajectory, numbered, *sightings
    )
    columns = np.vstack([control.reshape(-1, ties.shape[1]), ties])
    sums = columns.reshape(len(columns), len(mountings), 6).sum(axis=1)
    return AddedUnknowns.of(equations, estimate.parameters, sums, prior_sigma(mountings[0]))


def scanner_warnings(estimate: Estimate, names: Sequence[str]) -> Iterator[str]:
    """Sentences on scanners that see the street elsewhere than the first, as ties tell it; on the
    only one where it sees a thing elsewhere from ahead than from behind.

    Parameters
    ----------
    estimate : Estimate
        With ties between scanners, or between views of one at a visit.
    names : sequence of str
        Of all scanners.
    """
    solved = estimate.equations.solve(estimate.parameters)
    scale = np.append(np.full(3, 1000.0), np.full(3, np.degrees(1.0)))
    least = np.repeat(SETTINGS.determined_sigma, 3)
    for number, name in enumerate(names[1:] or names):
        of_it = slice(6 * number, 6 * number + 6)
        lacks = solved.trend[of_it]
        covariance = solved.trend_covariance[of_it, of_it]
        sigma = np.sqrt(np.diag(covariance))
        statistic = lacks @ np.linalg.solve(covariance, lacks)
        is_large = np.abs(lacks) > np.maximum(SETTINGS.setup_sigmas * sigma, least)
        if statistic > chdtri(len(lacks), SETTINGS.significance) and is_large.any():
            both = list(zip(scale * lacks, scale * sigma, strict=True))
            arm = ", ".join(f"{a:.0f} ± {s:.0f}" for a, s in both[:3])
            turn = ", ".join(f"{a:.2f} ± {s:.2f}" for a, s in both[3:])
            who = "The scanner puts what it sees twice elsewhere the second time:"
            if len(names) > 1:
                who = (
                    f"Scanner {name} puts what both see elsewhere than {names[0]} does: beside it,"
                )
            yield (
                f"{who} its lever arm lacks {arm} mm to the right, forward, up, and its boresight "
                f"{turn} deg about them. No drift is made of it, "
                "but its points keep it. Run mlscorr calibrate --clouds first, and correct "
                "the survey that it writes."
            )
