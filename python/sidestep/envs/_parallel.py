"""PettingZoo's parallel environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Literal

import numpy as np
import pettingzoo
from gymnasium import spaces
from numpy.typing import NDArray

from .._errors import wrong
from .._native import Scenario, Simulation, Space, Team, rows_by_name
from ._rewards import DEFAULTS, Reward, earned, rewards

MOST = np.iinfo(np.int64).max
# Above the seeds of episodes.
MOST_SEED = 2**62
# The order that an action is where none is named: one in which every value within its bounds is right.
ORDERS = {"robots": "action", "chain": "to_m", "airspace": "turn_rate_rad_s"}
NOUNS = {"robots": "robot", "chain": "chain", "airspace": "airplane"}


def space_of(space: Space) -> spaces.Space[Any]:
    """Returns the Gymnasium space of one agent's share."""
    if space.choices is not None:
        if space.shape == ():
            return spaces.Discrete(len(space.choices))
        return spaces.MultiDiscrete(np.full(space.shape, len(space.choices)))
    if space.dtype == "int64":
        high = min(space.high, float(MOST - 512))
        return spaces.Box(np.int64(space.low), np.int64(high), space.shape, np.int64)
    return spaces.Box(np.float32(space.low), np.float32(space.high), space.shape, np.float32)


def within(space: Space) -> spaces.Space[Any]:
    """Returns the Gymnasium space of one agent's order: no value of it is out of bounds as a double."""
    found = space_of(space)
    if isinstance(found, spaces.Box) and space.dtype == "float64":
        least = [np.float32(space.low), np.nextafter(np.float32(space.low), np.float32(np.inf))]
        most = [np.float32(space.high), np.nextafter(np.float32(space.high), np.float32(-np.inf))]
        low = next(low for low in least if low >= space.low)
        high = next(high for high in most if high <= space.high)
        return spaces.Box(low, high, space.shape, np.float32)
    return found


