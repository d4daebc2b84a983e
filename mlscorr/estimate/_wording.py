"""Sentences on doubts about an estimate: its inputs, control points and ties."""

from collections.abc import Iterable

import numpy as np

from mlscorr.survey import Statement, Wording
from mlscorr.wording import counted


def sentences_of(statements: Iterable[Statement]) -> tuple[str, ...]:
    """The sentences of statements.

    Parameters
    ----------
    statements : iterable of Statement
        Of keys of SENTENCES.
    """
    return tuple(statement.sentence(SENTENCES) for statement in statements)


def _vector(vector):
    return "/".join(f"{value:.2f}" for value in vector)


def _refused(names, targets):
    return f"{len(names)} of {targets} control points ({', '.join(names)})"


def _unstated_drift(names, size, first, last):
    return (
        f"{', '.join(names)} deviate together by {size:.2f} m and more per axis from "
        f"{first:.1f} to {last:.1f} s: the POS drifts there by more than it states, "
        "so that its sigma was raised."
    )


def _wrong_or_drift(names, targets, odds, size):
    return (
        f"{_refused(names, targets)} were refused as wrong. That the POS drifts for a short time "
        f"beside each of them, and doesn't state it, is {odds:.1f} times as probable: then up to "
        f"{size:.2f} m are left there, and sigmas are larger for it. Survey these points again, "
        "or more of them around."
    )


def _neighbours_rejected(names, misclosures):
    return (
        f"{names[0]} and {names[1]} follow each other, were both rejected, and deviate in one "
        f"direction ({_vector(misclosures[0])} and {_vector(misclosures[1])} m). They may be "
        "wrong together, as by one setup of the instrument, or the POS drifted there for a "
        "short time: survey one of them again."
    )


def _neighbours_kept(names, misclosures):
    return (
        f"{names[0]} and {names[1]} follow each other and deviate from the others in one direction "
        f"({_vector(misclosures[0])} and {_vector(misclosures[1])} m). This was taken as drift of "
        "the POS; that both are wrong together, as by one setup of the instrument, is not much "
        "less likely: survey one of them again."
    )


def _contradicts_ties(name, misclosure, statistic, critical, is_used):
    off = "/".join(f"{value:.3f}" for value in misclosure)
    if is_used:
        what = "It is used, as too few are left to tell which point is wrong"
    else:
        what = "It takes no part"
    return (
        f"Control point {name} contradicts what ties carry to it from the other control "
        f"points: it is {off} m (E/N/H) off that, statistic {statistic:.1f} against "
        f"{critical:.1f}. {what}: survey it again, or see by --no-ties whether ties are wrong."
    )


def _lowered_order(targets, epochs, asked, order):
    verb = "is" if targets == 1 else "are"
    return (
        f"{counted(targets, 'control point')} at {counted(epochs, 'epoch')} {verb} too few for a "
        f"trend of order {asked}, which needs {asked + 2}: order {order} is used."
    )


def _few_targets(targets, least):
    noun = "point takes" if targets == 1 else "points take"
    return (
        f"Only {targets} control {noun} part: a wrong one cannot be found. Survey at least {least}."
    )


def _extrapolated(seconds, side, correlation_times, is_faded):
    effect = "only the trend applies" if is_faded else "it fades to the trend"
    return (
        f"Signal extrapolated {seconds:.0f} s {side} control point ({correlation_times:.1f} "
        f"correlation times): {effect} there."
    )


def _clock(lack, speed, spread):
    return (
        f"The lever arm lacks {1e3 * lack:.0f} mm forward. A clock offset of "
        f"{1e3 * abs(lack) / speed:.0f} ms at this survey's speed ({speed:.1f} ± {spread:.1f} "
        "m/s) looks the same but where speeds differ: by those mlscorr diagnose tells which."
    )


def _scanner_errors(components, corrections, sigmas, determined):
    units = {"range offset": "mm", "encoder scale": "mrad per rad"}
    lacks = []
    for part, lack, sigma, known in zip(components, corrections, sigmas, determined, strict=True):
        doubt = "" if known else " (not determined)"
        lacks.append(f"{part} {1000 * lack:.1f} ± {1000 * sigma:.1f} {units[part]}{doubt}")
    return (
        f"The scanner itself is off: it lacks {', '.join(lacks)}. The mounting is given free "
        "of that, but the points keep it: set it in the scanner's own software, export the "
        "clouds anew, and calibrate again."
    )


def _is_angle(component):
    return component.startswith("boresight")


