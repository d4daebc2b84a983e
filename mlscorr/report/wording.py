"""Sentences of reports on a correction, a calibration and a comparison of a survey."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from mlscorr.survey import Statement, Wording
from mlscorr.wording import (
    counted,
    joined,
    known,
    length_in_words,
    millimetres,
    number,
    percent,
    thousands,
)

NAMED = 6  # points or intervals on the first screen; the tables have all
ASSUMED_NAMES = {  # of a key of survey.toml
    "pos.position_sigma": "Position of the POS",
    "pos.attitude_sigma": "Attitude of the POS",
    "pos.correlation_time": "Correlation time of the POS",
    "scanner.range_noise": "Range noise",
    "scanner.angle_noise": "Angle noise",
}
JUDGES = {  # basis of a verdict on a correction
    "check": "independent check points",
    "leave-one-out": "control points (leave-one-out)",
    "fit": "the points used for the correction (fit only, no independent check)",
}
PLACES = {True: "scanned by another scanner only", False: "outside the scanned area"}
OTHERS = {  # kinds of methods other than our own
    "one move": "Best single transformation of the whole cloud",
    "over time": "Best polynomial or interpolation over time",
}


def names_in_words(names: Sequence[str]) -> str:
    """Names of points in a sentence; of many, the first ones and the number of the others.

    Parameters
    ----------
    names : sequence of str
    """
    words = ", ".join(names[:NAMED])
    if len(names) > NAMED:
        words += f" and {len(names) - NAMED} more"
    return words


def interval_in_words(
    start: float, end: float, chainage: float, length: float, why: str, sigma: float
) -> tuple[str, str]:
    """Location of an unconstrained part, and the reason, with its sigma.

    Parameters
    ----------
    start, end : float
        Units: s.
    chainage, length : float
        Units: m.
    why : str
    sigma : float
        Units: m.
    """
    return (
        f"{start:.1f} to {end:.1f} s, chainage {chainage:.0f} to {chainage + length:.0f} m",
        f"{why}; sigma up to {length_in_words(sigma)}",
    )


def assumed_in_words(row: Mapping[str, Any], use: str | None = None) -> tuple[str, str]:
    """Unstated accuracy: its name, and its default with its size estimated in this survey.

    Parameters
    ----------
    row : dict
        Row of ``assumed`` of a document.
    use : str, optional
        Use of a default without an estimate.
    """
    text = f"{_assumed_size(row['value'], row['unit'])} assumed"
    if row.get("estimate") is not None:
        text += f"; estimated from this survey: {_assumed_size(row['estimate'], row['unit'])}"
    elif use is not None:
        text += f"; {use}"
    return ASSUMED_NAMES.get(row["key"], row["key"]), text


def _assumed_size(value, unit):
    """Format a size, or several, in words."""
    values = [value]
    if isinstance(value, list | tuple):
        values = value
    if not all(map(known, values)):
        return "–"
    if unit == "m":
        return length_in_words(values[0])
    sign = f" {unit}"
    if unit == "deg":
        sign = "°"
    return ", ".join(f"{each:.2g}{sign}" for each in values)


def _verb(count, singular, plural):
    if count == 1:
        return singular
    return plural


# A correction: its result


def _change(before, after, kind):
    return (
        f"3D RMSE at {JUDGES[kind]}: {length_in_words(before)} before, {length_in_words(after)} "
        "after the correction"
    )


def _improved(before, after, kind, times, holds_everywhere):
    """Sentence on the improvement; without a factor if a part of the cloud may be as wrong as
    before.
    """
    addition = ""
    if not holds_everywhere:
        addition = ". It does not apply to the whole cloud; the items below state where"
    elif times is not None:
        addition = f" ({times:.0f} times smaller)"
    return f"{_change(before, after, kind)}{addition}."


def points_in_words(points: int, observations: int) -> str:
    """Number of points: '8 points', or '12 observations of 8 points'.

    Parameters
    ----------
    points, observations : int
    """
    words = counted(points, "point")
    if points == observations:
        return words
    return f"{observations} observations of {words}"


def _rmse(before, after):
    """RMSE (3,) before and after, with the decimals of the smallest one."""
    low = min(*before, *after)
    decimals = 4
    if low >= 0.03:
        decimals = 2
    elif low >= 0.003:
        decimals = 3
    pair = ["/".join(number(value, decimals) for value in values) for values in (before, after)]
    return f"RMSE {pair[0]} m before, {pair[1]} m after (E/N/H)"


def _rmse_of_checks(before, after, points, observations):
    return (
        f"Check points, not used in the estimate: {_rmse(before, after)}, "
        f"{points_in_words(points, observations)}."
    )


def _rmse_left_out(before, after, points, observations, has_checks):
    none = "There are no check points."
    if has_checks:
        none = "No check point was found in the cloud."
    return (
        f"{none} Control points, leave-one-out: {_rmse(before, after)}, "
        f"{points_in_words(points, observations)}."
    )


def _rmse_of_fit(before, after, points, observations):
    return (
        f"Fit to the points used for the correction: {_rmse(before, after)}, "
        f"{points_in_words(points, observations)}. No independent point shows the accuracy "
        "elsewhere."
    )


def _worse_axes(rises, points, observations):
    axes = ", ".join(f"{axis} by {number(rise)} m" for axis, rise in rises.items())
    return (
        f"The RMSE of {points_in_words(points, observations)} increased after the correction: "
        f"{axes}."
    )


# A correction: its points


def _scored(scored, surveyed):
    were = _verb(scored, "was", "were")
    return f"{scored} of {surveyed} surveyed check points {were} found and used for the RMSE."


def _lost(names, words):
    points = _verb(len(names), "check point was", "check points were")
    return f"{len(names)} {points} {words} ({names_in_words(names)}). The error there is unknown."


def _elsewhere(count, by_others):
    return f"{count} {_verb(count, 'was', 'were')} {PLACES[by_others]}."


def _control(scored, surveyed, refused, hidden, elsewhere):
    parts = [f"{scored} of {surveyed} surveyed points used"]
    for names, words in ((refused, "rejected"), (hidden, "not found")):
        if names:
            parts.append(f"{len(names)} {words} ({names_in_words(names)})")
    parts += [f"{count} {PLACES[by_others]}" for by_others, count in elsewhere.items()]
    return f"{', '.join(parts)}."


def _uncontrolled(is_tied, sigma):
    """Sentence on the reference of a result without control points."""
    result = "No control point was used: the absolute position of the cloud is that of the POS."
    if is_tied:
        result += (
            " Tie features align the passes with one another. The accuracy is relative only, and "
            "an error that all passes share remains."
        )
    if sigma > 0:
        result += f" Expected error up to {length_in_words(sigma)} (1 sigma)."
    return result


def _moved(held, extrapolated, left):
    """Sentence on the share of corrected points, and the basis."""
    total = max(held + extrapolated + left, 1)
    sentence = (
        f"{percent(held / total)} of all points constrained by control, "
        f"{percent(extrapolated / total)} extrapolated, {percent(left / total)} not corrected."
    )
    if left:
        sentence += (
            f" {left} of {total} points were measured outside the trajectory or in its gaps."
        )
    return sentence


def _datum(lengths):
    terms = ", ".join(f"{term} {length_in_words(length)}" for term, length in lengths.items())
    return (
        f"Control and cloud differ systematically ({terms}). Check points from the same survey "
        "cannot show this."
    )


def _extrapolated(seconds, metres, share, sigma):
    return (
        f"{seconds:.1f} s ({metres:.0f} m, {percent(share)} of the points) are outside the "
        "control. The correction is extrapolated there; expected error up to "
        f"{length_in_words(sigma)} (1 sigma)."
    )


def _left_out(rmse, rmse_3d):
    axes = ", ".join(map(length_in_words, rmse))
    return (
        f"3D RMSE at control points, each predicted from the others: {length_in_words(rmse_3d)} "
        f"({axes} in E, N, H)."
    )


def _sigma(largest, time, median):
    return (
        f"3D sigma of the corrected position: median {length_in_words(median)}, largest "
        f"{length_in_words(largest)} (at {time:.1f} s)."
    )


def _assumed(count, purpose, sections, has_sigma):
    columns = ""
    if has_sigma:
        columns = ", or add sigma columns to the trajectory"
    return (
        f"{counted(count, 'accuracy')} {_verb(count, 'was', 'were')} not given and "
        f"{_verb(count, 'is', 'are')} assumed{purpose}. Set known values under {joined(sections)} "
        f"in survey.toml{columns}."
    )


# Ties between passes, for readers new to them


def _unused_ties(n, has_control):
    outcome = "The passes were not aligned with each other."
    if has_control:
        outcome = "The correction is based on the control points alone."
    return (
        f"None of the {thousands(n)} tie features was used, because more than half of them "
        f"contradict the others. {outcome}"
    )


def _ties_apart(n, before, after):
    return (
        f"Median misclosure of {thousands(n)} tie features (walls, road surfaces, poles and "
        f"painted lines scanned twice): {length_in_words(before)} before, "
        f"{length_in_words(after)} after the correction."
    )


def _wrong_ties(wrong):
    return (
        f"{thousands(wrong)} of these tie features {_verb(wrong, 'was', 'were')} rejected because "
        "the others contradict them. Likely causes: moving cars, people, foliage, or repeated "
        "facade elements matched wrongly."
    )


def _share(control):
    return (
        f"Information on the drift: {percent(control)} from control points, "
        f"{percent(1 - control)} from tie features."
    )


def _sufficient(control, sufficient):
    points = f"{sufficient} of them, evenly spaced,"
    if sufficient == 1:
        points = "1 of them"
    return (
        f"{control} control points were used; {points} would give a sigma within 10 % of the "
        "present one."
    )


def _all_needed(control):
    points = f"All {control}"
    if control == 2:
        points = "Both"
    return f"{points} control points are needed: with fewer, the sigma of the correction increases."


# A calibration


def _relative(first, name, fit, lever_arm, boresight):
    both = f"No wall was scanned by both scanner {first} and scanner {name}."
    if fit is not None:
        both = (
            f"Walls scanned by both scanner {first} and scanner {name} agree to "
            f"{millimetres(fit)} mm."
        )
    return (
        f"{both} Sigma of scanner {name} relative to scanner {first}: lever arm "
        f"{'/'.join(map(millimetres, lever_arm))} mm (right/forward/up), boresight "
        f"{'/'.join(f'{sigma:.3f}' for sigma in boresight)} deg about the same axes."
    )


def _component(row):
    """Component of a mounting, with its correction and sigma in mm or deg."""
    value = row["lsc"]
    sigma = row["lsc_sigma"]
    if row["unit"] == "m":
        return f"{row['name']} {millimetres(value)} ± {millimetres(sigma)} mm"
    return f"{row['name']} {value:.3f} ± {sigma:.3f} deg"


def _lacks(components):
    words = []
    for row in components:
        text = _component(row)
        if not row["determined"]:
            text += " (not determined)"
        words.append(text)
    return f"Corrections to the recorded mounting: {', '.join(words)}."


def _undetermined(components, count):
    return (
        f"This geometry determines {count - len(components)} of {count} components. Not "
        f"determined: {', '.join(map(_component, components))}. Their sigmas rest on the stated "
        "accuracy of the POS."
    )


def _calibrated(end: str) -> Callable[..., str]:
    """Wording of the errors of targets of a role before and after."""

    def sentence(role, before, after):
        return (
            f"3D RMSE at {role} points: {length_in_words(before)} before, {length_in_words(after)} "
            f"after the calibration{end}"
        )

    return sentence


def _scanner(end: str) -> Callable[..., str]:
    """Wording of errors of the scanner's own ranges and encoder."""

    def sentence(range_offset, encoder_scale):
        undetermined = []
        for row in (range_offset, encoder_scale):
            words = ""
            if row["significant"] and not row["determined"]:
                words = " (not determined)"
            undetermined.append(words)
        return (
            f"Range offset {millimetres(range_offset['correction'])} ± "
            f"{millimetres(range_offset['sigma'])} mm{undetermined[0]}, scale of the scan angles "
            f"{1e3 * encoder_scale['correction']:.2f} ± {1e3 * encoder_scale['sigma']:.2f} mrad "
            f"per rad{undetermined[1]}{end}"
        )

    return sentence


