"""Control in another datum or scale: the cloud would follow it by more than the POS allows."""

from collections.abc import Iterator

import numpy as np

from mlscorr.estimate.inputs import filled_sigmas
from mlscorr.evaluate.settings import SETTINGS
from mlscorr.matching.settings import SETTINGS as MATCHING
from mlscorr.pos import stated_sigma
from mlscorr.survey import Matched, Pos, Trajectory

FOLLOWS = "The corrected cloud follows the control; find out which of the two is right."
ASSUMED = (
    "Nobody stated the sigma of the POS: {sigma:g} m is assumed, and a worse POS could differ as "
    "much. State it under [pos] in survey.toml."
)


def datum_warnings(control: Matched, trajectory: Trajectory, pos: Pos) -> tuple[str, ...]:
    """Sentences where what all control points have in common is no error of this POS.

    A constant misclosure beyond what the POS states, and a scale or a turn of the map, are said
    where they explain the misclosures: a POS that drifts by more than it states is no datum.

    Parameters
    ----------
    control : Matched
        Control points that take part in the estimate.
    trajectory : Trajectory
        As recorded.
    pos : Pos

    Returns
    -------
    tuple of str
    """
    if len(control) < 3:
        return ()
    filled, _ = filled_sigmas(trajectory)
    sigma = stated_sigma(filled, pos, control.gps_time).position
    sentences = *_height(control.misclosure[:, 2], sigma[:, 2]), *_plan(control, sigma[:, :2], pos)
    if trajectory.position_sigma is not None or "position_sigma" not in pos.assumed:
        return sentences
    assumed = ASSUMED.format(sigma=pos.position_sigma)
    return tuple(f"{sentence} {assumed}" for sentence in sentences)


def _height(misclosure, sigma):
    """A sentence on heights that differ by a constant."""
    shift = np.average(misclosure, weights=sigma**-2)
    scatter, limit = np.std(misclosure), _common_sigma(sigma)
    if _stands_out(abs(shift), limit, scatter):
        yield (
            f"The control points lie {abs(shift):.2f} m {'below' if shift < 0 else 'above'} the "
            f"cloud as the POS puts it ({len(misclosure)} observations agree to {scatter:.3f} m), "
            f"{abs(shift) / limit:.0f} times the sigma of {limit:.3f} m that this leaves room for: "
            "they look like heights of another vertical datum or geoid, or the height of an "
            f"antenna, an instrument or a post is wrong. {FOLLOWS}"
        )


def _plan(control, sigma, pos) -> Iterator[str]:
    """Sentences on a constant shift, a scale and a turn of the map."""
    place = control.surveyed.position[:, :2]
    local = place - place.mean(axis=0)
    design = np.zeros((len(local), 2, 4))  # of shift east, shift north, scale, turn to the left
    design[:, 0, 0] = design[:, 1, 1] = 1.0
    design[:, :, 2], design[:, :, 3] = local, local[:, ::-1] * [-1.0, 1.0]
    rows, values = (design / sigma[..., None]).reshape(-1, 4), control.misclosure[:, :2] / sigma
    # Where the points leave scale and turn open they are zero: the solution of least length.
    x = np.linalg.lstsq(rows, values.ravel(), rcond=1e-9)[0]
    scatter = float(np.std(control.misclosure[:, :2] - design @ x, axis=0).max())
    shift, limit = float(np.hypot(*x[:2])), _common_sigma(sigma.max(axis=1))
    if _stands_out(shift, limit, scatter):
        yield (
            f"The control points lie {shift:.2f} m beside the cloud as the POS puts it (E "
            f"{x[0]:+.2f}, N {x[1]:+.2f} m; {len(local)} observations agree to {scatter:.3f} m), "
            f"{shift / limit:.0f} times the sigma of {limit:.3f} m that this leaves room for: they "
            f"look like points of another horizontal datum, realisation or epoch. {FOLLOWS}"
        )
    extent = float(np.sqrt(np.mean(np.sum(local**2, axis=1))))
    typical = float(np.sqrt(np.mean(sigma**2)))
    stretches = min(len(local), 1.0 + np.ptp(control.gps_time) / pos.correlation_time)
    apart, limit = float(np.hypot(*x[2:])) * extent, typical / np.sqrt(stretches)
    # A drift may look like a scale too; then the rest is larger than the POS states.
    if len(local) > 3 and scatter < 2 * typical and _stands_out(apart, limit, scatter):
        yield (
            f"The net of control points is larger by {x[2] * 1e6:+.0f} ppm than what the POS says "
            f"of it, and turned by {np.degrees(x[3]):+.4f} deg ({apart:.2f} m at {extent:.0f} m "
            f"from its middle, {apart / limit:.0f} times the sigma of {limit:.3f} m): it looks "
            "like ground distances without the map's scale, or another projection or zone. "
            f"{FOLLOWS}"
        )


def _common_sigma(sigma):
    """Sigma of a mean of POS errors that may all be one, with a good mounting. Units: m."""
    mean = np.sum(1.0 / sigma) / np.sum(sigma**-2)
    return float(np.hypot(mean, MATCHING.unstated_sigmas[0]))


def _stands_out(value, limit, scatter):
    """Whether a value is beyond its sigma, and explains what it was estimated from."""
    return value > SETTINGS.datum_sigmas * limit and 3 * scatter < value
