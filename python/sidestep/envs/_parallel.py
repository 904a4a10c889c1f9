"""PettingZoo's parallel environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pettingzoo
from gymnasium import spaces
from numpy.typing import NDArray

from .._errors import checked_int, input_error
from .._native import Scenario, Simulation, Space, Team, rows_by_name, world_facts, worlds
from ._rewards import DEFAULTS, Reward, combine_rewards, compute_rewards

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import ParallelOptions


MAX_INT64 = np.iinfo(np.int64).max
# Cycles of an episode are at most this.
MAX_CYCLES = 2**63 - 1
# Seeds of episodes are below this.
MAX_SEED = 2**62


def space_of(space: Space) -> spaces.Space[Any]:
    """Returns the Gymnasium space of one agent."""
    if space.choices is not None:
        if space.shape == ():
            return spaces.Discrete(len(space.choices))
        return spaces.MultiDiscrete(np.full(space.shape, len(space.choices)))
    if space.dtype == "int64":
        high = min(space.high, float(MAX_INT64 - 512))
        return spaces.Box(np.int64(space.low), np.int64(high), space.shape, np.int64)
    return spaces.Box(np.float32(space.low), np.float32(space.high), space.shape, np.float32)


def inside_bounds(space: Space) -> spaces.Space[Any]:
    """Returns the Gymnasium space of one agent's order: all its float32 values are inside the bounds in double precision."""
    result = space_of(space)
    if isinstance(result, spaces.Box) and space.dtype == "float64":
        lows = [np.float32(space.low), np.nextafter(np.float32(space.low), np.float32(np.inf))]
        highs = [np.float32(space.high), np.nextafter(np.float32(space.high), np.float32(-np.inf))]
        low = next(low for low in lows if low >= space.low)
        high = next(high for high in highs if high <= space.high)
        return spaces.Box(low, high, space.shape, np.float32)
    return result


