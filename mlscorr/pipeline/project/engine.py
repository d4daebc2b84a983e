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
from weakref import WeakSet

from mlscorr.io.store import temporary_folder
from mlscorr.survey import Statement

THREADS = ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
LONGER = "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT=10min"
LARGE_ARRAY = 1 << 20  # B; glibc keeps freed ones of up to 32 MB: 0.15 GB after some tasks


class Loop:
    """No process but this, one call after the other: what loses it ends the run."""

    width = 1
    lost = 0
    losses = ()

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
        self.width = width
        self.lost = 0
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
    tell : function of a Statement
        Is told when there is something to wait for.

    Raises
    ------
    ValueError
        Where no scheduler answers there, or no worker comes: both in dask's time to connect.
    ImportError
        Without the extra ``cluster``.
    """

    def __init__(self, scheduler: str, tell: Callable[[Statement], object]) -> None:
        try:
            from dask import config
            from distributed import Client, KilledWorker
        except ImportError:
            raise ImportError("A cluster needs dask: pip install 'mlscorr[cluster]'") from None
        patience = config.get("distributed.comm.timeouts.connect")  # with its unit, as "30s"
        self._tell = tell
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
                tell(Statement("no worker yet", values=self._waiting))
            self._client.wait_for_workers(1, patience)
        except OSError as error:
            self.close()
            raise ValueError(
                f"The scheduler at {scheduler} has no worker after {patience} ({error}). Start "
                f"some, as dask worker {scheduler} --nworkers 8 --nthreads 1, or wait longer: "
                f"set {LONGER} in the environment."
            ) from None
        # tried in vain again and again
        self.lost = 0
        self.losses = (KilledWorker,)
        self._calls: WeakSet[Future] = WeakSet()
        self._executor = self._client.get_executor(pure=False)
        self._connection = self._client.scheduler_comm
        self._client.subscribe_topic("all", self._count)

    @property
    def width(self) -> int:
        """Threads that its workers have now: a cluster grows and shrinks while it works.

        Raises
        ------
        CancelledError
            Where the scheduler ended, and none answered at its address in dask's time to connect.
        """
        is_lost = False
        while self._client.status in ("running", "connecting"):
            if not is_lost and self._client.status == "connecting":
                is_lost = True
                self._tell(Statement("scheduler lost", values=self._waiting))
            # That it ended may not be known yet, else this waits for it; or dask just gives up
            with suppress(OSError, AttributeError, RuntimeError):
                threads = sum(self._client.nthreads().values())
                if self._client.status == "running":
                    self._renew()
                    return max(1, threads)
        raise CancelledError

    def _renew(self):
        """After another connection cancel calls of the one before: some may never end else."""
        if self._client.scheduler_comm is not self._connection:
            for call in [call for call in self._calls if not call.done()]:
                call.cancel()
                call.set_running_or_notify_cancel()  # wakes who waits; else RuntimeError: it ended
            self._connection = self._client.scheduler_comm
            self._client.subscribe_topic("all", self._count)
            self.lost += 1
            self._tell(Statement("scheduler back"))

    def submit(self, function: Callable, *arguments: object) -> Future:
        """The Future of a call; cancelled where the connection to the scheduler ends before it."""
        call = self._executor.submit(_in_single_threads, function, *arguments)
        self._calls.add(call)
        return call

    def _count(self, event):
        """Count a worker that nobody sent away; the scheduler tells what happens."""
        fact = event[1]
        self.lost += fact.get("action") == "remove-worker" and not fact.get("expected", False)

    def close(self) -> None:
        """Leave the cluster as it is."""
        self._client.close()


# Works on calls, ``width`` at a time; one of ``losses`` tells that it lost a worker by a call.
Engine = Loop | Processes | Cluster


@contextmanager
def engine(
    workers: int = 1, scheduler: str | None = None, tell: Callable[[Statement], object] = str
) -> Iterator[Engine]:
    """The engine that is asked for.

    Parameters
    ----------
    workers : int
        Processes of this machine; one is this process itself.
    scheduler : str, optional
        Address of a cluster's.
    tell : function of a Statement
        As of Cluster.

    Raises
    ------
    ValueError
        Where both are given, and as of Cluster.
    ConnectionError
        When the scheduler ends before its calls, and isn't started again.
    """
    check_engine(workers, scheduler)
    if scheduler is None and workers == 1:
        yield Loop()
        return
    if scheduler is None:
        chosen = Processes(workers)
    else:
        chosen = Cluster(scheduler, tell)
    before = {name: value for name, value in os.environ.items() if name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))  # of the processes that are started from here
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
            f"--workers {workers} is for this machine, and --scheduler {scheduler} is for a "
            "cluster with its own workers. Give only one of them."
        )
