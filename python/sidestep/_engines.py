"""Engines outside this process for the trials of a sweep: any executor, or Ray.

The process that calls :func:`sidestep.sweep` keeps plan, journal and stopping rule. A task is a batch of trials with
their scenarios, about a second of work by the times of earlier tasks; it returns outcomes, so no shared file system
is needed. Slow tasks are sent a second time when nothing else is left to start: the first result counts, because both
are bit-identical.
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
from typing import Any, Literal, NamedTuple, TypeAlias

from ._errors import EngineError, SidestepError, input_error
from ._workers import driving, run_task

#: Engines that run the trials of a sweep.
Engine: TypeAlias = Literal["local", "ray"] | Executor | Callable[[], Executor]
#: The text of a scenario, and its files by name.
Bundle: TypeAlias = tuple[str, list[tuple[str, bytes]]]
#: Requests scenarios by the number of their variant, and yields outcomes.
Steps: TypeAlias = Generator[int | list[str], Bundle | None, None]

#: Target duration of a task in seconds: long beside the milliseconds that sending one takes on a cluster, and short
#: enough that a lost worker costs little.
TASK_S = 1.0
#: Maximum number of trials of a task, so that the outcomes of very short trials are stored from time to time.
MAX_TRIALS = 1000
#: Times that a task, or a pool, may fail without any outcome in between: a worker that is lost once is normal on a
#: cluster, and a trial that always ends its worker must not go on forever.
MAX_ATTEMPTS = 3
#: A task is slow when it takes this many times as long as expected, and at least `MIN_SLOW_S`: durations of trials
#: differ, and those of short tasks are mostly the time of sending.
SLOW_FACTOR = 3.0
MIN_SLOW_S = 2.0
#: Seconds between two checks for slow tasks.
POLL_INTERVAL_S = 0.2
#: Maximum number of cached scenarios: each holds all its files.
MAX_CACHED_SCENARIOS = 256


class Trial(NamedTuple):
    """A run of a sweep."""

    #: Its number in the plan.
    id: int
    #: Number of its variant.
    variant: int
    #: Number of the run among those of its variant.
    replicate: int
    #: The seed of its scenario.
    seed: int


@dataclass
class _Task:
    """Trials that were submitted, once or twice."""

    trials: list[Trial]
    sent_s: float
    failures: int = 0
    copies: list[Future[list[str]]] = field(default_factory=list)
    outcomes: dict[int, Any] | None = None


class TaskPool:
    """Runs trials on an executor, for one call of :func:`sidestep.sweep`.

    ``engine`` is an executor, or a function that creates one: then a pool that breaks, as
    ``ProcessPoolExecutor`` does when a worker is killed, is replaced by a new one.
    """

    def __init__(self, engine: Executor | Callable[[], Executor], at_once: int | None) -> None:
        self._factory = None if isinstance(engine, Executor) else engine
        self._executor = engine if isinstance(engine, Executor) else self._create(engine)
        self.at_once = at_once or parallelism(self._executor)
        self._scenarios: dict[int, Bundle] = {}
        self._series: list[str] | None = None
        self._trial_s: float | None = None
        self._attempts = 0

    def close(self) -> None:
        """Shuts down an executor that was created here."""
        if self._factory is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)

    @staticmethod
    def _create(make: Callable[[], Executor]) -> Executor:
        executor = make()
        if not isinstance(executor, Executor):
            cause = f"the function returned {type(executor).__name__}"
            raise input_error("engine", cause, "return a concurrent.futures.Executor")
        return executor

    def run(self, build: str, trials: Sequence[Trial], series: list[str] | None = None) -> Steps:
        """Runs all trials; yields the numbers of variants whose scenarios it needs, and outcomes as they arrive.

        ``series`` are the metrics that the trials keep over time; None for those that their world is about.
        """
        self._series = series
        with driving():
            yield from self._run(build, trials)

    def _run(self, build: str, trials: Sequence[Trial]) -> Steps:
        tasks: list[_Task] = []
        waiting = deque(trials)
        retries: deque[_Task] = deque()
        try:
            while waiting or retries or tasks:
                while (retries or waiting) and len(tasks) < 2 * self.at_once:
                    task = retries.popleft() if retries else self._next_task(waiting)
                    yield from self._send(build, task)
                    tasks.append(task)
                if not waiting and not retries:
                    yield from self._send_slow(build, tasks)
                futures = [copy for task in tasks for copy in task.copies]
                ended, _ = wait(futures, timeout=POLL_INTERVAL_S, return_when=FIRST_COMPLETED)
                for task in [task for task in tasks if not ended.isdisjoint(task.copies)]:
                    outcomes = self._collect(task, tasks, retries)
                    if outcomes:
                        yield outcomes
        finally:
            for task in tasks:
                for copy in task.copies:
                    copy.cancel()

    def _next_task(self, waiting: deque[Trial]) -> _Task:
        """Takes the trials of the next task: a single one until their duration is known."""
        count = 1 if self._trial_s is None else int(TASK_S / max(self._trial_s, 1e-6))
        # The rest is divided evenly, so that no worker has a long task when the others are idle.
        even = -(-len(waiting) // (2 * self.at_once))
        count = max(1, min(count, MAX_TRIALS, even))
        return _Task([waiting.popleft() for _ in range(min(count, len(waiting)))], time.monotonic())

    def _send(self, build: str, task: _Task) -> Steps:
        scenarios = []
        for variant in sorted({trial.variant for trial in task.trials}):
            if variant not in self._scenarios:
                bundle = yield variant
                assert bundle is not None
                if len(self._scenarios) >= MAX_CACHED_SCENARIOS:
                    self._scenarios.clear()
                self._scenarios[variant] = bundle
            scenarios.append((variant, self._scenarios[variant]))
        task.sent_s = time.monotonic()
        try:
            copy = self._executor.submit(run_task, build, scenarios, task.trials, self._series)
        except BrokenExecutor as error:
            copy = Future()
            copy.set_exception(error)
        except RuntimeError as error:
            remedy = "give one that is not shut down, or a function that creates one"
            raise EngineError(f"the executor accepts no tasks: {error}\n  help: {remedy}") from error
        task.copies.append(copy)

    def _send_slow(self, build: str, tasks: list[_Task]) -> Steps:
        """Submits tasks that take much longer than expected a second time, if workers are idle."""
        if self._trial_s is None:
            return
        now = time.monotonic()
        for task in tasks:
            if sum(len(task.copies) for task in tasks) >= self.at_once:
                return
            expected = max(SLOW_FACTOR * self._trial_s * len(task.trials), MIN_SLOW_S)
            if len(task.copies) == 1 and now - task.sent_s > expected:
                yield from self._send(build, task)

    def _collect(self, task: _Task, tasks: list[_Task], retries: deque[_Task]) -> list[str]:
        """Returns the outcomes of a task once a copy of it is done; a failed task is queued again."""
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
                self._on_failure(task, error, retries)
                return []
            self._attempts = 0
            for other in task.copies:
                other.cancel()
            tasks.remove(task)
            self._update_estimate(outcomes)
            return outcomes
        return []

    def _on_failure(self, task: _Task, error: BaseException, retries: deque[_Task]) -> None:
        retries.append(task)
        if not isinstance(error, BrokenExecutor):
            task.failures += 1
            if task.failures < MAX_ATTEMPTS:
                return
            remedy = "see the cause above; with `out`, finished runs are kept, and the same call continues"
            raise EngineError(f"a task has failed {MAX_ATTEMPTS} times: {error}\n  help: {remedy}") from error
        if self._factory is None:
            remedy = (
                "give a function that creates one, such as lambda: ProcessPoolExecutor(4); with `out`, finished runs are "
                "kept, and the same call with a new executor continues"
            )
            raise EngineError(f"the executor broke: {error}\n  help: {remedy}") from error
        if not _is_broken(self._executor):
            # Another task of the same pool has already replaced it.
            return
        self._attempts += 1
        if self._attempts >= MAX_ATTEMPTS:
            remedy = "find out what ends its workers (memory?); with `out`, finished runs are kept"
            cause = f"{MAX_ATTEMPTS} executors broke one after another, without any outcome"
            raise EngineError(f"{cause}: {error}\n  help: {remedy}") from error
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._executor = self._create(self._factory)

    def _update_estimate(self, outcomes: list[str]) -> None:
        """Updates the estimated duration of a trial; the last task weighs as much as all before it."""
        costs = [json.loads(outcome)["costs"] for outcome in outcomes]
        spent = [cost.get("compile_wall_s", 0.0) + cost.get("run_wall_s", 0.0) for cost in costs]
        if spent:
            mean = sum(spent) / len(spent)
            self._trial_s = mean if self._trial_s is None else (self._trial_s + mean) / 2


def _is_broken(executor: Executor) -> bool:
    """Returns whether an executor accepts no more tasks."""
    try:
        executor.submit(int).cancel()
    except RuntimeError:
        return True
    return False


def parallelism(executor: Executor) -> int:
    """Returns how many tasks an executor runs at once, if known; else the number of processors."""
    for name in ("_max_workers", "max_workers", "_num_workers"):
        count = getattr(executor, name, None)
        if isinstance(count, int) and count > 0:
            return count
    client = getattr(executor, "_client", None)
    if client is not None and hasattr(client, "nthreads"):
        return max(1, sum(int(threads) for threads in client.nthreads().values()))
    return os.cpu_count() or 1


class RayExecutor(Executor):
    """Ray as an executor; Ray itself repeats tasks of lost nodes."""

    def __init__(self) -> None:
        try:
            ray: Any = importlib.import_module("ray")
        except ImportError as error:
            raise ImportError("engine=\"ray\" needs Ray: pip install 'ray>=2.30'") from error
        if not ray.is_initialized():
            ray.init(log_to_driver=False)
        self._ray = ray
        self._remote = ray.remote(num_cpus=1, max_retries=MAX_ATTEMPTS)(_run_on_ray)
        self._scenarios: dict[int, tuple[Bundle, Any]] = {}
        self.max_workers = max(1, int(ray.cluster_resources().get("CPU", 1)))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submits a task; scenarios are sent once per variant and node."""
        if fn is not run_task:
            raise TypeError("this executor only runs the tasks of sweeps")
        build, scenarios, trials, series = args
        numbers = [variant for variant, _ in scenarios]
        sent = [self._stored(variant, bundle) for variant, bundle in scenarios]
        future: Future[Any] = self._remote.remote(build, trials, series, numbers, *sent).future()
        return future

    def _stored(self, variant: int, bundle: Bundle) -> Any:
        known = self._scenarios.get(variant)
        if known is None or known[0] is not bundle:
            if len(self._scenarios) >= MAX_CACHED_SCENARIOS:
                self._scenarios.clear()
            known = (bundle, self._ray.put(bundle))
            self._scenarios[variant] = known
        return known[1]


def _run_on_ray(
    build: str, trials: list[Trial], series: list[str] | None, variants: list[int], *bundles: Bundle
) -> list[str]:
    return run_task(build, list(zip(variants, bundles, strict=True)), trials, series)


def task_pool(engine: Engine, workers: int | None) -> TaskPool | None:
    """Returns the task pool of an engine; None for threads of this process."""
    if engine == "local":
        return None
    if engine == "ray":
        return TaskPool(RayExecutor(), workers)
    if isinstance(engine, Executor) or callable(engine):
        return TaskPool(engine, workers)
    remedy = 'give "local", "ray", a concurrent.futures.Executor, or a function that creates one'
    raise input_error("engine", f"{engine!r} is not an engine", remedy)
