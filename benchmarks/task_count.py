"""Overhead of a task of a cluster.

    python benchmarks/task_count.py tcp://HOST:8786 1500

Empty calls are submitted like the tasks of a run, at most twice as many at a time as there are
workers.
"""

import argparse
import time
from concurrent.futures import FIRST_COMPLETED, wait

from mlscorr.pipeline.project.engine import engine
from mlscorr.pipeline.project.settings import SETTINGS


def seconds_each(scheduler: str, number: int) -> float:
    """Time of one call, on average over this number of calls."""
    with engine(scheduler=scheduler, notify=print) as cluster:
        start = time.perf_counter()
        running = set()
        for _ in range(number):
            running.add(cluster.submit(abs, -1))
            if len(running) >= SETTINGS.waiting * cluster.width:
                running = wait(running, return_when=FIRST_COMPLETED).not_done
        wait(running)
        return (time.perf_counter() - start) / number


def main() -> None:
    """Print it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scheduler", help="its address")
    parser.add_argument("number", type=int, help="of calls")
    given = parser.parse_args()
    print(f"{1000 * seconds_each(given.scheduler, given.number):.1f} ms a task")


if __name__ == "__main__":
    main()
