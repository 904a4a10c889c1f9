"""What runs in the workers of a sweep: tasks, and a watch that ends a worker whose driver is gone.

A forked worker of ``ProcessPoolExecutor`` waits for tasks in a pipe of which it holds the other end itself, so that it
would wait forever for a driver that was killed.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import util
from typing import Any

from . import _native

#: Seconds between two looks whether the driver is there: a worker that outlives it by this time harms nobody.
POLL_INTERVAL_S = 0.5


def run_task(build: str, scenarios: list[Any], trials: list[Any], series: list[str] | None = None) -> list[str]:
    """Runs some trials of a sweep, and returns their outcomes as JSON; a worker that does it ends with its driver."""
    end_with_driver()
    return _native.run_task(build, scenarios, trials, series)


class _Watch:
    """The watch of this process, and of how many sweeps it is the driver."""

    def __init__(self) -> None:
        self.process = 0
        self.sweeps = 0

    def on_fork(self) -> None:
        """Called in each worker that ``multiprocessing`` has forked: idle workers get no task, and end as well."""
        if self.sweeps > 0:
            self.sweeps = 0
            end_with_driver()


_watch = _Watch()
util.register_after_fork(_watch, _Watch.on_fork)


@contextmanager
def driving() -> Iterator[None]:
    """Makes the workers that are forked meanwhile end with this process."""
    _watch.sweeps += 1
    try:
        yield
    finally:
        _watch.sweeps -= 1


def end_with_driver() -> None:
    """Starts the watch of a worker process; does nothing in any other process."""
    driver = multiprocessing.parent_process()
    if driver is None or driver.pid is None or _watch.process == os.getpid():
        return
    _watch.process = os.getpid()
    threading.Thread(target=_wait_and_exit, args=(driver,), name="sidestep-driver", daemon=True).start()


def _wait_and_exit(driver: Any) -> None:
    if os.name == "nt":
        driver.join()
    else:
        # Not by the pipe of `driver`: forked workers hold each other's.
        parent = os.getppid()
        while os.getppid() == parent and _exists(driver.pid):
            time.sleep(POLL_INTERVAL_S)
    # Nobody waits for the task, and its end may be far away.
    os._exit(1)


def _exists(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        # Of another user, as no driver is, or not allowed to ask: the other sign decides.
        return True
    return True
