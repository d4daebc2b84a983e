"""Execution of tasks: in this process, in local processes, or in a cluster."""

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
from weakref import WeakSet

from mlscorr.io.store import temporary_folder
from mlscorr.survey import Statement

THREADS = ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
LONGER = "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT=10min"
LARGE_ARRAY = 1 << 20  # B; glibc keeps freed ones of up to 32 MB: 0.15 GB after some tasks


class Loop:
    """Only this process, one call after the other: its loss ends the run."""

    width = 1
    lost = 0
    losses = ()

    def submit(self, function: Callable, *arguments: object) -> Future:
        """Return a completed Future."""
        future: Future = Future()
        future.set_result(function(*arguments))
        return future


class Processes:
    """Local processes, which are restarted if one is lost.

    Parameters
    ----------
    width : int
        Number of them.
    """

    losses = (BrokenProcessPool,)

    def __init__(self, width: int) -> None:
        self.width = width
        self.lost = 0
        self._executor: Executor | None = None
        self._others = {*multiprocessing.active_children()}

    def submit(self, function: Callable, *arguments: object) -> Future:
        """Return the Future of a call."""
        try:
            return self._pool().submit(function, *arguments)
        except BrokenProcessPool:
            self.lost += 1
            self.close()
            return self._pool().submit(function, *arguments)

    def _pool(self):
        if self._executor is None:
            context = multiprocessing.get_context("spawn")  # a forked process may inherit locks
            self._executor = ProcessPoolExecutor(
                self.width, context, _start_worker, (temporary_folder(),)
            )
        return self._executor

    def close(self) -> None:
        """End the processes immediately."""
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
            self._executor = None
            for process in {*multiprocessing.active_children()} - self._others:
                process.terminate()  # its current output is complete or absent
                process.join()


def _in_single_threads(function, *arguments):
    """Result of a call in a worker started by others; libraries read this at their start."""
    for name in THREADS:
        os.environ.setdefault(name, "1")
    return function(*arguments)


