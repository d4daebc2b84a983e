"""A user's own effect is applied so that whatever its code does ends in a sentence."""

import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from traceback import extract_tb
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation


def checked_change(effect: Any, change: Callable, value: Any, *given: Any) -> Any:
    """What a user's effect makes of the value of its stage, whose columns it can't write into.

    Parameters
    ----------
    effect : Effect
    change : function
        Of the effect: from a value and what else is given to the changed value.
    value
        Of its stage.
    *given

    Raises
    ------
    ValueError
        Where it raises anything, or gives what can't take the place of the value: of another type,
        shape or kind of numbers, or no numbers.
    """
    if is_dataclass(value):
        columns = {f.name: getattr(value, f.name) for f in fields(value)}
    else:
        columns = {}
    arrays = [name for name, column in columns.items() if isinstance(column, np.ndarray)]
    views = {name: np.broadcast_to(columns[name], columns[name].shape) for name in arrays}
    try:
        changed = change(replace(value, **views) if views else value, *given)
        if not all(hasattr(changed, name) for name in columns):
            raise TypeError(f"it gives a {type(changed).__name__}")
        same = {name: columns[name] for name in arrays if getattr(changed, name) is views[name]}
        changed = replace(changed, **same) if same else changed
        for name, column in columns.items() or [("divergence", value)]:
            _check(name, column, getattr(changed, name, changed))
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        file = getattr(sys.modules.get(type(effect).__module__), "__file__", "") or "no file"
        lines = [
            f"line {f.lineno}, " for f in extract_tb(error.__traceback__) if f.filename == file
        ]
        raise ValueError(
            f"The effect {effect.name} ({''.join(lines[-1:])}{file}) can't be applied to the "
            f"{type(value).__name__} of its stage, {effect.stage}: {type(error).__name__}: "
            f"{str(error).rstrip('.')}. Mend its code, or leave it out; docs/own-simulator.md says "
            "what it is given and gives."
        ) from error
    return changed


def _check(name, old, new):
    """Refuse a column that can't take the place of the old one."""
    if new is old:
        return
    old, new = (np.asarray(c.as_quat() if isinstance(c, Rotation) else c) for c in (old, new))
    if new.shape != old.shape or not np.can_cast(new.dtype, old.dtype, "same_kind"):
        raise ValueError(f"{name} is {new.dtype} {new.shape}, not {old.dtype} {old.shape}")
    if new.dtype.kind == "f" and (lost := np.isfinite(old) & ~np.isfinite(new)).any():
        raise ValueError(f"of {name} {lost.sum()} of {lost.size} numbers are not a number")
