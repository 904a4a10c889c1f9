"""Progress of long calls: reported to a function, or shown as a bar of tqdm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from ._errors import input_error

#: Called now and then with the number of units that are done, and the number of all. True shows a bar.
Progress: TypeAlias = Callable[[int, int], object] | bool


class Reporter:
    """Passes progress on; :meth:`close` ends it, also after an error."""

    def __init__(self, report: Callable[[int, int], object]) -> None:
        self._report = report

    def __call__(self, done: int, total: int) -> None:
        """Reports that ``done`` of ``total`` are done."""
        self._report(done, total)

    def close(self) -> None:
        """Does nothing: a function needs no end."""


class Bar(Reporter):
    """A bar in a terminal or a notebook."""

    def __init__(self, unit: str) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError as error:
            raise ImportError("bars need tqdm: pip install 'tqdm>=4.64'; or give a function as progress") from error
        self._bar: Any = tqdm(unit=unit)
        super().__init__(self._update)

    def _update(self, done: int, total: int) -> None:
        self._bar.total = total
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Leaves the bar as it is."""
        self._bar.close()


def reporter(progress: Progress | None, unit: str) -> Reporter | None:
    """Returns what an argument ``progress`` asks for; None for nothing."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar(unit)
    if callable(progress):
        return Reporter(progress)
    raise input_error("progress", f"is {progress!r}", "give True for a bar, or a function of two numbers: done and all")
