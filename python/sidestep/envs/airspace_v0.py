"""The environment :class:`sidestep.envs.Airspace` under the names that PettingZoo users expect.

>>> from sidestep.envs import airspace_v0
>>> airspace_v0.parallel_env.metadata["name"]
'airspace_v0'
"""

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import parallel_to_aec

from ._parallel import Airspace as parallel_env

__all__ = ["env", "parallel_env"]


def env(*args: Any, **options: Any) -> AECEnv[str, Any, Any]:
    """Returns the environment in PettingZoo's AEC form; it takes the arguments of ``parallel_env``."""
    return parallel_to_aec(parallel_env(*args, **options))
