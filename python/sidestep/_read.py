"""The tables of folders."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence

from . import _native, _notebook
from ._errors import input_error
from ._native import Table, table_names


class Tables(Mapping[str, Table]):
    """The tables of a run folder or of a sweep's folder by name, as :func:`read` returns them.

    A table is read from its files on first access and cached. Access raises InputError when a file is damaged, and
    KeyError when there is no such table.
    """

    def __init__(self, folder: str | os.PathLike[str], names: Sequence[str]) -> None:
        self._folder = folder
        self._names = list(names)
        self._read: dict[str, Table] = {}

    def __getitem__(self, name: str) -> Table:
        if name not in self._names:
            raise KeyError(f"no table `{name}` in {os.fspath(self._folder)}; it has {', '.join(self._names)}")
        if name not in self._read:
            self._read[name] = _native.read(self._folder, [name])[name]
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"Tables({os.fspath(self._folder)}: {', '.join(self._names)})"

    def _repr_html_(self) -> str:
        return _notebook.tables(self)


def read(folder: str | os.PathLike[str], tables: Sequence[str] | None = None) -> Tables:
    """Returns the tables of a run folder or a sweep's folder by name; each is read on first access.

    ``tables`` lists the tables to return; by default all. A table of an unfinished run ends at its last checkpoint. A sweep has ``results``, one row per finished run, ``timings``, and
    ``series``, metrics over time.

    Raises InputError when there is no such folder or table.

    >>> import tempfile, sidestep
    >>> from pathlib import Path
    >>> folder = Path(tempfile.mkdtemp()) / "run"
    >>> floor = {"world": "robots", "cycles": 30, "map": {"ascii": "......"}, "robots": [{"count": 2}]}
    >>> with sidestep.Simulation(floor, out=folder) as sim:
    ...     sim.run()
    30
    >>> tables = sidestep.read(folder)
    >>> sorted(tables), len(tables["trajectories"])
    (['events', 'series', 'trajectories'], 60)
    """
    known = table_names(folder)
    if not known and not any(os.path.isfile(os.path.join(folder, name)) for name in ("run.json", "sweep.json")):
        cause, remedy = "there is no run and no sweep", "give the folder that one was recorded to"
        raise input_error(os.fspath(folder), cause, remedy)
    unknown = [name for name in tables or () if name not in known]
    if unknown:
        raise input_error(os.fspath(folder), f"there is no table `{unknown[0]}`", f"give some of {', '.join(known)}")
    return Tables(folder, known if tables is None else tables)
