"""Sweeps: many variants of a scenario, each with many seeds."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from . import _engines, _notebook
from ._engines import Engine
from ._errors import whole, wrong
from ._native import Scenario, Table, compare_methods, run_sweep

#: Largest number of runs of a variant.
MOST_RUNS = 1_000_000


@dataclass(frozen=True)
class Sweep:
    """The runs of a sweep and their summary, as :func:`sweep` returns them."""

    #: One row per run: cell, variant, replicate, seed, parameters, metrics and the digest of the last state.
    results: Table
    #: Times that a clock measured of each run, in seconds; it differs when the runs are made again.
    timings: Table
    #: The output of ``sidestep sweep --json``: ``summary`` has every metric with intervals and comparisons.
    told: dict[str, Any]

    @property
    def summary(self) -> dict[str, Any]:
        """Variants, metrics with their intervals, comparisons with the baseline, effects of parameters."""
        summary: dict[str, Any] = self.told["summary"]
        return summary

    @property
    def failed(self) -> int:
        """Number of runs that failed; the column ``failure`` says why."""
        return int(self.told["failed"])

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
        return values if variant is None else values[self.results["variant"] == variant]

    def __len__(self) -> int:
        return len(self.results)

    def __repr__(self) -> str:
        name = self.told["name"] or self.told["world"]
        return f"Sweep({name}, {len(self)} runs of {len(self.summary['variants'])} variants)"

    def _repr_html_(self) -> str:
        return _notebook.sweep(self)


class Compared(dict[str, Any]):
    """Methods that were compared, as :func:`compare` returns them: a dict that notebooks show as a table."""

    def _repr_html_(self) -> str:
        return _notebook.compared(self)


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
    record: bool = False,
    workers: int | None = None,
    out: str | os.PathLike[str] | None = None,
    engine: Engine = "local",
) -> Sweep:
    """Runs many variants of a scenario, each with many seeds, as ``sidestep sweep`` does, with the same bits.

    ``sweep`` is a sweep file, a dict of the keys of one, or a scenario of any sort. ``vary`` has a list of values for each
    key, and every combination is a variant; ``set`` holds for all variants, and so does ``cycles``. Each is run ``replicate``
    times (10), or ``until`` the 95 % intervals of means are narrow: ``"ci=0.05"``, a share of the mean, or ``"abs=2.5"``, in
    the unit of the metric, and at most ``max_runs`` (1000) times. Replicate `k` of every variant has the seed ``seed + k``.
    ``metrics`` are those to report, ``baseline`` the variant to compare with: its name, or the values that it has.

    With ``out`` the runs are kept in a folder, which is that of the command, byte for byte: Ctrl-C or a kill lose no finished
    run, and the same call goes on. ``record`` keeps a run folder of every run in it.

    ``engine`` runs the cells: ``"local"``, on ``workers`` threads; ``"ray"``; or a ``concurrent.futures.Executor``, such as
    ``ProcessPoolExecutor()``, Dask's ``client.get_executor()`` or one of mpi4py, or a function that makes one, which is then
    called again when workers were killed. ``workers`` is then the number of tasks at once. The table is the same for
    every engine.

    Raises InputError when anything asked for is wrong, before any run starts; RecordError when the folder cannot be written;
    EngineError when an executor is beyond help.

    >>> import sidestep
    >>> floor = {"world": "robots", "cycles": 50, "map": {"ascii": "......\\n......"}, "robots": {"count": 2}}
    >>> swept = sidestep.sweep(floor, vary={"robots.count": [2, 4]}, replicate=3, seed=7)
    >>> swept
    Sweep(robots, 6 runs of 2 variants)
    >>> swept.results["seed"].tolist()
    [7, 8, 9, 7, 8, 9]
    >>> [variant["name"] for variant in swept.summary["variants"]]
    ['count=2', 'count=4']
    """
    if replicate is not None and until is not None:
        raise wrong("replicate", "`until` says how often to run, too", "give one of them; max_runs bounds until")
    if until is not None and not isinstance(until, str):
        raise wrong("until", f"{until!r} is no text", 'write "ci=0.05" (of the mean) or "abs=2.5" (in units)')
    if isinstance(baseline, str) and "=" in baseline:
        remedy = 'give values as a dict, {"robots.count": 2}, or the name of a variant of the sweep file'
        raise wrong("baseline", f"{baseline!r} is no name", remedy)
    options = {
        "vary": _mapping("vary", vary),
        "set": {**_mapping("set", set), **({} if cycles is None else {"cycles": cycles})},
        "replicate": _count("replicate", replicate, MOST_RUNS),
        "until": until,
        "max_runs": _count("max_runs", max_runs, MOST_RUNS),
        "metrics": _names("metrics", metrics),
        "baseline": baseline if isinstance(baseline, Mapping) else None,
        "baseline_name": baseline if isinstance(baseline, str) else None,
        "seed": _seed(seed),
        "record": record,
    }
    _count("workers", workers, 1024)
    if record and engine != "local":
        raise wrong("record", "runs are recorded on this machine alone", 'leave it out, or give engine="local"')
    if record and out is None:
        raise wrong("record", "there is no folder to record runs to", "name one as `out`")
    crew = _engines.crew(engine, workers)
    if crew is None:
        return Sweep(*run_sweep(sweep, options, out, workers or 0, None))
    try:
        return Sweep(*run_sweep(sweep, options, out, crew.at_once, crew.run))
    finally:
        crew.close()


def compare(
    scenario: str | os.PathLike[str] | Mapping[str, Any] | Scenario,
    *,
    methods: Sequence[str] = ("pc", "orca", "mvp", "none"),
    runs: int = 10,
    seed: int | None = None,
    workers: int | None = None,
) -> Compared:
    """Compares methods of collision avoidance on the same air traffic, as ``sidestep compare --json`` prints them.

    ``methods`` are among ``"pc"`` (probability collectives), ``"orca"``, ``"mvp"`` and ``"none"``. Each flies ``runs``
    times, with consecutive seeds from ``seed`` on (the scenario's). The answer has a dict of each method under ``"methods"``:
    ``losses`` of separation, ``arrived`` (a share), ``delay_percent`` and others, each with its ``mean``, the ``interval`` of that
    (95 %) and ``n``; ``min_separation_m`` is the nearest of all runs.

    Any other two variants are compared by :func:`sweep` with ``baseline=``, or by :func:`sidestep.stats.paired`.

    Raises InputError when the scenario is of another world, or a method is unknown.

    >>> import sidestep
    >>> four = {"world": "airspace", "airspace": {"shield": "off", "generator": {"kind": "superconflict", "n": 4}}}
    >>> compared = sidestep.compare(four, methods=["pc", "none"], runs=3)
    >>> [(method["method"], method["loss_free"]) for method in compared["methods"]]
    [('pc', 3), ('none', 0)]
    """
    count = _count("runs", runs, MOST_RUNS) or 1
    workers = _count("workers", workers, 1024) or 0
    return Compared(compare_methods(scenario, _names("methods", methods), count, _seed(seed), workers))


def _mapping(name: str, values: Mapping[str, Any] | None) -> Mapping[str, Any]:
    if values is not None and not isinstance(values, Mapping):
        raise wrong(name, f"{values!r} is no dict", "give a dict by keys of the scenario")
    return values or {}


def _count(name: str, value: int | None, most: int) -> int | None:
    return None if value is None else whole(name, value, 1, most)


def _seed(seed: int | None) -> int | None:
    return None if seed is None else whole("seed", seed, 0, 2**63 - 1)


def _names(name: str, names: Sequence[str]) -> list[str]:
    if isinstance(names, str):
        raise wrong(name, f"{names!r} is one text", f"give a list: [{names!r}]")
    return list(names)
