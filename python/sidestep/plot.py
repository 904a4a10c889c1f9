"""Figures of runs, with Matplotlib: tracks, separation, groups. Needs the extra ``plot``: ``pip install 'sidestep[plot]'``.

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
from ._native import Simulation, Table, read

__all__ = ["Places", "groups", "places", "separation", "tracks"]

#: The source of a run's rows.
Rows = str | os.PathLike[str] | Mapping[str, Table] | Table


class Places(NamedTuple):
    """Positions of agents, one row per agent and cycle, in the order of the cycles: arrays of the shape (rows,)."""

    #: The cycle at whose start it was measured.
    cycle: NDArray[np.int64]
    #: Number of the agent: of the robot, person, airplane or chain.
    agent: NDArray[np.int64]
    #: Number of the connector of a chain; 0 for other agents.
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
        raise ImportError("figures need Matplotlib: pip install 'sidestep[plot]'") from error
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


def places(rows: Rows, kinds: Collection[str] = ("robot", "person")) -> Places:
    """Returns the positions of agents in m, from the table ``trajectories`` of any world.

    In a world on a grid, ``kinds`` selects bodies: ``"robot"``, ``"person"``, ``"door"``.

    Raises InputError when the run has recorded no positions.

    >>> import sidestep
    >>> from sidestep import plot
    >>> sim = sidestep.Simulation("scenarios/robots/one-robot.toml", record=True)
    >>> _ = sim.step(5)
    >>> plot.places(sim.tables()).cycle.tolist()
    [0, 1, 2, 3, 4]
    """
    table = _table(rows, "trajectories")
    cycle = np.asarray(table["cycle"], dtype=np.int64)
    if "col_boxes" in table:
        return _of_boxes(table, cycle, kinds)
    name = "chain" if "chain" in table else "airplane"
    agent = np.asarray(table[name], dtype=np.int64)
    part = np.asarray(table["connector"], dtype=np.int64) if name == "chain" else np.zeros_like(agent)
    x_m = np.asarray(table["x_m"])
    y_m = np.asarray(table["y_m"])
    # The first leg of a cycle starts with the cycle.
    first = np.unique(np.stack([cycle, agent, part]), axis=1, return_index=True)[1]
    return Places(cycle[first], agent[first], part[first], x_m[first], y_m[first])


def _of_boxes(table: Table, cycle: NDArray[np.int64], kinds: Collection[str]) -> Places:
    about = table.about
    body = np.asarray(table["body"], dtype=np.int64)
    selected = np.zeros(len(body), dtype=bool)
    for kind in kinds:
        # Bodies of one kind have consecutive ids, such as 0-7.
        if ids := about.get(f"ids_{kind}"):
            first, last = map(int, ids.split("-"))
            selected |= (first <= body) & (body <= last)
    box_m = float(about["box_m"])
    yaw_rad = float(about["yaw_rad"])
    east_m = np.asarray(table["col_boxes"], dtype=np.float64) * box_m
    north_m = np.asarray(table["row_boxes"], dtype=np.float64) * box_m
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

    ``run`` is a simulation, its metrics, or, for airplanes, its folder or tables with the table ``optimizations``.

    Raises InputError when there are no sizes.

    >>> import sidestep
    >>> from sidestep import plot
    >>> sim = sidestep.Simulation("scenarios/robots/default.toml")
    >>> _ = sim.run(50)
    >>> plot.groups(sim).get_xlabel()
    'bodies of a group'
    """
    source = run.metrics() if isinstance(run, Simulation) else run
    if isinstance(source, Mapping) and "group_sizes" in source:
        counts = list(source["group_sizes"])
        ends = [(2**k, 2 ** (k + 1) - 1) for k in range(len(counts))]
        labels = [str(low) if low == high else f"{low}-{high}" for low, high in ends]
    elif isinstance(source, Mapping) and "optimizations" in source and not isinstance(source["optimizations"], Table):
        raise input_error("run", "metrics of airplanes have no group sizes", "give the run's folder or tables")
    else:
        sizes, numbers = np.unique(_table(source, "optimizations")["airplanes"], return_counts=True)
        labels, counts = [str(size) for size in sizes], numbers.tolist()
    axes = _axes(ax)
    axes.bar(labels, counts)
    axes.set_yscale("log" if max(counts, default=0) > 100 else "linear")
    axes.set_xlabel("bodies of a group")
    axes.set_ylabel("groups, over all cycles")
    return axes
