"""Sentences on observations without a name, and on surveyed points without an observation."""

from collections.abc import Sequence

from mlscorr.survey import Statement, Wording
from mlscorr.wording import counted, number


def _metres(value: float) -> str:
    return f"{number(value, 2)} m"


def _seconds(time: float) -> str:
    return f"{number(time, 1)} s"


def _limit(search_radius: float) -> str:
    return f"search radius {_metres(search_radius)}"


def _corrected(neighbours: Sequence[tuple[str, float]], sigma: float) -> str:
    """State the neighbors by which an observation was corrected, and the sigma."""
    if not neighbours:
        return f"No other target constrains the misclosure there (sigma {_metres(sigma)})"
    words = [f"{name} ({later:+.1f} s)" for name, later in neighbours]
    listed = " and ".join(words)
    return f"Its neighbors {listed} predict the misclosure with a sigma of {_metres(sigma)}"


def _whereabouts(time: float, away: float, found_name: str | None) -> str:
    """State time of an observation, distance from a surveyed point, and its name if it has one."""
    name = ""
    if found_name is not None:
        name = f" (it is {found_name})"
    return f"was found at {_seconds(time)}, {_metres(away)} away{name}"


def _other_appearance(
    name, time, kind, size, surveyed_kind, surveyed_size, off, exchanged, neighbours, sigma
):
    sentence = (
        f"The observation at {_seconds(time)} is a {kind} of {_metres(size)} and {name} is a "
        f"{surveyed_kind} of {_metres(surveyed_size)}, {_metres(off)} from it after correction. "
        f"{_corrected(neighbours, sigma)}"
    )
    if not exchanged:
        return f"{sentence}. Kind or size is wrong in the survey or in the extraction."
    return f"{sentence}. {name} and {' or '.join(exchanged)} seem to be exchanged."


def _wrong_point(
    name, time, off, probability, observations, misclosure, search_radius, neighbours, sigma
):
    return (
        f"{name} is {_metres(off)} from the corrected observation at {_seconds(time)}. "
        f"{_corrected(neighbours, sigma)}. Its coordinates are wrong, or the observation is "
        f"another object (probability {number(probability)} by "
        f"{counted(observations, 'observation')}; misclosure {_metres(misclosure)}, "
        f"{_limit(search_radius)}): check its survey record, or exclude it."
    )


def _two_points(names, apart, time, probabilities, search_radius, neighbours, sigma):
    first, second = map(number, probabilities)
    return (
        f"{names[0]} and {names[1]}, {_metres(apart)} apart, both match the observation at "
        f"{_seconds(time)} ({_limit(search_radius)}, probability {first} and {second}). "
        f"{_corrected(neighbours, sigma)}."
    )


def _two_observations(name, apart, times, probability, search_radius, neighbours, sigma):
    return (
        f"Two observations {_metres(apart)} apart, at {_seconds(times[0])} and "
        f"{_seconds(times[1])}, both match {name} ({_limit(search_radius)}, probability "
        f"{number(probability)} of the first). {_corrected(neighbours, sigma)}."
    )


def _doubtful(name, misclosure, time, probability, wrong, search_radius, neighbours, sigma):
    return (
        f"The match of {name} with the observation at {_seconds(time)}, {_metres(misclosure)} "
        f"away, is uncertain ({_limit(search_radius)}, probability {number(probability)}; "
        f"{number(wrong)} for a wrong surveyed point). {_corrected(neighbours, sigma)}."
    )


def _another_object(name, time, off, misclosure, search_radius, neighbours, sigma):
    return (
        f"{name} is {_metres(off)} from the corrected observation at {_seconds(time)}. "
        f"{_corrected(neighbours, sigma)}. The observation is another object (misclosure "
        f"{_metres(misclosure)}, {_limit(search_radius)})."
    )


def _no_control(kind, size, time):
    return f"No point was surveyed for the {kind} of {_metres(size)} at {_seconds(time)}."


def _no_point_left(
    kind, size, time, search_radius, nearest, nearest_kind, nearest_size, distance, is_taken
):
    role = ""
    if is_taken:
        role = ", already matched in this pass,"
    return (
        f"No surveyed point remains for the {kind} of {_metres(size)} at {_seconds(time)} "
        f"({_limit(search_radius)}); the nearest, {nearest}{role} a {nearest_kind} of "
        f"{_metres(nearest_size)}, is {_metres(distance)} away."
    )


def _only_refused(kind, size, time, away, found_name, why):
    return (
        f"The nearest unmatched {kind} of {_metres(size)} "
        f"{_whereabouts(time, away, found_name)}. {sentence_of(why)}"
    )


def _only_others(kind, size, time, away, found_name, search_radius):
    return (
        f"Each {kind} of {_metres(size)} found near it ({_limit(search_radius)}) belongs to "
        f"another surveyed point; the nearest {_whereabouts(time, away, found_name)}."
    )


def _none_of_its_kind(
    kind, size, time, away, found_name, search_radius, nearest_kind, nearest_size
):
    return (
        f"No {kind} of {_metres(size)} was found near it ({_limit(search_radius)}). The nearest "
        f"target, a {nearest_kind} of {_metres(nearest_size)}, "
        f"{_whereabouts(time, away, found_name)}."
    )


REASONS: dict[str, Wording] = {
    "other appearance": _other_appearance,
    "wrong point": _wrong_point,
    "two points": _two_points,
    "two observations": _two_observations,
    "doubtful match": _doubtful,
    "another object": _another_object,
    "no control": _no_control,
    "no point left": _no_point_left,
    "nothing found": "No target was found in the cloud.",
    "only refused": _only_refused,
    "only others": _only_others,
    "none of its kind": _none_of_its_kind,
    "not matched": "{why}",
}


def sentence_of(why: Statement) -> str:
    """Return the sentence of a reason.

    Parameters
    ----------
    why : Statement
        With a key of REASONS.
    """
    return why.sentence(REASONS)
