"""Many worlds of a task as the batches of libraries for learning, where these are installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from ..._errors import input_error
from ._task import Task
from ._worlds import TaskBatch, TaskVectorEnv

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import WorldOptions


def sb3_env(task: Task, num_envs: int, **options: Unpack[WorldOptions]) -> Any:
    """Returns the agents of many worlds as a ``VecEnv`` of Stable-Baselines3, for one policy that all share.

    At the end of an episode ``infos`` have ``terminal_observation``, ``TimeLimit.truncated``, ``score`` and ``metrics``, and the
    observation is the first one of the next episode. An agent that is gone before its world ends is done with its last step; its
    rows mean nothing until the world restarts. Wrap it into ``VecMonitor`` for the log of returns; sb3-contrib's ``MaskablePPO`` finds
    the masks. It takes the arguments of :class:`TaskVectorEnv`.
    """
    try:
        from stable_baselines3.common.vec_env import VecEnv
    except ImportError as error:
        raise ImportError("this needs Stable-Baselines3: pip install 'stable-baselines3>=2.3'") from error

    class TaskVecEnv(VecEnv):  # type: ignore[misc, unused-ignore]
        def __init__(self) -> None:
            self.vector = TaskVectorEnv(task, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
            self.render_mode = None
            self._seed: int | None = None
            self._actions: Any = None
            super().__init__(num_envs, self.vector.single_observation_space, self.vector.single_action_space)

        def reset(self) -> Any:
            observed, _ = self.vector.reset(seed=self._seed)
            # The next one draws its seeds.
            self._seed = None
            return observed

        def seed(self, seed: int | None = None) -> list[int | None]:
            self._seed = seed
            return [seed] * self.num_envs

        def step_async(self, actions: Any) -> None:
            self._actions = actions

        def step_wait(self) -> Any:
            observed, rewards, terminations, truncations, infos = self.vector.step(self._actions)
            ended = terminations | truncations
            is_world_over = infos.get("_final_obs", np.zeros(self.num_envs, bool))
            told: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
            for k in np.flatnonzero(ended):
                told[k] = {
                    "terminal_observation": infos["final_obs"][k] if is_world_over[k] else observed[k],
                    "TimeLimit.truncated": bool(truncations[k]),
                }
                # Airplanes that arrive end before their world.
                if "score" in infos and infos["_score"][k]:
                    told[k] |= {"score": float(infos["score"][k]), "metrics": infos["metrics"][k]}
            return observed, rewards.astype(np.float32), ended, told

        def close(self) -> None:
            self.vector.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            # Learners with masks ask for them by this name.
            owner = self if attr_name == "action_masks" else self.vector
            return [getattr(owner, attr_name)] * len(list(self._get_indices(indices)))

        def action_masks(self) -> Any:
            """Returns which choices make sense now, a row for each environment."""
            return self.vector.tasks.action_masks().astype(bool).reshape(self.num_envs, -1)

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise input_error("set_attr", "the worlds share one object", "give options when it is made")

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
            if method_name == "action_masks":
                return list(self.action_masks()[list(self._get_indices(indices))])
            raise input_error("env_method", f"there is no `{method_name}`", 'the only one is "action_masks"')

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * len(list(self._get_indices(indices)))

    return TaskVecEnv()


def torchrl_env(task: Task, worlds: int, *, device: Any = None, **options: Unpack[WorldOptions]) -> Any:
    """Returns many worlds as an ``EnvBase`` of TorchRL with the batch size (worlds,), in the manner of its multi-agent
    environments: the key ``agents`` has ``observation``, ``action``, ``reward`` and, where there is one, ``action_mask``, with
    a row for each agent. It takes the arguments of :class:`TaskBatch`, but ``mask`` and ``copy``: masks have a key of their own, and
    steps are kept, so that their arrays may not be overwritten.
    """
    try:
        import torch
        from tensordict import TensorDict
        from torchrl.data import Bounded, Categorical, Composite, MultiCategorical, Unbounded
        from torchrl.envs import EnvBase
    except ImportError as error:
        raise ImportError("this needs TorchRL: pip install 'torchrl>=0.6'") from error

    for name in sorted({"mask", "copy"} & set(options)):
        raise input_error(name, "an environment of TorchRL has no such option", "leave it out")
    batch = TaskBatch(task, worlds, autoreset_mode=AutoresetMode.DISABLED, **options)
    agents, size = len(batch.agents), batch.encoder.size
    shape = (worlds, agents)
    one = batch.single_action_space
    has_mask = batch.design.actions.mask is not None and isinstance(one, spaces.Discrete)

    class TaskTorchEnv(EnvBase):  # type: ignore[misc, unused-ignore]
        def __init__(self) -> None:
            super().__init__(device=device, batch_size=torch.Size([worlds]))
            self.batch = batch
            self._next_seed: int | None = None
            seen = {"observation": Bounded(-1.0, 1.0, shape=(*shape, size), dtype=torch.float32)}
            if has_mask:
                seen["action_mask"] = Categorical(2, shape=(*shape, len(batch.design.actions.parts)), dtype=torch.bool)
            self.observation_spec = Composite(agents=Composite(seen, shape=shape), shape=(worlds,))
            self.action_spec = Composite(
                agents=Composite({"action": self._action_spec()}, shape=shape), shape=(worlds,)
            )
            reward = Unbounded(shape=(*shape, 1), dtype=torch.float32)
            self.reward_spec = Composite(agents=Composite({"reward": reward}, shape=shape), shape=(worlds,))
            ends = {
                name: Categorical(2, shape=(worlds, 1), dtype=torch.bool)
                for name in ("done", "terminated", "truncated")
            }
            self.done_spec = Composite(ends, shape=(worlds,))

        def _action_spec(self) -> Any:
            if isinstance(one, spaces.Discrete):
                return Categorical(int(one.n), shape=shape, dtype=torch.int64)
            if isinstance(one, spaces.MultiDiscrete):
                counts = torch.as_tensor(one.nvec).expand(*shape, len(one.nvec))
                return MultiCategorical(one.nvec.tolist(), shape=counts.shape, dtype=torch.int64)
            return Bounded(-1.0, 1.0, shape=(*shape, *one.shape), dtype=torch.float32)  # type: ignore[misc]

        def _seen(self, observed: Any) -> dict[str, Any]:
            # Without a copy where the tensors stay on the processor.
            seen = {"observation": torch.from_numpy(observed).to(self.device or "cpu")}
            if has_mask:
                masks = torch.from_numpy(batch.action_masks().astype(bool))
                seen["action_mask"] = masks.to(self.device or "cpu")
            return seen

        def _reset(self, tensordict: Any = None, **_: Any) -> Any:
            mask = None if tensordict is None else tensordict.get("_reset", None)
            options = None
            if mask is not None:
                options = {"reset_mask": mask.reshape(worlds).cpu().numpy()}
            observed, _ = batch.reset(seed=self._next_seed, options=options)
            # Further episodes draw theirs.
            self._next_seed = None
            falses = torch.zeros((worlds, 1), dtype=torch.bool, device=self.device)
            ends = {name: falses.clone() for name in ("done", "terminated", "truncated")}
            held = TensorDict(self._seen(observed), batch_size=shape, device=self.device)
            return TensorDict({"agents": held, **ends}, batch_size=(worlds,), device=self.device)

        def _step(self, tensordict: Any) -> Any:
            actions = tensordict["agents", "action"].cpu().numpy()
            observed, rewards, terminations, truncations, _ = batch.step(actions)
            seen = self._seen(observed)
            seen["reward"] = torch.from_numpy(rewards.astype(np.float32))[..., None].to(self.device or "cpu")
            ended = terminations | truncations
            ends = {
                name: torch.from_numpy(values.copy())[:, None].to(self.device or "cpu")
                for name, values in (("done", ended), ("terminated", terminations), ("truncated", truncations))
            }
            held = TensorDict(seen, batch_size=shape, device=self.device)
            return TensorDict({"agents": held, **ends}, batch_size=(worlds,), device=self.device)

        def _set_seed(self, seed: int | None) -> None:
            self._next_seed = seed

    return TaskTorchEnv()
