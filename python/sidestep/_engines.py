"""Engines outside of this process for the cells of a sweep: any executor, or Ray.

The process that calls :func:`sidestep.sweep` keeps plan, journal and stopping rule. A task is some cells with their
scenarios, about a second of work by the times of earlier tasks; it returns outcomes, so no common file system is
needed. Tasks that are still running when nothing is left to start are sent a second time: whichever comes first
counts, because both are equal to the bit.
"""

from __future__ import annotations

import importlib
import json
import os
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from ._errors import EngineError, SidestepError, wrong
from ._native import run_task

#: Engines that run the cells of a sweep.
Engine: TypeAlias = Literal["local", "ray"] | Executor | Callable[[], Executor]
#: Number, variant, replicate and seed of a cell.
Cell: TypeAlias = tuple[int, int, int, int]
#: The text of a scenario, and its files by name.
Bundle: TypeAlias = tuple[str, list[tuple[str, bytes]]]
#: Wants scenarios by the number of their variant, and gives outcomes.
Steps: TypeAlias = Generator[int | list[str], Bundle | None, None]

#: Seconds of work that a task is made for.
TASK_S = 1.0
#: Largest number of cells of a task.
MOST_CELLS = 1000
#: Times that a task, or a pool, may break without any outcome in between.
ATTEMPTS = 3
#: A task is slow when it takes this many times as long as expected, and at least `SLOW_S`.
SLOW_FACTOR = 3.0
SLOW_S = 2.0
#: Seconds between two looks at tasks that may be slow.
LOOK_S = 0.2
#: Scenarios that are kept for the next task.
KEPT_SCENARIOS = 256


@dataclass
class _Task:
    """Cells that were sent off, once or twice."""

    cells: list[Cell]
    sent_s: float
    failures: int = 0
    copies: list[Future[list[str]]] = field(default_factory=list)
    outcomes: dict[int, Any] | None = None


