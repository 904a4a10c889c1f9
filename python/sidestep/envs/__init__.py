"""Environments for reinforcement learning, from any scenario whose agents take orders.

PettingZoo's ``ParallelEnv`` (``Robots``, ``Chain``, ``Airspace``; also modules such as ``robots_v0``), many worlds at once as
arrays (``Batch``), and Gymnasium's ``Env`` and ``VectorEnv`` for one agent.

Needs the extra ``rl``: ``pip install 'sidestep[rl]'``.

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
    raise ImportError("environments need gymnasium and pettingzoo: pip install 'sidestep[rl]'") from error

from ._batch import Batch, VectorEnv
from ._parallel import Airspace, Chain, ParallelEnv, Robots, parallel_env
from ._rewards import DEFAULTS, TERMS, Reward, Term
from ._single import Env

__all__ = [
    "DEFAULTS",
    "TERMS",
    "Airspace",
    "Batch",
    "Chain",
    "Env",
    "ParallelEnv",
    "Reward",
    "Robots",
    "Term",
    "VectorEnv",
    "parallel_env",
]

del _gymnasium, _pettingzoo
