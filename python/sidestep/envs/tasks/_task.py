"""Tasks: a scenario with what its agents observe, may do, and are rewarded for."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ..._errors import input_error
from ..._native import Scenario, Simulation, Space, Team
from .._rewards import Reward
from ._features import Arrays, Feature

#: The folder of the scenario files.
SCENARIOS = Path(__file__).parent.parent / "scenarios"

#: Name of the array with the share of the episode that is left, which every task has.
TIME_LEFT = "time_left"


class Tracker(Protocol):
    """What a task remembers of an episode, beside what agents observe: targets that are reached, boxes that were visited."""

    #: Its arrays, a row for each agent; they are overwritten.
    arrays: dict[str, NDArray[Any]]

    def restart(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Begins anew for the agents with a true mask, which observe this."""

    def advance(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Takes in what the agents with a true mask observe after a cycle."""


@dataclass(frozen=True)
class Setting:
    """What the parts of a task are made for: its scenario, and the team that acts."""

    #: The keys of the scenario, as a scripted method plays it.
    keys: Mapping[str, Any]
    team: Team
    #: The spaces of the team's observations by name.
    spaces: Mapping[str, Space]
    #: Cycles of an episode.
    max_cycles: int


@dataclass(frozen=True)
class Actions:
    """What an agent may do."""

    #: The space of an agent's action.
    space: spaces.Space[Any]
    #: The meaning of each choice, or of each number.
    parts: tuple[str, ...]
    #: Returns orders by name, of the actions of all agents, a row for each.
    orders: Callable[[NDArray[Any], Arrays], dict[str, NDArray[Any]]]
    #: Returns which choices make sense, of the shape (agents, choices); None for actions of which all do.
    mask: Callable[[Arrays], NDArray[np.bool_]] | None = None


@dataclass(frozen=True)
class RewardTerm:
    """A part of the reward."""

    meaning: str
    weight: float
    #: Returns the unweighted reward of each agent, of its observations before and after a cycle.
    measure: Reward


@dataclass(frozen=True)
class Design:
    """The parts of a task for a scenario."""

    features: list[Feature]
    actions: Actions
    rewards: dict[str, RewardTerm]
    tracker: Callable[[int], Tracker] | None = None
    #: Returns whether each agent's episode has ended by itself; None where only the world decides.
    is_done: Callable[[Arrays], NDArray[np.bool_]] | None = None
    #: Returns whether each agent takes part; None where all do at all times.
    is_active: Callable[[Arrays], NDArray[np.bool_]] | None = None


@dataclass(frozen=True)
class Score:
    """The number by which policies are compared: of a whole episode."""

    name: str
    meaning: str
    is_higher_better: bool
    #: Returns it, of the measurements of a run and the tracker's arrays at its end.
    measure: Callable[[Mapping[str, Any], Arrays], float]


@dataclass(frozen=True)
class Task:
    """A task with a goal. Its version changes whenever scores change."""

    name: str
    version: int
    #: What its agents are to do.
    meaning: str
    #: The file of its scenario, in :data:`SCENARIOS`: it opens in the studio, where a scripted method plays it.
    file: str
    #: Keys of the scenario that let a caller control the agents.
    control: Mapping[str, Any]
    design: Callable[[Setting], Design]
    score: Score
    #: Scripted methods by name: keys of the scenario; None leaves one out.
    methods: Mapping[str, Mapping[str, Any]]
    #: Whether it has a single agent.
    is_single: bool = False

    def __repr__(self) -> str:
        return f"Task({self.id}: {self.meaning} Methods: {', '.join(self.methods)}.)"

    @property
    def id(self) -> str:
        """Its name with the version, such as ``Superconflict-v0``."""
        return f"{self.name}-v{self.version}"

    @property
    def path(self) -> Path:
        """The file of its scenario."""
        return SCENARIOS / self.file

    def scenario(self, method: str | None = None, keys: Mapping[str, Any] | None = None) -> Scenario:
        """Returns the scenario whose agents a caller controls, or in which a scripted method does."""
        keys = keys or {}
        if method is None:
            chosen = self.control
            # Keys within what the control replaces, such as targets, are for the description of the task alone.
            keys = {key: value for key, value in keys.items() if not key.startswith(tuple(f"{one}." for one in chosen))}
        elif method in self.methods:
            chosen = self.methods[method]
        else:
            raise input_error("method", f"there is no `{method}`", f"one of {', '.join(self.methods)}")
        return with_keys(self.path, {**chosen, **keys})

    def setting(self, keys: Mapping[str, Any] | None = None, max_cycles: int | None = None) -> Setting:
        """Returns what the parts of the task are made for."""
        scenario = self.scenario(keys=keys)
        team = acting_team(Simulation(scenario).teams)
        names = {space.name: space for space in team.observation_spaces}
        # The file says where agents are to go, which those that take orders are not told.
        described = with_keys(self.path, keys or {})
        return Setting(described.to_dict(), team, names, max_cycles or scenario.cycles)


#: All tasks, by their names with the version, such as ``Superconflict-v0``.
TASKS: dict[str, Task] = {}


def found_task(task: str | Task) -> Task:
    """Returns a task by its name, such as ``Superconflict-v0`` or ``sidestep/Superconflict-v0``."""
    if isinstance(task, Task):
        return task
    name = str(task).removeprefix("sidestep/")
    if name in TASKS:
        return TASKS[name]
    near = difflib.get_close_matches(name, TASKS, 1)
    remedy = f"did you mean `{near[0]}`? " if near else ""
    raise input_error("task", f"there is no `{task}`", f"{remedy}one of {', '.join(TASKS)}")


def with_keys(path: Path, keys: Mapping[str, Any]) -> Scenario:
    """Returns a scenario with other values of some keys, and without those whose value is None."""
    scenario = Scenario(path)
    without = [key for key, value in keys.items() if value is None]
    if without:
        content = scenario.to_dict()
        for key in without:
            *places, last = (int(place) if place.isdecimal() else place for place in key.split("."))
            part: Any = content
            for place in places:
                part = part[place]
            if isinstance(part, list):
                part.pop(int(last))
            else:
                part.pop(last, None)
        scenario = Scenario(content, base=path.parent)
    rest = {key: value for key, value in keys.items() if value is not None}
    return scenario.set(rest) if rest else scenario


def acting_team(teams: list[Team]) -> Team:
    """Returns the team that takes orders, or of a scripted method the first one."""
    return next((team for team in teams if team.action_spaces), teams[0])


def time_left() -> Feature:
    """Returns the share of the episode that is left."""
    part = "cycles left of the episode: 1 at its start, -1 at its end"
    return Feature("time_left", (part,), lambda arrays: 2.0 * arrays[TIME_LEFT] - 1.0)