class Crew:
    """Runs cells on an executor. One crew serves one call of :func:`sidestep.sweep`.

    ``engine`` is an executor, or a function that makes one: then a pool that breaks, as
    ``ProcessPoolExecutor`` does when a worker is killed, is replaced by a new one.
    """

    def __init__(self, engine: Executor | Callable[[], Executor], at_once: int | None) -> None:
        self._make = None if isinstance(engine, Executor) else engine
        self._executor = engine if isinstance(engine, Executor) else self._made(engine)
        self.at_once = at_once or width(self._executor)
        self._scenarios: dict[int, Bundle] = {}
        self._cell_s: float | None = None
        self._attempts = 0

    def close(self) -> None:
        """Shuts down an executor that was made here."""
        if self._make is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)

    @staticmethod
    def _made(make: Callable[[], Executor]) -> Executor:
        executor = make()
        if not isinstance(executor, Executor):
            words = f"a function that returned {type(executor).__name__}"
            raise wrong("engine", words, "let it return a concurrent.futures.Executor")
        return executor

    def run(self, build: str, cells: Sequence[Cell]) -> Steps:
        """Runs all cells; yields the numbers of variants whose scenarios it wants, and outcomes as they come."""
        tasks: list[_Task] = []
        waiting = deque(cells)
        again: deque[_Task] = deque()
        try:
            while waiting or again or tasks:
                while (again or waiting) and len(tasks) < 2 * self.at_once:
                    task = again.popleft() if again else self._cut(waiting)
                    yield from self._send(build, task)
                    tasks.append(task)
                if not waiting and not again:
                    yield from self._send_slow(build, tasks)
                futures = [copy for task in tasks for copy in task.copies]
                ended, _ = wait(futures, timeout=LOOK_S, return_when=FIRST_COMPLETED)
                for task in [task for task in tasks if not ended.isdisjoint(task.copies)]:
                    outcomes = self._take(task, tasks, again)
                    if outcomes:
                        yield outcomes
        finally:
            for task in tasks:
                for copy in task.copies:
                    copy.cancel()

    def _cut(self, waiting: deque[Cell]) -> _Task:
        """Takes the cells of the next task: a single one until their duration is known."""
        count = 1 if self._cell_s is None else int(TASK_S / max(self._cell_s, 1e-6))
        # At the end the rest is shared out, so that no worker has much when others have nothing.
        fair = -(-len(waiting) // (2 * self.at_once))
        count = max(1, min(count, MOST_CELLS, fair))
        return _Task([waiting.popleft() for _ in range(min(count, len(waiting)))], time.monotonic())

    def _send(self, build: str, task: _Task) -> Steps:
        scenarios = []
        for variant in sorted({cell[1] for cell in task.cells}):
            if variant not in self._scenarios:
                bundle = yield variant
                assert bundle is not None
                if len(self._scenarios) >= KEPT_SCENARIOS:
                    self._scenarios.clear()
                self._scenarios[variant] = bundle
            scenarios.append((variant, self._scenarios[variant]))
        task.sent_s = time.monotonic()
        try:
            copy = self._executor.submit(run_task, build, scenarios, task.cells)
        except BrokenExecutor as error:
            copy = Future()
            copy.set_exception(error)
        except RuntimeError as error:
            remedy = "give one that was not shut down, or a function that makes one"
            raise EngineError(f"the executor takes no tasks: {error}\n  help: {remedy}") from error
        task.copies.append(copy)

    def _send_slow(self, build: str, tasks: list[_Task]) -> Steps:
        """Sends tasks a second time that take much longer than they should, where workers are free."""
        if self._cell_s is None:
            return
        now = time.monotonic()
        for task in tasks:
            if sum(len(task.copies) for task in tasks) >= self.at_once:
                return
            expected = max(SLOW_FACTOR * self._cell_s * len(task.cells), SLOW_S)
            if len(task.copies) == 1 and now - task.sent_s > expected:
                yield from self._send(build, task)

    def _take(self, task: _Task, tasks: list[_Task], again: deque[_Task]) -> list[str]:
        """Returns the outcomes of a task of which a copy has ended; a task that failed is sent again."""
        for copy in [copy for copy in task.copies if copy.done()]:
            task.copies.remove(copy)
            try:
                outcomes = copy.result()
            except SidestepError as error:
                # Ray wraps an exception of a task into its own traceback.
                cause = getattr(error, "cause", None)
                raise (cause if isinstance(cause, SidestepError) else error) from None
            except (Exception, BrokenExecutor) as error:
                if task.copies:
                    continue
                tasks.remove(task)
                self._failed(task, error, again)
                return []
            self._attempts = 0
            for other in task.copies:
                other.cancel()
            tasks.remove(task)
            self._learn(outcomes)
            return outcomes
        return []

    def _failed(self, task: _Task, error: BaseException, again: deque[_Task]) -> None:
        again.append(task)
        if not isinstance(error, BrokenExecutor):
            task.failures += 1
            if task.failures < ATTEMPTS:
                return
            remedy = "see the cause above; what is finished is kept with `out`, and the same call goes on"
            raise EngineError(f"a task has failed {ATTEMPTS} times: {error}\n  help: {remedy}") from error
        if self._make is None:
            remedy = (
                "give a function that makes one, such as lambda: ProcessPoolExecutor(4); what is finished is kept with "
                "`out`, and the same call with a new executor goes on"
            )
            raise EngineError(f"the executor broke: {error}\n  help: {remedy}") from error
        if not _is_broken(self._executor):
            # Another task of the same pool has told already, and there is a new one.
            return
        self._attempts += 1
        if self._attempts >= ATTEMPTS:
            remedy = "look for what ends its workers (memory?); what is finished is kept with `out`"
            words = f"{ATTEMPTS} executors broke one after another, without any outcome"
            raise EngineError(f"{words}: {error}\n  help: {remedy}") from error
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._executor = self._made(self._make)

    def _learn(self, outcomes: list[str]) -> None:
        """Learns how long a cell takes, the last task counting as much as all before it."""
        costs = [json.loads(outcome)["costs"] for outcome in outcomes]
        spent = [cost.get("compile_wall_s", 0.0) + cost.get("run_wall_s", 0.0) for cost in costs]
        if spent:
            mean = sum(spent) / len(spent)
            self._cell_s = mean if self._cell_s is None else (self._cell_s + mean) / 2


def _is_broken(executor: Executor) -> bool:
    """Returns whether an executor takes no more tasks."""
    try:
        executor.submit(int).cancel()
    except RuntimeError:
        return True
    return False


def width(executor: Executor) -> int:
    """Returns how many tasks an executor runs at once, as far as it says so."""
    for name in ("_max_workers", "max_workers", "_num_workers"):
        count = getattr(executor, name, None)
        if isinstance(count, int) and count > 0:
            return count
    client = getattr(executor, "_client", None)
    if client is not None and hasattr(client, "nthreads"):
        return max(1, sum(int(threads) for threads in client.nthreads().values()))
    return os.cpu_count() or 1


class RayExecutor(Executor):
    """The tasks of Ray as an executor; Ray itself repeats those of nodes that are lost."""

    def __init__(self) -> None:
        try:
            ray: Any = importlib.import_module("ray")
        except ImportError as error:
            raise ImportError("engine=\"ray\" needs Ray: pip install 'sidestep[ray]'") from error
        if not ray.is_initialized():
            ray.init(log_to_driver=False)
        self._ray = ray
        self._remote = ray.remote(num_cpus=1, max_retries=ATTEMPTS)(_run_on_ray)
        self._scenarios: dict[int, tuple[Bundle, Any]] = {}
        self.max_workers = max(1, int(ray.cluster_resources().get("CPU", 1)))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Sends a task; scenarios go along once per variant and node."""
        if fn is not run_task:
            raise TypeError("this executor runs the tasks of sweeps alone")
        build, scenarios, cells = args
        numbers = [variant for variant, _ in scenarios]
        sent = [self._stored(variant, bundle) for variant, bundle in scenarios]
        future: Future[Any] = self._remote.remote(build, cells, numbers, *sent).future()
        return future

    def _stored(self, variant: int, bundle: Bundle) -> Any:
        known = self._scenarios.get(variant)
        if known is None or known[0] is not bundle:
            if len(self._scenarios) >= KEPT_SCENARIOS:
                self._scenarios.clear()
            known = (bundle, self._ray.put(bundle))
            self._scenarios[variant] = known
        return known[1]


def _run_on_ray(build: str, cells: list[Cell], variants: list[int], *bundles: Bundle) -> list[str]:
    return run_task(build, list(zip(variants, bundles, strict=True)), cells)


def crew(engine: Engine, workers: int | None) -> Crew | None:
    """Returns the crew of an engine; None for threads of this process."""
    if engine == "local":
        return None
    if engine == "ray":
        return Crew(RayExecutor(), workers)
    if isinstance(engine, Executor) or callable(engine):
        return Crew(engine, workers)
    remedy = 'give "local", "ray", a concurrent.futures.Executor, or a function that makes one'
    raise wrong("engine", f"{engine!r} is no engine", remedy)
