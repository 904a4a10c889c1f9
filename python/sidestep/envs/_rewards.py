"""Rewards: named terms with weights, of a team's observations before and after a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, input_error
from .._native import world_facts, worlds

Arrays = Mapping[str, NDArray[Any]]

Reward = Callable[[Arrays, Arrays], NDArray[Any]]
"""A term: from a team's observations before and after a step to a number for each agent."""


# Measures are plain functions, whose observations are bound by `partial`: environments are pickled with their rewards.


def _value(before: Arrays, after: Arrays, *, observation: str) -> NDArray[Any]:
    return after[observation]


def _positive(before: Arrays, after: Arrays, *, observation: str) -> NDArray[Any]:
    return np.asarray(after[observation] > 0)


def _changed(before: Arrays, after: Arrays, *, observation: str) -> NDArray[Any]:
    return np.asarray(after[observation] != before[observation])


def _distance(before: Arrays, after: Arrays, *, observation: str) -> NDArray[Any]:
    return np.asarray(np.abs(after[observation] - before[observation]).sum(axis=1))


def _increase(before: Arrays, after: Arrays, *, observation: str, active: str) -> NDArray[Any]:
    return np.where(_acts(before, after, active), after[observation] - before[observation], 0.0)


def _approach(
    before: Arrays, after: Arrays, *, target: str, targets_left: str, active: str, none_beyond_m: float
) -> NDArray[Any]:
    was_m = np.linalg.norm(before[target], axis=1)
    is_m = np.linalg.norm(after[target], axis=1)
    # After reaching a target, an agent observes the next one, at an unrelated distance.
    is_there = after[targets_left] < before[targets_left]
    has_one = (was_m < none_beyond_m) & (is_m < none_beyond_m) & _acts(before, after, active)
    return np.where(has_one, np.where(is_there, was_m, was_m - is_m), 0.0)


def _near(before: Arrays, after: Arrays, *, positions: str, ids: str, separations: str) -> NDArray[Any]:
    distance_m = np.linalg.norm(after[positions], axis=2)
    is_near = (after[ids] >= 0) & (distance_m < after[separations])
    return np.asarray(is_near.sum(axis=1))


def _acts(before: Arrays, after: Arrays, active: str) -> NDArray[Any]:
    """Returns where observations before and after are real: not the padding of agents that do not act yet, or no more."""
    return (before[active] > 0) & (after[active] > 0)


#: The measures of terms, by the names by which worlds declare them.
_MEASURES: dict[str, Callable[..., NDArray[Any]]] = {
    "value": _value,
    "positive": _positive,
    "changed": _changed,
    "distance": _distance,
    "increase": _increase,
    "approach": _approach,
    "near": _near,
}


@dataclass(frozen=True)
class Term:
    """A named term of a reward."""

    #: The quantity that it measures.
    meaning: str
    #: Functions with their required observations: the first whose observations exist is used.
    forms: tuple[tuple[Reward, frozenset[str]], ...]


def _form(measure: Mapping[str, Any]) -> tuple[Reward, frozenset[str]]:
    """Returns the function of a declared measure, and the observations that it needs: all of its words."""
    arguments = {name: value for name, value in measure.items() if name != "kind"}
    needs = frozenset(value for value in arguments.values() if isinstance(value, str))
    return partial(_MEASURES[measure["kind"]], **arguments), needs


def _declared_terms() -> dict[str, Term]:
    """Returns the terms of all worlds. One that several worlds have says what it measures in each."""
    declared: dict[str, list[tuple[str, Mapping[str, Any]]]] = {}
    for world in worlds():
        facts = world_facts(world)
        for term in facts["reward_terms"]:
            declared.setdefault(term["name"], []).append((facts["agent"], term))
    terms = {}
    for name, alike in declared.items():
        meanings = [term["meaning"] if len(alike) == 1 else f"{agent}: {term['meaning']}" for agent, term in alike]
        terms[name] = Term("; ".join(meanings), tuple(_form(term["measure"]) for _, term in alike))
    return terms


def _default_weights(world: str) -> dict[str, float]:
    terms = world_facts(world)["reward_terms"]
    return {term["name"]: term["default_weight"] for term in terms if term["default_weight"] != 0}


TERMS: dict[str, Term] = _declared_terms()
"""The named terms."""

DEFAULTS: dict[str, dict[str, float]] = {world: _default_weights(world) for world in worlds()}
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
    return _WeightedSum(chosen)


class _WeightedSum:
    """The weighted sum of terms: a class, because environments are pickled, and functions in functions cannot be."""

    def __init__(self, terms: list[tuple[Reward, float]]) -> None:
        self._first, *self._others = terms

    def __call__(self, before: Arrays, after: Arrays) -> NDArray[Any]:
        # One term is the usual case, and a step of ten agents costs no more than a few NumPy calls.
        term, weight = self._first
        total = weight * term(before, after)
        for term, weight in self._others:
            total = total + weight * term(before, after)
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