def _two_passes(used, n, is_between_scanners, before, after, without_drift):
    views = "between passes"
    if is_between_scanners:
        views = "between passes or scanners"
    sentence = (
        f"{used} of {n} tie features {views} were used. Median misclosure: "
        f"{length_in_words(before)} before, {length_in_words(after)} after the calibration"
    )
    if without_drift is not None:
        sentence += f", {length_in_words(without_drift)} with the drift removed"
    return f"{sentence}."


# A comparison of methods


def _no_method(least, raw):
    return (
        f"No method reduces the 3D RMSE by {1000 * least:.0f} mm or more. The recorded cloud has "
        f"{number(raw)} m."
    )


def _best(name, about, rmse, raw):
    return (
        f"Best method: {name}, 3D RMSE {number(rmse)} m; {number(raw)} m without correction. "
        f"{about}"
    )


def _several_best(names, rmse, raw, least):
    return (
        f"Best methods: {joined(names)}, 3D RMSE {number(rmse)} m; {number(raw)} m without "
        f"correction. They differ by less than {1000 * least:.0f} mm, which is not significant."
    )


def _best_of_kind(kind, name, rmse):
    return f"{OTHERS[kind]}: {name}, {number(rmse)} m."


def _behind(name, rmse, behind):
    return f"{name} has {number(rmse)} m, {number(behind)} m more than the best."


