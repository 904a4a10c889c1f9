"""The environment :class:`sidestep.envs.Chain` under the names that PettingZoo users expect.

>>> from sidestep.envs import chain_v0
>>> chain_v0.parallel_env.metadata["name"]
'chain_v0'
"""

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import parallel_to_aec

from ._parallel import Chain as parallel_env

__all__ = ["env", "parallel_env"]


def env(*args: Any, **options: Any) -> AECEnv[str, Any, Any]:
    """Returns the environment in PettingZoo's AEC form; it takes the arguments of ``parallel_env``."""
    return parallel_to_aec(parallel_env(*args, **options))
