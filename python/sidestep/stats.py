"""Intervals, paired differences and the stopping rule, as in the command and its reports.

Intervals are two-sided at 95 %. A value that is NaN, infinite or None is missing: it is counted, but not part of a mean. All
functions assume independent values, as of runs with different seeds; robots of one run are not independent.

>>> from sidestep import stats
>>> stats.mean([4.0, 5.0, 7.0, float("nan")])
Mean(mean=5.33..., sd=1.52..., interval=Interval(low=1.53..., high=9.12...), ..., n=3, missing=1)
>>> stats.paired([4.0, 5.0, 7.0], [6.0, 6.0, 9.0]).lower     # in 3 of 3 pairs the first is lower
3
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native, _notebook
from ._errors import input_error

__all__ = [
    "Correlation",
    "Interval",
    "Mean",
    "Paired",
    "Quantile",
    "Share",
    "StopDecision",
    "StoppingRule",
    "correlation",
    "holm",
    "mean",
    "paired",
    "proportion",
    "quantile",
    "share",
]


class Interval(NamedTuple):
    """An interval, ends included."""

    low: float
    high: float


class Mean(NamedTuple):
    """A mean of values, in their unit."""

    #: Arithmetic mean; None without values.
    mean: float | None
    #: Standard deviation (divisor n - 1); None below two values.
    sd: float | None
    #: Student's interval of the mean; None if all are equal but for rounding, which is no spread.
    interval: Interval | None
    #: Bootstrap (BCa) interval of the mean, for skewed values; None if all are equal.
    bootstrap: Interval | None
    #: Number of values.
    n: int
    #: Number of values that are missing.
    missing: int


class Share(NamedTuple):
    """A proportion of runs."""

    #: From 0 to 1; None without runs.
    share: float | None
    #: Wilson's interval: its coverage is 95 % on average over proportions.
    interval: Interval
    #: Clopper and Pearson's interval: its coverage is never below 95 %.
    exact: Interval


class Quantile(NamedTuple):
    """A quantile of values, in their unit."""

    #: The estimate; None without values.
    value: float | None
    #: Interval by order statistics; None with too few values for one.
    interval: Interval | None
    #: The coverage of that interval, 0.95 or more.
    coverage: float | None


class Paired(NamedTuple):
    """Two treatments, a and b, of the same cases, such as the same seeds."""

    #: Number of complete pairs.
    n: int
    #: Number of cases with one or both values missing.
    incomplete: int
    #: Mean of a - b.
    difference: float | None
    #: Student's interval of it; None if all pairs are the same one but for rounding.
    interval: Interval | None
    #: Bootstrap interval of it; None where the other is.
    bootstrap: Interval | None
    #: Two-sided p-value of Student's paired test of no difference; None below 5 pairs, and if all differ by the same
    #: but for rounding (a standard deviation of at most 1e-9 of the largest magnitude). 1 if none differs.
    p_value: float | None
    #: Two-sided p-value of the sign test, which makes no assumption about the values; None below 5 pairs.
    sign_p_value: float | None
    #: Numbers of pairs in which a is lower, equal but for rounding, and higher.
    lower: int
    equal: int
    higher: int
    #: Mean of a over mean of b; None if values are negative, or the mean of b may be 0.
    ratio: float | None
    #: Fieller's interval of it.
    ratio_interval: Interval | None

    def _repr_html_(self) -> str:
        return _notebook.paired(self)


class Correlation(NamedTuple):
    """Spearman's rank correlation."""

    #: From -1 to 1.
    value: float
    #: Its interval; None below four pairs, or if the order is perfect.
    interval: Interval | None
    #: Number of complete pairs.
    n: int


class StopDecision(NamedTuple):
    """The decision of a stopping rule."""

    #: Total number of runs needed; once reached, use only that many, from the first.
    runs: int
    #: Reason to stop; None if more runs are needed.
    reason: str | None


def _values(name: str, values: ArrayLike) -> NDArray[np.float64]:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise input_error(name, f"are not numbers: {error}", "give numbers; NaN or None for missing ones") from error
    if array.ndim != 1:
        raise input_error(name, f"have the shape {array.shape}", "give an array of one dimension")
    return np.ascontiguousarray(array)


def mean(values: ArrayLike) -> Mean:
    """Returns the mean of values of the shape (n,), with its intervals.

    Trust ``interval`` from 5 values on if they are roughly symmetric, ``bootstrap`` from 20 on if they are skewed.

    Raises InputError when they are not numbers.

    >>> from sidestep import stats
    >>> stats.mean([2, 2, 2]).interval
    Interval(low=2.0, high=2.0)
    """
    return _native.stats_mean(_values("values", values))


