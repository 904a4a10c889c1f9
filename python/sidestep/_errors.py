"""The exceptions: each gives the mistake, its place, and its remedy."""

from __future__ import annotations

import operator


class SidestepError(Exception):
    """Base class of all exceptions of Sidestep."""


class InputError(SidestepError, ValueError):
    """Wrong input: a scenario, a file, a table whose rows do not sum to 1.

    Its text is that of the command. ``place`` is the file or option, ``line`` and ``column`` count from 1 where they
    are known, ``key`` is the key in the notation of :meth:`Scenario.set`, where it is known.
    """

    def __init__(
        self,
        message: str,
        place: str = "",
        line: int | None = None,
        column: int | None = None,
        key: str | None = None,
        cause: str = "",
        remedy: str = "",
    ) -> None:
        super().__init__(message, place, line, column, key, cause, remedy)
        self.place = place
        self.line = line
        self.column = column
        self.key = key
        self.cause = cause or message
        self.remedy = remedy

    def __str__(self) -> str:
        return str(self.args[0])


class OrderError(SidestepError, ValueError):
    """An order that is not allowed, or arrays of a wrong shape; no part of it takes effect."""


class RecordError(SidestepError, OSError):
    """Rows, files or images that cannot be stored."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class CheckpointError(SidestepError, ValueError):
    """A checkpoint that is damaged, or belongs to another scenario or version."""


class ReplayError(SidestepError, RuntimeError):
    """A run that stopped, or whose result differs from the recording; the text says how to replay it."""


class EngineError(SidestepError, RuntimeError):
    """An executor that cannot run the tasks of a sweep; finished runs are kept, and the same call continues."""


class FleetError(SidestepError, RuntimeError):
    """A fleet that could not go on: a node or the server is lost, or the program of the network fails."""


class ClosedError(SidestepError, RuntimeError):
    """Use of a closed simulation."""


def input_error(place: str, cause: str, remedy: str) -> InputError:
    """Returns the error of an argument."""
    return InputError(f"{place}: {cause}\n  help: {remedy}", place, None, None, None, cause, remedy)


def checked_int(name: str, value: int, low: int, high: int) -> int:
    """Returns an integer, if it is one and in its range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise input_error(name, f"is {value!r}", f"give a whole number from {low} to {high}") from None
    if not low <= number <= high:
        raise input_error(name, f"is {number}", f"give a number from {low} to {high}")
    return number
