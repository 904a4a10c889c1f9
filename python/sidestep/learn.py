"""Error models of real sensors and wheels, learned from tables: arrays, data frames, or the recording of a run.

Every probability has its number of counts, and Wilson's 95 % interval. For other logs (MRCLAM, CARMEN, ROS 2 bags)
use ``sidestep learn``.

>>> from sidestep import learn
>>> moves = {"action": ["forward"] * 4, "ahead_boxes": [1, 1, 1, 0], "left_boxes": [0] * 4, "turn_deg": [0] * 4}
>>> learned = learn.effector(moves)
>>> learned.report["rounded_counts"]
{'0,0': 1, '1,0': 3}
>>> "[effectors.mine]" in learned.profile("mine")
True
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _native
from ._columns import log_columns
from ._native import Learned
from ._progress import Progress

__all__ = ["Learned", "effector", "sensor"]

#: Columns of a table, or the folder of a run that recorded it.
Columns = Mapping[str, Any] | str | os.PathLike[str] | Any

MOTIONS = (
    "cycle", "robot", "action", "ahead_boxes", "left_boxes", "turn_deg", "contact", "effector", "box_m",
    "delay_cycles",
)  # fmt: skip
READINGS = (
    "cycle", "robot", "sensor", "sensor_name", "true", "reported", "true_distance_m", "reported_distance_m", "true_class",
    "reported_class", "bearing_error_deg",
)  # fmt: skip


def effector(
    moves: Columns,
    *,
    box_m: float | None = None,
    name: str | None = None,
    robots: Sequence[int] = (),
    alpha: float = 0.5,
    hold_out: int = 2,
    max_unexplained: float = 0.05,
    progress: Progress | None = None,
) -> Learned:
    """Learns the outcomes of an effector's actions.

    ``moves`` has a row per move, as a dict of columns or a data frame (pandas, polars, pyarrow, :class:`sidestep.Table`, anything
    with an Arrow stream), whose numbers are not copied: ``action``
    (``"forward"``, ``"left"``, ``"right"``, ``"stay"``), ``ahead_boxes`` and ``left_boxes``, displacements in boxes in the frame
    of the start, ``turn_deg``, positive to the left, and optionally ``contact`` (``"yes"`` where an obstacle stopped it: such rows
    are skipped), ``robot``, a number by which robots that differ are found, ``effector``, and ``delay_cycles``, the steps without
    motion before the move, from which delays are learned. Or the folder of a run with ``record.calibration = true``, which
    knows its box. ``box_m`` is the side of a box in meters: without it, a scenario that
    uses the result warns. ``name`` chooses one of several effectors, ``robots`` some robots. ``alpha`` is added to every count
    before rows become probabilities; every ``hold_out``-th move is held out to test the model, and so is each quarter of the
    time and each robot. No interval is given where a greater share of rows than ``max_unexplained`` is left out for a reason
    that nothing explains, such as damage. ``progress`` is a function that is told the rows that are read and all, or True for a
    bar of tqdm: rows are counted again from 0 where a table has to be read twice.

    Raises InputError when columns are missing or differ in length, or a value is out of range.

    >>> from sidestep import learn
    >>> moved = {"action": ["forward"] * 10, "ahead_boxes": [1] * 9 + [0], "left_boxes": [0] * 10, "turn_deg": [0] * 10}
    >>> learned = learn.effector(moved)
    >>> one = learned.report["probabilities"][0]
    >>> one["row"], one["count"], one["of"]
    ('forward', 9.0, 10.0)
    >>> "[effectors.mine]" in learned.profile("mine")
    True
    """
    choice = {"box_m": box_m, "effector": name, "robots": [int(robot) for robot in robots]}
    return _native.learn_effector(_options(moves, MOTIONS, alpha, hold_out, max_unexplained, progress), choice)


def sensor(
    readings: Columns,
    *,
    edges_m: Sequence[float] | None = None,
    classes: Sequence[str] = (),
    bearings_deg: Sequence[float] | None = None,
    range_m: float | None = None,
    name: str | None = None,
    beam: bool = False,
    alpha: float = 0.5,
    hold_out: int = 2,
    max_unexplained: float = 0.05,
    progress: Progress | None = None,
) -> Learned:
    """Learns the reports of a sensor.

    ``readings`` has a row per reading, as a dict of columns or a data frame: ``true`` and ``reported``, one word each
    (``"nothing"`` for no observation), and ``true_distance_m`` and ``reported_distance_m``, or ``true_class`` and
    ``reported_class``. Or the folder of a run with ``record.calibration = true``, with ``name`` if it has several sensors.
    ``edges_m`` divide distances into ``classes``, near to far, one more than edges; ``bearings_deg`` of the beams, positive
    to the left, and ``range_m`` are for the profile; a run knows all four. With ``beam`` the four-part beam model (hit, short,
    max, random) is fitted to ranges in meters, too, as it always is to those of a run; it is the sensor ``NAME-beam`` of the
    profile. ``alpha``, ``hold_out``, ``max_unexplained`` and ``progress`` are as for :func:`effector`.

    Raises InputError when columns are missing or differ in length, or a value is out of range.

    >>> from sidestep import learn
    >>> readings = {"true": ["wall", "wall", "nothing"], "reported": ["wall", "nothing", "nothing"],
    ...         "true_distance_m": [1.0, 1.5, None], "reported_distance_m": [1.1, None, None]}
    >>> learned = learn.sensor(readings, edges_m=[2.0], classes=["near", "far"], range_m=4.0)
    >>> one = learned.report["probabilities"][0]
    >>> one["row"], one["column"], one["count"], one["of"]
    ('nothing', 'nothing', 1.0, 1.0)
    """
    shape = {
        "edges_m": None if edges_m is None else [float(edge) for edge in edges_m],
        "classes": list(classes),
        "bearings_deg": None if bearings_deg is None else [float(b) for b in bearings_deg],
        "range_m": range_m,
        "sensor": name,
        "beam": beam,
    }
    return _native.learn_sensor(_options(readings, READINGS, alpha, hold_out, max_unexplained, progress), shape)


def _options(
    columns: Columns,
    known: Sequence[str],
    alpha: float,
    hold_out: int,
    max_unexplained: float,
    progress: Progress | None,
) -> dict[str, Any]:
    """Returns a table, as columns or as the folder that contains it, and how to learn from it."""
    options: dict[str, Any] = {
        "columns": None, "run": None, "alpha": alpha, "hold_out_every": hold_out, "max_unexplained": max_unexplained,
        "facts": [], "progress": progress,
    }  # fmt: skip
    if isinstance(columns, str | os.PathLike):
        options["run"] = os.fspath(columns)
    else:
        options["columns"] = log_columns(columns, known)
        if isinstance(columns, _native.Table):
            # A recorded table says of all of its rows what a file would leave out, such as the side of a box.
            options["facts"] = sorted(columns.about.items())
    return options