class ParallelEnv(pettingzoo.ParallelEnv[str, Any, Any]):
    """The agents of a scenario that take orders, as a PettingZoo environment.

    Args:
        scenario: a ``Scenario``, a path or a dict. All agents that take orders act here; the others decide for
            themselves.
        rewards: weights of named terms (``sidestep.envs.TERMS``), or a function of a team's observations before and
            after a step, which returns a number for each agent.
        orders: names of the orders that an action gives. One of them makes the action that order alone; several make
            it a dict. By default the action of a robot, the place toward which a chain goes, the turn rate of an
            airplane.
        max_cycles: cycles of an episode; the scenario's own by default. An episode that is cut there is
            *truncated*; one in which nothing can happen anymore is *terminated*.
        render_mode: ``"rgb_array"`` or None.
        width: width of pictures in pixels.
        workers: workers of the simulation.

    An episode's seed is that of ``reset``; without one it is drawn from the environment's own generator, so
    that a sequence of episodes is repeated from its first seed.
    """

    #: The world of its scenarios; None for any.
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
            raise wrong("render_mode", f"there is no `{render_mode}`", 'give "rgb_array" or None')
        self.scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
        if self.world not in (None, self.scenario.world):
            cause = f"its world is `{self.scenario.world}`, and not `{self.world}`"
            raise wrong("scenario", cause, "use `parallel_env`, which takes any world")
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
        if max_cycles is not None and max_cycles < 1:
            raise wrong("max_cycles", f"{max_cycles} cycles are no episode", "give 1 or more")
        self.max_cycles = self.scenario.cycles if max_cycles is None else max_cycles
        self.sim = Simulation(self.scenario, workers=workers)
        self._teams = [(k, t) for k, t in enumerate(self.sim.teams) if t.ordered]
        if not self._teams:
            remedy = "let its agents be decided from outside (`external`)"
            raise wrong("scenario", "no agent of this scenario takes orders", remedy)
        world = self.scenario.world
        wanted = [ORDERS[world]] if orders is None else orders
        wanted = [wanted] if isinstance(wanted, str) else wanted
        self._orders = [orders_of(team, wanted) for _, team in self._teams]
        self._order_names = [[space.name for space in chosen] for chosen in self._orders]
        self._rewards = [rewards_of(team, world, rewards) for _, team in self._teams]
        self._columns = [[(space.name, space.dtype == "float64") for space in team.observed] for _, team in self._teams]
        self._names = [[f"{NOUNS[world]}_{agent}" for agent in team.agents] for _, team in self._teams]
        self.possible_agents = [name for names in self._names for name in names]
        self.agents: list[str] = []
        # While an episode goes on, all of them act.
        self._playing = frozenset(self.possible_agents)
        self.observation_spaces: dict[str, spaces.Space[Any]] = {}
        self.action_spaces: dict[str, spaces.Space[Any]] = {}
        for (_, team), names, chosen in zip(self._teams, self._names, self._orders, strict=True):
            observed = spaces.Dict({space.name: space_of(space) for space in team.observed})
            acted = action_space(chosen)
            for name in names:
                self.observation_spaces[name] = observed
                self.action_spaces[name] = acted
        self._rng = np.random.default_rng()
        self._before: list[dict[str, NDArray[Any]]] = []

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's observations: a dict by the names of its team's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Starts an episode, and returns the observations of all agents; it has no options, and takes any."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        # From the generator also with a seed, so that the next episode differs from this one.
        drawn = int(self._rng.integers(MOST_SEED))
        self.sim.close()
        self.sim = Simulation(self.scenario, seed=drawn, workers=self._workers)
        self.agents = list(self.possible_agents)
        self._before = self._observed()
        return self._split(self._before), {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, Any],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Orders an action of each agent, and simulates one cycle."""
        if not self.agents:
            raise wrong("step", "no episode goes on", "call reset first")
        if len(actions) != len(self.agents) or actions.keys() != self._playing:
            unknown = sorted(set(actions) - self._playing)
            if unknown:
                raise wrong("actions", f"there is no agent `{unknown[0]}`", "name those of `agents`")
            missing = next(agent for agent in self.agents if agent not in actions)
            raise wrong("actions", f"`{missing}` has none", "give one for each agent")
        for (k, _), names, chosen in zip(self._teams, self._names, self._order_names, strict=True):
            self._order(k, names, chosen, actions)
        self.sim.step()
        after = self._observed()
        gains: dict[str, float] = {}
        for reward, names, old, new in zip(self._rewards, self._names, self._before, after, strict=True):
            gains.update(zip(names, earned(reward, old, new, len(names)).tolist(), strict=True))
        self._before = after
        is_over = self.sim.is_over
        is_cut = not is_over and self.sim.cycle >= self.max_cycles
        agents = self.agents
        if is_over or is_cut:
            self.agents = []
        return (
            self._split(after),
            gains,
            dict.fromkeys(agents, is_over),
            dict.fromkeys(agents, is_cut),
            {agent: {} for agent in agents},
        )

    def state(self) -> NDArray[np.float32]:
        """Returns all that all agents observe as one vector."""
        parts = [array.ravel() for team in self._before for array in team.values()]
        return np.concatenate(parts).astype(np.float32)

    def render(self) -> NDArray[np.uint8] | None:
        """Returns a picture of the present state, (height, width, 3)."""
        return None if self.render_mode is None else self.sim.picture(self._width)

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


class Robots(ParallelEnv):
    """Robots that take orders, as a PettingZoo environment: ``robots_v0``; see :class:`ParallelEnv`."""

    world = "robots"
    metadata = {**ParallelEnv.metadata, "name": "robots_v0"}


class Chain(ParallelEnv):
    """Chains that take orders, as a PettingZoo environment: ``chain_v0``; see :class:`ParallelEnv`."""

    world = "chain"
    metadata = {**ParallelEnv.metadata, "name": "chain_v0"}


class Airspace(ParallelEnv):
    """Airplanes that take orders, as a PettingZoo environment: ``airspace_v0``; see :class:`ParallelEnv`."""

    world = "airspace"
    metadata = {**ParallelEnv.metadata, "name": "airspace_v0"}


def parallel_env(scenario: Scenario | str | PathLike[str] | Mapping[str, Any], **options: Any) -> ParallelEnv:
    """Returns the environment of the scenario's world: :class:`Robots`, :class:`Chain` or :class:`Airspace`."""
    scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
    of_world = next(one for one in (Robots, Chain, Airspace) if one.world == scenario.world)
    return of_world(scenario, **options)


def orders_of(team: Team, orders: Sequence[str]) -> list[Space]:
    """Returns the spaces of the named orders of a team."""
    known = {space.name: space for space in team.ordered}
    unknown = [order for order in orders if order not in known]
    if unknown or not orders:
        cause = f"team `{team.name}` takes no order {unknown}"
        raise wrong("orders", cause, f"some of {', '.join(known)}")
    return [known[order] for order in orders]


def rewards_of(team: Team, world: str, given: Mapping[str, float] | Reward | None) -> Reward:
    """Returns the reward of a team; by default that of its world."""
    given = DEFAULTS[world] if given is None else given
    return rewards(given, {space.name for space in team.observed})


def action_space(chosen: list[Space]) -> spaces.Space[Any]:
    """Returns the Gymnasium space of an action: of the order alone, or a dict of several."""
    if len(chosen) == 1:
        return within(chosen[0])
    return spaces.Dict({space.name: within(space) for space in chosen})
