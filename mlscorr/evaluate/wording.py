"""Sentences of an evaluation: reasons for unused points, doubts, accuracy."""

import numpy as np

from mlscorr.matching import REASONS as MATCHING
from mlscorr.survey import Statement, Wording

FOLLOWS = "The corrected cloud follows the control; find out which of the two is right."


def _bayes_factor(log_evidence):
    """Bayes factor in words: its power of ten if it is large."""
    power = log_evidence / np.log(10)
    if power < 3:
        return f"{np.exp(log_evidence):.0f}"
    return f"1e{power:.0f}"


def _evidence(observations, log_evidence):
    return (
        f"{observations} observations, Bayes factor {_bayes_factor(log_evidence)} against an "
        "error of the POS"
    )


def _assumed(sigma):
    """End of a sentence that depends on an unstated sigma."""
    if sigma is None:
        return ""
    return (
        f" The sigma of the POS is not given: {sigma:g} m is assumed, and a less accurate POS "
        "could explain the difference. Set it under [pos] in survey.toml."
    )


def _shift(size, length, observations, log_evidence, assumed_sigma):
    return (
        f"The control points are offset from the cloud by {length:.2f} m (E {size[0]:+.2f}, N "
        f"{size[1]:+.2f} m; {_evidence(observations, log_evidence)}). Likely cause: another "
        f"horizontal datum, realization or epoch. {FOLLOWS}{_assumed(assumed_sigma)}"
    )


def _height(size, observations, log_evidence, assumed_sigma):
    where = "above"
    if size[0] < 0:
        where = "below"
    return (
        f"The control points are {abs(size[0]):.2f} m {where} the cloud "
        f"({_evidence(observations, log_evidence)}). Likely cause: another vertical datum or "
        "geoid, or a wrong height of an antenna, instrument or prism pole. "
        f"{FOLLOWS}{_assumed(assumed_sigma)}"
    )


def _net(words, length, extent, observations, log_evidence):
    """Sentence on the difference of all control points from the cloud."""
    return (
        f"The control network is {words} ({length:.3f} m at {extent:.0f} m from its center; "
        f"{_evidence(observations, log_evidence)})."
    )


def _scale(size, sigma, ground, is_ground, **net):
    """Sentence on the scale compared with ground distances, and how to declare it."""
    words = f"larger than the cloud by {1e6 * size[0]:+.0f} +/- {1e6 * sigma[0]:.0f} ppm"
    factor = f"scale_factor = {1 / (1 + size[0]):.6f}"
    if ground is None:
        cause = (
            f"Likely cause: ground distances without the map scale. If so, set {factor} under "
            "[control]."
        )
    else:
        expected = 1 / ground.combined - 1
        cause = f"Ground distances would be larger by {1e6 * expected:+.0f} ppm there ({ground}), "
        if is_ground:
            cause += (
                "which fits. If the control is in ground distances, set scale_factor = "
                f'"ground" under [control], or {factor}.'
            )
        else:
            cause += (
                "which does not fit. Look for another projection or a wrong unit; if the "
                f"control has this scale, set {factor} under [control]."
            )
    return f"{_net(words, **net)} {cause} {FOLLOWS}"


def _turn(size, sigma, ground, **net):
    turn, uncertainty = np.degrees([size[0], sigma[0]])
    words = (
        f"rotated counter-clockwise relative to the cloud by {turn:+.4f} +/- {uncertainty:.4f} deg"
    )
    convergence = ""
    if ground is not None:
        angle = -np.degrees(ground.convergence)
        convergence = f" (true north would give {angle:+.4f} deg)"
    return (
        f"{_net(words, **net)} Likely cause: another projection or zone, or a local network with "
        f"another orientation{convergence}. Export the control in the CRS of the cloud. {FOLLOWS}"
    )


def _tilt(size, sigma, **net):
    rise = 1e3 * size
    uncertainty = 1e3 * sigma
    words = (
        f"tilted relative to the cloud: it rises by {rise[0]:+.2f} +/- {uncertainty[0]:.2f} mm/m "
        f"toward east and {rise[1]:+.2f} +/- {uncertainty[1]:.2f} mm/m toward north"
    )
    return (
        f"{_net(words, **net)} Likely cause: another geoid model, or a network that was never "
        f"leveled. Export the control with the geoid of the cloud. {FOLLOWS}"
    )


