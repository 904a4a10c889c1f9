"""Progress of a sweep that other processes run."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from . import _native, _notebook


@dataclass(frozen=True)
class SweepStatus:
    """Progress of a sweep, as :func:`sweep_status` returns it."""

    #: Whether the table of all runs exists.
    is_complete: bool
    #: Number of finished runs, including failed ones.
    runs: int
    #: Total number of runs; the maximum if a precision ends the sweep.
    total: int
    #: Whether a precision ends the sweep.
    until_precise: bool
    #: Number of runs that failed.
    failed: int
    #: The first failed runs: dicts of ``cell``, ``variant``, ``seed`` and ``why``.
    failures: list[dict[str, Any]]
    #: Whether a process is running it: by the locks of its journals, or by the time since the last finished run.
    is_active: bool
    #: The shares that were started: dicts of ``share``, ``runs``, ``of``, ``is_done`` and ``idle_s``.
    shares: list[dict[str, Any]]
    #: Recent rate of finished runs per second; None before the second run, and once the sweep is complete.
    runs_per_s: float | None
    #: Seconds since the last run finished; None if no share is in progress.
    idle_s: float | None
    #: Estimated seconds left at the recent rate; None if no process seems to be running.
    eta_s: float | None

    @property
    def of(self) -> int:
        """The same as ``total``."""
        return self.total

    @property
    def is_worked_on(self) -> bool:
        """The same as ``is_active``."""
        return self.is_active

    @property
    def left_s(self) -> float | None:
        """The same as ``eta_s``."""
        return self.eta_s

    def _repr_html_(self) -> str:
        return _notebook.status(self)


def sweep_status(folder: str | os.PathLike[str]) -> SweepStatus:
    """Returns the progress of the sweep in a folder, as ``sidestep sweep status --json`` prints it.

    It only reads the journals, whatever process runs the sweep. The rate is that of the ten minutes before the last
    finished run.

    Raises InputError when the folder holds no sweep, or a file is damaged.

    >>> import tempfile, sidestep
    >>> from pathlib import Path
    >>> floor = {"world": "robots", "cycles": 20, "map": {"ascii": "......"}, "robots": {"count": 2}}
    >>> folder = Path(tempfile.mkdtemp()) / "sweep"
    >>> result = sidestep.sweep(floor, replicate=3, out=folder)
    >>> status = sidestep.sweep_status(folder)
    >>> status.is_complete, status.runs, status.total, status.failed
    (True, 3, 3, 0)
    """
    return _native.sweep_status(folder)
