"""Kinematics of arms: many postures (joint configurations), or many targets, in one call."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import checked_int, input_error
from ._native import Arm, arm_trajectories

_Floats = NDArray[np.float64]


class FkResult(NamedTuple):
    """Result of forward kinematics in the frame of the arm's base, one row per posture (joint configuration)."""

    #: Position of the tip in m, of the shape (n, 3).
    tip: _Floats
    #: Rotation matrices of the tip, of the shape (n, 3, 3).
    rotation: _Floats
    #: The rotations as quaternions x, y, z, w, of the shape (n, 4).
    quaternion: _Floats
    #: Positions in m of the connectors, the points that the chain world moves, of the shape (n, connectors, 3).
    connectors: _Floats
    #: Whether all joints are inside their limits, of the shape (n,).
    inside_limits: NDArray[np.bool_]


class IkResult(NamedTuple):
    """Result of inverse kinematics, one row per target."""

    #: Joint values from the base out, in rad or m, of the shape (n, joints); where a target is not reached, the
    #: closest ones found.
    joints: _Floats
    #: Whether it is reached, of the shape (n,).
    reached: NDArray[np.bool_]
    #: Distance of the tip from the target in m, along the axes that count, of the shape (n,).
    error_m: _Floats
    #: Orientation error of the tip in rad, of the shape (n,).
    error_rad: _Floats
    #: Iterations over all starts, of the shape (n,).
    iterations: NDArray[np.int64]
    #: Number of postures that the search started from, of the shape (n,).
    starts: NDArray[np.int64]
    #: Reason why a target is not reached; None where it is.
    reasons: list[str | None]
    #: Further postures that reach the target, of the shape (found, joints) each; only with ``solutions`` above 1.
    others: list[_Floats]
    #: Meshes that are approximated by boxes, and shapes that could not be read.
    remarks: list[str]


class ArmTrajectory(NamedTuple):
    """Motion of the joints of one arm in a recorded run, one row per point of time."""

    #: Number of its chain.
    chain: int
    #: Name of its chain, or ``chain_`` and its number.
    name: str
    #: Names of its joints, from base to tip.
    joints: list[str]
    #: Times in s since the start of the run, of the shape (n,).
    times_s: _Floats
    #: Values of the joints in rad or m, of the shape (n, joints).
    positions: _Floats
    #: Their speeds in rad/s or m/s, of the shape (n, joints).
    velocities: _Floats
    #: Their accelerations in rad/s2 or m/s2, of the shape (n, joints).
    accelerations: _Floats


def trajectories(folder: str | os.PathLike[str], *, every: int = 1) -> list[ArmTrajectory]:
    """Motions of the joints of all arms of a recorded run, as ``sidestep export --to trajectory`` writes them.

    ``folder`` is the folder of a run; only cycles that are multiples of ``every`` count.

    Raises InputError when the run has no arms, or a file is damaged.

    >>> import sidestep, tempfile
    >>> from pathlib import Path
    >>> folder = Path(tempfile.mkdtemp()) / "run"
    >>> with sidestep.Simulation("scenarios/chain/arm.toml", out=folder) as sim:
    ...     _ = sim.run(20)
    >>> [motion] = sidestep.trajectories(folder, every=5)
    >>> motion.positions.shape == (len(motion.times_s), len(motion.joints))
    True
    """
    return arm_trajectories(folder, checked_int("every", every, 1, 2**32))


def fk(arm: Arm | str | os.PathLike[str], joints: ArrayLike | Mapping[str, ArrayLike] | None = None) -> FkResult:
    """Forward kinematics: the positions of an arm's tip and connectors.

    ``arm`` is an :class:`Arm` or a URDF file. ``joints`` are values in rad or m, one for each of ``arm.joints``, of the shape
    (joints,) or (n, joints); without them, each is as close to zero as its limits allow. A data frame, a table or a dict gives
    the values of each joint by its name, whatever the order of its columns. Values outside the limits are computed too.

    Raises InputError when a file or a shape is wrong.

    >>> import sidestep
    >>> arm = sidestep.Arm("scenarios/chain/arm.urdf")
    >>> arm
    Arm(...)
    >>> sidestep.fk(arm, [arm.posture()] * 3).tip.shape
    (3, 3)
    """
    arm = arm if isinstance(arm, Arm) else Arm(arm)
    values = arm.posture() if joints is None else _in_order("joints", arm.joints, joints)
    return arm.forward(_rows("joints", values))


def _in_order(name: str, joints: Sequence[str], values: ArrayLike | Mapping[str, ArrayLike]) -> ArrayLike:
    """Returns the values of joints in their order; columns are found by their names, as recordings have an order of their own."""
    columns = values.keys() if isinstance(values, Mapping) else getattr(values, "columns", None)
    # Arrow's tables have their columns themselves there, and their names elsewhere.
    columns = getattr(values, "column_names", columns)
    if columns is None:
        return cast(ArrayLike, values)
    known = [str(column) for column in columns]
    missing = [joint for joint in joints if joint not in known]
    if missing:
        cause = f"there is no column `{missing[0]}` among {', '.join(known)}"
        raise input_error(name, cause, "name the columns by `arm.joints`, or give an array in their order")
    named = cast(Any, values)
    rows = [_rows(f"{name}.{joint}", named[joint])[0] for joint in joints]
    lengths = {joint: len(row) for joint, row in zip(joints, rows, strict=True)}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{joint} has {length}" for joint, length in lengths.items())
        raise input_error(name, f"their lengths differ: {listed}", "give one value of each joint per row")
    return np.stack(rows, axis=-1)