def _other_clock(file, lag, later, beside, shifted, samples):
    """Sentence on points that surround the vehicle `later` s after their times."""
    order = "earlier"
    side = "after"
    clocks = "cloud seems to be in UTC, the trajectory in GPS time"
    if later < 0:
        order = "later"
        side = "before"
        clocks = "trajectory seems to be in UTC, the cloud in GPS time"
    return (
        f"The times of {file} are {lag} s {order} than the trajectory's: its points are "
        f"{beside:.0f} m from the vehicle, and {shifted:.0f} m from its position {lag} s {side} "
        f"(horizontal medians of {samples} samples). The {clocks}: export both in GPS time, or "
        f"add {-later} to trajectory.time_constant (s) in survey.toml."
    )


def _classes(axis, size, is_conformant, rmse, fit, survey):
    tested = "It would meet"
    if is_conformant:
        tested = "It meets"
    return (
        f"{tested} the {size}-cm {axis} accuracy class: RMSE_{axis[0].upper()} is "
        f"{100 * rmse:.1f} cm ({100 * fit:.1f} cm fit to the points, {100 * survey:.1f} cm "
        "survey of the points)."
    )


def _were(points):
    if points == 1:
        return "point was"
    return "points were"


def _left_out(points):
    return (
        f"No check point was used. {points} control {_were(points)} predicted from the others "
        "(leave-one-out). This estimates the accuracy but is not a conformant test, because "
        "these points were used in the correction."
    )


def _too_few(points, least):
    return (
        f"The standard requires at least {least} check points; {points} {_were(points)} used. "
        "The test is not conformant."
    )


def _inaccurate(axis, survey):
    return (
        f"The {axis} survey error of the points, {100 * survey:.1f} cm, is more than half of the "
        "RMSE found. Test points should be twice as accurate as the product."
    )


REASONS: dict[str, Wording] = {  # reasons for unused surveyed points
    **MATCHING,
    "check point": "check point",
    "outlier": "outlier: statistic {statistic:.1f}, critical value {critical:.1f}",
    "no pose": "{points} points near it, at {start:.1f} to {end:.1f} s, were measured outside "
    "the trajectory or in one of its gaps, where nothing is interpolated.",
    "seen by others": "Another scanner scanned it, this one did not.",
}
DATUM: dict[str, Wording] = {  # overall differences of control and cloud
    "shift": _shift,
    "height": _height,
    "scale": _scale,
    "turn": _turn,
    "tilt": _tilt,
}
BEAMS: dict[str, Wording] = {  # points of another survey, wrong times
    "no time": "{count} of {samples} points sampled from {file} have gps_time {values}, which "
    "means no time. They stay uncorrected (exit code 4). Export them with gps_time, "
    "or remove them.",
    "outside": "{count} of {samples} points sampled from {file} are outside the trajectory "
    "[{start:.3f}, {end:.3f}] s or in its gaps ({gaps}), by up to {away:.3f} s. They "
    "stay uncorrected (exit code 4). Export the whole trajectory.",
    "backwards": "The times of {file} run backward: none of {steps} sampled points is later "
    "than the one before. Unless the file was sorted this way, its gps_time is "
    "wrong, and the points would get the correction of another time.",
    "other survey": "The points of {file} are {beside:.0f} m from the trajectory and {off:.0f} "
    "deg off the scan plane (median of {samples} samples; limits {near:.0f} m "
    "and {off_plane:.0f} deg). The file may belong to another survey, its "
    "gps_time may be wrong (UTC is 18 s late), or [mounting] may be wrong or in "
    "wrong units.",
    "other clock": _other_clock,
}
ACCURACY: dict[str, Wording] = {  # by the standard
    "not determined": "Not determined: no check point was used, and there are too few control "
    "points for leave-one-out.",
    "left out": _left_out,
    "too few": _too_few,
    "tested": "This data set was tested with {points} independent check points.",
    "class": _classes,
    "inaccurate points": _inaccurate,
}
GATES: dict[str, Wording] = {  # failed by a report
    "not determined": "{quantity}: {what} is not determined.",
    "exceeded": "{quantity}: {what} is {value:.4g} {operator} {limit:g}.",
}


def reason_in_words(why: Statement | None) -> str:
    """Return the reason for an unused surveyed point; empty if unknown.

    Parameters
    ----------
    why : Statement or None
        With a key of REASONS.
    """
    if why is None:
        return ""
    return why.sentence(REASONS)
