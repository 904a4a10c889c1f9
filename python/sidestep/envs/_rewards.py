"""Rewards: named terms with weights, of a team's observations before and after a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, wrong

#: An airplane's way-point that is farther than this is none.
NO_WAY_POINT_M = 1e11

Arrays = Mapping[str, NDArray[Any]]

Reward = Callable[[Arrays, Arrays], NDArray[Any]]
"""A term: from a team's observations before and after a step to a number for each agent."""


def _contact(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["contact"] > 0)


def _moved(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(np.abs(after["at_boxes"] - before["at_boxes"]).sum(axis=1))


def _turned(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["heading"] != before["heading"])


def _veto(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(after["veto"] > 0)


def _done(before: Arrays, after: Arrays) -> NDArray[Any]:
    return after["done_share"]


def _nearer(before: Arrays, after: Arrays) -> NDArray[Any]:
    was_m, is_m = (np.linalg.norm(seen["way_point_m"], axis=1) for seen in (before, after))
    # An airplane that has reached a way-point looks at the next one, which is as far as it happens to be.
    is_there = after["way_points_left"] < before["way_points_left"]
    # No way-point lies as far: an airplane that keeps a heading says so.
    has_one = (was_m < NO_WAY_POINT_M) & (is_m < NO_WAY_POINT_M) & _flies(before, after)
    return np.where(has_one, np.where(is_there, was_m, was_m - is_m), 0.0)


def _separation(before: Arrays, after: Arrays) -> NDArray[Any]:
    distance_m = np.linalg.norm(after["neighbor_place_m"], axis=2)
    is_near = (after["neighbor_id"] >= 0) & (distance_m < after["neighbor_separation_m"])
    return np.asarray(is_near.sum(axis=1))


def _delay(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.where(_flies(before, after), after["delay_s"] - before["delay_s"], 0.0)


def _flies(before: Arrays, after: Arrays) -> NDArray[Any]:
    """Returns where observations are no padding, before and after: not those of airplanes to come or landed."""
    return (before["due"] > 0) & (after["due"] > 0)


@dataclass(frozen=True)
class Term:
    """A named term of a reward."""

    #: The quantity that it counts.
    meaning: str
    #: Functions with the observations that each needs: the first counts for which there are all.
    forms: tuple[tuple[Reward, frozenset[str]], ...]


def _term(meaning: str, *forms: tuple[Reward, str]) -> Term:
    return Term(meaning, tuple((form, frozenset(needs.split())) for form, needs in forms))


TERMS: dict[str, Term] = {
    "contact": _term("1 where the last action was stopped", (_contact, "contact")),
    "moved": _term("boxes moved", (_moved, "at_boxes")),
    "turned": _term("1 where the heading changed", (_turned, "heading")),
    "veto": _term("1 where a part of the chain objected", (_veto, "veto")),
    "progress": _term(
        "of a chain the part of the ordered way that was done, of an airplane the meters by which its way-point is nearer",
        (_done, "done_share"),
        (_nearer, "way_point_m way_points_left due"),
    ),
    "separation": _term(
        "others, as they are seen, that are nearer than the separation",
        (_separation, "neighbor_place_m neighbor_id neighbor_separation_m"),
    ),
    "delay": _term("seconds by which the arrival has become later", (_delay, "delay_s due")),
}
"""The terms that have names."""

DEFAULTS: dict[str, dict[str, float]] = {
    "robots": {"contact": -1.0},
    "chain": {"veto": -1.0, "progress": 0.1},
    "airspace": {"separation": -1.0, "delay": -0.01},
}
"""The weights of each world that are used where none are given."""


def rewards(terms: Mapping[str, float] | Reward, observed: set[str]) -> Reward:
    """Returns the sum of terms as one function; ``observed`` has the names of the observations."""
    if callable(terms):
        return terms
    chosen: list[tuple[Reward, float]] = []
    for name, weight in terms.items():
        if name not in TERMS:
            known = ", ".join(TERMS)
            raise _wrong(name, f"there is no reward `{name}`", f"one of {known}, or a function")
        fitting = [form for form, needs in TERMS[name].forms if needs <= observed]
        if not fitting:
            missing = " or ".join(f"`{', '.join(sorted(needs - observed))}`" for _, needs in TERMS[name].forms)
            raise _wrong(name, f"it needs {missing}, which nobody observes", "leave it out")
        if not isinstance(weight, (int, float)) or not math.isfinite(weight):
            raise _wrong(name, f"its weight is {weight!r}", "give a finite number")
        chosen.append((fitting[0], float(weight)))

    if not chosen:
        raise wrong("rewards", "no term is named", f"give weights to some of {', '.join(TERMS)}, or a function")
    (first, its_weight), *others = chosen

    def total(before: Arrays, after: Arrays) -> NDArray[Any]:
        # One term is the usual case, and a step of ten agents takes as long as some calls of NumPy.
        gains = its_weight * first(before, after)
        for term, weight in others:
            gains = gains + weight * term(before, after)
        return gains

    return total


def earned(reward: Reward, before: Arrays, after: Arrays, agents: int) -> NDArray[np.float64]:
    """Returns the reward of each agent of a team; a function of one's own may return the wrong thing."""
    values = np.array(reward(before, after), dtype=float)
    if values.shape != (agents,):
        cause = f"the function returned an array of the shape {values.shape}"
        raise _wrong("function", cause, f"return a number for each agent: the shape ({agents},)")
    return values


def _wrong(name: str, cause: str, remedy: str) -> InputError:
    return wrong(f"rewards.{name}", cause, remedy)
