"""Sentences of a correction's stages, on excluded or included control points."""

from mlscorr.survey import Wording
from mlscorr.wording import length_in_words


def _excluded(name: str, residual: float, by: str, with_point: float, without_point: float) -> str:
    before = length_in_words(with_point)
    after = length_in_words(without_point)
    return (
        f"{name} is excluded by the user; its 3D residual is {length_in_words(residual)}. "
        f"3D RMSE ({by}): {before} with it, {after} without it."
    )


CHOICES: dict[str, Wording] = {
    "excluded": _excluded,
    "included, contradicted": "{name} is used because include names it, and the other control "
    "points contradict it: statistic {statistic:.1f}, critical value {critical:.1f}. It pulls the "
    "correction toward its coordinates; check them.",
    "included, refused": "{name} is used because include names it. Matching rejected it: {reason}",
}
