"""The exceptions: each names the mistake, its place, and its remedy."""

from __future__ import annotations


class SidestepError(Exception):
    """Anything that Sidestep reports; the other exceptions stand below it."""


class InputError(SidestepError, ValueError):
    """Wrong input: a scenario, a file, a table whose rows do not sum to 1.

    Its text is the command's. ``place`` is the file or option, ``line`` and ``column`` count from 1 where they
    are known, ``key`` is the key as :meth:`Scenario.set` names it, where it is known.
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
    """An order that cannot be obeyed, or arrays of another shape; nothing of it was noted."""


class RecordError(SidestepError, OSError):
    """Rows, files or pictures that cannot be stored."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class CheckpointError(SidestepError, ValueError):
    """A checkpoint that is damaged, or belongs to another scenario or version."""


class ReplayError(SidestepError, RuntimeError):
    """A run that stopped, or did not come out as recorded; the text says how to replay it."""


class EngineError(SidestepError, RuntimeError):
    """An executor that cannot run the tasks of a sweep; finished runs are kept, and the same call goes on."""


class ClosedError(SidestepError, RuntimeError):
    """A simulation that was closed is used."""


def wrong(place: str, cause: str, remedy: str) -> InputError:
    """Returns the error of an argument."""
    return InputError(f"{place}: {cause}\n  help: {remedy}", place, None, None, None, cause, remedy)


def whole(name: str, value: int, least: int, most: int) -> int:
    """Returns a whole number, if it is in its range."""
    if not least <= value <= most:
        raise wrong(name, f"is {value}", f"give a number from {least} to {most}")
    return value