def _fitted(control):
    return f"Every method was fitted to the same {counted(control, 'control point')}"


def _scored_by_checks(control, check):
    return f"{_fitted(control)} and tested at {counted(check, 'check point')} not used in the fit."


def _scored_by_fit(control):
    return f"{_fitted(control)}. No independent point is left: the scores show the fit only."


def _cross_validated(control, check, groups):
    too_few = "no check points"
    others = ""
    if check:
        too_few = f"only {counted(check, 'check point')}"
        others = " Each check point is predicted from all control points."
    left = f"in {groups} groups"
    if groups == control:
        left = "leave-one-out"
    return (
        f"{_fitted(control)}. As there {_verb(check, 'is', 'are')} {too_few}, the scores are "
        f"cross-validated ({left}): control points are predicted from the others.{others}"
    )


def _tied(name, count):
    return (
        f"{name} also uses {counted(count, 'tie')} between passes (planes, poles and paint). All "
        "other methods use the control points only."
    )


def _untied(name, other, why):
    sentence = f"{name} equals {other} here because no ties were used."
    if why:
        sentence += f" {why}"
    return sentence


def _finely(value):
    """Format a difference of two results, to a tenth of a millimeter below a centimeter."""
    if value < 0.0095:
        return f"{1000 * value:.1f} mm"
    return length_in_words(value)


