"""Probability collectives: players that learn distributions over their strategies until their common cost is low.

>>> import numpy as np
>>> from sidestep import collectives
>>> apart = np.eye(3)                        # two players pay 1 for the same strategy
>>> found = collectives.minimize([[0.0, 0.5, 1.0]] * 2, {(0, 1): apart})
>>> found.cost, sorted(found.joint.tolist())
(0.5, [0, 1])
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._errors import whole, wrong

__all__ = ["Minimum", "minimize"]


class Minimum(NamedTuple):
    """The outcome of an optimization."""

    #: The strategy of each player, of the shape (players,).
    joint: NDArray[np.int64]
    #: Its cost.
    cost: float
    #: The final distributions, one array over the strategies of each player.
    q: list[NDArray[np.float64]]
    #: Each player's estimate of the expected cost by strategy, up to a constant: it ranks those that were not chosen.
    expected: list[NDArray[np.float64]]
    #: Number of rounds.
    rounds: int
    #: Whether the distributions settled; otherwise the rounds ran out.
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
    seed: int = 0,
) -> Minimum:
    """Looks for the joint move of least cost, one strategy per player.

    The cost is given in one of two ways. As a sum over players and pairs: ``own[i]`` has the costs of player `i`'s
    strategies, an array of the shape (strategies of i,), and ``pairs[a, b]`` those of two players', of the shape
    (strategies of a, strategies of b). Or as ``objective(joint)``, a function of an integer array of the shape (players,) that
    returns a number, with ``strategies``, how many each player has.

    Sums are estimated in closed form (``"exact"``), objectives from ``block`` samples a round, which age by ``ageing`` a
    round. ``step``, above 0 and up to 1, is that of the distributions' ``update``, by Newton's method or Brouwer's; ``utility`` is the cost that
    players learn from, the joint one or, for sums, the part that a player can influence. The temperature falls by ``cooling``
    a round, until no probability moves by more than ``threshold`` in ``calm_rounds`` rounds, or after ``max_rounds``. Costs should be
    of the order of 1. The same arguments and ``seed`` give the same answer, to the bit.

    Raises InputError when shapes do not fit, or a setting is out of range; and any exception of the objective.

    >>> from sidestep import collectives
    >>> collectives.minimize(objective=lambda joint: abs(joint.sum() - 4), strategies=[3, 3, 3], seed=1).cost
    0.0
    """
    is_exact = objective is None
    options: dict[str, Any] = {
        "estimator": estimator or ("exact" if is_exact else "sampled"),
        "block": whole("block", block, 1, 1_000_000),
        "ageing": ageing,
        "update": update,
        "step": step,
        "order": order,
        "utility": utility,
        "cooling": cooling,
        "threshold": threshold,
        "calm_rounds": whole("calm_rounds", calm_rounds, 1, 1_000_000),
        "max_rounds": whole("max_rounds", max_rounds, 1, 1_000_000_000),
        "choice": choice,
        "seed": whole("seed", seed, 0, 2**64 - 1),
    }
    if objective is not None:
        if own is not None or pairs is not None or strategies is None:
            raise wrong("objective", "an objective needs the numbers of strategies, and no tables", "give strategies=")
        if options["estimator"] == "exact":
            raise wrong("estimator", "an objective has no closed form", 'give estimator="sampled"')
        return Minimum(**_native.minimize_objective(list(strategies), objective, options))
    if own is None or strategies is not None:
        raise wrong("own", "tables need each player's own costs", "give own=, zeros if there are none; or an objective")
    costs = [_table(f"own[{k}]", table, 1) for k, table in enumerate(own)]
    both = [(*ab, _table(f"pairs[{ab}]", table, 2)) for ab, table in (pairs or {}).items()]
    return Minimum(**_native.minimize_pairs(costs, both, options))


def _table(name: str, values: ArrayLike, dimensions: int) -> NDArray[np.float64]:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != dimensions:
        raise wrong(name, f"has the shape {array.shape}", f"give an array of {dimensions} dimensions")
    if not np.isfinite(array).all():
        raise wrong(name, "has a cost that is not finite", "give finite numbers, large ones for what must not be")
    return array
