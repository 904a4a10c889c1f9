"""Rewards: named terms with weights, of what a team observed before and after a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, wrong

Arrays = Mapping[str, NDArray[Any]]

Reward = Callable[[Arrays, Arrays], NDArray[Any]]
"""A term: from a team's observations before and after a step to a number for each agent."""


def _contact(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["contact"] > 0, dtype=float)


def _moved(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(np.abs(after["at_boxes"] - before["at_boxes"]).sum(axis=1), dtype=float)


def _turned(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["heading"] != before["heading"], dtype=float)


def _veto(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["veto"] > 0, dtype=float)


def _done(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["done_share"], dtype=float)


def _near(before: Arrays, after: Arrays) -> NDArray[Any]:
    distance_m = np.linalg.norm(after["neighbor_place_m"], axis=2)
    is_near = (after["neighbor_id"] >= 0) & (distance_m < after["neighbor_separation_m"])
    return np.asarray(is_near.sum(axis=1), dtype=float)


def _delay(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["delay_s"] - before["delay_s"], dtype=float)


TERMS: dict[str, tuple[Reward, frozenset[str], str]] = {
    "contact": (_contact, frozenset({"contact"}), "1 where the last action was stopped"),
    "moved": (_moved, frozenset({"at_boxes"}), "boxes moved"),
    "turned": (_turned, frozenset({"heading"}), "1 where the heading changed"),
    "veto": (_veto, frozenset({"veto"}), "1 where a part of the chain objected"),
    "done": (_done, frozenset({"done_share"}), "part of the ordered way that was done"),
    "near": (
        _near,
        frozenset({"neighbor_place_m", "neighbor_id", "neighbor_separation_m"}),
        "others, as they are seen, that are nearer than the separation",
    ),
    "delay": (_delay, frozenset({"delay_s"}), "seconds by which the arrival has become later"),
}
"""The terms that have names: function, the observations that it needs, its meaning."""

DEFAULTS: dict[str, dict[str, float]] = {
    "robots": {"contact": -1.0},
    "chain": {"veto": -1.0, "done": 0.1},
    "airspace": {"near": -1.0, "delay": -0.01},
}
"""The weights of each world that are used where none are given."""


def rewards(terms: Mapping[str, float] | Reward, observed: set[str]) -> Reward:
    """Returns the sum of terms as one function; ``observed`` names what there is to observe."""
    if callable(terms):
        return terms
    chosen: list[tuple[Reward, float]] = []
    for name, weight in terms.items():
        if name not in TERMS:
            known = ", ".join(TERMS)
            raise _wrong(name, f"there is no reward `{name}`", f"one of {known}, or a function")
        term, needs, _ = TERMS[name]
        if not needs <= observed:
            missing = ", ".join(sorted(needs - observed))
            raise _wrong(name, f"it needs `{missing}`, which nobody observes", "leave it out")
        if not isinstance(weight, (int, float)) or not math.isfinite(weight):
            raise _wrong(name, f"its weight is {weight!r}", "give a finite number")
        chosen.append((term, float(weight)))

    def total(before: Arrays, after: Arrays) -> NDArray[Any]:
        return np.asarray(sum(weight * term(before, after) for term, weight in chosen))

    return total


def earned(
    reward: Reward, before: Arrays, after: Arrays, agents: int
) -> NDArray[np.float64]:
    """Returns what each agent of a team earned; a function of one's own may return the wrong thing."""
    values = np.array(reward(before, after), dtype=float)
    if values.shape != (agents,):
        cause = f"the function returned an array of the shape {values.shape}"
        raise _wrong("function", cause, f"return a number for each agent: the shape ({agents},)")
    return values


def _wrong(name: str, cause: str, remedy: str) -> InputError:
    return wrong(f"rewards.{name}", cause, remedy)