def proportion(successes: int, n: int) -> Share:
    """Returns the proportion of ``successes`` among ``n`` runs, with its intervals.

    Raises InputError when there are more successes than runs.

    >>> from sidestep import stats
    >>> stats.proportion(9, 10).interval
    Interval(low=0.59..., high=0.98...)
    """
    if successes < 0 or n < 0:
        raise input_error("proportion", f"{successes} of {n} is impossible", "give numbers from 0 on")
    return _native.stats_share(successes, n)


def share(successes: int, n: int) -> Share:
    """The same as :func:`proportion`.

    >>> from sidestep import stats
    >>> stats.share(9, 10) == stats.proportion(9, 10)
    True
    """
    return proportion(successes, n)


def quantile(values: ArrayLike, q: float) -> Quantile:
    """Returns the quantile ``q``, between 0 and 1, of values of the shape (n,).

    >>> from sidestep import stats
    >>> stats.quantile(range(100), 0.5).value
    49.5
    """
    if not 0.0 < q < 1.0:
        raise input_error("q", f"is {q}", "give a number between 0 and 1")
    return _native.stats_quantile(_values("values", values), q)


def paired(a: ArrayLike, b: ArrayLike) -> Paired:
    """Compares two treatments of the same cases: values of the shape (n,) each, case by case.

    The interval of the difference is much narrower than separate ones if the cases differ among themselves; the overlap
    of separate intervals says nothing about pairs.

    Raises InputError when the numbers of values differ.

    >>> from sidestep import stats
    >>> pairs = stats.paired([10.0, 21.0, 29.5, 42.0], [12.0, 23.0, 31.0, 44.5])
    >>> pairs.difference, pairs.interval.high < 0
    (-2.0, True)
    """
    return _native.stats_paired(_values("a", a), _values("b", b))


def holm(p_values: Sequence[float | None]) -> list[float | None]:
    """Returns p-values adjusted by Holm's method: all below 0.05 are significant together, at a confidence of 95 %.

    >>> from sidestep import stats
    >>> stats.holm([0.01, 0.04, None])
    [0.02, 0.04, None]
    """
    return _native.stats_holm(list(p_values))


def correlation(a: ArrayLike, b: ArrayLike) -> Correlation | None:
    """Returns Spearman's rank correlation of two quantities of the shape (n,); None if one of them is constant.

    >>> from sidestep import stats
    >>> stats.correlation([1, 2, 3, 4], [1, 4, 9, 16]).value
    1.0
    """
    first = _values("a", a)
    second = _values("b", b)
    if first.shape != second.shape:
        raise input_error(
            "correlation", f"{len(first)} and {len(second)} values are not pairs", "give two values of each case"
        )
    return _native.stats_correlation(first, second)


@dataclass(frozen=True)
class StoppingRule:
    """The rule that ends a sweep at a precision: once Student's interval of the mean is narrow enough.

    ``half_width`` is in the unit of the values or, if ``relative``, a fraction of the mean. It is first checked after
    ``min_runs``. The decision depends only on the values, not on parallelism or processes.

    >>> from sidestep import stats
    >>> rule = stats.StoppingRule(0.05)
    >>> rule.next([])
    StopDecision(runs=10, reason=None)
    >>> values = [10.0, 10.2, 9.9, 10.1, 9.8, 10.0, 10.3, 9.7, 10.0, 10.1]
    >>> rule.next(values)
    StopDecision(runs=10, reason='the interval is as narrow as wanted')
    """

    half_width: float
    relative: bool = True
    min_runs: int = 10
    max_runs: int = 1000

    def __post_init__(self) -> None:
        if not (0.0 < self.half_width < float("inf")):
            raise input_error("half_width", f"is {self.half_width}", "give a number above 0")
        if not 2 <= self.min_runs <= self.max_runs:
            raise input_error("min_runs", f"is {self.min_runs}", f"give a number from 2 to max_runs, {self.max_runs}")

    def next(self, *columns: ArrayLike) -> StopDecision:
        """Returns whether to stop, given the values so far: one column per quantity, in the order of the runs. With several
        columns, all must be precise enough.

        >>> from sidestep import stats
        >>> stats.StoppingRule(1.0, relative=False, max_runs=20).next([1.0, 9.0] * 5)
        StopDecision(runs=20, reason=None)
        """
        return _native.stats_next(self, [_values("columns", column) for column in columns])
