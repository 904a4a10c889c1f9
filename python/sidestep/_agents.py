"""A class per agent, for teaching: an object of one's own decides for each agent of a team."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ._errors import wrong
from ._native import Team


class Agent(Protocol):
    """A function that decides for one agent."""

    def decide(self, observed: dict[str, Any]) -> Any:
        """Returns the orders of the agent: a dict by name, or the only or first one.

        ``observed`` has its observations by name: its row of those of its team.
        """
        ...


class Each:
    """A function for ``decide=``, made of an object for each agent: see :func:`each`, which has an example."""

    def __init__(self, make: Callable[[int], Agent]) -> None:
        self._make = make
        self._teams: dict[str, _Members] = {}

    def of_team(self, team: Team) -> Callable[[dict[str, NDArray[Any]], Any], Any]:
        """Returns the function that decides for a team; a run asks for it, and a team has the same one in all runs."""
        if team.name not in self._teams:
            self._teams[team.name] = _Members([self._make(int(agent)) for agent in team.agents])
        return self._teams[team.name]

    def __call__(self, observed: dict[str, NDArray[Any]], state: Any) -> Any:
        """Refuses: without a team it is unknown which agents these observations belong to."""
        raise wrong("decide", "it was called without a team", "hand it to `Simulation.run`, or call `of_team` first")


class _Members:
    """The objects of a team."""

    def __init__(self, members: list[Agent]) -> None:
        self._members = members

    def __call__(self, observed: dict[str, NDArray[Any]], state: Any) -> Any:
        names, rows = tuple(observed), zip(*observed.values(), strict=True)
        answers = [
            member.decide(dict(zip(names, row, strict=True))) for member, row in zip(self._members, rows, strict=True)
        ]
        if not isinstance(answers[0], Mapping):
            return np.asarray(answers)
        return {name: np.asarray([answer[name] for answer in answers]) for name in answers[0]}


def each(make: Callable[[int], Agent]) -> Each:
    """Returns a function for ``decide=`` that asks an object per agent; ``make`` returns that of an agent by its id.

    It is for teaching and for trying things out: an agent takes about two microseconds more than in arrays. All
    agents of a team return the same sort of thing: a number each, or dicts with the same names. The objects keep
    their state from run to run.

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