def _start_worker(folder):
    """Ignore interruptions in a worker, leave them to the parent, and end with it.

    Temporary data go into the parent's folder, which is removed however this process ends. Memory
    of large arrays returns to the system at once, as with dask.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = folder
    with suppress(AttributeError, OSError, TypeError):  # a C library other than GNU's
        ctypes.CDLL(None).mallopt(-3, LARGE_ARRAY)  # M_MMAP_THRESHOLD of malloc.h
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent():
    """End this process if its parent was killed, because nobody else would."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class Cluster:
    """Workers of a cluster by dask.distributed.

    Parameters
    ----------
    scheduler : str
        Address of the scheduler.
    notify : function of a Statement
        Receives statements on waiting.

    Raises
    ------
    ValueError
        If no scheduler answers, or no worker connects, within dask's time to connect.
    ImportError
        If the extra ``cluster`` is missing.
    """

    def __init__(self, scheduler: str, notify: Callable[[Statement], object]) -> None:
        try:
            from dask import config
            from distributed import Client, KilledWorker
        except ImportError:
            raise ImportError("A cluster needs dask: pip install 'mlscorr[cluster]'") from None
        patience = config.get("distributed.comm.timeouts.connect")  # with its unit, as "30s"
        self._notify = notify
        self._waiting = {"scheduler": scheduler, "patience": patience}
        try:
            self._client = Client(scheduler)
        except (OSError, ValueError) as error:
            raise ValueError(
                f"No scheduler responds at {scheduler} ({error}). Start one with dask scheduler, "
                "and give the address that it prints."
            ) from None
        try:  # a batch system may start the first worker later than the scheduler
            if not self._client.nthreads():
                notify(Statement("no worker yet", values=self._waiting))
            self._client.wait_for_workers(1, patience)
        except OSError as error:
            self.close()
            raise ValueError(
                f"The scheduler at {scheduler} has no worker after {patience} ({error}). Start "
                f"some, as dask worker {scheduler} --nworkers 8 --nthreads 1, or wait longer: "
                f"set {LONGER} in the environment."
            ) from None
        # repeated attempts failed
        self.lost = 0
        self.losses = (KilledWorker,)
        self._calls: WeakSet[Future] = WeakSet()
        self._executor = self._client.get_executor(pure=False)
        self._connection = self._client.scheduler_comm
        self._client.subscribe_topic("all", self._count)

    @property
    def width(self) -> int:
        """Current number of worker threads: a cluster grows and shrinks while it works.

        Raises
        ------
        CancelledError
            If the scheduler ended, and none answered at its address within dask's time to connect.
        """
        is_lost = False
        while self._client.status in ("running", "connecting"):
            if not is_lost and self._client.status == "connecting":
                is_lost = True
                self._notify(Statement("scheduler lost", values=self._waiting))
            # Its end may not be known yet, and then this waits for it; or dask just gives up
            with suppress(OSError, AttributeError, RuntimeError):
                threads = sum(self._client.nthreads().values())
                if self._client.status == "running":
                    self._renew()
                    return max(1, threads)
        raise CancelledError

    def _renew(self):
        """After another connection, cancel calls of the previous one, some of which may never
        end.
        """
        if self._client.scheduler_comm is not self._connection:
            for call in [call for call in self._calls if not call.done()]:
                call.cancel()
                call.set_running_or_notify_cancel()  # wakes waiters; else RuntimeError: it ended
            self._connection = self._client.scheduler_comm
            self._client.subscribe_topic("all", self._count)
            self.lost += 1
            self._notify(Statement("scheduler back"))

    def submit(self, function: Callable, *arguments: object) -> Future:
        """Return the Future of a call; canceled if the connection to the scheduler ends before
        it.
        """
        call = self._executor.submit(_in_single_threads, function, *arguments)
        self._calls.add(call)
        return call

    def _count(self, event):
        """Count an unexpectedly lost worker, as reported by the scheduler."""
        fact = event[1]
        self.lost += fact.get("action") == "remove-worker" and not fact.get("expected", False)

    def close(self) -> None:
        """Leave the cluster unchanged."""
        self._client.close()


# Works on calls, ``width`` at a time; ``losses`` are the errors of a worker lost during a call.
Engine = Loop | Processes | Cluster


@contextmanager
def engine(
    workers: int = 1, scheduler: str | None = None, notify: Callable[[Statement], object] = str
) -> Iterator[Engine]:
    """Open the requested engine.

    Parameters
    ----------
    workers : int
        Number of local processes; one is this process itself.
    scheduler : str, optional
        Address of a cluster's scheduler.
    notify : function of a Statement
        See Cluster.

    Raises
    ------
    ValueError
        If both are given; see also Cluster.
    ConnectionError
        If the scheduler ends before its calls, and is not restarted.
    """
    check_engine(workers, scheduler)
    if scheduler is None and workers == 1:
        yield Loop()
        return
    if scheduler is None:
        chosen = Processes(workers)
    else:
        chosen = Cluster(scheduler, notify)
    before = {name: value for name, value in os.environ.items() if name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))  # of processes started from here
    try:
        yield chosen
    except CancelledError:  # of calls that no scheduler knows any more
        raise ConnectionError(
            f"The scheduler at {scheduler} ended and did not return in time ({LONGER}). Start it "
            "and its workers again, and continue with --resume."
        ) from None
    finally:
        chosen.close()
        for name in THREADS:
            del os.environ[name]
        os.environ.update(before)


def check_engine(workers: int, scheduler: str | None) -> None:
    """Refuse local workers together with a cluster.

    Parameters
    ----------
    workers, scheduler
        See engine.

    Raises
    ------
    ValueError
    """
    if scheduler is not None and workers > 1:
        raise ValueError(
            f"--workers {workers} is for this machine, and --scheduler {scheduler} is for a "
            "cluster with its own workers. Give only one of them."
        )
