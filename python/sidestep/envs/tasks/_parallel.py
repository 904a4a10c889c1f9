"""A task as PettingZoo's parallel environment."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pettingzoo
from gymnasium import spaces
from numpy.typing import NDArray

from ..._errors import input_error
from ._show import RENDER_MODES
from ._single import OneWorld, RenderMode
from ._task import Task

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import WorldOptions


class TaskParallelEnv(OneWorld, pettingzoo.ParallelEnv[str, Any, Any]):
    """One world of a task, each of whose agents observes and acts for itself.

    Agents that have arrived are *terminated*, and no longer in ``agents``. Where all others of an episode end with it,
    ``infos`` of each have ``metrics`` and ``score``. It takes the arguments of :class:`TaskEnv`.
    """

    metadata: dict[str, Any] = {"name": "sidestep_task_v0", "render_modes": RENDER_MODES, "render_fps": 10}

    def __init__(
        self, task: Task, *, render_mode: RenderMode | None = None, width: int = 480, **options: Unpack[WorldOptions]
    ) -> None:
        self._open(task, render_mode, width, options)
        self.metadata = {**self.metadata, "name": f"{snake_case(task.name)}_v{task.version}"}
        self.possible_agents = list(self.batch.agents)
        self.agents: list[str] = []
        self._numbers = {agent: k for k, agent in enumerate(self.possible_agents)}
        self.observation_spaces = dict.fromkeys(self.possible_agents, self.batch.single_observation_space)
        self.action_spaces = dict.fromkeys(self.possible_agents, self.batch.single_action_space)
        one = self.batch.single_action_space
        # The action of agents that are gone: any, since nobody obeys it.
        self._idle = np.zeros((len(self.possible_agents), *(one.shape or ())), one.dtype)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's actions."""
        return self.action_spaces[agent]

    @property
    def state_space(self) -> spaces.Box:
        """The space of :meth:`state`."""
        return spaces.Box(-1.0, 1.0, (len(self.possible_agents) * self.batch.encoder.size,), np.float32)

    def state(self) -> NDArray[np.float32]:
        """Returns the observations of all agents as one vector, for a critic that sees all."""
        observed = self.batch.observed()
        rows = observed["observation"] if isinstance(observed, dict) else observed
        return np.asarray(rows[0]).reshape(-1)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Starts an episode with this seed, or with one that is drawn. ``options`` are ignored."""
        observed, infos = self.batch.reset(seed=seed)
        if not self.batch.is_active().any():
            # Nobody is there yet.
            own = {name: infos[name] for name in ("seed", "_seed")}
            _, _, infos = self._advance(infos)
            observed, infos = self.batch.observed(), {**infos, **own}
        active = self.batch.is_active()[0].tolist()
        self.agents = [agent for agent, is_there in zip(self.possible_agents, active, strict=True) if is_there]
        return self._split(observed, self.agents), self._infos(infos, self.agents)

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Applies an action of each agent, and simulates one cycle."""
        agents = self.agents
        if not agents:
            raise input_error("step", "no episode is in progress", "call reset first")
        self._check(actions, agents)
        # In the type that was given: the worlds refuse numbers that are no choices.
        chosen = np.asarray([actions[agent] for agent in agents])
        given = chosen
        if len(agents) < len(self.possible_agents):
            given = np.zeros(self._idle.shape, chosen.dtype)
            given[[self._numbers[agent] for agent in agents]] = chosen
        observed, rewards, terminations, truncations, infos = self.batch.step(given[None])
        is_over, is_truncated = bool(terminations[0]), bool(truncations[0])
        active = self.batch.is_active()[0].tolist()
        if not (any(active) or is_over or is_truncated):
            is_over, is_truncated, infos = self._advance(infos)
            # Others may have come meanwhile.
            observed = self.batch.observed()
            active = self.batch.is_active()[0].tolist()
        was_there = set(agents)
        arrived = [agent for agent in self.possible_agents if active[self._numbers[agent]] and agent not in was_there]
        told = agents + arrived
        gone = {agent: is_over or not active[self._numbers[agent]] for agent in told}
        self.agents = [] if is_over or is_truncated else [agent for agent in told if not gone[agent]]
        earned = rewards[0].tolist()
        return (
            self._split(observed, told),
            {agent: earned[self._numbers[agent]] for agent in told},
            gone,
            {agent: is_truncated and not gone[agent] for agent in told},
            self._infos(infos, told),
        )

    def _advance(self, infos: dict[str, Any]) -> tuple[bool, bool, dict[str, Any]]:
        """Lets a world without agents go on until one is there or the episode ends; returns how that ended, and its infos."""
        is_over = is_truncated = False
        while not (is_over or is_truncated or self.batch.is_active().any()):
            *_, terminations, truncations, infos = self.batch.step(self._idle[None])
            is_over, is_truncated = bool(terminations[0]), bool(truncations[0])
        return is_over, is_truncated, infos

    def _check(self, actions: Mapping[str, Any], agents: list[str]) -> None:
        if actions.keys() == set(agents):
            return
        unknown = sorted(set(actions) - set(agents))
        if unknown:
            raise input_error("actions", f"there is no agent `{unknown[0]}`", "give those of `agents`")
        missing = next(agent for agent in agents if agent not in actions)
        raise input_error("actions", f"`{missing}` has no action", "give one for each agent")

    def _split(self, observed: Any, agents: list[str]) -> dict[str, Any]:
        if isinstance(observed, dict):
            columns = {name: self._split(array, agents) for name, array in observed.items()}
            return {agent: {name: column[agent] for name, column in columns.items()} for agent in agents}
        rows = list(observed[0])
        if len(agents) == len(rows):
            return dict(zip(agents, rows, strict=True))
        return {agent: rows[self._numbers[agent]] for agent in agents}

    def _infos(self, infos: dict[str, Any], agents: list[str]) -> dict[str, dict[str, Any]]:
        masks = list(infos["action_mask"][0]) if "action_mask" in infos else None
        common: dict[str, Any] = {
            name: infos[name][0].item() if isinstance(infos[name][0], np.generic) else infos[name][0]
            for name in ("seed", "metrics", "score")
            if name in infos and infos[f"_{name}"][0]
        }
        if masks is None:
            return {agent: dict(common) for agent in agents}
        return {agent: {"action_mask": masks[self._numbers[agent]], **common} for agent in agents}

    def copy(self) -> TaskParallelEnv:
        """Returns an independent environment in the same state."""
        return copy.deepcopy(self)


def snake_case(name: str) -> str:
    """Returns a name in letters of lower case, with ``_`` between words."""
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")