def _trajectories_differ(largest, time, rms, axes):
    by_axis = ", ".join(_finely(axes[name]) for name in ("easting", "northing", "height"))
    return (
        f"The corrected positions differ by up to {_finely(largest)} in 3D (at {time:.1f} s), "
        f"{_finely(rms)} RMS ({by_axis} in E, N, H)."
    )


def _epochs_differ(interpolated, first, second):
    words = []
    if interpolated:
        words.append(
            f"{counted(interpolated, 'epoch')} of the first result "
            f"{'has' if interpolated == 1 else 'have'} no counterpart in the second, which was "
            "interpolated there."
        )
    if first or second:
        words.append(
            f"Not covered by the other trajectory and therefore not compared: "
            f"{counted(first, 'epoch')} of the first, {second} of the second."
        )
    return " ".join(words)


def _scores_of_results(name, first, second, difference, counts):
    observed = " and ".join(counted(count, "observation") for count in dict.fromkeys(counts))
    words = "no change" if abs(difference) < 5e-5 else f"{1000 * difference:+.1f} mm"
    return (
        f"3D RMSE at {name}: {_finely(first)} in the first, {_finely(second)} in the second "
        f"({words}; {observed})."
    )


def _residuals_differ(name, change, count, all, least):
    if not count:
        return (
            f"No residual differs by more than {length_in_words(least)}; largest difference "
            f"{_finely(change)} at {name}."
        )
    return (
        f"The residuals of {count} of {counted(all, 'observation')} differ by more than "
        f"{length_in_words(least)}, most at {name} ({_finely(change)}):"
    )


