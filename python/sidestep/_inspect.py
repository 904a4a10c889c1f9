"""What files are, and what becomes of them when they are read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from . import _native
from ._errors import input_error


@dataclass(frozen=True)
class Finding:
    """Something in a file that was not taken as it stood, by rule."""

    #: What was done about it.
    treatment: Literal["dropped", "repaired", "guessed", "not-used", "suspicious", "noted"]
    #: The rule: ``rows without a position``.
    rule: str
    #: How often it applied.
    count: int
    #: The first places, at most three: ``line 7``.
    places: list[str]
    #: What to do for another result; empty where nothing can be done.
    remedy: str


@dataclass(frozen=True)
class ImportReport:
    """What was found in a file, as :func:`inspect` returns it."""

    #: The path, as it was given.
    file: str
    #: The format with its variant: ``ROS map (map_server)``.
    format: str
    #: Properties, such as origin, units and extent, as pairs of a name and a value.
    facts: list[tuple[str, str]]
    #: Numbers of items that were kept, by noun.
    kept: dict[str, int]
    #: What was not taken as it stood, in the order in which it was found first.
    findings: list[Finding]

    @property
    def dropped(self) -> int:
        """Number of items that were left out."""
        return sum(finding.count for finding in self.findings if finding.treatment == "dropped")


def inspect(
    file: str | os.PathLike[str],
    *,
    strict: bool = False,
    clean: str | os.PathLike[str] | None = None,
    import_options: Mapping[str, Any] | None = None,
) -> ImportReport:
    """Returns what a file or folder is, and what becomes of it when it is read, like ``sidestep inspect``.

    It reads what any function or command reads: maps, robot models, logs, bags, recorded traffic, scenarios, folders of
    runs and sweeps, recordings. ``clean`` is a file to write what was kept to: tracks as CSV, a CARMEN log, a bag as
    MCAP, a map as YAML and PGM. ``import_options`` has what ``--set import.KEY=VALUE`` gives to the command:
    ``{"max_gap_s": 120}``.

    Raises InputError when the file cannot be read, or more than half of it is bad; with ``strict`` when anything was
    left out.

    >>> import sidestep
    >>> report = sidestep.inspect("scenarios/chain/arm.urdf")
    >>> report.format, report.kept["joints"], report.dropped
    ('URDF', 8, 0)
    """
    found = _native.inspect(file, import_options)
    report = ImportReport(
        file=found["file"],
        format=found["format"],
        facts=[(fact["name"], fact["value"]) for fact in found["facts"]],
        kept={item["noun"]: item["count"] for item in found["kept"]},
        findings=[Finding(**finding) for finding in found["findings"]],
    )
    if strict and report.dropped:
        cause = f"{report.dropped} items were left out, and strict is set"
        raise input_error(report.file, cause, "mend them in the file, or go without strict")
    if clean is not None:
        _native.write_clean(file, clean, import_options)
    return report
