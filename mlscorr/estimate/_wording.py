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
        f"{', '.join(names)} deviate together by at least {size:.2f} m per axis from "
        f"{first:.1f} to {last:.1f} s. The POS drifts more than it states there, so its sigma was "
        "increased."
    )


def _wrong_or_drift(names, targets, odds, size):
    return (
        f"{_refused(names, targets)} were rejected as wrong. A short unstated drift of the POS "
        f"near each of them is {odds:.1f} times as probable; errors of up to {size:.2f} m would "
        "then remain, and the sigmas include this. Survey these points again, or more points "
        "around them."
    )


def _neighbours_rejected(names, misclosures):
    return (
        f"{names[0]} and {names[1]} are consecutive, were both rejected, and deviate in the same "
        f"direction ({_vector(misclosures[0])} and {_vector(misclosures[1])} m). Either both are "
        "wrong, as from one instrument setup, or the POS drifted there briefly. Survey one of "
        "them again."
    )


def _neighbours_kept(names, misclosures):
    return (
        f"{names[0]} and {names[1]} are consecutive and deviate from the others in the same "
        f"direction ({_vector(misclosures[0])} and {_vector(misclosures[1])} m). This was "
        "treated as drift of the POS, but an error in both, as from one instrument setup, is "
        "almost as likely. Survey one of them again."
    )


def _contradicts_ties(name, misclosure, statistic, critical, is_used):
    off = "/".join(f"{value:.3f}" for value in misclosure)
    if is_used:
        what = "It was used, because too few points remain to identify the wrong one"
    else:
        what = "It was not used"
    return (
        f"Control point {name} contradicts the other control points, connected to it by ties: it "
        f"deviates by {off} m (E/N/H), statistic {statistic:.1f}, critical value {critical:.1f}. "
        f"{what}. Survey it again, or test with --no-ties whether the ties are wrong."
    )


def _lowered_order(targets, epochs, asked, order):
    verb = "is" if targets == 1 else "are"
    return (
        f"{counted(targets, 'control point')} at {counted(epochs, 'epoch')} {verb} too few for a "
        f"trend of order {asked}, which needs {asked + 2}. Order {order} is used."
    )


def _few_targets(targets, least):
    noun = "point was" if targets == 1 else "points were"
    return (
        f"Only {targets} control {noun} used, so a wrong point cannot be identified. Survey at "
        f"least {least}."
    )


def _extrapolated(seconds, side, correlation_times, is_faded):
    effect = "only the trend applies" if is_faded else "it decays to the trend"
    return (
        f"The signal is extrapolated {seconds:.0f} s {side} control point "
        f"({correlation_times:.1f} correlation times): {effect} there."
    )


def _clock(lack, speed, spread):
    return (
        f"The lever arm needs a correction of {1e3 * lack:.0f} mm forward. A clock offset of "
        f"{1e3 * abs(lack) / speed:.0f} ms has the same effect at this survey's speed "
        f"({speed:.1f} ± {spread:.1f} m/s). mlscorr diagnose separates the two where speeds "
        "differ."
    )


def _scanner_errors(components, corrections, sigmas, determined):
    units = {"range offset": "mm", "encoder scale": "mrad per rad"}
    lacks = []
    for part, lack, sigma, known in zip(components, corrections, sigmas, determined, strict=True):
        doubt = "" if known else " (not determined)"
        lacks.append(f"{part} {1000 * lack:.1f} ± {1000 * sigma:.1f} {units[part]}{doubt}")
    return (
        f"The scanner itself has errors: {', '.join(lacks)}. The mounting is free of them, but "
        "the points are not. Set them in the scanner's software, export the clouds again, and "
        "repeat the calibration."
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
        f"This geometry does not determine {', '.join(parts)}. A constant offset between control "
        "and trajectory, or another component, has the same effect. Targets on both sides, near "
        "and far, high and low, passed in both directions, help; a level street never separates "
        "lever arm up from a height offset."
    )