class ParallelEnv(pettingzoo.ParallelEnv[str, Any, Any]):
    """The agents of a scenario that take orders, as a PettingZoo environment.

    Args:
        scenario: a ``Scenario``, a path or a dict. Agents that take orders are controlled here; the others decide
            for themselves.
        rewards: weights of named terms (``sidestep.envs.TERMS``), or a function of a team's observations before and
            after a step, which returns a number for each agent.
        orders: names of the orders in an action. With one of them the action is that order itself; with several it
            is a dict. By default the order that the world declares for it: the action of a robot, for example.
        max_cycles: cycles of an episode; the scenario's own by default. An episode that reaches them is
            *truncated*; one that has finished early is *terminated*.
        render_mode: ``"rgb_array"`` or None.
        width: width of images in pixels.
        workers: number of workers of the simulation.

    The episode after ``reset(seed=s)`` has the seed ``s``, and those after it draw theirs from a generator with that seed,
    so that a sequence of episodes is reproducible from its first seed.
    """

    #: The world of its scenarios; None for any world.
    world: str | None = None
    metadata: dict[str, Any] = {"name": "sidestep_v0", "render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self,
        scenario: Scenario | str | PathLike[str] | Mapping[str, Any],
        *,
        rewards: Mapping[str, float] | Reward | None = None,
        orders: Sequence[str] | None = None,
        max_cycles: int | None = None,
        render_mode: Literal["rgb_array"] | None = None,
        width: int = 480,
        workers: int = 1,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise input_error("render_mode", f"there is no `{render_mode}`", 'give "rgb_array" or None')
        self.scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
        if self.world not in (None, self.scenario.world):
            cause = f"its world is `{self.scenario.world}`, not `{self.world}`"
            raise input_error("scenario", cause, "use `parallel_env`, which accepts any world")
        self.render_mode = render_mode
        self._width = width
        self._workers = workers
        self._options: dict[str, Any] = {
            "rewards": rewards,
            "orders": orders,
            "max_cycles": max_cycles,
            "render_mode": render_mode,
            "width": width,
            "workers": workers,
        }
        if max_cycles is not None:
            max_cycles = checked_int("max_cycles", max_cycles, 1, MAX_CYCLES)
        self.max_cycles = self.scenario.cycles if max_cycles is None else max_cycles
        self.sim = Simulation(self.scenario, workers=workers)
        self._teams = [(k, t) for k, t in enumerate(self.sim.teams) if t.action_spaces]
        if not self._teams:
            remedy = "let its agents be controlled externally (`external`)"
            raise input_error("scenario", "no agent of this scenario takes orders", remedy)
        world = self.scenario.world
        noun = world_facts(world)["agent"]
        self._orders = [orders_of(team, world, orders) for _, team in self._teams]
        self._order_names = [[space.name for space in chosen] for chosen in self._orders]
        self._rewards = [rewards_of(team, world, rewards) for _, team in self._teams]
        self._columns = [
            [(space.name, space.dtype == "float64") for space in team.observation_spaces] for _, team in self._teams
        ]
        self._names = [[f"{noun}_{agent}" for agent in team.agents] for _, team in self._teams]
        self.possible_agents = [name for names in self._names for name in names]
        self.agents: list[str] = []
        # During an episode all of them act.
        self._acting = frozenset(self.possible_agents)
        self.observation_spaces: dict[str, spaces.Space[Any]] = {}
        self.action_spaces: dict[str, spaces.Space[Any]] = {}
        for (_, team), names, chosen in zip(self._teams, self._names, self._orders, strict=True):
            observation_space = spaces.Dict({space.name: space_of(space) for space in team.observation_spaces})
            agent_action_space = action_space(chosen)
            for name in names:
                self.observation_spaces[name] = observation_space
                self.action_spaces[name] = agent_action_space
        self._rng = np.random.default_rng()
        self._before: list[dict[str, NDArray[Any]]] = []

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's observations: a dict by name."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Starts an episode, and returns the observations of all agents, and its seed in their infos; ``options`` are
        ignored.
        """
        if seed is None:
            episode_seed = int(self._rng.integers(MAX_SEED))
        else:
            episode_seed = checked_int("seed", seed, 0, MAX_SEED - 1)
            self._rng = np.random.default_rng(episode_seed)
        self.sim.close()
        self.sim = Simulation(self.scenario, seed=episode_seed, workers=self._workers)
        self.agents = list(self.possible_agents)
        self._before = self._observed()
        return self._split(self._before), {agent: {"seed": episode_seed} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, Any],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Applies an action of each agent, and simulates one cycle."""
        if not self.agents:
            raise input_error("step", "no episode is in progress", "call reset first")
        if len(actions) != len(self.agents) or actions.keys() != self._acting:
            unknown = sorted(set(actions) - self._acting)
            if unknown:
                raise input_error("actions", f"there is no agent `{unknown[0]}`", "give those of `agents`")
            missing = next(agent for agent in self.agents if agent not in actions)
            raise input_error("actions", f"`{missing}` has no action", "give one for each agent")
        for (k, _), names, chosen in zip(self._teams, self._names, self._order_names, strict=True):
            self._order(k, names, chosen, actions)
        self.sim.step()
        after = self._observed()
        earned: dict[str, float] = {}
        for reward, names, old, new in zip(self._rewards, self._names, self._before, after, strict=True):
            earned.update(zip(names, compute_rewards(reward, old, new, len(names)).tolist(), strict=True))
        self._before = after
        is_over = self.sim.is_over
        is_truncated = not is_over and self.sim.cycle >= self.max_cycles
        agents = self.agents
        if is_over or is_truncated:
            self.agents = []
        return (
            self._split(after),
            earned,
            dict.fromkeys(agents, is_over),
            dict.fromkeys(agents, is_truncated),
            {agent: {} for agent in agents},
        )

    @property
    def state_space(self) -> spaces.Box:
        """The space of :meth:`state`: the observations of all agents as one vector, for a critic that sees all."""
        lows, highs = [], []
        for _, team in self._teams:
            for space in team.observation_spaces:
                count = len(team.agents) * int(np.prod(space.shape))
                lows.append(np.full(count, space.low, np.float32))
                highs.append(np.full(count, space.high, np.float32))
        return spaces.Box(np.concatenate(lows), np.concatenate(highs), dtype=np.float32)

    def state(self) -> NDArray[np.float32]:
        """Returns the observations of all agents as one vector; before the first ``reset``, those of the scenario's start."""
        if not self._before:
            self._before = self._observed()
        parts = [array.ravel() for team in self._before for array in team.values()]
        return np.concatenate(parts).astype(np.float32)

    def render(self) -> NDArray[np.uint8] | None:
        """Returns an image of the present state, (height, width, 3)."""
        return None if self.render_mode is None else self.sim.render(self._width)

    def close(self) -> None:
        """Ends the simulation."""
        self.sim.close()

    def copy(self) -> ParallelEnv:
        """Returns an independent environment in the same state."""
        other = type(self)(self.scenario, **self._options)
        other.sim = self.sim.copy()
        other.agents = list(self.agents)
        other._rng = np.random.Generator(type(self._rng.bit_generator)())
        other._rng.bit_generator.state = self._rng.bit_generator.state
        other._before = [dict(team) for team in self._before]
        return other

    def _order(
        self,
        number: int,
        names: list[str],
        chosen: list[str],
        actions: Mapping[str, Any],
    ) -> None:
        given = list(map(actions.__getitem__, names))
        for order in chosen:
            values = given if len(chosen) == 1 else [action[order] for action in given]
            self.sim.order(order, values, team=number)

    def _observed(self) -> list[dict[str, NDArray[Any]]]:
        return [self.sim.observe(k) for k, _ in self._teams]

    def _split(self, observed: list[dict[str, NDArray[Any]]]) -> dict[str, Any]:
        agents: dict[str, Any] = {}
        for columns, names, arrays in zip(self._columns, self._names, observed, strict=True):
            cells = {
                name: list(arrays[name].astype(np.float32) if is_real else arrays[name]) for name, is_real in columns
            }
            agents.update(rows_by_name(names, cells))
        return agents


def _environment_of(world: str) -> type[ParallelEnv]:
    """Makes the class of a world's environments, with the name that PettingZoo's users expect."""
    name = "".join(part.capitalize() for part in world.split("_"))
    versioned = f"{world}_v0"
    members = {
        "__doc__": f"The agents of the world ``{world}`` that take orders, as a PettingZoo environment: ``{versioned}``; "
        "see :class:`ParallelEnv`.",
        # By this name it is pickled.
        "__module__": "sidestep.envs",
        "world": world,
        "metadata": {**ParallelEnv.metadata, "name": versioned},
    }
    return type(name, (ParallelEnv,), members)


#: The class of each world's environments.
ENVIRONMENTS: dict[str, type[ParallelEnv]] = {world: _environment_of(world) for world in worlds()}


def parallel_env(
    scenario: Scenario | str | PathLike[str] | Mapping[str, Any], **options: Unpack[ParallelOptions]
) -> ParallelEnv:
    """Returns the environment of the scenario's world, e.g. ``Robots``."""
    scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
    return ENVIRONMENTS[scenario.world](scenario, **options)


def orders_of(team: Team, world: str, orders: Sequence[str] | str | None) -> list[Space]:
    """Returns the spaces of the named orders of a team; by default that of the order that its world declares."""
    if isinstance(orders, str):
        orders = [orders]
    if orders is None:
        # A world without a default has its most plain order first.
        orders = [world_facts(world)["default_order"] or team.action_spaces[0].name]
    known = {space.name: space for space in team.action_spaces}
    unknown = [order for order in orders if order not in known]
    if unknown or not orders:
        cause = f"team `{team.name}` takes no order {unknown}"
        raise input_error("orders", cause, f"some of {', '.join(known)}")
    return [known[order] for order in orders]


def rewards_of(team: Team, world: str, given: Mapping[str, float] | Reward | None) -> Reward:
    """Returns the reward of a team; by default that of its world."""
    given = DEFAULTS[world] if given is None else given
    return combine_rewards(given, {space.name for space in team.observation_spaces})


def action_space(chosen: list[Space]) -> spaces.Space[Any]:
    """Returns the Gymnasium space of an action: of the order alone, or a dict of several."""
    if len(chosen) == 1:
        return inside_bounds(chosen[0])
    return spaces.Dict({space.name: inside_bounds(space) for space in chosen})
