"""Tasks with goals over the three worlds, for learning and for comparing policies.

Each is a scenario file, which opens in the studio, with observations that hold the goal and the progress as float32 numbers
from -1 to 1, rewards of named terms, masks of actions, scripted methods to beat, and a score.

>>> import gymnasium
>>> import sidestep.envs                     # makes them known; or gymnasium.make("sidestep.envs:sidestep/Exploration-v0")
>>> env = gymnasium.make("sidestep/Exploration-v0")
>>> observed, infos = env.reset(seed=1)
>>> infos["seed"], observed.dtype.name, env.observation_space.contains(observed)
(1, 'float32', True)

Tasks with several agents are environments of PettingZoo, too:

>>> from sidestep.envs.tasks import superconflict_v0
>>> env = superconflict_v0.parallel_env()
>>> observations, infos = env.reset(seed=1)
>>> len(env.agents)
8
"""

from __future__ import annotations

import sys as _sys
from types import ModuleType as _ModuleType
from typing import TYPE_CHECKING, Any

import gymnasium as _gymnasium
import pettingzoo as _pettingzoo

from . import airspace as _airspace
from . import chain as _chain
from . import robots as _robots
from ._judge import (
    Judgment,
    Leaderboard,
    TaskComparison,
    compare_on_task,
    judge,
    judge_method,
    write_leaderboard,
)
from ._learners import sb3_env as _sb3_env
from ._learners import torchrl_env as _torchrl_env
from ._parallel import TaskParallelEnv, snake_case
from ._single import TaskEnv
from ._task import TASKS, Design, RewardTerm, Score, Setting, Task, found_task
from ._worlds import TaskBatch, TaskVectorEnv

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import RenderOptions, TaskOptions, WorldOptions

TASKS.update({task.id: task for task in (*_robots.TASKS, *_chain.TASKS, *_airspace.TASKS)})

__all__ = [
    "TASKS",
    "Design",
    "Judgment",
    "Leaderboard",
    "RewardTerm",
    "Score",
    "Setting",
    "Task",
    "TaskBatch",
    "TaskComparison",
    "TaskEnv",
    "TaskParallelEnv",
    "TaskVectorEnv",
    "aec_env",
    "batch_env",
    "compare_on_task",
    "find_task",
    "judge",
    "judge_method",
    "make",
    "parallel_env",
    "sb3_env",
    "torchrl_env",
    "vector_env",
    "write_leaderboard",
]


find_task = found_task


def make(task: str | Task, **options: Unpack[RenderOptions]) -> TaskEnv:
    """Returns a task as Gymnasium's environment; see :class:`TaskEnv`."""
    return TaskEnv(find_task(task), **options)


def vector_env(task: str | Task, num_envs: int = 1, **options: Unpack[TaskOptions]) -> TaskVectorEnv:
    """Returns the agents of many worlds as Gymnasium's vector environment; see :class:`TaskVectorEnv`."""
    return TaskVectorEnv(find_task(task), num_envs, **options)


def batch_env(task: str | Task, worlds: int, **options: Unpack[TaskOptions]) -> TaskBatch:
    """Returns many worlds as arrays (worlds, agents, ...); see :class:`TaskBatch`."""
    return TaskBatch(find_task(task), worlds, **options)


def parallel_env(task: str | Task, **options: Unpack[RenderOptions]) -> TaskParallelEnv:
    """Returns a task as PettingZoo's parallel environment; see :class:`TaskParallelEnv`."""
    return TaskParallelEnv(find_task(task), **options)


def aec_env(task: str | Task, **options: Unpack[RenderOptions]) -> Any:
    """Returns a task in PettingZoo's form of one agent after the other; see :class:`TaskParallelEnv`."""
    from pettingzoo.utils import parallel_to_aec

    return parallel_to_aec(parallel_env(task, **options))


def sb3_env(task: str | Task, num_envs: int, **options: Unpack[WorldOptions]) -> Any:
    """Returns the agents of many worlds as a ``VecEnv`` of Stable-Baselines3."""
    return _sb3_env(find_task(task), num_envs, **options)


def torchrl_env(task: str | Task, worlds: int, **options: Any) -> Any:
    """Returns many worlds as an environment of TorchRL."""
    return _torchrl_env(find_task(task), worlds, **options)


def _module_of(task: Task) -> _ModuleType:
    """Returns the module that PettingZoo's users expect, such as ``superconflict_v0``."""
    name = f"{snake_case(task.name)}_v{task.version}"
    module = _ModuleType(f"{__name__}.{name}", f"The task {task.id}. {task.meaning}")

    def parallel_env_of_task(**options: Unpack[RenderOptions]) -> TaskParallelEnv:
        """Returns it as PettingZoo's parallel environment."""
        return TaskParallelEnv(task, **options)

    def env(**options: Unpack[RenderOptions]) -> Any:
        """Returns it in PettingZoo's form of one agent after the other."""
        return aec_env(task, **options)

    vars(module).update(__all__=["env", "parallel_env"], env=env, parallel_env=parallel_env_of_task)
    _sys.modules[module.__name__] = module
    return module


def _register(task: Task) -> None:
    """Makes a task known to ``gymnasium.make`` and ``pettingzoo.make``; where it has one agent, to ``gymnasium.make_vec``, too."""
    _gymnasium.register(
        id=f"sidestep/{task.id}",
        entry_point=f"{__name__}:make",
        vector_entry_point=f"{__name__}:vector_env" if task.is_single else None,
        kwargs={"task": task.id},
    )
    # Newer versions of PettingZoo have a registry of their own.
    if hasattr(_pettingzoo, "register"):
        for kind, maker in (("parallel", "parallel_env"), ("aec", "aec_env")):
            entry_point = f"{__name__}:{maker}"
            _pettingzoo.register(kind, f"sidestep/{task.id}", entry_point, kwargs={"task": task.id})


for _one in TASKS.values():
    _register(_one)
    _module = _module_of(_one)
    globals()[_module.__name__.rpartition(".")[2]] = _module
del _module, _one
