"""Environments for reinforcement learning, from any scenario whose agents take orders.

PettingZoo's ``ParallelEnv``, of which each world has a class (such as ``Robots``) and a module (such as ``robots_v0``), many
worlds at once as arrays (``Batch``), and Gymnasium's ``Env`` and ``VectorEnv`` for one agent.

Needs the packages of the extra ``rl``: ``pip install 'gymnasium>=1.0' 'pettingzoo>=1.24'``.

>>> from sidestep.envs import parallel_env
>>> env = parallel_env({
...     "world": "robots",
...     "cycles": 50,
...     "map": {"ascii": "......\\n......\\n......"},
...     "robots": [{"count": 2, "behaviour": {"kind": "external"}}],
... })
>>> observations, infos = env.reset(seed=1)
>>> env.agents
['robot_0', 'robot_1']
>>> observations, rewards, terminations, truncations, infos = env.step({agent: 0 for agent in env.agents})
"""

try:
    import gymnasium as _gymnasium
    import pettingzoo as _pettingzoo
except ImportError as error:
    raise ImportError(
        "environments need gymnasium and pettingzoo: pip install 'gymnasium>=1.0' 'pettingzoo>=1.24'"
    ) from error

import sys as _sys
from typing import Any as _Any

from ._batch import Batch, VectorEnv
from ._parallel import ENVIRONMENTS, ParallelEnv, parallel_env
from ._rewards import DEFAULTS, TERMS, Reward, Term
from ._single import Env
from . import tasks
from ._versions import versioned_module as _versioned_module

__all__ = [
    "DEFAULTS",
    "ENVIRONMENTS",
    "TERMS",
    "Batch",
    "Env",
    "ParallelEnv",
    "Reward",
    "Term",
    "VectorEnv",
    "parallel_env",
    "tasks",
]

# The classes and modules of worlds, by their names. A module is known to Python's `import` as well.
_of_worlds: dict[str, _Any] = {}
for _environment in ENVIRONMENTS.values():
    _module = _versioned_module(_environment)
    _of_worlds[_environment.__name__] = _environment
    _of_worlds[_environment.metadata["name"]] = _sys.modules[_module.__name__] = _module
__all__ += sorted(_of_worlds)


def __getattr__(name: str) -> _Any:
    """Returns the class or the module of a world: type checkers do not know which worlds there are."""
    try:
        return _of_worlds[name]
    except KeyError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None


def __dir__() -> list[str]:
    return sorted({*globals(), *_of_worlds})


del _environment, _gymnasium, _module, _pettingzoo
