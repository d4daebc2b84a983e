"""Parallel blocks on all cores: slices of rows for threads, and reused arrays."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numpy as np

WORKERS = min(os.cpu_count() or 1, 8)  # threads; more would only wait for memory


class Workspace:
    """Arrays reused from block to block, because new memory costs more than filling it."""

    def __init__(self):
        self._flat = {}

    def array(self, name: str, *shape: int, dtype: type = float) -> np.ndarray:
        """Return an array by name, whose previous contents are lost.

        Parameters
        ----------
        name : str
        """
        size = int(np.prod(shape))
        if name not in self._flat or self._flat[name].size < size:
            self._flat[name] = np.empty(size, dtype)
        return self._flat[name][:size].reshape(shape)


def in_slices(n: int, kernel: Callable, rows: tuple, constants: tuple) -> list:
    """Call a compiled kernel(*rows, *constants) for slices of n rows, on all cores in parallel.

    Results are listed in the order of the slices, with the first row of each. Every row must be
    computed independently, so that the number of slices does not affect the result.

    Parameters
    ----------
    n : int
        Columns.
    kernel : compiled function
    rows : tuple of (n, ...) array
        First arguments of the kernel, sliced.
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
    """Return persistent threads, because starting them for every block costs more than the work."""
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="mlscorr")


os.register_at_fork(after_in_child=pool.cache_clear)  # a forked process has none of these threads
