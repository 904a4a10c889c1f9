"""The options of environments, for type checkers: a misspelled one is an error there, too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

from gymnasium.vector import AutoresetMode

from ._rewards import Reward

#: When a world restarts after the end of its episode.
Autoreset = AutoresetMode | Literal["NextStep", "SameStep", "Disabled"]


class ParallelOptions(TypedDict, total=False):
    """Those of :class:`sidestep.envs.ParallelEnv`."""

    rewards: Mapping[str, float] | Reward | None
    orders: Sequence[str] | None
    max_cycles: int | None
    render_mode: Literal["rgb_array"] | None
    width: int
    workers: int


class BatchOptions(TypedDict, total=False):
    """Those of :class:`sidestep.envs.Batch`."""

    team: str | int | None
    rewards: Mapping[str, float] | Reward | None
    orders: Sequence[str] | None
    max_cycles: int | None
    autoreset_mode: Autoreset
    copy: bool
    workers: int


class WorldOptions(TypedDict, total=False):
    """Those of one world of a task."""

    rewards: Mapping[str, float] | None
    max_cycles: int | None
    mask: bool
    copy: bool
    workers: int
    keys: Mapping[str, Any] | None


class TaskOptions(WorldOptions, total=False):
    """Those of :class:`sidestep.envs.tasks.TaskBatch`."""

    autoreset_mode: Autoreset


class RenderOptions(WorldOptions, total=False):
    """Those of :class:`sidestep.envs.tasks.TaskEnv`."""

    render_mode: Literal["rgb_array", "human", "ansi"] | None
    width: int