def _undetermined(components, sigmas):
    parts = []
    for part, sigma in zip(components, sigmas, strict=True):
        if _is_angle(part):
            parts.append(f"{part} (sigma {np.degrees(sigma):.3f} deg)")
        else:
            parts.append(f"{part} (sigma {sigma:.3f} m)")
    return (
        f"This geometry does not determine {', '.join(parts)}: a constant difference between the "
        "coordinates of control and trajectory, or another component, looks the same, and the "
        "sigma holds only as far as the POS's own do. Targets on both sides, near and far, high "
        "and low, passed in both directions tell more; no level street tells lever arm up from a "
        "height difference."
    )


def _wrong_mounting(components, corrections, sigmas, statistic, critical, scanners):
    parts = []
    for part, lack, sigma in zip(components, corrections, sigmas, strict=True):
        if _is_angle(part):
            parts.append(f"{part} {np.degrees(lack):.2f} ± {np.degrees(sigma):.2f} deg")
        else:
            parts.append(f"{part} {lack:.3f} ± {sigma:.3f} m")
    which = "a wrong mounting makes them: it lacks"
    if scanners > 1:
        which = f"wrong mountings make them: each of the {scanners} scanners' lacks, alike,"
    return (
        "Passes disagree by their direction of travel (arrows of opposite passes are "
        f"opposite), as {which} {', '.join(parts)} "
        f"(chi-squared {statistic:.0f}, critical {critical:.0f}). "
        "This correction takes that for drift. Run mlscorr calibrate --clouds first, and "
        "correct the survey that it writes."
    )


def _wrong_scanner(name, first, corrections, sigmas):
    arm = ", ".join(
        f"{1000 * lack:.0f} ± {1000 * sigma:.0f}"
        for lack, sigma in zip(corrections[:3], sigmas[:3], strict=True)
    )
    turn = ", ".join(
        f"{np.degrees(lack):.2f} ± {np.degrees(sigma):.2f}"
        for lack, sigma in zip(corrections[3:], sigmas[3:], strict=True)
    )
    who = f"Scanner {name} puts what both see elsewhere than {first} does: beside it,"
    if name == first:
        who = "The scanner puts what it sees twice elsewhere the second time:"
    return (
        f"{who} its lever arm lacks {arm} mm to the right, forward, up, and its boresight "
        f"{turn} deg about them. No drift is made of it, "
        "but its points keep it. Run mlscorr calibrate --clouds first, and correct "
        "the survey that it writes."
    )


SENTENCES: dict[str, Wording] = {
    "zero sigmas": (
        "All {epochs} trajectory epochs state a {column} of 0 {unit}, which no POS has: what "
        "survey.toml's [pos] believes is used."
    ),
    "filled sigmas": (
        "{filled} of {epochs} trajectory epochs state a {column} of 0 {unit}, or one that jumps at "
        "these epochs alone (first at {first:.3f} s), which is no statement: those of the epochs "
        "before and after are used there."
    ),
    "unstated drift": _unstated_drift,
    "wrong or drift": _wrong_or_drift,
    "neighbours rejected": _neighbours_rejected,
    "neighbours kept": _neighbours_kept,
    "contradicts ties": _contradicts_ties,
    "no tie used": (
        "None of the {ties} ties between passes was used: more than half of them contradict the "
        "others, or all of them several control points. Did the street change between the passes, "
        "is the mounting wrong (mlscorr calibrate), or does the scanner's own encoder turn by "
        "another scale (milliradians per radian)?"
    ),
    "on ties": "{sentence}",
    "lowered order": _lowered_order,
    "few targets": _few_targets,
    "one epoch": (
        "All {targets} control points were seen within {seconds:.1f} s at {start:.1f} s: the "
        "correction is known there. Nothing tells whether it is the same elsewhere, so that a part "
        "of it is kept, with growing sigmas."
    ),
    "relative only": (
        "No control point takes part. The passes agree with each other, but nothing is known of "
        "where they are beyond what the POS states: accuracy is relative only."
    ),
    "pass without control": (
        "The pass from {first:.1f} to {last:.1f} s has no control point: only the trend of the "
        "other passes and what is left of their signal correct it."
    ),
    "global test": (
        "The global test fails: the misclosures vary more than the stated sigmas of control points "
        "and targets allow (chi-squared {statistic:.0f} above {upper:.0f} of {redundancy:.0f} "
        "degrees of freedom). Are the sigmas of control points right?"
    ),
    "extrapolated": _extrapolated,
    "faded": (
        "No control point for {seconds:.0f} s from {start:.1f} s ({correlation_times:.1f} "
        "correlation times): only the trend applies in the middle of it."
    ),
    "clock": _clock,
    "scanner errors": _scanner_errors,
    "mounting by ties alone": (
        "No control point takes part: the mounting is that which makes the passes agree, and where "
        "they are is what the POS says."
    ),
    "undetermined": _undetermined,
    "wrong mounting": _wrong_mounting,
    "wrong scanner": _wrong_scanner,
}
