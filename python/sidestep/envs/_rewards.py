"""Rewards: named terms with weights, of a team's observations before and after a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, input_error

#: An airplane without a way-point reports one beyond this distance.
MIN_NO_WAY_POINT_M = 1e11

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
    was_m = np.linalg.norm(before["way_point_m"], axis=1)
    is_m = np.linalg.norm(after["way_point_m"], axis=1)
    # After reaching a way-point, an airplane observes the next one, at an unrelated distance.
    is_there = after["way_points_left"] < before["way_points_left"]
    # An airplane that keeps a heading has no way-point.
    has_one = (was_m < MIN_NO_WAY_POINT_M) & (is_m < MIN_NO_WAY_POINT_M) & _flies(before, after)
    return np.where(has_one, np.where(is_there, was_m, was_m - is_m), 0.0)


def _separation(before: Arrays, after: Arrays) -> NDArray[Any]:
    distance_m = np.linalg.norm(after["neighbor_place_m"], axis=2)
    is_near = (after["neighbor_id"] >= 0) & (distance_m < after["neighbor_separation_m"])
    return np.asarray(is_near.sum(axis=1))


def _delay(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.where(_flies(before, after), after["delay_s"] - before["delay_s"], 0.0)


def _flies(before: Arrays, after: Arrays) -> NDArray[Any]:
    """Returns where observations before and after are real: not the padding of future or landed airplanes."""
    return (before["due"] > 0) & (after["due"] > 0)


@dataclass(frozen=True)
class Term:
    """A named term of a reward."""

    #: The quantity that it measures.
    meaning: str
    #: Functions with their required observations: the first whose observations exist is used.
    forms: tuple[tuple[Reward, frozenset[str]], ...]


def _term(meaning: str, *forms: tuple[Reward, str]) -> Term:
    return Term(meaning, tuple((form, frozenset(needs.split())) for form, needs in forms))


TERMS: dict[str, Term] = {
    "contact": _term("1 where the last action was stopped", (_contact, "contact")),
    "moved": _term("boxes moved", (_moved, "at_boxes")),
    "turned": _term("1 where the heading changed", (_turned, "heading")),
    "veto": _term("1 where a part of the chain vetoed", (_veto, "veto")),
    "progress": _term(
        "chain: fraction of the ordered motion that was carried out; airplane: meters closer to its way-point",
        (_done, "done_share"),
        (_nearer, "way_point_m way_points_left due"),
    ),
    "separation": _term(
        "number of observed neighbors closer than the separation",
        (_separation, "neighbor_place_m neighbor_id neighbor_separation_m"),
    ),
    "delay": _term("seconds of additional delay at arrival", (_delay, "delay_s due")),
}
"""The named terms."""

DEFAULTS: dict[str, dict[str, float]] = {
    "robots": {"contact": -1.0},
    "chain": {"veto": -1.0, "progress": 0.1},
    "airspace": {"separation": -1.0, "delay": -0.01},
}
"""The default weights of each world."""


def combine_rewards(terms: Mapping[str, float] | Reward, observed: set[str]) -> Reward:
    """Returns the weighted sum of terms as one function; ``observed`` has the names of the observations."""
    if callable(terms):
        return terms
    chosen: list[tuple[Reward, float]] = []
    for name, weight in terms.items():
        if name not in TERMS:
            known = ", ".join(TERMS)
            raise _reward_error(name, f"there is no reward `{name}`", f"one of {known}, or a function")
        applicable = [form for form, needs in TERMS[name].forms if needs <= observed]
        if not applicable:
            missing = " or ".join(f"`{', '.join(sorted(needs - observed))}`" for _, needs in TERMS[name].forms)
            raise _reward_error(name, f"it needs {missing}, which no agent observes", "leave it out")
        if not isinstance(weight, (int, float)) or not math.isfinite(weight):
            raise _reward_error(name, f"its weight is {weight!r}", "give a finite number")
        chosen.append((applicable[0], float(weight)))

    if not chosen:
        raise input_error("rewards", "no term is given", f"give weights to some of {', '.join(TERMS)}, or a function")
    (first, first_weight), *others = chosen

    def total(before: Arrays, after: Arrays) -> NDArray[Any]:
        # One term is the usual case, and a step of ten agents costs no more than a few NumPy calls.
        total_rewards = first_weight * first(before, after)
        for term, weight in others:
            total_rewards = total_rewards + weight * term(before, after)
        return total_rewards

    return total


def compute_rewards(reward: Reward, before: Arrays, after: Arrays, agents: int) -> NDArray[np.float64]:
    """Returns the reward of each agent of a team, after checking the result of a user's function."""
    values = np.array(reward(before, after), dtype=float)
    if values.shape != (agents,):
        cause = f"the function returned an array of the shape {values.shape}"
        raise _reward_error("function", cause, f"return a number for each agent: the shape ({agents},)")
    return values


def _reward_error(name: str, cause: str, remedy: str) -> InputError:
    return input_error(f"rewards.{name}", cause, remedy)