def ik(
    arm: Arm | str | os.PathLike[str],
    targets: ArrayLike,
    *,
    rpy: ArrayLike | None = None,
    quaternion: ArrayLike | None = None,
    start: ArrayLike | None = None,
    free: Sequence[str] = (),
    engine: Literal["auto", "chain", "dls"] = "auto",
    tolerance_m: float = 1e-6,
    tolerance_rad: float = 1e-6,
    solutions: int = 1,
    apart: float = 0.1,
    nearest: bool = False,
    restarts: int = 100,
    seed: int = 0,
    obstacles: ArrayLike | None = None,
    body: Literal["rods", "shapes", "own"] = "shapes",
    ignore_limits: bool = False,
    workers: int = 1,
) -> IkResult:
    """Inverse kinematics: joint values that move an arm's tip to targets, as ``sidestep ik`` computes them.

    ``targets`` are positions of the tip in m in the frame of the base, of the shape (3,) or (n, 3). ``rpy`` (roll, pitch and yaw
    in rad, of the shape (n, 3)) or ``quaternion`` (x, y, z, w, of the shape (n, 4)) give orientations; a single one for all targets may be
    one-dimensional. ``free`` lists axes of the target's frame that are ignored: ``"x"``, ``"y"``, ``"z"``, and ``"rx"``, ``"ry"``,
    ``"rz"`` for rotations about them. The search starts from ``start``, joint values of the shape (joints,) or (n, joints), then
    from ``restarts`` random postures. With ``solutions`` above 1 it continues until it has as many that differ by ``apart`` rad in some
    joint; ``nearest`` finds those closest to the start. ``obstacles`` are spheres, rows of x, y, z and radius in m; ``body`` is the
    collision model of the arm: ``"rods"`` between connectors, the links' collision ``"shapes"``, or ``"own"``, shapes that must
    not touch each other either. The results do not depend on ``workers``.

    Raises InputError when a file, a shape or an option is wrong; a target out of reach is no error: its row gives the reason.

    >>> import sidestep
    >>> arm = sidestep.Arm("scenarios/chain/arm.urdf")
    >>> there = sidestep.fk(arm, [[0.3] * len(arm.joints), [0.1] * len(arm.joints)]).tip
    >>> found = sidestep.ik(arm, [*there, [0, 0, 50]], restarts=5)
    >>> found.reached.tolist()
    [True, True, False]
    >>> found.reasons
    [None, None, "the target is ... m from the arm's first connector, and its rods reach 0.950000 m"]
    """
    arm = arm if isinstance(arm, Arm) else Arm(arm)
    poses = _rows("targets", targets)
    if rpy is not None and quaternion is not None:
        raise input_error("rpy", "a quaternion is given, too", "give one of them")
    for name, given, width in (("rpy", rpy, 3), ("quaternion", quaternion, 4)):
        if given is not None:
            rows = _rows(name, given)
            if rows.shape[1] != width or len(rows) not in (1, len(poses)):
                expected = f"({len(poses)}, {width}) or ({width},)"
                raise input_error(name, f"has the shape {rows.shape}", f"give an array of the shape {expected}")
            rows = np.broadcast_to(rows, (len(poses), width))
            poses = np.hstack([_check_width("targets", poses, 3), rows])
    if rpy is None and quaternion is None:
        poses = _check_width("targets", poses, 3)
    starts = _rows("start", arm.posture() if start is None else start)
    if len(starts) not in (1, len(poses)):
        raise input_error("start", f"has {len(starts)} rows", f"give one row, or one per target, {len(poses)}")
    spheres = np.empty((0, 4)) if obstacles is None else _rows("obstacles", obstacles)
    if not np.isfinite(spheres).all():
        raise input_error("obstacles", "has values that are not numbers", "give x, y, z and radius in meters")
    options = {
        "free": list(free),
        "engine": engine,
        "tolerance_m": tolerance_m,
        "tolerance_rad": tolerance_rad,
        "solutions": checked_int("solutions", solutions, 1, 10_000),
        "apart": apart,
        "nearest": nearest,
        "restarts": checked_int("restarts", restarts, 0, 1_000_000),
        "seed": checked_int("seed", seed, 0, 2**64 - 1),
        "obstacles": _check_width("obstacles", spheres, 4).tolist(),
        "body": body,
        "ignore_limits": ignore_limits,
        "workers": checked_int("workers", workers, 1, 1024),
    }
    return arm.inverse(np.ascontiguousarray(poses), starts, options)


def _rows(name: str, values: ArrayLike) -> _Floats:
    try:
        array = np.atleast_2d(np.asarray(values, dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise input_error(name, f"are not numbers: {error}", "give an array of numbers") from error
    if array.ndim != 2:
        raise input_error(name, f"has the shape {array.shape}", "give an array of one or two dimensions")
    return np.ascontiguousarray(array)


def _check_width(name: str, rows: _Floats, width: int) -> _Floats:
    if rows.shape[1] != width:
        raise input_error(name, f"has the shape {rows.shape}", f"give an array of the shape (n, {width})")
    return rows
