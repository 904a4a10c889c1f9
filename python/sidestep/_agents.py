"""A class per agent, for teaching: a Python object decides for each agent of a team."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ._errors import input_error
from ._native import Team


class Agent(Protocol):
    """An object that decides for one agent."""

    def decide(self, observed: dict[str, Any]) -> Any:
        """Returns the orders of the agent: a dict by name, or the only or first one.

        ``observed`` has its observations by name: its row of the arrays of its team.
        """
        ...


class Each:
    """A function for ``decide=`` with an object for each agent: see :func:`each`, which has an example."""

    def __init__(self, make: Callable[[int], Agent]) -> None:
        self._make = make
        self._teams: dict[str, _Members] = {}

    def of_team(self, team: Team) -> Callable[[dict[str, NDArray[Any]], Any], Any]:
        """Returns the function that decides for a team: the same one in all runs."""
        if team.name not in self._teams:
            self._teams[team.name] = _Members([self._make(int(agent)) for agent in team.agents])
        return self._teams[team.name]

    def __call__(self, observed: dict[str, NDArray[Any]], state: Any) -> Any:
        """Raises InputError: without a team, the agents of these observations are unknown."""
        raise input_error(
            "decide", "it was called without a team", "pass it to `Simulation.run`, or call `of_team` first"
        )


class _Members:
    """The objects of a team."""

    def __init__(self, members: list[Agent]) -> None:
        self._members = members

    def __call__(self, observed: dict[str, NDArray[Any]], state: Any) -> Any:
        names = tuple(observed)
        rows = zip(*observed.values(), strict=True)
        decisions = [
            member.decide(dict(zip(names, row, strict=True))) for member, row in zip(self._members, rows, strict=True)
        ]
        if not isinstance(decisions[0], Mapping):
            return np.asarray(decisions)
        return {name: np.asarray([decision[name] for decision in decisions]) for name in decisions[0]}


def each(make: Callable[[int], Agent]) -> Each:
    """Returns a function for ``decide=`` that calls an object per agent; ``make`` creates it from the agent's id.

    It is for teaching and experiments: an agent costs about two microseconds more than with arrays. All agents of a
    team return the same type: a number each, or dicts with the same names. The objects keep their state from run to run.

    >>> import sidestep
    >>> class Turner:
    ...     def __init__(self, agent):
    ...         self.turns = 0
    ...     def decide(self, observed):
    ...         self.turns += observed["contact"] > 0
    ...         return 1 if observed["contact"] > 0 else 0     # left where it touched something, else forward
    >>> scenario = {"world": "robots", "map": {"ascii": "....."},
    ...             "robots": [{"count": 2, "behaviour": {"kind": "external"}}]}
    >>> sidestep.Simulation(scenario).run(20, decide=sidestep.each(Turner))
    20
    """
    return Each(make)