def _values_differ(count, all):
    if not count:
        return f"All {all} values of model and coverage agree."
    return f"{count} of {all} values of model and coverage differ (first → second):"


def _inputs_differ(count, all):
    if not count:
        return f"All {all} inputs have the same contents."
    return f"{count} of {counted(all, 'input')} differ:"


CORRELATED = (
    "The test disregards the correlation between neighboring check points: a value just outside "
    "the limits proves little."
)


def _check_sigmas(relation: str, consequence: str) -> Callable[..., str]:
    """Sentence on the test of check points, by the relation of their residuals to the sigmas."""

    def sentence(points, statistic, degrees_of_freedom, limits, significance, factor):
        inside = "within"
        if consequence:
            inside = "outside"
        return (
            f"The residuals at {counted(points, 'check point')} {relation} their stated sigmas: "
            f"chi-squared {statistic:.1f} with {degrees_of_freedom} degrees of freedom, {inside} "
            f"the limits {limits[0]:.1f} and {limits[1]:.1f} ({percent(1 - significance)}). "
            f"{consequence.format(factor=factor)}{CORRELATED}"
        )

    return sentence


SENTENCES: dict[str, Wording] = {
    "nothing to judge by": "The accuracy of the correction is unknown: no point was surveyed.",
    "no target to judge by": "The accuracy of the correction is unknown: no target was found.",
    "hardly changed": lambda before, after, kind: (
        f"The correction hardly changed the cloud. {_change(before, after, kind)}."
    ),
    "changed within sigma": lambda before, after, kind: (
        f"The change is smaller than the accuracy of these targets. {_change(before, after, kind)}."
    ),
    "made worse": lambda before, after, kind: (
        f"The correction made the cloud worse; don't use it. {_change(before, after, kind)}."
    ),
    "improved": _improved,
    "rmse of check points": _rmse_of_checks,
    "rmse left out": _rmse_left_out,
    "rmse of the fit": _rmse_of_fit,
    "worse axes": _worse_axes,
    "points": _moved,
    "no check point": "No check point was surveyed: there is no independent test of this result.",
    "check points": _scored,
    "hidden check points": lambda names: _lost(
        names, "not found although the cloud covers the surroundings"
    ),
    "refused check points": lambda names: _lost(
        names, "found but rejected, because position, kind or size does not fit"
    ),
    "check points elsewhere": _elsewhere,
    "control points": _control,
    "no control point": _uncontrolled,
    "control of other drives": "This drive has no control point of its own. Control points of "
    "other drives constrain it through ties.",
    "datum": _datum,
    "held by other drives": "Control points of other drives constrain the whole drive through "
    "ties.",
    "held": "Control points constrain the whole drive.",
    "extrapolated": _extrapolated,
    "between control points": lambda sigma: (
        f"Between control points, expected error up to {length_in_words(sigma)}."
    ),
    "left out": _left_out,
    "single control point": "No leave-one-out test is possible with a single control point: only "
    "the stated sigmas of the POS check it.",
    "sigma": _sigma,
    "stated sigma": lambda sigma: (
        f"The POS states {length_in_words(sigma)} for the recorded position."
    ),
    "assumed": _assumed,
    "warnings": lambda count: f"{counted(count, 'warning')}:",
    "check sigmas hold": _check_sigmas("agree with", ""),
    "check sigmas too small": _check_sigmas(
        "exceed",
        "The sigmas are too small by a factor of about {factor:.1f}, or some check points are "
        "wrong. ",
    ),
    "check sigmas too large": _check_sigmas(
        "are smaller than",
        "The sigmas are pessimistic: the residuals are only {factor:.2f} times as large. ",
    ),
    "no ties": "{reason}",
    "unused ties": _unused_ties,
    "ties": _ties_apart,
    "contradicting ties": _wrong_ties,
    "relative ties": "The accuracy is relative only: no control point was used, and an error "
    "that all passes share remains in the cloud.",
    "share of control": _share,
    "sufficient control": _sufficient,
    "all control needed": _all_needed,
    "scanners together": _relative,
    "mounting not told": "This geometry can't confirm the recorded mounting.",
    "mounting holds": "The recorded mounting is confirmed: no correction exceeds {sigmas:g} sigma.",
    "determined parts hold": "The determined components of the recorded mounting are confirmed: no "
    "correction exceeds {sigmas:g} sigma.",
    "mounting lacks": _lacks,
    "all parts determined": "This geometry determines all {count} components.",
    "parts not determined": _undetermined,
    "no target": "The accuracy of the calibration is unknown: no target was found.",
    "fit of a calibration": _calibrated(" (fit only, no independent check)."),
    "calibration tested": _calibrated(" (not used in the estimate)."),
    "worse by the scanner": _calibrated(
        " (not used in the estimate; errors of the scanner itself remain)."
    ),
    "worse by chance": _calibrated(
        " (not used in the estimate). No component changed significantly."
    ),
    "scanner is off": _scanner("; the mounting is free of these errors."),
    "scanner is right": _scanner(": not significant."),
    "scanner hardly told": _scanner("; this geometry hardly determines them."),
    "two passes": _two_passes,
    "no method improves": _no_method,
    "best method": _best,
    "best methods": _several_best,
    "best of a kind": _best_of_kind,
    "behind the best": _behind,
    "scored by check points": _scored_by_checks,
    "scored by the fit": _scored_by_fit,
    "cross-validated": _cross_validated,
    "method with ties": _tied,
    "method without ties": _untied,
    "methods without a score": "{count} of {methods} methods have no score.",
    "equal trajectories": "The corrected trajectories are equal at all {epochs} epochs.",
    "trajectories differ": _trajectories_differ,
    "epochs differ": _epochs_differ,
    "scores of results": _scores_of_results,
    "residuals differ": _residuals_differ,
    "surveyed differently": lambda count: (
        f"{counted(count, 'surveyed point')} "
        f"{'has' if count == 1 else 'have'} different coordinates in the second result:"
    ),
    "same targets used": "Both results use the same {n} observations of targets.",
    "targets used in one": lambda count: (
        f"{counted(count, 'observation')} "
        f"{'was' if count == 1 else 'were'} used in one result only:"
    ),
    "values differ": _values_differ,
    "inputs differ": _inputs_differ,
    "warnings of one": lambda count: (
        f"{counted(count, 'warning')} {'appears' if count == 1 else 'appear'} in one result only:"
    ),
}


