"""Mechanisms that grade a diagnosis; training and settings must not use them."""

from mlscorr.simulate import Mechanism, mechanisms


def grading_mechanisms() -> tuple[Mechanism, ...]:
    """Return the half of the grammar that is reserved for grading."""
    return tuple(each for each in mechanisms() if not each.is_for_training)
