"""Blocks on all cores: slices of rows to threads, and arrays that serve again."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numpy as np

WORKERS = min(os.cpu_count() or 1, 8)  # threads; beyond, memory is what they wait for


class Workspace:
    """Arrays that serve again from block to block: fresh memory costs more than what fills it."""

    def __init__(self):
        self._flat = {}

    def array(self, name: str, *shape: int, dtype: type = float) -> np.ndarray:
        """An array of a name, whose content, and that of the one before it, is lost.

        Parameters
        ----------
        name : str
        """
        size = int(np.prod(shape))
        if name not in self._flat or self._flat[name].size < size:
            self._flat[name] = np.empty(size, dtype)
        return self._flat[name][:size].reshape(shape)


def in_slices(n: int, kernel: Callable, rows: tuple, constants: tuple) -> list:
    """Call a compiled kernel(*rows, *constants) for slices of n rows, on all cores at once.

    What it returns is listed in the order of the slices, with the first row of each. Every row
    must be computed by itself, so that the number of slices leaves no trace.

    Parameters
    ----------
    n : int
        Columns.
    kernel : compiled function
    rows : tuple of (n, ...) array
        First arguments of the kernel, of which each slice takes its part.
    constants : tuple
        Its other arguments.
    """
    parts = min(WORKERS, 1 + n // 4_000)  # rows that are worth a thread
    slices = [slice(*pair) for pair in pairwise(np.linspace(0, n, parts + 1).astype(int))]

    def work(part):
        return part.start, kernel(*(row[part] for row in rows), *constants)

    if len(slices) > 1:
        return list(pool().map(work, slices))
    return [work(slices[0])]


@cache
def pool() -> ThreadPoolExecutor:
    """Threads that stay, as starting them for every block costs more than the work."""
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="mlscorr")


os.register_at_fork(after_in_child=pool.cache_clear)  # a forked process has no threads of these