def in_words(statements: Iterable[Statement]) -> list[str]:
    """Return the sentences of statements.

    Parameters
    ----------
    statements : iterable of Statement
        With keys of SENTENCES.
    """
    return [statement.sentence(SENTENCES) for statement in statements]


# The first screen and the certificate of a correction

FIRST_SCREEN: dict[str, Wording] = {
    "rmse at check": "3D RMSE at check points, before → after",
    "rmse at leave-one-out": "3D RMSE at control points, before → leave-one-out",
    "rmse at fit": "3D RMSE at control points, before → after (fit only)",
    "nothing judges": "no residual judges the result",
    "control used": "surveyed control points used",
    "well determined": "of the drive is well determined by control",
    "crs": "Coordinate reference system",
    "no crs": "not stated in survey.toml",
    "recorded": "Recorded",
    "recorded on a date": "{start:%Y-%m-%d}, {start:%H:%M:%S} to {end:%H:%M:%S} GPS time",
    "recorded on a weekday": "{day}, {start} to {end} GPS time (the files state no date)",
    "cloud files": "Cloud files",
    "other files": "Other input files",
}


def _corrected_points(points: int, files: int, outside: int) -> str:
    return (
        f"The coordinates of {thousands(points)} points of a mobile laser scan in "
        f"{counted(files, 'file')} were corrected for the error of the positioning system by least "
        f"squares collocation on surveyed targets. {thousands(outside)} points lie outside the "
        "trajectory and are unchanged. Page 2 lists the files."
    )


def _tested_sigmas(
    verdict: str,
    statistic: float,
    degrees_of_freedom: int,
    limits: Sequence[float],
    significance: float,
) -> str:
    relation = f"The stated sigmas are {verdict}"
    if verdict == "hold":
        relation = "The stated sigmas hold"
    low, high = limits
    return (
        f"{relation}: chi-squared of the check residuals over their sigmas is {statistic:.1f} "
        f"({degrees_of_freedom} degrees of freedom, limits {low:.1f} and {high:.1f} at "
        f"{percent(1 - significance)})."
    )


