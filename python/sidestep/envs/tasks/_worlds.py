"""Many worlds of a task at once, as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..._errors import input_error
from .._batch import Batch, VectorEnv, worlds_of
from .._rewards import compute_rewards
from ._features import Arrays, Feature
from ._task import TIME_LEFT, Design, RewardTerm, Task

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import Autoreset, TaskOptions


class Encoder:
    """Computes the observations of a task from arrays."""

    def __init__(self, features: list[Feature]) -> None:
        self._features = features
        self.size = sum(len(feature.parts) for feature in features)

    @property
    def space(self) -> spaces.Box:
        """The space of an agent's observation."""
        return spaces.Box(-1.0, 1.0, (self.size,), np.float32)

    @property
    def meanings(self) -> list[tuple[str, str]]:
        """The name and the meaning of each number."""
        return [(feature.name, part) for feature in self._features for part in feature.parts]

    def encode(self, arrays: Arrays, out: NDArray[np.float32]) -> None:
        """Writes the observations of all agents, a row for each."""
        at = 0
        for feature in self._features:
            width = len(feature.parts)
            values = feature.values(arrays)
            if width == 1:
                out[:, at] = values.reshape(len(out))
            else:
                out[:, at : at + width] = values.reshape(len(out), width)
            at += width


class TaskBatch(Batch):
    """Many worlds of a task, whose agents are controlled together: observations (worlds, agents, numbers).

    Args:
        task: the task.
        worlds: number of worlds.
        rewards: weights of the terms of its reward, instead of its own; terms that are not named count nothing.
        max_cycles: cycles of an episode; the task's own by default.
        autoreset_mode: as of :class:`sidestep.envs.Batch`.
        mask: whether the mask of actions is in the observations, too: dicts of ``observation`` and ``action_mask``.
        copy: as of :class:`sidestep.envs.Batch`.
        workers: number of workers.
        keys: keys of the scenario to set, such as ``{"robots.0.count": 4}``: for a task of your own.

    ``infos`` have, for all worlds, ``action_mask`` (worlds, agents, choices) where actions are choices, and ``active`` (worlds,
    agents) where agents come and go, as airplanes do: rows of those that are not there mean nothing. Where episodes end they
    have ``metrics``, the measurements of the run, and ``score``.
    """

    def __init__(
        self,
        task: Task,
        worlds: int,
        *,
        rewards: Mapping[str, float] | None = None,
        max_cycles: int | None = None,
        autoreset_mode: Autoreset = AutoresetMode.NEXT_STEP,
        mask: bool = False,
        copy: bool = True,
        workers: int = 1,
        keys: Mapping[str, Any] | None = None,
    ) -> None:
        scenario = task.scenario(keys=keys)
        super().__init__(
            scenario, worlds, max_cycles=max_cycles, autoreset_mode=autoreset_mode, copy=copy, workers=workers
        )
        self.task = task
        self.setting = task.setting(keys, self.max_cycles)
        self.design: Design = task.design(self.setting)
        self.terms = chosen_terms(self.design.rewards, rewards)
        self.encoder = Encoder(self.design.features)
        rows = self._shape[0] * self._shape[1]
        self._tracker = None if self.design.tracker is None else self.design.tracker(rows)
        self._encoded = [np.zeros((*self._shape, self.encoder.size), np.float32) for _ in range(2)]
        self._before_arrays: dict[str, NDArray[Any]] = {}
        self._now_arrays: dict[str, NDArray[Any]] = {}
        self._reward_parts: dict[str, NDArray[np.float64]] = {}
        #: The orders of the last step, by name (worlds, agents, ...).
        self.last_orders: dict[str, NDArray[Any]] = {}
        self._has_mask = mask and self.design.actions.mask is not None
        self.single_action_space = self.design.actions.space
        self.single_observation_space = self._observation_space()
        self.observation_space, self.action_space = (
            batch_space(batch_space(space, self._shape[1]), worlds)
            for space in (self.single_observation_space, self.single_action_space)
        )

    def __getstate__(self) -> dict[str, Any]:
        # Functions within functions are not pickled: the parts of the task are made again.
        return {name: value for name, value in vars(self).items() if name not in ("design", "encoder")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.design = self.task.design(self.setting)
        self.encoder = Encoder(self.design.features)

    @property
    def team_number(self) -> int:
        """The number of the team that acts."""
        return self._number

    @property
    def observation_parts(self) -> list[tuple[str, str]]:
        """The name and the meaning of each number of an observation."""
        return self.encoder.meanings

    def _observation_space(self) -> spaces.Space[Any]:
        space = self.encoder.space
        if not self._has_mask:
            return space
        choices = len(self.design.actions.parts)
        return spaces.Dict({"observation": space, "action_mask": spaces.Box(0, 1, (choices,), np.int8)})

    def _rows(self, by_world: NDArray[Any]) -> NDArray[Any]:
        """Returns a row for each agent, of one for each world."""
        return np.repeat(by_world, self._shape[1], axis=0)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """Returns what all agents observe now, a row for each, with what the task remembers."""
        rows = self._shape[0] * self._shape[1]
        arrays = {name: array.reshape(rows, *array.shape[2:]) for name, array in self._raw[self._now].items()}
        if self._tracker is not None:
            arrays |= self._tracker.arrays
        left = 1.0 - self.worlds.cycles.astype(np.float32) / self.max_cycles
        arrays[TIME_LEFT] = self._rows(np.maximum(left, 0.0))
        return arrays

    def _on_restart(self, mask: NDArray[np.bool_]) -> None:
        if self._tracker is not None:
            self._tracker.restart(self._rows(mask), self._arrays())
        self._remember()

    def _on_step(self, mask: NDArray[np.bool_]) -> None:
        self._before_arrays = self._now_arrays
        if self._tracker is not None:
            self._tracker.advance(self._rows(mask), self._arrays())
        self._remember()

    def _remember(self) -> None:
        """Keeps the arrays of now: those of the tracker are overwritten, and rewards need those before, too."""
        arrays = self._arrays()
        if self._tracker is not None:
            arrays |= {name: array.copy() for name, array in self._tracker.arrays.items()}
        self._now_arrays = arrays

    def _compute_rewards(self) -> NDArray[np.float64]:
        rows = self._shape[0] * self._shape[1]
        active = None if self.design.is_active is None else self.design.is_active(self._before_arrays)
        for name, term in self.terms.items():
            part = term.weight * compute_rewards(term.measure, self._before_arrays, self._now_arrays, rows)
            if active is not None:
                # The step with which an agent is gone still counts: in it, it arrives.
                part[~active] = 0.0
            self._reward_parts[name] = part.reshape(self._shape)
        return np.asarray(np.sum(list(self._reward_parts.values()), axis=0))

    def _drop_rewards(self, mask: NDArray[np.bool_]) -> None:
        for part in self._reward_parts.values():
            part[mask] = 0.0

    def reward_parts(self) -> dict[str, NDArray[np.float64]]:
        """Returns the weighted terms of the last rewards, by name: arrays (worlds, agents)."""
        return {name: part.copy() for name, part in self._reward_parts.items()}

    def _is_over(self) -> NDArray[np.bool_]:
        over = np.asarray(super()._is_over())
        if self.design.is_done is None:
            return over
        done = self.design.is_done(self._now_arrays).reshape(self._shape)
        return over | done.all(axis=1)

    def observed(self) -> Any:
        """Returns the observations of now, as the last call did."""
        return self._observed(copy=True)

    def _observed(self, copy: bool = False) -> Any:
        encoded = self._encoded[self._now]
        self.encoder.encode(self._now_arrays, encoded.reshape(-1, self.encoder.size))
        observed: Any = encoded.copy() if copy or self._copy else encoded
        return {"observation": observed, "action_mask": self.action_masks()} if self._has_mask else observed

    def _check_begun(self, call: str) -> None:
        if not self._now_arrays:
            raise input_error(call, "no episode is in progress", "call reset first")

    def action_masks(self) -> NDArray[np.int8]:
        """Returns which choices make sense now (worlds, agents, choices): 1 for those that do."""
        self._check_begun("action_masks")
        parts = self.design.actions.parts
        if self.design.actions.mask is None:
            return np.ones((*self._shape, len(parts)), np.int8)
        return self.design.actions.mask(self._now_arrays).astype(np.int8).reshape(*self._shape, -1)

    def is_active(self) -> NDArray[np.bool_]:
        """Returns which agents take part now (worlds, agents)."""
        self._check_begun("is_active")
        if self.design.is_active is None:
            return np.ones(self._shape, bool)
        return self.design.is_active(self._now_arrays).reshape(self._shape)

    def _order(self, actions: Any) -> None:
        # A copy: policies may fill the same array again.
        actions = np.array(actions)
        expected = (*self._shape, *(self.single_action_space.shape or ()))
        if actions.shape != expected:
            raise input_error("actions", f"their shape is {actions.shape}", f"give an array of the shape {expected}")
        rows = actions.reshape(-1, *actions.shape[2:])
        check_actions(self.single_action_space, rows)
        orders = self.design.actions.orders(rows, self._now_arrays)
        self.last_orders = {name: values.reshape(*self._shape, *values.shape[1:]) for name, values in orders.items()}
        for name, values in self.last_orders.items():
            self.worlds.order(name, values, team=self._number)

    def _infos_at_start(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        return {**self._present_infos(), **super()._infos_at_start(mask)}

    def _present_infos(self) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        everywhere = np.ones(self._shape[0], bool)
        if self.design.actions.mask is not None:
            infos |= {"action_mask": self.action_masks(), "_action_mask": everywhere}
        if self.design.is_active is not None:
            infos |= {"active": self.is_active(), "_active": everywhere}
        return infos

    def _infos(self, ended: NDArray[np.bool_]) -> dict[str, Any]:
        infos = self._present_infos()
        if ended.any():
            metrics = self.worlds.metrics(mask=ended)
            scores = np.full(len(ended), np.nan)
            for world in np.flatnonzero(ended):
                scores[world] = self._score(int(world), metrics[world] or {})
            infos |= {"metrics": metrics, "_metrics": ended.copy(), "score": scores, "_score": ended.copy()}
        return infos

    def _score(self, world: int, metrics: Mapping[str, Any]) -> float:
        agents = self._shape[1]
        rows = slice(world * agents, (world + 1) * agents)
        tracked = {} if self._tracker is None else {k: array[rows] for k, array in self._tracker.arrays.items()}
        return self.task.score.measure(metrics, tracked)


class TaskVectorEnv(VectorEnv):
    """The agents of many worlds of a task as Gymnasium's vector environment, for one policy that all share.

    An agent that is gone before its world ends, such as an airplane that has arrived, is terminated with its last step. Its
    row stays, and means nothing until the world restarts: ``infos["active"]`` tells which rows count.
    """

    def __init__(self, task: Task, num_envs: int, **options: Unpack[TaskOptions]) -> None:
        agents = len(task.setting(options.get("keys")).team)
        #: The worlds.
        self.tasks = TaskBatch(task, worlds_of(num_envs, agents), **options)
        self._wrap(self.tasks)

    @property
    def observation_parts(self) -> list[tuple[str, str]]:
        """The name and the meaning of each number of an observation."""
        return self.tasks.observation_parts

    @property
    def terms(self) -> dict[str, RewardTerm]:
        """The terms of the reward, by name."""
        return self.tasks.terms

    def step(
        self, actions: Any
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Applies an action of each environment, and simulates one cycle; see :meth:`sidestep.envs.Batch.step`."""
        given = as_actions(actions, (self.num_envs, *(self.single_action_space.shape or ())))
        was_active = self.tasks.is_active().ravel()
        observed, rewards, terminated, truncated, infos = super().step(given)
        # Worlds that restart in the same step have agents again.
        ended = terminated | truncated
        is_gone = was_active & ~self.tasks.is_active().ravel() & ~ended
        return observed, rewards, terminated | is_gone, truncated, infos


def as_actions(actions: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Returns actions as an array of this shape."""
    array = np.asarray(actions)
    if array.shape != shape or array.dtype.kind not in "biuf":
        given = f"of the shape {array.shape}" if array.dtype.kind in "biuf" else f"{actions!r}"
        raise input_error("actions", f"they are {given}", f"give numbers of the shape {shape}")
    return array


def check_actions(space: spaces.Space[Any], rows: NDArray[Any]) -> None:
    """Refuses actions that are not in their space, but for numbers beyond the bounds, which are cut."""
    if isinstance(space, spaces.Box):
        if not np.issubdtype(rows.dtype, np.number) or not np.isfinite(rows).all():
            raise input_error("actions", "one is not a finite number", "give numbers from -1 to 1")
        return
    counts = space.nvec if isinstance(space, spaces.MultiDiscrete) else np.array(space.n)  # type: ignore[attr-defined]
    if not np.issubdtype(rows.dtype, np.integer) or ((rows < 0) | (rows >= counts)).any():
        remedy = " and ".join(f"0 to {count - 1}" for count in np.atleast_1d(counts))
        is_whole = np.issubdtype(rows.dtype, np.integer)
        cause = "one is no choice" if is_whole else f"numbers of the type {rows.dtype} are no choices"
        raise input_error("actions", cause, f"give whole numbers from {remedy}")


def chosen_terms(known: Mapping[str, RewardTerm], weights: Mapping[str, float] | None) -> dict[str, RewardTerm]:
    """Returns the terms of a reward with other weights."""
    if weights is None:
        return dict(known)
    if not isinstance(weights, Mapping):
        raise input_error("rewards", f"{weights!r} is no dict", f"give weights to some of {', '.join(known)}")
    chosen = {}
    for name, weight in weights.items():
        if name not in known:
            raise input_error(f"rewards.{name}", "there is no such term", f"one of {', '.join(known)}")
        if not isinstance(weight, (int, float, np.number)) or not math.isfinite(weight):
            raise input_error(f"rewards.{name}", f"its weight is {weight!r}", "give a finite number")
        chosen[name] = RewardTerm(known[name].meaning, float(weight), known[name].measure)
    if not chosen:
        raise input_error("rewards", "no term is given", f"give weights to some of {', '.join(known)}")
    return chosen
