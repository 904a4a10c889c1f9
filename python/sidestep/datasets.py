"""Recorded runs as data sets for learning offline, in the format of Minari.

Needs Minari: ``pip install 'minari[create,hdf5]>=0.5'``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import input_error
from ._native import Simulation, Space, Team, read

__all__ = ["to_minari"]


def to_minari(
    runs: str | PathLike[str] | Sequence[str | PathLike[str]],
    dataset_id: str,
    *,
    rewards: Mapping[str, float] | Any = None,
    description: str | None = None,
    **options: Any,
) -> Any:
    """Makes a Minari data set of run folders whose agents a caller controlled: an episode of each folder.

    A folder is one that ``Simulation(..., out=...)`` wrote, or a recorded run of a leaderboard. Its run is repeated, and must end
    with the recorded digest, so that the observations are those that the caller had. All agents are one: an observation is a
    dict of arrays (agents, ...), an action a dict of the orders (agents, ...), and the reward the mean of theirs, by
    ``rewards`` (as of :class:`sidestep.envs.ParallelEnv`). ``infos`` have ``ordered_NAME``: which agents had the order NAME in a cycle;
    others have the lowest value in the action. ``options`` are those of Minari's ``create_dataset_from_buffers``, such as
    ``author`` and ``code_permalink``.

    An episode that a task ended before the world was over, such as one whose targets were all visited, is cut here: truncated.

    Of a task, Minari's own ``DataCollector(tasks.make(...))`` makes data sets with the task's observations.

    Raises InputError when a folder has no run, or no orders, or the runs are of different scenarios.
    """
    try:
        import minari
        from gymnasium import spaces
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise ImportError("data sets need Minari: pip install 'minari[create,hdf5]>=0.5' 'gymnasium>=1.0'") from error
    from .envs._parallel import inside_bounds, rewards_of, space_of
    from .envs._rewards import compute_rewards

    folders = [runs] if isinstance(runs, (str, PathLike)) else list(runs)
    if not folders:
        raise input_error("runs", "there are none", "give the folder of a run, or a list of them")
    buffers, seen_space, done_space = [], None, None
    for number, folder in enumerate(folders):
        episode = _Episode(Path(folder))
        team = episode.team
        observed_space = spaces.Dict({s.name: _of_all(space_of(s), len(team)) for s in team.observation_spaces})
        ordered_space = spaces.Dict({s.name: _of_all(inside_bounds(s), len(team)) for s in episode.ordered})
        if number == 0:
            seen_space, done_space = observed_space, ordered_space
        elif (observed_space, ordered_space) != (seen_space, done_space):
            raise input_error("runs", f"{folder} has other observations or orders than {folders[0]}", "give alike runs")
        reward = rewards_of(team, episode.world, rewards)
        observations, earned = [episode.observe()], []
        for _ in range(episode.cycles):
            episode.step()
            observations.append(episode.observe())
            earned.append(float(compute_rewards(reward, observations[-2], observations[-1], len(team)).mean()))
        episode.check()
        ends = np.arange(1, episode.cycles + 1) == episode.cycles
        buffers.append(
            EpisodeBuffer(
                id=number,
                seed=episode.seed,
                observations=_stacked([_as_in_space(observed, team) for observed in observations]),
                actions={name: values[: episode.cycles] for name, values in episode.values.items()},
                rewards=earned,
                terminations=list(ends & episode.is_over),
                truncations=list(ends & ~np.bool_(episode.is_over)),
                infos={f"ordered_{name}": given[: episode.cycles] for name, given in episode.given.items()},
            )
        )
    text = description or f"Recorded runs of Sidestep: {', '.join(Path(folder).name for folder in folders)}"
    return minari.create_dataset_from_buffers(
        dataset_id, buffers, observation_space=seen_space, action_space=done_space, description=text, **options
    )


class _Episode:
    """A recorded run, repeated cycle by cycle."""

    def __init__(self, folder: Path) -> None:
        try:
            run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
            # A run that ended before the planned cycle has its digest here alone.
            summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise input_error("runs", f"{folder} has no run: {error}", "give a folder that `out` wrote") from error
        self._folder, self._digest = folder, summary["digest"]
        self.seed, self.cycles = int(run["seed"]), int(run["cycles_done"])
        self._sim = Simulation(folder / "scenario.toml", seed=self.seed)
        self.world: str = self._sim.scenario.world
        acting = [(k, team) for k, team in enumerate(self._sim.teams) if team.action_spaces]
        orders = read(folder, ["orders"]).get("orders") if acting else None
        if orders is None or len(orders) == 0:
            raise input_error("runs", f"no agent of {folder} was given an order", "record a run that a caller controls")
        if len(acting) > 1:
            raise input_error("runs", f"{len(acting)} teams of {folder} take orders", "record a run with one of them")
        ((self._number, self.team),) = acting
        columns = {name: orders[name] for name in ("cycle", "agent", "order", "part", "value")}
        names = set(columns["order"].tolist())
        self.ordered: list[Space] = [space for space in self.team.action_spaces if space.name in names]
        row_of = {int(agent): row for row, agent in enumerate(self.team.agents)}
        rows = np.array([row_of[int(agent)] for agent in columns["agent"]])
        #: By name of the order: its values (cycles, agents, ...), and who was given it (cycles, agents).
        self.values: dict[str, NDArray[Any]] = {}
        self._exact: dict[str, NDArray[np.float64]] = {}
        self.given: dict[str, NDArray[np.bool_]] = {}
        for space in self.ordered:
            mine = columns["order"] == space.name
            shape = (self.cycles, len(self.team))
            lowest = 0.0 if space.choices is not None or not np.isfinite(space.low) else space.low
            parts = max(int(np.prod(space.shape)), 1)
            values = np.full((*shape, parts), lowest)
            given = np.zeros(shape, bool)
            # Orders for a cycle that was not done are none of the episode.
            within = mine & (columns["cycle"] < self.cycles)
            cycle, row = columns["cycle"][within].astype(np.int64), rows[within]
            values[cycle, row, columns["part"][within].astype(np.int64)] = columns["value"][within]
            given[cycle, row] = True
            dtype = np.float32 if space.dtype == "float64" else np.int64
            # Float32 would repeat another run.
            self._exact[space.name] = values.reshape(*shape, *space.shape)
            self.values[space.name] = self._exact[space.name].astype(dtype)
            self.given[space.name] = given

    def observe(self) -> dict[str, NDArray[Any]]:
        return self._sim.observe(self._number)

    def step(self) -> None:
        """Gives the recorded orders, and does a cycle."""
        cycle = self._sim.cycle
        for name, given in self.given.items():
            rows = np.flatnonzero(given[cycle])
            if len(rows):
                agents = self.team.agents[rows].tolist()
                self._sim.order(name, self._exact[name][cycle, rows], agents=agents)
        self._sim.step()

    @property
    def is_over(self) -> bool:
        return self._sim.is_over

    def check(self) -> None:
        """Refuses a run that went otherwise: its observations would not be those that the caller had."""
        if self._sim.digest != self._digest:
            cause = f"the run of {self._folder} ends with another digest than was recorded"
            raise input_error("runs", cause, "repeat it with the build that recorded it; `sidestep replay` tells which")


def _of_all(one: Any, agents: int) -> Any:
    """Returns the space of all agents."""
    from gymnasium.vector.utils import batch_space

    return batch_space(one, agents)


def _as_in_space(observed: Mapping[str, NDArray[Any]], team: Team) -> dict[str, NDArray[Any]]:
    reals = {space.name for space in team.observation_spaces if space.dtype == "float64"}
    return {name: array.astype(np.float32) if name in reals else array for name, array in observed.items()}


def _stacked(rows: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}
