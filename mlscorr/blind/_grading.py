"""The mechanisms that grade a diagnosis: nothing that trains or sets anything may open them."""

from mlscorr.simulate import Mechanism, mechanisms


def grading_mechanisms() -> tuple[Mechanism, ...]:
    """The half of the grammar on which nothing is set."""
    return tuple(each for each in mechanisms() if not each.is_for_training)
