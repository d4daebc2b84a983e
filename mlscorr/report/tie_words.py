"""What ties between passes did, in sentences for a reader who never heard of them."""

from typing import Any

from mlscorr.wording import length_in_words, percent, thousands


def tie_sentences(section: dict[str, Any] | None, control: int) -> list[str]:
    """What was seen twice, how far apart they are, and what that spares.

    Parameters
    ----------
    section : dict or None
        ``ties`` of report.json.
    control : int
        Number of control points that took part.

    Returns
    -------
    list of str
        Why there are none in one sentence; nothing where nobody looked for any.
    """
    if section is None:
        return []
    if section["n"] == 0:
        return [section["reason"]]
    if section["used"] == 0:
        return [
            f"None of the {thousands(section['n'])} places that were seen twice is used, since "
            "more than half of them contradict the others: "
            + ("control points alone made the correction." if control else "passes stay apart.")
        ]
    return [*_misfit(section), *_share(section, control)]


def _misfit(section):
    """How far apart passes lay and lie, and how many ties contradict the others."""
    before, after = (length_in_words(section[state]["median"]) for state in ("before", "after"))
    yield (
        "The same wall, road surface, pole or painted line was seen twice in "
        f"{thousands(section['n'])} places: there both views lay {before} apart before the "
        f"correction and lie {after} apart after it (median)."
    )
    wrong = section["n"] - section["used"]
    if wrong:
        yield (
            f"{thousands(wrong)} of these places {'is' if wrong == 1 else 'are'} not used, as the "
            "others contradict them: cars that moved, people, leaves, or one row of windows taken "
            "for the next."
        )


def _share(section, control):
    """What control and ties each bring, and how many control points would have done."""
    if control == 0:
        yield (
            "This is relative only; nothing is claimed in absolute terms: no control point takes "
            "part, and an error that all passes share stays in the cloud."
        )
        return
    if "share" not in section:  # an area's, of which the drive is a piece
        return
    share = section["share"]["control"]
    yield (
        f"Of what the result knows of the drive, {percent(share)} comes from control points and "
        f"{percent(1 - share)} from these places."
    )
    sufficient = section["sufficient_control"]
    if sufficient is None or control < 2:
        return
    if sufficient < control:
        if sufficient == 1:
            points = "1 of them"
        else:
            points = f"{sufficient} of them, evenly spread,"
        yield (
            f"{control} control points took part; {points} would have sufficed to know the drive "
            "about as well (to a tenth of its sigma)."
        )
    else:
        points = "Both" if control == 2 else f"All {control}"
        yield f"{points} control points were needed: with fewer the drive is known less well."
