"""Many worlds at once: arrays with a row for each world, and Gymnasium's vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import Autoreset, BatchOptions


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

    After ``reset(seed=s)``, the first episode of world ``k`` has the seed ``s + k``, and the seeds of its further episodes
    are drawn from a generator with that seed: it has the episodes of a ``parallel_env`` reset with ``s + k``.
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
        autoreset_mode: Autoreset = AutoresetMode.NEXT_STEP,
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
        self.single_observation_space: spaces.Space[Any] = spaces.Dict(
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
        # Seeds that a caller gave for the next episode of worlds.
        self._given_seeds: dict[int, int] = {}
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
                self._given_seeds[k] = checked_int("seed", one, 0, MAX_SEED - 1)
                self._rngs[k] = np.random.default_rng(one)
        self._restart(mask)
        self._observe()
        self._on_restart(mask)
        return self._observed(), self._infos_at_start(mask)

    def step(
        self, actions: Actions
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Applies an action of each agent in each world, and simulates one cycle.

        Returns the observations, rewards (worlds, agents), terminations and truncations (worlds,), and infos. A world
        restarts after its episode according to ``autoreset_mode``: in the next step, in which its action is ignored
        and its rewards are 0; or in the same step, in which ``infos["final_obs"]`` and ``infos["final_info"]`` have the final
        observations and infos of the worlds with a true ``infos["_final_obs"]``.
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
        self._on_step(continuing)
        rewards = self._compute_rewards()
        rewards[restarting] = 0.0
        self._drop_rewards(restarting)
        if restarting.any():
            self._on_restart(restarting)
        terminations = self._is_over() & continuing
        truncations = ~terminations & continuing & (self.worlds.cycles >= self.max_cycles)
        self._ended = terminations | truncations
        infos = self._infos(self._ended)
        restarted = restarting
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            ended = restarted = self._ended
            last = {"final_info": dict(infos), "_final_info": ended.copy()}
            infos |= {"final_obs": self._observed(copy=True), "_final_obs": ended.copy(), **last}
            self._restart(ended)
            # Into the same buffer: the arrays of the previous step still belong to the caller.
            self.worlds.observe(self._number, out=self._raw[self._now])
            self._on_restart(ended)
        if restarted.any():
            infos |= self._infos_at_start(restarted)
        return self._observed(), rewards, terminations, truncations, infos

    def render(self, world: int = 0, width: int = 480) -> NDArray[np.uint8]:
        """Returns an image of the present state of a world, (height, width, 3): all of one size, as films need them."""
        return self.worlds.render(world, size=(width, width * 3 // 4))

    def close(self) -> None:
        """Does nothing: worlds have no open files."""

    # What environments of tasks do otherwise.

    def _on_restart(self, mask: NDArray[np.bool_]) -> None:
        """Is called when worlds have restarted and are observed."""

    def _on_step(self, mask: NDArray[np.bool_]) -> None:
        """Is called when worlds have done a cycle and are observed."""

    def _drop_rewards(self, mask: NDArray[np.bool_]) -> None:
        """Is called with the worlds whose rewards are none, since they have restarted."""

    def _is_over(self) -> NDArray[np.bool_]:
        """Returns whether each world's episode has ended by itself."""
        return self.worlds.is_over

    def _infos_at_start(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        """Returns the infos of worlds that have restarted: their seeds, and as Gymnasium has it, which have one."""
        return {"seed": np.where(mask, self.worlds.seeds, 0).astype(np.int64), "_seed": mask.copy()}

    def _infos(self, ended: NDArray[np.bool_]) -> dict[str, Any]:
        """Returns the infos of a step; ``ended`` are the worlds whose episodes have ended with it."""
        return {}

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
            given = self._given_seeds.pop(int(k), None)
            seeds[k] = self._rngs[k].integers(MAX_SEED) if given is None else given
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
    """The agents of many worlds as Gymnasium's vector environment: with one policy for all, environment
    ``world * agents + agent`` is an agent of a world.

    It takes the arguments of :class:`Batch`, with ``num_envs`` for the environments in all, a multiple of the number of
    agents; arrays have the shape (num_envs, ...). Agents of one world begin and end their episodes together.
    """

    def __init__(
        self,
        scenario: Scenario | str | PathLike[str] | Mapping[str, Any],
        num_envs: int,
        **options: Unpack[BatchOptions],
    ) -> None:
        one = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
        agents = len(Batch(one, 1, **options).agents)
        self._wrap(Batch(one, worlds_of(num_envs, agents), **options))

    def _wrap(self, batch: Batch) -> None:
        self.batch = batch
        self.num_envs = batch.num_worlds * len(batch.agents)
        self.single_observation_space = batch.single_observation_space
        self.single_action_space = batch.single_action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {**self.metadata, "autoreset_mode": batch.autoreset_mode}

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Starts an episode in every world; see :meth:`Batch.reset`.

        ``seed`` is the seed of the first world, or a list with one for each world; the mask has one for each environment.
        """
        mask = (options or {}).get("reset_mask")
        if mask is not None and np.shape(mask) == (self.num_envs,) and np.asarray(mask).dtype == bool:
            rows = np.asarray(mask).reshape(self.batch.num_worlds, -1)
            options = {**(options or {}), "reset_mask": rows.any(axis=1)}
        observed, infos = self.batch.reset(seed=seed, options=options)
        return _in_rows(observed), self._infos_of_rows(infos)

    def step(
        self, actions: Actions
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Orders an action in each environment, and simulates one cycle; see :meth:`Batch.step`."""
        if isinstance(actions, Mapping):
            given: Actions = {name: self._by_worlds(values) for name, values in actions.items()}
        else:
            given = self._by_worlds(actions)
        observed, rewards, terminations, truncations, infos = self.batch.step(given)
        return (
            _in_rows(observed),
            rewards.reshape(-1),
            self._repeat(terminations),
            self._repeat(truncations),
            self._infos_of_rows(infos),
        )

    def render(self) -> tuple[NDArray[np.uint8], ...]:
        """Returns an image of each world."""
        return tuple(self.batch.render(world) for world in range(self.batch.num_worlds))

    def close_extras(self, **_: Any) -> None:
        """Does nothing: worlds have no open files."""

    def _by_worlds(self, values: Any) -> NDArray[Any]:
        array = np.asarray(values)
        return array.reshape(self.batch.num_worlds, -1, *array.shape[1:])

    def _repeat(self, by_world: NDArray[Any]) -> NDArray[Any]:
        return np.repeat(by_world, len(self.batch.agents), axis=0)

    def _infos_of_rows(self, infos: dict[str, Any]) -> dict[str, Any]:
        """Returns infos as Gymnasium has them: a row for each environment, and for dicts a list with dicts or None."""
        result: dict[str, Any] = {}
        for name, value in infos.items():
            if name == "final_obs":
                rows = _in_rows(value)
                ended = self._repeat(infos["_final_obs"])
                last = np.full(self.num_envs, None, dtype=object)
                for k in np.flatnonzero(ended):
                    last[k] = {key: array[k] for key, array in rows.items()} if isinstance(rows, dict) else rows[k]
                result[name] = last
            elif name == "final_info":
                result[name] = self._infos_of_rows(value)
            elif isinstance(value, list):
                result[name] = np.repeat(np.array(value, dtype=object), len(self.batch.agents))
            elif np.ndim(value) == 1:
                result[name] = self._repeat(value)
            else:
                result[name] = _in_rows(value)
        return result


def worlds_of(num_envs: int, agents: int) -> int:
    """Returns the number of worlds in which there are as many agents as environments are asked for."""
    num_envs = checked_int("num_envs", num_envs, 1, MAX_CYCLES)
    if num_envs % agents:
        cause = f"{num_envs} is no multiple of the {agents} agents of a world"
        raise input_error("num_envs", cause, f"give {agents * -(-num_envs // agents)}, for example")
    return num_envs // agents


def _in_rows(observed: Any) -> Any:
    """Returns arrays with a row for each agent of each world."""
    if isinstance(observed, dict):
        return {name: _in_rows(array) for name, array in observed.items()}
    return observed.reshape(-1, *observed.shape[2:])
