"""Gymnasium's environment of a scenario with one agent that takes orders."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from .._errors import input_error
from .._native import Scenario
from ._parallel import parallel_env

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import ParallelOptions


class Env(gymnasium.Env[dict[str, Any], Any]):
    """The one agent of a scenario that takes orders, as a Gymnasium environment.

    It takes the arguments of :class:`ParallelEnv`; an episode equals that of a ``parallel_env`` reset with the same
    seed. Other agents of the scenario decide for themselves.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self, scenario: Scenario | str | PathLike[str] | Mapping[str, Any], **options: Unpack[ParallelOptions]
    ) -> None:
        self.parallel = parallel_env(scenario, **options)
        agents = self.parallel.possible_agents
        if len(agents) != 1:
            remedy = "use parallel_env for many, or leave one"
            raise input_error("scenario", f"{len(agents)} agents take orders", remedy)
        (self._agent,) = agents
        self.observation_space = self.parallel.observation_space(self._agent)
        self.action_space = self.parallel.action_space(self._agent)
        self.render_mode = self.parallel.render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Starts an episode, and returns the agent's observation."""
        super().reset(seed=seed)
        observed, infos = self.parallel.reset(seed=seed, options=options)
        return observed[self._agent], infos[self._agent]

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Applies an action, and simulates one cycle."""
        observed, rewards, terminations, truncations, infos = self.parallel.step({self._agent: action})
        one = self._agent
        return observed[one], rewards[one], terminations[one], truncations[one], infos[one]

    def render(self) -> NDArray[np.uint8] | None:
        """Returns an image of the present state, (height, width, 3)."""
        return self.parallel.render()

    def close(self) -> None:
        """Ends the simulation."""
        self.parallel.close()
