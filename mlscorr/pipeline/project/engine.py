"""Who works on tasks: this process, processes of this machine, or a cluster of others."""

import ctypes
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress

from mlscorr.io.preparation import temporary_folder

THREADS = ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
LARGE_ARRAY = 1 << 20  # B; glibc keeps freed ones of up to 32 MB: 0.15 GB after some tasks


class Loop:
    """No process but this, one call after the other: what loses it ends the run."""

    width, lost, losses = 1, 0, ()

    def submit(self, function: Callable, *arguments: object) -> Future:
        """A Future that is done."""
        future: Future = Future()
        future.set_result(function(*arguments))
        return future


class Processes:
    """Processes of this machine, which are started anew where one is lost.

    Parameters
    ----------
    width : int
        Number of them.
    """

    losses = (BrokenProcessPool,)

    def __init__(self, width: int) -> None:
        self.width, self.lost = width, 0
        self._executor: Executor | None = None
        self._others = {*multiprocessing.active_children()}

    def submit(self, function: Callable, *arguments: object) -> Future:
        """The Future of a call."""
        try:
            return self._pool().submit(function, *arguments)
        except BrokenProcessPool:
            self.lost += 1
            self.close()
            return self._pool().submit(function, *arguments)

    def _pool(self):
        if self._executor is None:
            context = multiprocessing.get_context("spawn")  # a fork may inherit held locks
            self._executor = ProcessPoolExecutor(
                self.width, context, _start_worker, (temporary_folder(),)
            )
        return self._executor

    def close(self) -> None:
        """End the processes, whatever they are at."""
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
            self._executor = None
            for process in {*multiprocessing.active_children()} - self._others:
                process.terminate()  # what it is at is whole or not there
                process.join()


def _in_single_threads(function, *arguments):
    """The result of a call in a worker that others started; libraries read this at their start."""
    for name in THREADS:
        os.environ.setdefault(name, "1")
    return function(*arguments)


def _start_worker(folder):
    """Leave interruptions to the process that waits for this one, and end with it.

    What it keeps for a while goes into that one's folder, which goes however this one ends. Large
    arrays' memory returns to the system at once, as dask has it, too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = folder
    with suppress(AttributeError, OSError, TypeError):  # a C library that isn't GNU's
        ctypes.CDLL(None).mallopt(-3, LARGE_ARRAY)  # M_MMAP_THRESHOLD of malloc.h
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent():
    """End this process when the one that waits for it was killed: nobody else would."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class Cluster:
    """Workers of a cluster by dask.distributed.

    Parameters
    ----------
    scheduler : str
        Its address.

    Raises
    ------
    ValueError
        Where no scheduler answers there, or it has no worker.
    ImportError
        Without the extra ``cluster``.
    """

    def __init__(self, scheduler: str) -> None:
        try:
            from distributed import Client, KilledWorker
        except ImportError:
            raise ImportError(
                "A cluster needs dask.distributed, which is not installed: pip install "
                "'mlscorr[cluster]'"
            ) from None
        try:
            self._client = Client(scheduler)
        except (OSError, ValueError) as error:
            raise ValueError(
                f"No scheduler answers at {scheduler} ({error}). Start one with dask scheduler, "
                "and give the address that it prints."
            ) from None
        if not self._client.nthreads():
            self.close()
            raise ValueError(
                f"The scheduler at {scheduler} has no worker. Start some, as dask worker "
                f"{scheduler} --nworkers 8 --nthreads 1, or let its cluster scale."
            )
        self._gone, self.losses = self._removed(), (KilledWorker,)  # tried in vain again and again
        self._executor = self._client.get_executor(pure=False)

    @property
    def width(self) -> int:
        """Threads that its workers have now: a cluster grows and shrinks while it works.

        Raises
        ------
        CancelledError
            Where the scheduler ended: of a result that it was just sending nobody else says so.
        """
        with suppress(OSError):
            if self._client.status == "running":
                return max(1, sum(self._client.nthreads().values()))
        raise CancelledError

    def submit(self, function: Callable, *arguments: object) -> Future:
        """The Future of a call."""
        return self._executor.submit(_in_single_threads, function, *arguments)

    @property
    def lost(self) -> int:
        """Workers that nobody sent away since this began."""
        return self._removed() - self._gone

    def _removed(self):
        events = [event for _, event in self._client.get_events("all")]
        removed = [event for event in events if event.get("action") == "remove-worker"]
        return sum(not event.get("expected", False) for event in removed)

    def close(self) -> None:
        """Leave the cluster as it is."""
        self._client.close()


# Works on calls, ``width`` at a time; one of ``losses`` tells that it lost a worker by a call.
Engine = Loop | Processes | Cluster


@contextmanager
def engine(workers: int = 1, scheduler: str | None = None) -> Iterator[Engine]:
    """The engine that is asked for.

    Parameters
    ----------
    workers : int
        Processes of this machine; one is this process itself.
    scheduler : str, optional
        Address of a cluster's.

    Raises
    ------
    ValueError
        Where both are given, and as of Cluster.
    ConnectionError
        When the scheduler ends before its calls.
    """
    check_engine(workers, scheduler)
    if scheduler is None and workers == 1:
        yield Loop()
        return
    chosen = Processes(workers) if scheduler is None else Cluster(scheduler)
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))  # of the processes that are started from here
    try:
        yield chosen
    except CancelledError:  # of calls that no scheduler knows any more
        raise ConnectionError(
            f"The scheduler at {scheduler} ended, and with it what its workers were at. Start it "
            "again; --resume goes on where it ended."
        ) from None
    finally:
        chosen.close()
        for name, value in before.items():
            os.environ.pop(name)
            os.environ.update({name: value} if value is not None else {})


def check_engine(workers: int, scheduler: str | None) -> None:
    """Refuse workers of this machine and of a cluster together.

    Parameters
    ----------
    workers, scheduler
        As of engine.

    Raises
    ------
    ValueError
    """
    if scheduler is not None and workers > 1:
        raise ValueError(
            f"--workers {workers} are of this machine and --scheduler {scheduler} is of a cluster, "
            "which has workers of its own: give one."
        )
