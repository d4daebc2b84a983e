"""Workers of tasks: some that end in the middle, and a cluster of other processes."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mlscorr.io.store import TaskStore, temporary_folder
from mlscorr.pipeline.project import check_engine
from mlscorr.pipeline.project.engine import engine
from mlscorr.pipeline.project.running import Run
from mlscorr.pipeline.project.tasks import Task
from tests.beds.places import ROOT

CLUSTER = """
from distributed import LocalCluster
from tests.pipeline.test_project_engines import grow, lose_a_call, lose_a_worker, squares
if __name__ == "__main__":
    with LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster:
        squares({folder!r}, scheduler=cluster.scheduler_address)
        lose_a_worker({folder!r}, cluster.scheduler_address)
        grow(cluster)
        lose_a_call(cluster.scheduler_address)
"""


def square(number):
    "A result of a task"
    if number < 0:
        raise ValueError(f"{number} has no square here.")
    return number * number


def end_at_first(path, number):
    "Ends its process as the system does where memory lacks, but for the second time"
    if not os.path.exists(path):
        open(path, "w").close()
        os.kill(os.getpid(), signal.SIGKILL)
    return square(number)


def span(number):
    "Start and end of a call of half a second. Units: s"
    start = time.time()
    time.sleep(0.5)
    return start, time.time()


def end(number):
    "Ends its process each time"
    os.kill(os.getpid(), signal.SIGKILL)


def kept_memory(count, large):
    "MB that a process keeps of as many arrays of MB once they are let go of, small ones between"
    page = os.sysconf("SC_PAGE_SIZE")
    resident = lambda: int(Path("/proc/self/statm").read_text().split()[1]) * page / 1e6  # noqa: E731
    before = resident()
    arrays = [[np.ones(int(size * 1e6) // 8) for size in (large, 0.05)] for _ in range(count)]
    assert resident() - before > 0.9 * count * large
    small = [pair[1] for pair in arrays]
    del arrays
    return resident() - before - sum(part.nbytes for part in small) / 1e6


def task(number, function=square, *arguments):
    "A Task by its number"
    name = f"{function.__name__}-{number}"
    return Task("clouds", name, "drive", name, 1, function, (*arguments, number))


def squares(folder, workers=1, scheduler=None):
    "Run of tasks, one of which fails, with an engine; asserts the results"
    with engine(workers, scheduler) as chosen:
        run = Run(TaskStore(Path(folder)), chosen, lambda outcome: None)
        tasks = [task(number) for number in (-1, 2, 3, 4, 5)]
        results = run.results(tasks)
        assert list(results.values()) == [4, 9, 16, 25]
        assert [fault.fault for fault in run.faults] == ["-1 has no square here."]
    return run


def start(part, address):
    "Process of a scheduler at an address, or of its worker, which has two threads"
    paths = {"PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    options = {
        "scheduler": ("--port", address.rpartition(":")[2]),
        "worker": (address, "--nthreads", "2", "--no-nanny"),
    }
    return subprocess.Popen(
        [sys.executable, "-m", "dask", part, *options[part], "--no-dashboard"],
        stderr=subprocess.DEVNULL,
        env=os.environ | paths,
    )


def start_cluster(address):
    "Processes of a scheduler and of its worker"
    return [start(part, address) for part in ("scheduler", "worker")]


def lose_a_worker(folder, scheduler):
    "A cluster does again what a worker was at that ended, and none was lost before"
    with engine(scheduler=scheduler) as chosen:
        assert chosen.lost == 0
        run = Run(TaskStore(Path(folder)), chosen, lambda outcome: None)
        mark = Path(folder) / "mark"
        assert run.results([task(7, end_at_first, mark)]) == {"end_at_first-7": 49}
        assert chosen.lost == 1


def grow(cluster):
    "Workers that come later are counted on; where all left, a task waits for the next to come"
    with engine(scheduler=cluster.scheduler_address) as chosen:
        for workers, width in ((3, 3), (0, 1), (2, 2)):
            cluster.scale(workers)
            for _ in range(100):
                time.sleep(0.1)
                if len(cluster.scheduler_info["workers"]) == workers and chosen.width == width:
                    break
            assert chosen.width == width


def lose_a_call(scheduler):
    "A call that nobody will carry out any more is said in a sentence"
    with (
        pytest.raises(ConnectionError, match="with --resume"),
        engine(scheduler=scheduler) as chosen,
    ):
        call = chosen.submit(time.sleep, 60.0)
        call.cancel()
        call.result()


@pytest.mark.long
@pytest.mark.parametrize("workers", [1, 2])
def test_tasks_that_fail_end_no_run(tmp_path, workers):
    "The results of all others, in the order of their tasks, and the sentence of the one"
    squares(tmp_path, workers)


def test_parts_that_are_needed_together_fail_by_name(tmp_path):
    "Of five two fail: both are named with the reason of the last, and the others are kept"
    ends = []
    numbers = (3, -1, 2, -2, 4)
    with engine() as chosen:
        run = Run(TaskStore(tmp_path), chosen, ends.append)
        named = r"2 of 5 .* \(square--1, square--2\): -2 has no square here. --resume"
        with pytest.raises(ValueError, match=named):
            run.all_results([task(n) for n in numbers])
        assert run.all_results([task(n) for n in numbers if n > 0]) == [9, 4, 16]
    assert [outcome.seconds for outcome in ends[len(numbers) :]] == [0.0, 0.0, 0.0]


def test_long_tasks_are_begun_first(tmp_path):
    "Tasks with most points, or most near targets, start first; equal ones keep their order"
    begun = []
    points = {1: (5, 0.0), 2: (7, 0.0), 3: (5, 3.5), 4: (5, 0.0)}

    def noted(number):
        begun.append(number)
        return square(number)

    tasks = [
        replace(task(number, noted), points=size, near_points=near)
        for number, (size, near) in points.items()
    ]
    with engine() as chosen:
        run = Run(TaskStore(tmp_path), chosen, lambda outcome: None)
        assert list(run.results(tasks).values()) == [1, 4, 9, 16]
    assert begun == [3, 2, 1, 4]


@pytest.mark.long
def test_a_lost_worker_is_counted_and_its_task_done_again(tmp_path):
    "A task that ends its worker once has a result; one that ends it each time is given up"
    ends = []
    with engine(2) as chosen:
        run = Run(TaskStore(tmp_path), chosen, ends.append)
        tasks = [task(n) for n in range(6)]
        tasks[2:2] = [task(7, end_at_first, tmp_path / "mark"), task(8, end)]
        results = run.results(tasks)
        assert results == {f"square-{n}": n * n for n in range(6)} | {"end_at_first-7": 49}
        assert chosen.lost >= 3
    (fault,) = run.faults
    assert fault.task.name == "end-8" and "its worker was lost 2 times" in fault.fault
    assert len(ends) == len(tasks)


@pytest.mark.long
def test_what_was_lost_with_others_is_done_again_beside_others(tmp_path):
    "A worker that ends but once costs what was at work; not that the rest is done in turn"
    told = []
    with engine(2) as chosen:
        run = Run(TaskStore(tmp_path), chosen, lambda outcome: None, told.append)
        lost = task(7, end_at_first, tmp_path / "mark")
        results = run.results([lost, *(task(n, span) for n in range(3))])
    assert results.pop(lost.name) == 49 and len(told) == 4
    (_, first), (second, _), _ = sorted(results.values())
    assert second < first


@pytest.fixture
def cluster():
    "An address, and processes of a scheduler there and of a worker; ended with those added to them"
    distributed = pytest.importorskip("distributed", reason="mlscorr[cluster] is not installed")
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    processes = start_cluster(address)
    try:
        with distributed.Client(address) as client:
            client.wait_for_workers(1)
        yield address, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.long
@pytest.mark.parametrize("with_worker", [True, False])
def test_a_scheduler_that_is_started_again_is_given_the_rest(tmp_path, cluster, with_worker):
    "Killed after a task, alone or with its worker, and started again: all is done, it is counted"
    address, processes = cluster
    said = []

    def kill_once(outcome):
        if len(processes) == 2:
            for process in processes[: 1 + with_worker]:
                process.kill()
            processes.extend(start_cluster(address))

    with engine(scheduler=address, notify=said.append) as chosen:
        run = Run(TaskStore(tmp_path), chosen, kill_once, said.append)
        assert len(run.results([task(n, span) for n in range(8)])) == 8
        assert chosen.lost == 1 and not run.faults
    assert {"scheduler back", "task lost with scheduler"} <= {each.key for each in said}


@pytest.mark.long
def test_a_scheduler_that_ends_for_good_ends_the_run(tmp_path, cluster):
    "Killed with its worker after the first of some tasks: a sentence after dask's time to connect"
    from dask import config

    address, processes = cluster
    kill = lambda _: [process.kill() for process in processes]  # noqa: E731
    with (
        config.set({"distributed.comm.timeouts.connect": "2s"}),
        pytest.raises(ConnectionError, match="with --resume"),
        engine(scheduler=address) as chosen,
    ):
        Run(TaskStore(tmp_path), chosen, kill).results([task(n, span) for n in range(8)])


@pytest.mark.long
def test_the_first_worker_is_waited_for(cluster):
    "A scheduler without a worker is refused after dask's time to connect, not before, and says so"
    from dask import config

    address, processes = cluster
    processes[1].kill()
    processes[1].wait()
    said = []
    with config.set({"distributed.comm.timeouts.connect": "2s"}):
        begun = time.monotonic()
        with pytest.raises(ValueError, match="no worker after 2s"), engine(1, address):
            pass
        assert time.monotonic() - begun > 2.0
    processes.append(start("worker", address))
    with engine(1, address, said.append) as chosen:
        assert chosen.submit(square, 3).result() == 9
    assert said[0].key == "no worker yet"
    assert said[0].values == {"scheduler": address, "patience": "30s"}


@pytest.mark.long
def test_a_cluster_works_on_tasks(tmp_path):
    "Workers of dask.distributed give the same results and failures; one that is lost is counted"
    pytest.importorskip("distributed", reason="pip install 'mlscorr[cluster]' tests clusters")
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER.format(folder=str(tmp_path / "tasks")))
    paths = {"PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    run = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, env=os.environ | paths
    )
    assert run.returncode == 0, run.stderr


def test_what_can_not_work_is_said(tmp_path):
    "Workers of two kinds, and a scheduler that is not there"
    with pytest.raises(ValueError, match="Give only one"):
        check_engine(2, "tcp://127.0.0.1:1")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no /proc tells memory here")
def test_a_worker_gives_memory_back():
    "Of 30 arrays of 8 MB none stays in a worker after they are gone"
    with engine(2, None) as chosen:
        chosen.submit(kept_memory, 3, 12.0).result()  # the threshold of C grows with what is freed
        assert chosen.submit(kept_memory, 30, 8.0).result() < 8.0


def test_a_worker_keeps_files_in_the_folder_of_who_started_it():
    "So nothing is left when it is ended in the middle: the folder goes with the program"
    with engine(2, None) as workers:
        folder = workers.submit(tempfile.gettempdir).result()
    assert folder == temporary_folder()
