"""Many worlds at once: arrays with a row for each world, and Gymnasium's vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv as GymnasiumVectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from .._errors import checked_int, input_error
from .._native import Batch as Worlds
from .._native import Scenario, world_facts
from ._parallel import (
    MAX_CYCLES,
    MAX_SEED,
    action_space,
    orders_of,
    rewards_of,
    space_of,
)
from ._rewards import Reward, compute_rewards

Observations = dict[str, NDArray[Any]]
Actions = NDArray[Any] | Mapping[str, NDArray[Any]]


class Batch:
    """Many worlds of one scenario, whose agents are controlled together: arrays of the shape (worlds, agents, ...).

    Args:
        scenario: a ``Scenario``, a path or a dict.
        worlds: number of worlds.
        team: name or number of the team that acts; by default the only one that takes orders.
        rewards: weights of named terms (``sidestep.envs.TERMS``), or a function of the agents' observations before
            and after a step. It receives all agents of all worlds at once, world by world, and returns a number for each.
        orders: names of the orders in an action. With one of them the action is that order itself; with several it
            is a dict.
        max_cycles: cycles of an episode; the scenario's own by default.
        autoreset_mode: when a world restarts after the end of its episode: in the next step, in the same step, or
            not at all (``AutoresetMode`` of Gymnasium, or its value); then call ``reset`` with a mask.
        copy: whether returned arrays belong to the caller. Otherwise they are overwritten two steps later.
        workers: number of workers; each world is stepped by one of them.

    Every world draws the seeds of its episodes from its own generator: after ``reset(seed=s)``, world ``k`` has the
    episodes of a ``parallel_env`` reset with ``s + k``.
    """

    def __init__(
        self,
        scenario: Scenario | str | PathLike[str] | Mapping[str, Any],
        worlds: int,
        *,
        team: str | int | None = None,
        rewards: Mapping[str, float] | Reward | None = None,
        orders: Sequence[str] | None = None,
        max_cycles: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        workers: int = 1,
    ) -> None:
        self.scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
        if max_cycles is not None:
            max_cycles = checked_int("max_cycles", max_cycles, 1, MAX_CYCLES)
        modes = [mode.value for mode in AutoresetMode]
        if not isinstance(autoreset_mode, AutoresetMode) and autoreset_mode not in modes:
            remedy = f"one of {', '.join(modes)}"
            raise input_error("autoreset_mode", f"there is no `{autoreset_mode}`", remedy)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.max_cycles = self.scenario.cycles if max_cycles is None else max_cycles
        self.worlds = Worlds(self.scenario, worlds, workers=workers)
        self._number = self._acting_team(team)
        acting = self.worlds.teams[self._number]
        world = self.scenario.world
        noun = world_facts(world)["agent"]
        self._orders = orders_of(acting, world, orders)
        self._reward = rewards_of(acting, world, rewards)
        self.agents = [f"{noun}_{agent}" for agent in acting.agents]
        self.single_observation_space = spaces.Dict(
            {space.name: space_of(space) for space in acting.observation_spaces}
        )
        self.single_action_space = action_space(self._orders)
        singles = (self.single_observation_space, self.single_action_space)
        self.observation_space, self.action_space = (
            batch_space(batch_space(space, len(acting)), worlds) for space in singles
        )
        self._shape = (worlds, len(acting))
        self._copy = copy
        self._reals = [space.name for space in acting.observation_spaces if space.dtype == "float64"]
        # Two buffers of observations, used alternately for before and after a step; and as returned, in float32.
        self._raw = [self.worlds.observe(self._number) for _ in range(2)]
        self._as_float32 = [{name: np.zeros(raw[name].shape, np.float32) for name in self._reals} for raw in self._raw]
        self._now = 0
        self._rngs: list[np.random.Generator] = []
        self._ended = np.ones(worlds, bool)

    @property
    def num_worlds(self) -> int:
        """Number of worlds."""
        return len(self.worlds)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Starts an episode in every world, and returns the observations.

        ``seed`` is a list of seeds, or the seed of world 0; the other worlds get the following seeds. With
        ``options={"reset_mask": mask}`` only the worlds with a true mask restart.
        """
        mask = self._mask(options)
        n = self.num_worlds
        seeds = [None] * n if seed is None else seed
        if isinstance(seeds, (int, np.integer)):
            seeds = [int(seeds) + k for k in range(n)]
        if len(seeds) != n:
            raise input_error("seed", f"{len(seeds)} seeds for {n} worlds", "give one for each world")
        if not self._rngs:
            self._rngs = [np.random.default_rng() for _ in range(n)]
        for k, one in enumerate(seeds):
            if one is not None and mask[k]:
                self._rngs[k] = np.random.default_rng(one)
        self._restart(mask)
        self._observe()
        return self._observed(), {}

    def step(
        self, actions: Actions
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Applies an action of each agent in each world, and simulates one cycle.

        Returns the observations, rewards (worlds, agents), terminations and truncations (worlds,), and infos. A world
        restarts after its episode according to ``autoreset_mode``: in the next step, in which its action is ignored
        and its rewards are 0; or in the same step, in which ``infos["final_obs"]`` has the final observations of the
        worlds with a true ``infos["_final_obs"]``.
        """
        if not self._rngs:
            raise input_error("step", "no episode is in progress", "call reset first")
        restarting = self._ended
        if restarting.any():
            if self.autoreset_mode is not AutoresetMode.NEXT_STEP:
                which = int(np.flatnonzero(restarting)[0])
                remedy = 'call reset, e.g. with options={"reset_mask": terminations | truncations}'
                raise input_error("step", f"the episode of world {which} has ended", remedy)
        continuing = ~restarting
        self._order(actions)
        self.worlds.step(mask=continuing)
        if restarting.any():
            self._restart(restarting)
        self._observe()
        rewards = self._compute_rewards()
        rewards[restarting] = 0.0
        terminations = self.worlds.is_over & continuing
        truncations = ~terminations & continuing & (self.worlds.cycles >= self.max_cycles)
        self._ended = terminations | truncations
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            ended = self._ended
            infos = {"final_obs": self._observed(copy=True), "_final_obs": ended.copy()}
            self._restart(ended)
            # Into the same buffer: the arrays of the previous step still belong to the caller.
            self.worlds.observe(self._number, out=self._raw[self._now])
        return self._observed(), rewards, terminations, truncations, infos

    def close(self) -> None:
        """Does nothing: worlds have no open files."""

    def _acting_team(self, team: str | int | None) -> int:
        teams = self.worlds.teams
        acting = [k for k, one in enumerate(teams) if one.action_spaces]
        if not acting:
            remedy = "let its agents be controlled externally (`external`)"
            raise input_error("scenario", "no agent of this scenario takes orders", remedy)
        known = ", ".join(teams[k].name for k in acting)
        if team is None:
            if len(acting) > 1:
                cause = f"{len(acting)} teams take orders"
                raise input_error("team", cause, f"give one of {known}; the others get no orders")
            return acting[0]
        found = [k for k in acting if team in (k, teams[k].name)]
        if not found:
            raise input_error("team", f"no team `{team}` takes orders", f"one of {known}")
        return found[0]

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        unknown = sorted(set(options or {}) - {"reset_mask"})
        if unknown:
            raise input_error(f"options.{unknown[0]}", "there is no such option", "the only one is reset_mask")
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.num_worlds, bool)
        mask = np.asarray(mask)
        if mask.shape != (self.num_worlds,) or mask.dtype != bool or not mask.any():
            remedy = f"give {self.num_worlds} truth values, at least one of them true"
            raise input_error("options.reset_mask", "it does not say which worlds restart", remedy)
        return mask

    def _restart(self, mask: NDArray[np.bool_]) -> None:
        seeds = np.zeros(self.num_worlds, np.uint64)
        for k in np.flatnonzero(mask):
            seeds[k] = self._rngs[k].integers(MAX_SEED)
        self.worlds.reset(seeds, mask=mask)
        self._ended = self._ended & ~mask

    def _observe(self) -> None:
        self._now = 1 - self._now
        self.worlds.observe(self._number, out=self._raw[self._now])

    def _observed(self, copy: bool = False) -> Observations:
        raw = self._raw[self._now]
        as_float32 = self._as_float32[self._now]
        for name in self._reals:
            np.copyto(as_float32[name], raw[name], casting="same_kind")
        observations = {**raw, **as_float32}
        return {name: array.copy() for name, array in observations.items()} if copy or self._copy else observations

    def _order(self, actions: Actions) -> None:
        if not isinstance(actions, Mapping):
            if len(self._orders) > 1:
                names = ", ".join(space.name for space in self._orders)
                raise input_error("actions", "there are several orders", f"give a dict of {names}")
            self.worlds.order(self._orders[0].name, np.asarray(actions), team=self._number)
            return
        known = {space.name for space in self._orders}
        unknown = sorted(set(actions) - known)
        missing = sorted(known - set(actions))
        if unknown or missing:
            cause = f"there is no order `{unknown[0]}`" if unknown else f"`{missing[0]}` is missing"
            raise input_error("actions", cause, f"give {', '.join(sorted(known))}")
        try:
            for name, values in actions.items():
                self.worlds.order(name, np.asarray(values), team=self._number)
        except Exception:
            # An action takes effect as a whole or not at all.
            n = self.num_worlds
            self.worlds.reset(np.zeros(n, np.uint64), mask=np.zeros(n, bool))
            raise

    def _compute_rewards(self) -> NDArray[np.float64]:
        n = self._shape[0] * self._shape[1]
        before, after = (
            {name: array.reshape(n, *array.shape[2:]) for name, array in self._raw[k].items()}
            for k in (1 - self._now, self._now)
        )
        return compute_rewards(self._reward, before, after, n).reshape(self._shape)


class VectorEnv(GymnasiumVectorEnv[Any, Any, Any]):
    """Gymnasium's vector environment of a scenario with one agent that takes orders.

    It takes the arguments of :class:`Batch`, with ``num_envs`` for ``worlds``; arrays have the shape (num_envs, ...).
    """

    def __init__(
        self,
        scenario: Scenario | str | PathLike[str] | Mapping[str, Any],
        num_envs: int,
        **options: Any,
    ) -> None:
        self.batch = Batch(scenario, num_envs, **options)
        if len(self.batch.agents) != 1:
            cause = f"{len(self.batch.agents)} agents take orders"
            raise input_error("scenario", cause, "use sidestep.envs.Batch for many, or leave one")
        self.num_envs = num_envs
        self.single_observation_space = self.batch.single_observation_space
        self.single_action_space = self.batch.single_action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.metadata = {"autoreset_mode": self.batch.autoreset_mode, "render_modes": []}
        self.render_mode = None

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Starts an episode in every environment; see :meth:`Batch.reset`."""
        observed, infos = self.batch.reset(seed=seed, options=options)
        return _of_one(observed), infos

    def step(
        self, actions: Actions
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Orders an action in each environment, and simulates one cycle; see :meth:`Batch.step`."""
        if isinstance(actions, Mapping):
            given: Actions = {name: np.asarray(values)[:, None] for name, values in actions.items()}
        else:
            given = np.asarray(actions)[:, None]
        observed, rewards, terminations, truncations, ends = self.batch.step(given)
        infos: dict[str, Any] = {}
        if ends:
            final = _of_one(ends["final_obs"])
            for k in np.flatnonzero(ends["_final_obs"]):
                last = {name: array[k] for name, array in final.items()}
                infos = self._add_info(infos, {"final_obs": last, "final_info": {}}, int(k))
        return _of_one(observed), rewards[:, 0], terminations, truncations, infos


def _of_one(observed: Observations) -> Observations:
    return {name: array[:, 0] for name, array in observed.items()}
