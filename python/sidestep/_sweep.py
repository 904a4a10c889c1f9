"""Sweeps: many variants of a scenario, each with many seeds."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _engines, _notebook
from ._engines import Engine
from ._errors import checked_int, input_error
from ._native import Scenario, Table, compare_methods, run_sweep
from ._progress import Progress

if TYPE_CHECKING:
    from .envs.tasks import Task, TaskComparison

#: Methods of collision avoidance that are compared by default.
METHODS = ["pc", "orca", "mvp", "bands", "none"]
#: Maximum number of runs of a variant.
MAX_RUNS = 1_000_000


@dataclass(frozen=True)
class Sweep:
    """The runs of a sweep and their summary, as :func:`sweep` returns them."""

    #: One row per run: its trial (column ``cell``), variant, replicate, seed, parameters, metrics and final digest.
    results: Table
    #: Measured times of each run in seconds; they differ if the sweep is repeated.
    timings: Table
    #: Metrics over time that the world is about, one row per run and cycle (the number of cycles done); without rows for
    #: more than 20,000 runs.
    series: Table
    #: Their means over the runs of each variant, with 95 % intervals: one row per variant, metric and cycle. A run that
    #: was over before a cycle has the metrics of its end there.
    bands: Table
    #: The output of ``sidestep sweep --json``: ``summary`` has every metric with intervals and comparisons.
    output: dict[str, Any]

    @property
    def told(self) -> dict[str, Any]:
        """The same as ``output``."""
        return self.output

    @property
    def summary(self) -> dict[str, Any]:
        """Variants, metrics with their intervals, comparisons with the baseline, effects of parameters."""
        summary: dict[str, Any] = self.output["summary"]
        return summary

    @property
    def failed(self) -> int:
        """Number of runs that failed; the column ``failure`` gives the reason."""
        return int(self.output["failed"])

    def values(self, metric: str, variant: int | None = None) -> Any:
        """Returns a metric of all runs, or of one variant, by the number of the replicate: an array of shape (runs,).

        Runs of two variants with the same replicate have the same seed, so they are pairs for
        :func:`sidestep.stats.paired`.

        >>> import sidestep
        >>> floor = {"world": "robots", "cycles": 50, "map": {"ascii": "......"}, "robots": {"count": 2}}
        >>> sidestep.sweep(floor, replicate=3).values("contacts").shape
        (3,)
        """
        values = self.results[metric]
        if variant is None:
            return values
        variant = checked_int("variant", variant, 0, len(self.summary["variants"]) - 1)
        return values[self.results["variant"] == variant]

    def __len__(self) -> int:
        return len(self.results)

    def __repr__(self) -> str:
        name = self.output["name"] or self.output["world"]
        return f"Sweep({name}, {len(self)} runs of {len(self.summary['variants'])} variants)"

    def _repr_html_(self) -> str:
        return _notebook.sweep(self)


class Comparison(dict[str, Any]):
    """A comparison of methods, as :func:`compare` returns it: a dict that notebooks show as a table."""

    def _repr_html_(self) -> str:
        return _notebook.comparison(self)


def sweep(
    sweep: str | os.PathLike[str] | Mapping[str, Any] | Scenario,
    *,
    vary: Mapping[str, Sequence[Any]] | None = None,
    set: Mapping[str, Any] | None = None,
    cycles: int | None = None,
    replicate: int | None = None,
    until: str | None = None,
    max_runs: int | None = None,
    seed: int | None = None,
    metrics: Sequence[str] = (),
    baseline: str | Mapping[str, Any] | None = None,
    series: Sequence[str] | None = None,
    record: bool = False,
    workers: int | None = None,
    out: str | os.PathLike[str] | None = None,
    engine: Engine = "local",
    progress: Progress | None = None,
) -> Sweep:
    """Runs many variants of a scenario, each with many seeds, as ``sidestep sweep`` does, with the same bits.

    ``sweep`` is a sweep file, a dict of the keys of one, or a scenario in any form. ``vary`` has a list of values for each
    key, and every combination is a variant; ``set`` and ``cycles`` apply to all variants. Each is run ``replicate``
    times (10), or ``until`` the 95 % intervals of means are narrow: ``"ci=0.05"``, a fraction of the mean, or ``"abs=2.5"``,
    in the unit of the metric, and at most ``max_runs`` (1000) times. Replicate `k` of every variant has the seed ``seed + k``.
    ``metrics`` are those to report, ``baseline`` the variant to compare with: its name or its values. ``series`` are the
    metrics to keep over time, instead of those that the world is about.

    With ``out`` the runs are kept in a folder, byte for byte that of the command: Ctrl-C or a kill loses no finished
    run, and the same call continues. ``record`` keeps a run folder of every run in it.

    ``engine`` runs the trials: ``"local"``, on ``workers`` threads; ``"ray"``; or a ``concurrent.futures.Executor``, such as
    ``ProcessPoolExecutor()``, Dask's ``client.get_executor()`` or one of mpi4py, or a function that creates one, which is
    called again when workers are killed. ``workers`` is then the number of tasks at once. The table is the same for
    every engine.

    ``progress`` is a function that is told now and then how many runs are done, and how many there are (those that are certain,
    with ``until``), or True for a bar of tqdm.

    Raises InputError when an argument is wrong, before any run starts; RecordError when the folder cannot be written;
    EngineError when an executor keeps failing.

    >>> import sidestep
    >>> floor = {"world": "robots", "cycles": 50, "map": {"ascii": "......\\n......"}, "robots": {"count": 2}}
    >>> result = sidestep.sweep(floor, vary={"robots.count": [2, 4]}, replicate=3, seed=7)
    >>> result
    Sweep(robots, 6 runs of 2 variants)
    >>> result.results["seed"].tolist()
    [7, 8, 9, 7, 8, 9]
    >>> [variant["name"] for variant in result.summary["variants"]]
    ['count=2', 'count=4']
    """
    if replicate is not None and until is not None:
        raise input_error(
            "replicate", "`until` also sets the number of runs", "give one of them; max_runs bounds until"
        )
    if until is not None and not isinstance(until, str):
        raise input_error("until", f"{until!r} is not a text", 'write "ci=0.05" (of the mean) or "abs=2.5" (in units)')
    if isinstance(baseline, str) and "=" in baseline:
        remedy = 'give values as a dict, {"robots.count": 2}, or the name of a variant of the sweep file'
        raise input_error("baseline", f"{baseline!r} is not a name", remedy)
    options = {
        "vary": _mapping("vary", vary),
        "set": {**_mapping("set", set), **({} if cycles is None else {"cycles": cycles})},
        "replicate": _count("replicate", replicate, MAX_RUNS),
        "until": until,
        "max_runs": _count("max_runs", max_runs, MAX_RUNS),
        "metrics": _names("metrics", metrics),
        "baseline": baseline if isinstance(baseline, Mapping) else None,
        "baseline_name": baseline if isinstance(baseline, str) else None,
        "seed": _seed(seed),
        "record": record,
        "series": None if series is None else _names("series", series),
        "progress": progress,
    }
    _count("workers", workers, 1024)
    if record and engine != "local":
        raise input_error("record", "runs are recorded on this machine only", 'leave it out, or give engine="local"')
    if record and out is None:
        raise input_error("record", "there is no folder to record runs to", "give one as `out`")
    pool = _engines.task_pool(engine, workers)
    if pool is None:
        return run_sweep(sweep, options, out, workers or 0, None)
    try:
        return run_sweep(sweep, options, out, pool.at_once, pool.run)
    finally:
        pool.close()


def compare(
    scenario: str | os.PathLike[str] | Mapping[str, Any] | Scenario | Task,
    *,
    methods: Sequence[str] | Mapping[str, Any] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int | None = None,
) -> Comparison | TaskComparison:
    """Compares methods of collision avoidance on the same air traffic, as ``sidestep compare --json`` does; or policies and
    scripted methods on a task of :mod:`sidestep.envs.tasks`.

    Of a task, or its name such as ``"sidestep/Superconflict-v0"``, ``methods`` are policies, or names of scripted methods, by the
    names under which they are listed; ``runs`` is 100 by default. See :func:`sidestep.envs.tasks.compare_on_task`.

    Of air traffic, which is any other scenario of airplanes:

    ``methods`` are among ``"pc"`` (probability collectives), ``"orca"``, ``"mvp"``, ``"bands"`` (of detect and
    avoid) and ``"none"``, all of them by default. Each flies ``runs`` times (10), with consecutive seeds from ``seed`` on (the scenario's). The result has a dict of each method under ``"methods"``:
    ``losses`` of separation, ``arrived`` (a proportion), ``delay_percent``, ``intrusion_prevention_rate``, ``domino_effect``
    (conflicts beside those of the same traffic without resolution) and others, each with its ``mean``, its 95 %
    ``interval`` and ``n``; ``min_separation_m`` is the minimum over all runs.

    Use :func:`sweep` with ``baseline=``, or :func:`sidestep.stats.paired`, to compare any other two variants.

    Raises InputError when the scenario is of another world, or a method is unknown.

    >>> import sidestep
    >>> four = {"world": "airspace", "airspace": {"shield": "off", "generator": {"kind": "superconflict", "n": 4}}}
    >>> comparison = sidestep.compare(four, methods=["pc", "none"], runs=3)
    >>> [(method["method"], method["loss_free"]) for method in comparison["methods"]]
    [('pc', 3), ('none', 0)]
    """
    count = _count("runs", runs, MAX_RUNS)
    workers = _count("workers", workers, 1024) or 0
    if isinstance(methods, str):
        _names("methods", methods)
    if _is_task(scenario):
        from .envs import tasks

        task = tasks.find_task(scenario)  # type: ignore[arg-type]
        return tasks.compare_on_task(task, methods, runs=count or 100, seed=_seed(seed), workers=workers or 1)
    if isinstance(methods, Mapping):
        remedy = "give a list of names; policies are compared on tasks, such as sidestep/Superconflict-v0"
        raise input_error("methods", "they are a dict, and the scenario is no task", remedy)
    names = METHODS if methods is None else _names("methods", methods)
    chosen: Any = scenario
    return Comparison(compare_methods(chosen, names, count or 10, _seed(seed), workers))


def _is_task(scenario: object) -> bool:
    """Returns whether it is a task, or the name of one; nothing is imported for what is none."""
    if isinstance(scenario, str):
        is_name = scenario.startswith("sidestep/") or re.fullmatch(r"[A-Z]\w*-v\d+", scenario) is not None
        return is_name and not os.path.exists(scenario)
    kinds = {f"{kind.__module__}.{kind.__name__}" for kind in type(scenario).__mro__}
    return "sidestep.envs.tasks._task.Task" in kinds


def _mapping(name: str, values: Mapping[str, Any] | None) -> Mapping[str, Any]:
    if values is not None and not isinstance(values, Mapping):
        raise input_error(name, f"{values!r} is not a dict", "give a dict by keys of the scenario")
    return values or {}


def _count(name: str, value: int | None, high: int) -> int | None:
    return None if value is None else checked_int(name, value, 1, high)


def _seed(seed: int | None) -> int | None:
    return None if seed is None else checked_int("seed", seed, 0, 2**63 - 1)


def _names(name: str, names: Sequence[str]) -> list[str]:
    if isinstance(names, str):
        raise input_error(name, f"{names!r} is a single text", f"give a list: [{names!r}]")
    return list(names)