def _accuracy_class(horizontal: float, vertical: float, standard: str, conforms: bool) -> str:
    verb = "conforms" if conforms else "does not conform"
    return (
        f"Accuracy class: {horizontal} cm horizontal, {vertical} cm vertical. The test {verb} to "
        f"the {standard}."
    )


CERTIFICATE: dict[str, Wording] = {
    "corrected points": _corrected_points,
    "residuals": "Residual = surveyed − observed. Check points took no part in the correction; in "
    "the leave-one-out, each control point is predicted by the others.",
    "accuracy class": _accuracy_class,
    "no accuracy": "Not determined: no point judges the result.",
    "sigmas tested": _tested_sigmas,
    "well determined": lambda share: (
        f"{percent(share)} of the driven distance is well determined by control."
    ),
    "all constrained": "None: control constrains the whole drive.",
    "more files": "and {count} more; report.json lists all with their SHA-256",
    "more intervals": "and {count} more with smaller sigmas; weak.csv lists all",
    "warning": "Warning: {text}",
    "foot": "Written {time} by {software}. Page {page} of 2",
}

MEANINGS = {  # key of the model in report.json -> name, unit, meaning
    "method": ("Method", "", "lsc: least squares collocation (Mao et al. 2015)"),
    "order": (
        "Order of the trend",
        "",
        "degree of the polynomial in time on each axis; none: the drift alone",
    ),
    "estimated_by": ("Parameters estimated by", "", "criterion and data that chose them"),
    "log_likelihood": (
        "Log-likelihood",
        "",
        "of the observations under this model; only differences between models count",
    ),
    "sigma0": ("sigma0", "1", "square root of the variance of unit weight; 1: stated sigmas hold"),
    "covariance.family": (
        "Covariance function",
        "",
        "process of the position's drift: exponential, Matérn 3/2 or 5/2, or integrated walk",
    ),
    "covariance.correlation_time": (
        "Correlation time of the drift",
        "s",
        "time after which the position error has forgotten most of its value",
    ),
    "covariance.scale": (
        "Scale of the drift",
        "1",
        "factor on the stated sigma of the position; 1: the POS states it correctly",
    ),
    "covariance.jitter_correlation_time": (
        "Correlation time of the fast part",
        "s",
        "of position errors that change faster than the drift",
    ),
    "covariance.jitter_scale": (
        "Scale of the fast part",
        "1",
        "factor on the stated sigma of the position for this part",
    ),
    "covariance.bias_correlation_time": (
        "Correlation time of the slow part",
        "s",
        "of position errors that last longer than the drift",
    ),
    "covariance.bias_scale": (
        "Scale of the slow part",
        "1",
        "factor on the stated sigma of the position for this part",
    ),
    "covariance.level_scale": (
        "Scale of the level",
        "1",
        "factor on the stated sigma for an offset that stays within a segment",
    ),
    "covariance.attitude_scale": (
        "Scale of the attitude",
        "1",
        "factor on the stated sigmas of roll, pitch and heading",
    ),
    "global_test.statistic": (
        "Global test: statistic",
        "1",
        "weighted sum of squared residuals of the adjustment",
    ),
    "global_test.redundancy": (
        "Global test: redundancy",
        "1",
        "observations that are not needed to determine the correction",
    ),
    "global_test.limits": ("Global test: limits", "1", "the statistic must lie between them"),
    "global_test.passed": ("Global test: passed", "", "whether model and sigmas fit the residuals"),
    "determined": ("Determined by control", "", "components of the pose that control determines"),
    "variance_ratio": (
        "Variance ratio",
        "1",
        "posterior over prior variance: near 0 control determines the component, near 1 the POS",
    ),
    "longest_gap": ("Longest interval without control", "s", "its start and end, gps_time"),
    "passes_without_control": (
        "Passes without control",
        "s",
        "start and end of each, gps_time",
    ),
    "warnings": ("Warnings", "", "of the estimate"),
}