def _wrong_mounting(components, corrections, sigmas, statistic, critical, scanners):
    parts = []
    for part, lack, sigma in zip(components, corrections, sigmas, strict=True):
        if _is_angle(part):
            parts.append(f"{part} {np.degrees(lack):.2f} ± {np.degrees(sigma):.2f} deg")
        else:
            parts.append(f"{part} {lack:.3f} ± {sigma:.3f} m")
    which = "wrong mounting; estimated corrections:"
    if scanners > 1:
        which = f"wrong mountings; estimated common corrections of the {scanners} scanners:"
    return (
        "The misclosures depend on the direction of travel (arrows of opposite passes are "
        f"opposite). Likely cause: {which} {', '.join(parts)} (chi-squared {statistic:.0f}, "
        f"critical value {critical:.0f}). This correction treats them as drift: run mlscorr "
        "calibrate --clouds first, and correct the survey that it writes."
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
    who = f"Scanner {name} disagrees with scanner {first}. Relative to it,"
    if name == first:
        who = "The scanner disagrees with itself between passes:"
    return (
        f"{who} the lever arm needs corrections of {arm} mm (right, forward, up), and the "
        f"boresight {turn} deg about the same axes. They are kept out of the drift but remain in "
        "the points. Run mlscorr calibrate --clouds first, and correct the survey that it "
        "writes."
    )


SENTENCES: dict[str, Wording] = {
    "zero sigmas": (
        "All {epochs} trajectory epochs state {column} = 0 {unit}, which is not realistic. "
        "The values under [pos] in survey.toml are used instead."
    ),
    "filled sigmas": (
        "{filled} of {epochs} trajectory epochs state {column} = 0 {unit}, or an isolated "
        "outlier (first at {first:.3f} s). The values of the neighboring epochs are used there."
    ),
    "unstated drift": _unstated_drift,
    "wrong or drift": _wrong_or_drift,
    "neighbours rejected": _neighbours_rejected,
    "neighbours kept": _neighbours_kept,
    "contradicts ties": _contradicts_ties,
    "no tie used": (
        "None of the {ties} ties between passes was used: more than half of them contradict the "
        "others, or all of them contradict several control points. Possible causes: the street "
        "changed between passes, the mounting is wrong (run mlscorr calibrate), or the "
        "scanner's encoder has a scale error."
    ),
    "on ties": "{sentence}",
    "lowered order": _lowered_order,
    "few targets": _few_targets,
    "one epoch": (
        "All {targets} control points were observed within {seconds:.1f} s at {start:.1f} s, "
        "and the correction is determined only there. Elsewhere a decreasing part of it is "
        "applied, with increasing sigmas."
    ),
    "relative only": (
        "No control point was used. The passes agree with each other, but their absolute "
        "position rests on the POS: the accuracy is relative only."
    ),
    "pass without control": (
        "The pass from {first:.1f} to {last:.1f} s has no control point. It is corrected only "
        "by the trend of the other passes and the remaining correlation with them."
    ),
    "global test": (
        "The global test fails: the misclosures exceed the stated sigmas of control points and "
        "targets (chi-squared {statistic:.0f}, limit {upper:.0f}, {redundancy:.0f} degrees of "
        "freedom). Check the sigmas of the control points."
    ),
    "extrapolated": _extrapolated,
    "faded": (
        "There is no control point for {seconds:.0f} s from {start:.1f} s "
        "({correlation_times:.1f} correlation times). Only the trend applies in the middle of "
        "this interval."
    ),
    "clock": _clock,
    "scanner errors": _scanner_errors,
    "mounting by ties alone": (
        "No control point was used. The calibration makes the passes agree; their absolute "
        "position rests on the POS."
    ),
    "undetermined": _undetermined,
    "wrong mounting": _wrong_mounting,
    "wrong scanner": _wrong_scanner,
}
