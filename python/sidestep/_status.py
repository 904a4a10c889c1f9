"""Progress of a sweep that other processes work on."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from . import _native, _notebook


@dataclass(frozen=True)
class SweepStatus:
    """Progress of a sweep, as :func:`sweep_status` returns it."""

    #: Whether the table of all runs is there.
    is_complete: bool
    #: Number of finished runs, those that failed among them.
    runs: int
    #: Number of runs that there will be; at most as many where a precision ends the sweep.
    of: int
    #: Whether a precision ends the sweep.
    until_precise: bool
    #: Number of runs that failed.
    failed: int
    #: The first of them: dicts of ``cell``, ``variant``, ``seed`` and ``why``.
    failures: list[dict[str, Any]]
    #: Whether a process works on it: by the locks of its journals, or by how long ago the last runs came in.
    is_worked_on: bool
    #: The shares that were begun: dicts of ``share``, ``runs``, ``of``, ``is_done`` and ``idle_s``.
    shares: list[dict[str, Any]]
    #: Finished runs per second of late; None before the second run, and once the sweep is complete.
    runs_per_s: float | None
    #: Seconds since the last run came in; None where no share is in progress.
    idle_s: float | None
    #: Seconds until the last run comes in, if all goes on as of late; None where no process seems to work on it.
    left_s: float | None

    def _repr_html_(self) -> str:
        return _notebook.status(self)


def sweep_status(folder: str | os.PathLike[str]) -> SweepStatus:
    """Returns the progress of the sweep in a folder, as ``sidestep sweep status --json`` prints it.

    It reads the journals and changes nothing, whichever process works on the sweep. The rate is that of
    the last ten minutes before the last run came in.

    Raises InputError when the folder holds no sweep, or a file is damaged.

    >>> import tempfile, sidestep
    >>> from pathlib import Path
    >>> floor = {"world": "robots", "cycles": 20, "map": {"ascii": "......"}, "robots": {"count": 2}}
    >>> folder = Path(tempfile.mkdtemp()) / "sweep"
    >>> swept = sidestep.sweep(floor, replicate=3, out=folder)
    >>> status = sidestep.sweep_status(folder)
    >>> status.is_complete, status.runs, status.of, status.failed
    (True, 3, 3, 0)
    """
    return SweepStatus(**_native.sweep_status(folder))
