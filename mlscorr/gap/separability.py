"""Which effects a geometry can tell apart, and how small an effect it can find: without data."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.background import BELIEVED
from mlscorr.gap.estimate import DETECTABLE
from mlscorr.gap.whitening import whitener

SAME = 0.9  # squared correlation above which two signatures are one class


@dataclass(frozen=True)
class Separability:
    """Signatures compared in the metric of V^-1.

    Parameters
    ----------
    names : tuple of c str
        Of each parameter: "range_bias", "lever_arm up".
    effects, units : tuples of c str
    correlation : (c, c) array
    detectable : (c,) array
        Minimal detectable bias of each parameter alone.
    classes : tuple of tuples of str
        Effects of which some parameters can't be told apart.
    normal : (c, c) array
        A^T V^-1 A of the parameters.
    """

    names: tuple[str, ...]
    effects: tuple[str, ...]
    units: tuple[str, ...]
    correlation: np.ndarray
    detectable: np.ndarray
    classes: tuple[tuple[str, ...], ...]
    normal: np.ndarray

    def same(self, effect, estimate=None):
        """Effects that shift the rows as this one does, with squared correlation above SAME.

        estimate (p,) is of its parameters; without it any of them alone counts.
        """
        mine = self._rows(effect)
        if len(mine) == 0:
            return (effect,)
        ways = np.eye(len(mine)) if estimate is None else np.asarray(estimate, float)[None]
        names = dict.fromkeys(self.effects)
        return tuple(n for n in names if any(self.share(effect, way, n) > SAME for way in ways))

    def share(self, effect, estimate, other):
        """Share of an effect's squared signal that the best parameters of another explain."""
        mine, others = self._rows(effect), self._rows(other)
        signal = estimate @ self.normal[np.ix_(mine, mine)] @ estimate
        if signal <= 0 or len(others) == 0:
            return 0.0
        across = self.normal[np.ix_(others, mine)] @ estimate
        scale = np.sqrt(np.diag(self.normal)[others])
        scaled = self.normal[np.ix_(others, others)] / np.outer(scale, scale)
        explained = (across / scale) @ np.linalg.pinv(scaled, rcond=1e-9) @ (across / scale)
        return float(explained / signal)

    def _rows(self, effect):
        return np.flatnonzero([name == effect for name in self.effects])


def separability(epochs, signatures, setting=BELIEVED):
    """Compare the signatures that are no events: one that has many members is left out.

    Parameters
    ----------
    epochs : Epochs
    signatures : tuple of Signature
    setting : Setting
        Of V.
    """
    several = {}
    for one in signatures:
        several[one.name] = several.get(one.name, 0) + 1
    use = [one for one in signatures if several[one.name] == 1 and not one.is_noise]
    columns = [epochs.columns(one.jacobian) for one in use]
    names, effects, units = [], [], []
    for one in use:
        alone = len(one.parameters) == 1
        names += [one.name if alone else f"{one.name} {part}" for part in one.parameters]
        effects += [one.name] * len(one.parameters)
        units += one.units
    columns = np.hstack([np.zeros((len(epochs), 0)), *columns])
    white = whitener(epochs, setting).whiten(columns)
    normal = white.product(white)
    seen = np.flatnonzero(np.diag(normal) > 0)
    names, effects, units = ([values[i] for i in seen] for values in (names, effects, units))
    normal = normal[np.ix_(seen, seen)]
    length = np.sqrt(np.diag(normal))
    correlation = normal / np.outer(length, length)
    return Separability(
        tuple(names),
        tuple(effects),
        tuple(units),
        correlation,
        DETECTABLE / length,
        _classes(effects, correlation**2 > SAME),
        normal,
    )


def _classes(effects, same):
    """Effects joined by parameters that are the same, in the order in which they come."""
    group = np.arange(len(effects))
    for i, j in zip(*np.nonzero(np.triu(same, 1)), strict=True):
        group[group == group[j]] = group[i]
    classes = []
    for number in dict.fromkeys(group.tolist()):
        members = tuple(dict.fromkeys(effects[i] for i in np.flatnonzero(group == number)))
        if len(members) > 1:
            classes.append(members)
    return tuple(classes)
