"""A task as Gymnasium's environment: of its one agent, or of a central controller of all its agents."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from ..._errors import checked_int, input_error
from ._show import RENDER_MODES, show
from ._task import RewardTerm, Task
from ._worlds import TaskBatch, as_actions

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import WorldOptions


RenderMode = Literal["rgb_array", "human", "ansi"]


class OneWorld:
    """What the environments of one world share, whatever interface they have."""

    def _open(self, task: Task, render_mode: RenderMode | None, width: int, options: WorldOptions) -> None:
        if render_mode not in (None, *RENDER_MODES):
            remedy = f"one of {', '.join(RENDER_MODES)}, or None"
            raise input_error("render_mode", f"there is no `{render_mode}`", remedy)
        width = checked_int("width", width, 64, 4096)
        # All images of an episode have one size: films need that.
        self._size = (width, width * 3 // 4)
        self.batch = TaskBatch(task, 1, autoreset_mode=AutoresetMode.DISABLED, **options)
        self.task = task
        self.render_mode: str | None = render_mode

    @property
    def observation_parts(self) -> list[tuple[str, str]]:
        """The name and the meaning of each number of an agent's observation."""
        return self.batch.observation_parts

    @property
    def terms(self) -> dict[str, RewardTerm]:
        """The terms of the reward, by name."""
        return self.batch.terms

    def render(self) -> Any:
        """Returns an image (height, width, 3), or text with "ansi"; with "human" it shows the image in a window."""
        if self.render_mode is None:
            return None
        return show(self.batch.worlds.render(0, size=self._size), self.render_mode, self.task.id)

    def close(self) -> None:
        """Ends the worlds."""
        self.batch.close()


class TaskEnv(OneWorld, gymnasium.Env[Any, Any]):
    """One world of a task.

    A task of one agent has that agent's observations and actions. Of a task with many it is the central controller: it
    observes a row for each agent, and gives each an action; its reward is the mean of theirs.

    Args:
        task: the task.
        render_mode: ``"rgb_array"`` for images, ``"human"`` for a window of Matplotlib, ``"ansi"`` for text, or None.
        width: width of images in pixels.
        options: arguments of :class:`TaskBatch`, such as ``rewards``, ``mask`` and ``keys``.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": 10}

    def __init__(
        self, task: Task, *, render_mode: RenderMode | None = None, width: int = 480, **options: Unpack[WorldOptions]
    ) -> None:
        self._open(task, render_mode, width, options)
        self._has_ended = True
        self._agents = len(self.batch.agents)
        self._is_alone = self._agents == 1
        self.observation_space = self._space_of_all(self.batch.single_observation_space)
        self.action_space = self._space_of_all(self.batch.single_action_space)

    def _space_of_all(self, one: spaces.Space[Any]) -> spaces.Space[Any]:
        if self._is_alone:
            return one
        if isinstance(one, spaces.Dict):
            return spaces.Dict({name: self._space_of_all(space) for name, space in one.items()})
        if isinstance(one, spaces.Box):
            shape = (self._agents, *one.shape)
            return spaces.Box(np.broadcast_to(one.low, shape), np.broadcast_to(one.high, shape), dtype=one.dtype)
        choices = one.nvec if isinstance(one, spaces.MultiDiscrete) else np.array([one.n])  # type: ignore[attr-defined]
        counts = np.tile(choices, (self._agents, 1))
        return spaces.MultiDiscrete(counts[:, 0] if isinstance(one, spaces.Discrete) else counts)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Starts an episode with this seed, or with one that is drawn; ``infos["seed"]`` has it. ``options`` are ignored."""
        super().reset(seed=seed)
        observed, infos = self.batch.reset(seed=seed)
        self._has_ended = False
        if self.render_mode == "human":
            self.render()
        return self._of_world(observed), self._infos(infos)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Applies an action, and simulates one cycle."""
        if self._has_ended:
            raise input_error("step", "the episode has ended, or none has begun", "call reset")
        one = as_actions(action, self.action_space.shape or ())
        actions = one[None, None] if self._is_alone else one[None]
        observed, rewards, terminations, truncations, infos = self.batch.step(actions)
        if self.render_mode == "human":
            self.render()
        reward = float(rewards[0].mean())
        self._has_ended = bool(terminations[0] or truncations[0])
        return self._of_world(observed), reward, bool(terminations[0]), bool(truncations[0]), self._infos(infos)

    def _of_world(self, observed: Any) -> Any:
        if isinstance(observed, dict):
            return {name: self._of_world(array) for name, array in observed.items()}
        return observed[0, 0] if self._is_alone else observed[0]

    def _infos(self, infos: dict[str, Any]) -> dict[str, Any]:
        """Returns those of the one world."""
        own: dict[str, Any] = {}
        for name, value in infos.items():
            if name.startswith("_") or not infos[f"_{name}"][0]:
                continue
            one = value[0]
            per_agent = isinstance(one, np.ndarray) and self._is_alone
            own[name] = one[0] if per_agent else one.item() if isinstance(one, np.generic) else one
        return own

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns which choices make sense now: by this name learners with masks ask for it."""
        masks = self.batch.action_masks()[0].astype(bool)
        return np.asarray(masks[0] if self._is_alone else masks)
