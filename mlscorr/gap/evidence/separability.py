"""Separability of effects in a geometry, and minimal detectable sizes, without data."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.gap.evidence.observations import STATED, ErrorModel, Observations
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.signatures import Signature


@dataclass(frozen=True)
class Separability:
    """Signatures compared in the metric of V^-1.

    Parameters
    ----------
    names : tuple of c str
        Name of each parameter: "range_bias", "lever_arm up".
    effects, units : tuples of c str
    normal : (c, c) array
        A^T V^-1 A of the parameters.
    """

    names: tuple[str, ...]
    effects: tuple[str, ...]
    units: tuple[str, ...]
    normal: np.ndarray

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the parameters: (c, c)."""
        length = np.sqrt(np.diag(self.normal))
        return self.normal / np.outer(length, length)

    @property
    def detectable(self) -> np.ndarray:
        """Minimal detectable bias of each parameter alone: (c,)."""
        return SETTINGS.detectable / np.sqrt(np.diag(self.normal))

    @property
    def classes(self) -> tuple[tuple[str, ...], ...]:
        """Effects with some parameters that are not separable, in order of appearance."""
        same = self.correlation**2 > SETTINGS.same
        group = np.arange(len(self.effects))
        for i, j in zip(*np.nonzero(np.triu(same, 1)), strict=True):
            group[group == group[j]] = group[i]
        classes = []
        for number in dict.fromkeys(group.tolist()):
            members = dict.fromkeys(self.effects[i] for i in np.flatnonzero(group == number))
            classes.append(tuple(members))
        return tuple(members for members in classes if len(members) > 1)

    def same(self, effect: str, estimate: np.ndarray | None = None) -> tuple[str, ...]:
        """Return effects that shift the rows like one, with a squared correlation of one class.

        Parameters
        ----------
        effect : str
        estimate : (p,) array, optional
            Of its parameters; without it any single one counts.
        """
        number = len(self._rows(effect))
        if number == 0:
            return (effect,)
        if estimate is None:
            directions = np.eye(number)
        else:
            directions = np.asarray(estimate, float)[None]
        return tuple(
            name
            for name in dict.fromkeys(self.effects)
            if any(self.share(effect, direction, name) > SETTINGS.same for direction in directions)
        )

    def share(self, effect: str, estimate: np.ndarray, other: str) -> float:
        """Share of an effect's squared signal explained by the best parameters of another.

        Parameters
        ----------
        effect : str
        estimate : (p,) array
            Of its parameters.
        other : str
        """
        numbers = self._rows(effect)
        others = self._rows(other)
        signal = estimate @ self.normal[np.ix_(numbers, numbers)] @ estimate
        if signal <= 0 or len(others) == 0:
            return 0.0
        across = self.normal[np.ix_(others, numbers)] @ estimate
        return explained_square(self.normal[np.ix_(others, others)], across) / float(signal)

    def _rows(self, effect):
        return np.flatnonzero([name == effect for name in self.effects])


def explained_square(normal: np.ndarray, across: np.ndarray) -> float:
    """Squared signal explained by the best amplitudes of some columns.

    Parameters
    ----------
    normal : (p, p) array
        A^T V^-1 A of the columns.
    across : (p,) array
        A^T V^-1 r with the signal r.
    """
    length = np.sqrt(np.diag(normal))
    visible = length > 0
    length, part = length[visible], across[visible] / length[visible]
    scaled = normal[np.ix_(visible, visible)] / np.outer(length, length)
    if visible.any():
        return float(part @ np.linalg.pinv(scaled, rcond=1e-9) @ part)
    return 0.0


def compare_signatures(
    observations: Observations, signatures: Sequence[Signature], model: ErrorModel = STATED
) -> Separability:
    """Compare the signatures that are not events; those with many members are omitted.

    Parameters
    ----------
    observations : Observations
    signatures : sequence of Signature
    model : ErrorModel
        Of V.
    """
    members = Counter(signature.name for signature in signatures)
    use = [s for s in signatures if members[s.name] == 1 and not s.is_noise]
    names = []
    effects = []
    units = []
    for s in use:
        is_scalar = len(s.parameters) == 1
        names += [s.name if is_scalar else f"{s.name} {part}" for part in s.parameters]
        effects += [s.name] * len(s.parameters)
        units += s.units
    columns = [observations.columns(s.jacobian) for s in use]
    columns = np.hstack([np.zeros((len(observations), 0)), *columns])
    white = observations.whitener(model).whiten(columns)
    normal = white.product(white)
    visible = np.flatnonzero(np.diag(normal) > 0)
    labels: list[tuple[str, ...]] = [
        tuple(values[i] for i in visible) for values in (names, effects, units)
    ]
    return Separability(labels[0], labels[1], labels[2], normal[np.ix_(visible, visible)])
