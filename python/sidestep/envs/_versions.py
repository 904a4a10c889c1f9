"""Modules with the names that PettingZoo's users expect, such as ``sidestep.envs.robots_v0``: one for each world."""

from types import ModuleType
from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import parallel_to_aec

from ._parallel import ParallelEnv


def versioned_module(environment: type[ParallelEnv]) -> ModuleType:
    """Returns the module of an environment, with ``env`` and ``parallel_env``."""

    def env(*args: Any, **options: Any) -> AECEnv[str, Any, Any]:
        """Returns the environment in PettingZoo's AEC form; it takes the arguments of ``parallel_env``."""
        return parallel_to_aec(environment(*args, **options))

    name = environment.metadata["name"]
    doc = f"""The environment :class:`sidestep.envs.{environment.__name__}` under the names that PettingZoo users expect.

>>> from sidestep.envs import {name}
>>> {name}.parallel_env.metadata["name"]
'{name}'
"""
    module = ModuleType(f"sidestep.envs.{name}", doc)
    vars(module).update(__all__=["env", "parallel_env"], env=env, parallel_env=environment)
    return module
