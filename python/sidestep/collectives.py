"""Probability collectives: players that learn distributions over their strategies until their common cost is low.

>>> import numpy as np
>>> from sidestep import collectives
>>> apart = np.eye(3)                        # two players pay 1 for the same strategy
>>> result = collectives.minimize([[0.0, 0.5, 1.0]] * 2, {(0, 1): apart})
>>> result.cost, sorted(result.joint.tolist())
(0.5, [0, 1])
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._errors import checked_int, input_error

__all__ = ["MinimizeResult", "minimize"]


class MinimizeResult(NamedTuple):
    """The result of an optimization."""

    #: The strategy of each player, of the shape (players,).
    joint: NDArray[np.int64]
    #: Its cost.
    cost: float
    #: A lower bound on the cost of every joint strategy; None for an objective.
    bound: float | None
    #: The final distributions, one array over the strategies of each player.
    q: list[NDArray[np.float64]]
    #: Each player's estimate of the expected cost by strategy, up to a constant: it ranks the strategies. After a local
    #: search it is the cost beside the strategies of the others.
    expected: list[NDArray[np.float64]]
    #: Number of rounds.
    rounds: int
    #: Whether the distributions converged within the allowed rounds.
    converged: bool


def minimize(
    own: Sequence[ArrayLike] | None = None,
    pairs: Mapping[tuple[int, int], ArrayLike] | None = None,
    *,
    objective: Callable[[NDArray[np.int64]], float] | None = None,
    strategies: Sequence[int] | None = None,
    estimator: Literal["exact", "sampled"] | None = None,
    block: int = 30,
    ageing: float = 0.5,
    update: Literal["newton", "brouwer"] = "newton",
    step: float = 0.3,
    order: Literal["parallel", "sequence"] = "sequence",
    utility: Literal["joint", "private"] = "joint",
    cooling: float = 0.95,
    threshold: float = 1e-3,
    calm_rounds: int = 3,
    max_rounds: int = 500,
    choice: Literal["argmax", "draw"] = "argmax",
    local_search: Literal["none", "pairs", "branch-and-bound"] | None = None,
    random_starts: int = 8,
    seed: int = 0,
) -> MinimizeResult:
    """Searches for the joint strategy of least cost, with one strategy per player.

    The cost is given in one of two forms. As a sum over players and pairs: ``own[i]`` has the costs of player `i`'s
    strategies, an array of the shape (strategies of i,), and ``pairs[a, b]`` those of two players', of the shape
    (strategies of a, strategies of b). Or as ``objective(joint)``, a function of an integer array of the shape (players,) that
    returns a number, with ``strategies``, the number of each player's.

    Sums are estimated in closed form (``"exact"``), objectives from ``block`` samples a round, which age by ``ageing`` a
    round. ``step``, above 0 and up to 1, is the step size of the distributions' ``update``, by Newton's method or
    Brouwer's; ``utility`` is the cost that players learn from, the joint one or, for sums, the part that a player can
    influence. The temperature falls by ``cooling``
    a round, until no probability moves by more than ``threshold`` in ``calm_rounds`` rounds, or after ``max_rounds``. Costs should be
    of the order of 1. For sums, a local search follows (``"pairs"``): moves of one or two players while they save anything,
    from there, from each player's cheapest strategy alone, and from ``random_starts`` joint strategies. After it
    ``"branch-and-bound"`` finds the true minimum, unless it takes too long: then ``bound`` is below ``cost``. The same
    arguments and ``seed`` give the same bits.

    Raises InputError when shapes do not match, or a setting is out of range; and any exception of the objective.

    >>> from sidestep import collectives
    >>> collectives.minimize(objective=lambda joint: abs(joint.sum() - 4), strategies=[3, 3, 3], seed=1).cost
    0.0
    """
    if callable(own) or callable(pairs):
        remedy = "give objective=, and the number of each player's strategies as strategies="
        raise input_error("own" if callable(own) else "pairs", "it is a function, and costs are tables", remedy)
    is_exact = objective is None
    options: dict[str, Any] = {
        "estimator": estimator or ("exact" if is_exact else "sampled"),
        "block": checked_int("block", block, 1, 1_000_000),
        "ageing": ageing,
        "update": update,
        "step": step,
        "order": order,
        "utility": utility,
        "cooling": cooling,
        "threshold": threshold,
        "calm_rounds": checked_int("calm_rounds", calm_rounds, 1, 1_000_000),
        "max_rounds": checked_int("max_rounds", max_rounds, 1, 1_000_000_000),
        "choice": choice,
        "local_search": local_search or ("pairs" if is_exact else "none"),
        "random_starts": checked_int("random_starts", random_starts, 0, 10_000),
        "seed": checked_int("seed", seed, 0, 2**64 - 1),
    }
    if objective is not None:
        if own is not None or pairs is not None or strategies is None:
            raise input_error("objective", "an objective needs numbers of strategies and no tables", "give strategies=")
        if options["estimator"] == "exact":
            raise input_error("estimator", "an objective has no closed form", 'give estimator="sampled"')
        if options["local_search"] != "none":
            raise input_error("local_search", "an objective is no sum over pairs", 'give local_search="none"')
        return _native.minimize_objective(list(strategies), objective, options)
    if own is None or strategies is not None:
        raise input_error(
            "own", "tables need each player's own costs", "give own=, zeros if there are none; or an objective"
        )
    costs = [_table(f"own[{k}]", table, 1) for k, table in enumerate(own)]
    both = [(*ab, _table(f"pairs[{ab}]", table, 2)) for ab, table in (pairs or {}).items()]
    return _native.minimize_pairs(costs, both, options)


def _table(name: str, values: ArrayLike, dimensions: int) -> NDArray[np.float64]:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != dimensions:
        raise input_error(name, f"has the shape {array.shape}", f"give an array of {dimensions} dimensions")
    if not np.isfinite(array).all():
        raise input_error(
            name, "has a cost that is not finite", "give finite numbers, large ones for what is forbidden"
        )
    return array
