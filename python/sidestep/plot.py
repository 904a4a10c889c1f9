"""Figures of runs, with Matplotlib: tracks, separation, groups. Needs Matplotlib: ``pip install 'matplotlib>=3.7'``.

Each function draws into ``ax``, or into a new figure, and returns the axes. The figures show the rows that
a run has recorded: its folder, or the tables of ``Simulation.tables()`` or :func:`sidestep.read`.

>>> import sidestep
>>> from sidestep import plot
>>> sim = sidestep.Simulation("scenarios/airspace/superconflict.toml", record=True)
>>> sim.run(30)
30
>>> rows = sim.tables()
>>> plot.separation(rows, limit_m=500.0).get_ylabel()
'nearest two, m'
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._errors import input_error
from ._native import Simulation, Table, read, table_names, world_facts, worlds

__all__ = ["Places", "groups", "places", "separation", "tracks"]

#: The source of a run's rows.
Rows = str | os.PathLike[str] | Mapping[str, Table] | Table


class Places(NamedTuple):
    """Positions of agents, one row per agent and cycle, in the order of the cycles: arrays of the shape (rows,)."""

    #: The cycle at whose start it was measured.
    cycle: NDArray[np.int64]
    #: Number of the agent.
    agent: NDArray[np.int64]
    #: Number of the agent's part, e.g. of the connector of a chain; 0 for agents without parts.
    part: NDArray[np.int64]
    #: Position in m; of a body on a grid, the lower-left corner of its box.
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    try:
        pyplot = importlib.import_module("matplotlib.pyplot")
    except ImportError as error:
        raise ImportError("figures need Matplotlib: pip install 'matplotlib>=3.7'") from error
    return pyplot.subplots()[1]


def _table(rows: Rows, name: str) -> Table:
    if isinstance(rows, Table):
        return rows
    tables = rows if isinstance(rows, Mapping) else read(rows, [name])
    if name not in tables:
        raise input_error(
            "rows", f"there is no table `{name}`", f"record it: the tables are {', '.join(tables) or 'none'}"
        )
    return tables[name]


def places(rows: Rows, kinds: Collection[str] | None = None) -> Places:
    """Returns the positions of agents in m, from the table ``trajectories`` of any world.

    In a world whose table has bodies of several kinds, ``kinds`` selects some of them: ``"robot"``, ``"person"``,
    ``"door"``; by default those that are agents.

    Raises InputError when the run has recorded no positions.

    >>> import sidestep
    >>> from sidestep import plot
    >>> sim = sidestep.Simulation("scenarios/robots/one-robot.toml", record=True)
    >>> _ = sim.step(5)
    >>> plot.places(sim.tables()).cycle.tolist()
    [0, 1, 2, 3, 4]
    """
    table = _table(rows, "trajectories")
    columns = _columns_of(table)
    cycle = np.asarray(table["cycle"], dtype=np.int64)
    if columns["unit"] == "boxes":
        return _of_boxes(table, columns, cycle, columns["kinds"] if kinds is None else kinds)
    agent = np.asarray(table[columns["agent"]], dtype=np.int64)
    part = np.zeros_like(agent)
    if columns["part"] is not None:
        part = np.asarray(table[columns["part"]], dtype=np.int64)
    x_m, y_m = (np.asarray(table[axis]) for axis in columns["axes"])
    # The first leg of a cycle starts with the cycle.
    first = np.unique(np.stack([cycle, agent, part]), axis=1, return_index=True)[1]
    return Places(cycle[first], agent[first], part[first], x_m[first], y_m[first])


def _columns_of(table: Table) -> dict[str, Any]:
    """Returns the columns with positions as the world declares them whose columns the table has."""
    for world in worlds():
        columns = world_facts(world)["positions"]
        if columns is None:
            continue
        names = [columns["agent"], *columns["axes"], *([columns["part"]] if columns["part"] else [])]
        if all(name in table for name in names):
            return dict(columns)
    raise input_error("rows", f"the table `{table.name}` has no positions", "give the table `trajectories` of a run")


def _of_boxes(table: Table, columns: dict[str, Any], cycle: NDArray[np.int64], kinds: Collection[str]) -> Places:
    about = table.about
    body = np.asarray(table[columns["agent"]], dtype=np.int64)
    selected = np.zeros(len(body), dtype=bool)
    for kind in kinds:
        # Bodies of one kind have consecutive ids, such as 0-7.
        if ids := about.get(f"ids_{kind}"):
            first, last = map(int, ids.split("-"))
            selected |= (first <= body) & (body <= last)
    box_m = float(about["box_m"])
    yaw_rad = float(about["yaw_rad"])
    east_m, north_m = (np.asarray(table[axis], dtype=np.float64) * box_m for axis in columns["axes"])
    x_m = float(about["origin_x_m"]) + np.cos(yaw_rad) * east_m - np.sin(yaw_rad) * north_m
    y_m = float(about["origin_y_m"]) + np.sin(yaw_rad) * east_m + np.cos(yaw_rad) * north_m
    part = np.zeros_like(body)
    return Places(cycle[selected], body[selected], part[selected], x_m[selected], y_m[selected])


def tracks(rows: Rows, *, agents: Collection[int] | None = None, ax: Any = None) -> Any:
    """Plots the tracks of agents, with a dot at the last position of each.

    ``agents`` are the numbers of those to plot, by default all.

    Raises InputError when the run has recorded no positions.

    >>> import sidestep
    >>> from sidestep import plot
    >>> sim = sidestep.Simulation("scenarios/robots/one-robot.toml", record=True)
    >>> _ = sim.step(20)
    >>> plot.tracks(sim.tables()).get_xlabel()
    'x, m'
    """
    positions = places(rows)
    axes = _axes(ax)
    for agent in np.unique(positions.agent):
        if agents is not None and agent not in agents:
            continue
        color = None
        for part in np.unique(positions.part[positions.agent == agent]):
            own = (positions.agent == agent) & (positions.part == part)
            (line,) = axes.plot(positions.x_m[own], positions.y_m[own], linewidth=1, color=color)
            color = line.get_color()
            axes.plot(positions.x_m[own][-1:], positions.y_m[own][-1:], "o", markersize=4, color=color)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    return axes


def separation(rows: Rows, *, limit_m: float | None = None, ax: Any = None) -> Any:
    """Plots the distance of the closest two agents at the start of each cycle, with a line at ``limit_m``.

    Parts of one agent do not count. Within a cycle two may have been closer: the metric ``min_separation_m`` of airplanes
    is the minimum.

    Raises InputError when the run has recorded no positions, or has fewer than two agents.

    >>> import sidestep
    >>> from sidestep import plot
    >>> sim = sidestep.Simulation("scenarios/airspace/superconflict.toml", record=True)
    >>> _ = sim.step(20)
    >>> plot.separation(sim.tables(), limit_m=500.0).get_xlabel()
    'cycle'
    """
    positions = places(rows)
    if len(np.unique(positions.agent)) < 2:
        raise input_error("rows", "there are fewer than two agents", "give a run with at least two")
    cycles, starts = np.unique(positions.cycle, return_index=True)
    nearest = [
        _nearest(positions.agent[own], positions.x_m[own], positions.y_m[own])
        for own in np.split(np.arange(len(positions.cycle)), starts[1:])
    ]
    axes = _axes(ax)
    axes.plot(cycles, nearest, linewidth=1)
    if limit_m is not None:
        axes.axhline(limit_m, linestyle="--", color="0.4", linewidth=1)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("cycle")
    axes.set_ylabel("nearest two, m")
    return axes


def _nearest(agent: NDArray[Any], x_m: NDArray[Any], y_m: NDArray[Any]) -> float:
    """Returns the distance of the closest two different agents; NaN if there are fewer than two."""
    minimum = np.inf
    for k in range(len(agent) - 1):
        others = agent[k + 1 :] != agent[k]
        if others.any():
            distance = np.hypot(x_m[k + 1 :] - x_m[k], y_m[k + 1 :] - y_m[k])[others]
            minimum = min(minimum, float(distance.min()))
    return minimum if np.isfinite(minimum) else float("nan")


def groups(run: Simulation | Mapping[str, Any] | str | os.PathLike[str], *, ax: Any = None) -> Any:
    """Plots the distribution of conflict-group sizes.

    ``run`` is a simulation, or its metrics, if its world measures the sizes; else the folder or the tables of a run that
    records a row for each group, as airplanes do in the table ``optimizations``.

    Raises InputError when there are no sizes.

    >>> import sidestep
    >>> from sidestep import plot
    >>> sim = sidestep.Simulation("scenarios/robots/default.toml")
    >>> _ = sim.run(50)
    >>> plot.groups(sim).get_xlabel()
    'bodies of a group'
    """
    source = run.metrics() if isinstance(run, Simulation) else run
    declared = [facts for world in worlds() if (facts := world_facts(world)["group_sizes"])]
    metrics = [facts["metric"] for facts in declared if facts["kind"] == "metric"]
    measured = [source[metric] for metric in metrics if isinstance(source, Mapping) and metric in source]
    if measured:
        counts = list(measured[0])
        ends = [(2**k, 2 ** (k + 1) - 1) for k in range(len(counts))]
        labels = [str(low) if low == high else f"{low}-{high}" for low, high in ends]
    else:
        sizes, numbers = np.unique(_sizes(source, declared), return_counts=True)
        labels, counts = [str(size) for size in sizes], numbers.tolist()
    axes = _axes(ax)
    axes.bar(labels, counts)
    axes.set_yscale("log" if max(counts, default=0) > 100 else "linear")
    axes.set_xlabel("bodies of a group")
    axes.set_ylabel("groups, over all cycles")
    return axes


def _sizes(source: Rows, declared: list[dict[str, str]]) -> Any:
    """Returns the size of each group from the table that a world declares."""
    tables = [facts for facts in declared if facts["kind"] == "column"]
    names = list(source) if isinstance(source, Mapping) else []
    if isinstance(source, (str, os.PathLike)):
        names = table_names(source)
    # Where there is none of them, the first one is reported as missing.
    facts = next((facts for facts in tables if facts["table"] in names), tables[0])
    if isinstance(source, Mapping) and not isinstance(source.get(facts["table"]), (Table, type(None))):
        raise input_error("run", "these metrics have no group sizes", "give the run's folder or tables")
    return _table(source, facts["table"])[facts["column"]]
