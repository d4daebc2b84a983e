"""What a task of a cluster takes by itself: python benchmarks/task_count.py tcp://HOST:8786 1500

Calls that do nothing are handed out as a run hands out its tasks, twice as many as there are
workers at a time.
"""

import sys
import time
from concurrent.futures import FIRST_COMPLETED, wait

from mlscorr.pipeline.project.engine import engine
from mlscorr.pipeline.project.settings import SETTINGS


def seconds_each(scheduler: str, number: int) -> float:
    """Time of one call, of as many as are handed out."""
    with engine(scheduler=scheduler, tell=print) as cluster:
        start, running = time.perf_counter(), set()
        for _ in range(number):
            running.add(cluster.submit(abs, -1))
            if len(running) >= SETTINGS.waiting * cluster.width:
                running = wait(running, return_when=FIRST_COMPLETED).not_done
        wait(running)
        return (time.perf_counter() - start) / number


if __name__ == "__main__":
    print(f"{1000 * seconds_each(sys.argv[1], int(sys.argv[2])):.1f} ms a task")
