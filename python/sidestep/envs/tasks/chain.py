"""Tasks of the world ``chain``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ._features import Arrays, Feature, rotated, scaled, vector
from ._task import Actions, Design, RewardTerm, Score, Setting, Task, time_left

#: Steps of a corridor's middle line, in meters.
LINE_STEP_M = 0.1
#: The places ahead on the middle line that a leader observes, in meters.
AHEAD_M = (0.5, 1.5, 3.0)
#: A tip that is so near has visited a target: the scripted method comes nearer.
TOLERANCE_M = 0.06
#: Seconds after which the next target is due.
PATIENCE_S = 6.0
#: The connectors from the leading one on whose surroundings it observes.
WATCHED = 4


class TargetTracker:
    """Targets that a connector has to visit, in any order; one of them, not yet visited, is its present target."""

    def __init__(self, targets_m: NDArray[Any], patience_cycles: int, connector: int, rows: int) -> None:
        self._targets_m = targets_m
        self._patience_cycles = patience_cycles
        self._connector = connector
        self._number = np.zeros(rows, np.int64)
        self._age_cycles = np.zeros(rows, np.int64)
        self._is_visited = np.zeros((rows, len(targets_m)), bool)
        self.arrays = {
            "targets_reached": np.zeros(rows, np.int64),
            "target_m": np.zeros((rows, targets_m.shape[1])),
            "is_reached": np.zeros(rows, bool),
            "patience_left": np.ones(rows),
        }

    def restart(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Begins with the first target."""
        self._number[mask] = 0
        self._age_cycles[mask] = 0
        self._is_visited[mask] = False
        self.arrays["targets_reached"][mask] = 0
        self.arrays["is_reached"][mask] = False
        self.arrays["target_m"][mask] = self._targets_m[0]
        self.arrays["patience_left"][mask] = 1.0

    def advance(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Counts targets that are visited. The next one is due when the present one is, or was not for a long time: in
        clutter some cannot be reached.
        """
        offset_m = self._targets_m - observed["joints_m"][:, self._connector, None]
        near = np.sqrt((offset_m * offset_m).sum(axis=2)) <= TOLERANCE_M
        fresh = near & ~self._is_visited & mask[:, None]
        self._is_visited |= fresh
        self._age_cycles[mask] += 1
        rows = np.arange(len(mask))
        is_over = self._is_visited[rows, self._number] | (self._age_cycles > self._patience_cycles)
        turned = np.flatnonzero(is_over & mask & ~self._is_visited.all(axis=1))
        if len(turned):
            count = len(self._targets_m)
            following = (self._number[turned, None] + 1 + np.arange(count)) % count
            is_open = ~self._is_visited[turned[:, None], following]
            self._number[turned] = following[np.arange(len(turned)), is_open.argmax(axis=1)]
            self._age_cycles[turned] = 0
        self.arrays["is_reached"][:] = fresh.any(axis=1)
        self.arrays["targets_reached"][:] = self._is_visited.sum(axis=1)
        self.arrays["target_m"][:] = self._targets_m[self._number]
        self.arrays["patience_left"][:] = 1.0 - self._age_cycles / (self._patience_cycles + 1)


class LineTracker:
    """How far a connector has come along a line, in meters."""

    def __init__(self, line_m: NDArray[Any], dt_s: float, rows: int) -> None:
        self._line_m = line_m
        self._dt_s = dt_s
        self._start_m = np.zeros(rows)
        self._elapsed_s = np.zeros(rows)
        # Where it is, how far it came in the last cycle, and how fast it was from the start on.
        self.arrays = {"along_m": np.zeros(rows), "gained_m": np.zeros(rows), "speed_m_s": np.zeros(rows)}

    def restart(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Searches the whole line for the nearest place."""
        self.arrays["along_m"][mask] = self._nearest(observed["joints_m"][mask, 0], None)
        self._start_m[mask] = self.arrays["along_m"][mask]
        self._elapsed_s[mask] = 0.0
        self.arrays["gained_m"][mask] = 0.0
        self.arrays["speed_m_s"][mask] = 0.0

    def advance(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Searches nearby alone: where the corridor turns back, the other leg is near, too."""
        along_m = self.arrays["along_m"]
        now_m = self._nearest(observed["joints_m"][mask, 0], along_m[mask])
        self.arrays["gained_m"][:] = 0.0
        self.arrays["gained_m"][mask] = now_m - along_m[mask]
        along_m[mask] = now_m
        self._elapsed_s[mask] += self._dt_s
        way_m = along_m[mask] - self._start_m[mask]
        self.arrays["speed_m_s"][mask] = way_m / self._elapsed_s[mask]

    def _nearest(self, at_m: NDArray[Any], near_m: NDArray[Any] | None) -> NDArray[Any]:
        offset_m = at_m[:, None, :] - self._line_m[None]
        distance_m = (offset_m * offset_m).sum(axis=2)
        if near_m is not None:
            away_m = np.abs(np.arange(len(self._line_m)) * LINE_STEP_M - near_m[:, None])
            distance_m = np.where(away_m <= 1.0, distance_m, np.inf)
        return np.asarray(distance_m.argmin(axis=1) * LINE_STEP_M)


def middle_line(corridor: Mapping[str, Any]) -> NDArray[np.float64]:
    """Returns the middle of a corridor as points of equal distances along it, from its beginning at the origin, eastward."""
    legs = [(_leg_length_m(leg), math.radians(leg.get("turn_deg", 0.0))) for leg in corridor["legs"]]
    total_m = sum(length_m for length_m, _ in legs)
    along_m = np.arange(int(total_m / LINE_STEP_M + 1e-9) + 1) * LINE_STEP_M
    points = np.zeros((len(along_m), 2))
    begin, heading, begin_m = np.zeros(2), 0.0, 0.0
    for length_m, turn_rad in legs:
        within = along_m >= begin_m - 1e-9
        points[within] = _along_leg(begin, heading, along_m[within] - begin_m, turn_rad / length_m)
        begin = _along_leg(begin, heading, np.array([length_m]), turn_rad / length_m)[0]
        heading += turn_rad
        begin_m += length_m
    return points


def _leg_length_m(leg: Mapping[str, Any]) -> float:
    if "straight_m" in leg:
        return float(leg["straight_m"])
    return abs(math.radians(leg["turn_deg"])) * float(leg["radius_m"])


def _along_leg(begin: NDArray[Any], heading: float, by_m: NDArray[Any], bend_per_m: float) -> NDArray[np.float64]:
    """Returns the points so far along a leg, which is straight or an arc."""
    half = 0.5 * bend_per_m * by_m
    # The chord of an arc is shorter than the arc, and halfway turned.
    chord_m = by_m * np.sinc(half / np.pi)
    direction = np.stack([np.cos(heading + half), np.sin(heading + half)], axis=1)
    return np.asarray(begin + chord_m[:, None] * direction)


# What chains observe.


def _own_state(setting: Setting) -> list[Feature]:
    reasons = setting.spaces["veto"].choices or []
    veto = f"1 where a part objected to the last motion ({', '.join(reasons[1:4])} and so on), else 0"
    return [
        Feature("veto", (veto,), lambda arrays: (arrays["veto"] > 0).astype(float)),
        scaled("done_share", "part of the last cycle's way that was done", lambda arrays: arrays["done_share"], 0, 1),
    ]


def _part(name: str, number: int, arrays: Arrays) -> NDArray[Any]:
    """Returns what an array has of one of its parts, such as a connector."""
    return np.asarray(arrays[name][:, number])


def _clearances(setting: Setting, connectors: range, axes: str) -> list[Feature]:
    look_m = setting.spaces["gap_m"].high
    features = []
    for k in connectors:
        features.append(scaled(f"gap_{k}", f"gap of connector {k} in m", partial(_part, "gap_m", k), 0, look_m))
        meaning = f"way from connector {k} to the nearest obstacle"
        features.append(vector(f"nearest_{k}", meaning, partial(_part, "nearest_m", k), 2 * look_m, axes))
    return features


def _offset_of_target(connector: int, arrays: Arrays) -> NDArray[Any]:
    return np.asarray(arrays["target_m"] - arrays["joints_m"][:, connector])


# What they may do.


def _shortened(actions: NDArray[Any]) -> NDArray[np.float64]:
    """Returns actions in bounds, and none longer than 1."""
    clipped = np.clip(actions.astype(np.float64), -1.0, 1.0)
    length = np.sqrt((clipped * clipped).sum(axis=1, keepdims=True))
    return np.asarray(clipped / np.maximum(length, 1.0))


def _toward(tip: int, step_m: float, dimensions: int) -> Actions:
    """Returns the action of moving a connector, as far as it goes."""

    def orders(actions: NDArray[Any], arrays: Arrays) -> dict[str, NDArray[Any]]:
        to_m = arrays["joints_m"][:, tip] + step_m * _shortened(actions)
        n = len(actions)
        return {"to_m": to_m, "connector": np.full(n, tip), "reach": np.ones(n, np.int64)}

    axes = ("x", "y", "z")[:dimensions]
    parts = tuple(f"way along {axis} in a cycle: 1 is {step_m:g} m, the speed limit" for axis in axes)
    return Actions(spaces.Box(-1.0, 1.0, (dimensions,), np.float32), parts, orders)


# What they are rewarded for.


def _measure_reached(before: Arrays, after: Arrays) -> NDArray[Any]:
    return after["is_reached"].astype(float)


def _measure_approach(connector: int, before: Arrays, after: Arrays) -> NDArray[Any]:
    """Meters nearer to the target that was to be reached."""
    was_m = before["target_m"] - before["joints_m"][:, connector]
    is_m = before["target_m"] - after["joints_m"][:, connector]
    return np.asarray(np.sqrt((was_m * was_m).sum(axis=1)) - np.sqrt((is_m * is_m).sum(axis=1)))


def _measure_veto(before: Arrays, after: Arrays) -> NDArray[Any]:
    return (after["veto"] > 0).astype(float)


def _measure_gain(before: Arrays, after: Arrays) -> NDArray[Any]:
    return after["gained_m"].astype(float)


def _measure_time(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.ones(len(after["veto"]))


def _reach_design(setting: Setting) -> Design:
    chain = setting.keys["chains"][0]
    targets = _file_targets(chain)
    dimensions = targets.shape[1]
    connectors = setting.spaces["joints_m"].shape[0]
    task = chain["tasks"][0]
    tip = int(task.get("connector", 0))
    base = connectors - 1 if tip == 0 else 0
    speed_m_s, dt_s = task.get("speed_m_s", 0.5), setting.keys["chain"]["dt_s"]
    reach_m = float(np.abs(targets).max()) * 2.0
    axes = " ".join(("x", "y", "z")[:dimensions])
    bends = [k for k in range(connectors) if k not in (tip, base)]
    features = [
        vector("target", "way from the tip to the target", partial(_offset_of_target, tip), reach_m, axes),
        vector("target_near", "way from the tip to the target", partial(_offset_of_target, tip), 0.1 * reach_m, axes),
        vector("tip", "place of the tip", lambda arrays: arrays["joints_m"][:, tip], reach_m, axes),
        *(
            vector(f"connector_{k}", f"place of connector {k}", partial(_part, "joints_m", k), reach_m, axes)
            for k in bends
        ),
        *_clearances(setting, range(connectors), axes),
        *_own_state(setting),
        scaled(
            "patience_left",
            "share left of the time for this target, after which the next one is due",
            lambda arrays: arrays["patience_left"],
            0,
            1,
        ),
        scaled("targets_reached", "targets reached", lambda arrays: arrays["targets_reached"], 0, len(targets)),
        time_left(),
    ]
    rewards = {
        "target": RewardTerm("1 where a target was reached", 2.0, _measure_reached),
        "approach": RewardTerm("meters nearer to the target", 2.0 / reach_m, partial(_measure_approach, tip)),
        "veto": RewardTerm("1 where a part objected", -0.01, _measure_veto),
        "time": RewardTerm("1 in each cycle", -0.005, _measure_time),
    }
    return Design(
        features,
        _toward(tip, speed_m_s * dt_s, dimensions),
        rewards,
        partial(TargetTracker, targets, round(PATIENCE_S / dt_s), tip),
        lambda arrays: arrays["targets_reached"] >= len(targets),
    )


def _file_targets(chain: Mapping[str, Any]) -> NDArray[np.float64]:
    return np.array(chain["tasks"][0]["targets_m"], dtype=float)


def _in_line_frame(setting_line_m: NDArray[Any], vectors: NDArray[Any], arrays: Arrays) -> NDArray[Any]:
    """Returns vectors in the frame of the corridor: ahead along its middle, and to the left."""
    number = np.rint(arrays["along_m"] / LINE_STEP_M).astype(np.int64)
    return rotated(vectors, -_line_headings(setting_line_m)[number])


def _line_headings(line_m: NDArray[Any]) -> NDArray[np.float64]:
    step_m = np.diff(line_m, axis=0, append=2.0 * line_m[-1:] - line_m[-2:-1])
    return np.arctan2(step_m[:, 1], step_m[:, 0])


def _corridor_design(setting: Setting) -> Design:
    line_m = middle_line(setting.keys["ground"]["corridor"])
    width_m = setting.keys["ground"]["corridor"]["width_m"]
    chain = setting.keys["chains"][0]
    speed_m_s = chain["tasks"][0]["speed_m_s"]
    step_m = speed_m_s * setting.keys["chain"]["dt_s"]
    last = len(line_m) - 1
    length_m = last * LINE_STEP_M
    # Of a shorter chain, all.
    connectors = setting.spaces["joints_m"].shape[0]
    watched = min(WATCHED, connectors)

    def own(vectors: NDArray[Any], arrays: Arrays) -> NDArray[Any]:
        return _in_line_frame(line_m, vectors, arrays)

    def own_part(name: str, number: int, arrays: Arrays) -> NDArray[Any]:
        return own(_part(name, number, arrays), arrays)

    def ahead(by_m: float, arrays: Arrays) -> NDArray[Any]:
        number = np.minimum(np.rint((arrays["along_m"] + by_m) / LINE_STEP_M).astype(np.int64), last)
        return own(line_m[number] - arrays["joints_m"][:, 0], arrays)

    def rod(k: int, arrays: Arrays) -> NDArray[Any]:
        return own(arrays["joints_m"][:, k] - arrays["joints_m"][:, k + 1], arrays)

    features = [
        *(
            vector(
                f"ahead_{k}",
                f"way to the corridor's middle {by_m:g} m ahead",
                partial(ahead, by_m),
                by_m + 1,
                "ahead left",
            )
            for k, by_m in enumerate(AHEAD_M)
        ),
        *(
            vector(f"rod_{k}", f"rod {k}, forward", partial(rod, k), 1.0, "ahead left")
            for k in range(min(WATCHED, connectors - 1))
        ),
    ]
    for k in range(watched):
        look_m = setting.spaces["gap_m"].high
        gap = scaled(f"gap_{k}", f"gap of connector {k} in m", partial(_part, "gap_m", k), 0, look_m)
        meaning = f"way from connector {k} to the nearest wall"
        nearest = vector(f"nearest_{k}", meaning, partial(own_part, "nearest_m", k), width_m, "ahead left")
        features += [gap, nearest]
    features += [
        *_own_state(setting),
        scaled("along", "way along the corridor in m", lambda arrays: arrays["along_m"], 0, length_m),
        time_left(),
    ]
    headings = _line_headings(line_m)
    world_frame = _toward(0, step_m, 2)

    def orders(actions: NDArray[Any], arrays: Arrays) -> dict[str, NDArray[Any]]:
        number = np.rint(arrays["along_m"] / LINE_STEP_M).astype(np.int64)
        # Long ones are shortened before they are turned: after it, their direction would change.
        return world_frame.orders(rotated(_shortened(actions), headings[number]), arrays)

    parts = tuple(f"way {axis} in a cycle: 1 is {step_m:g} m, the speed limit" for axis in ("ahead", "to the left"))
    rewards = {
        "gain": RewardTerm("meters gained along the corridor", 0.2, _measure_gain),
        "veto": RewardTerm("1 where a part objected", -0.01, _measure_veto),
        "time": RewardTerm("1 in each cycle", -0.005, _measure_time),
    }
    return Design(
        features,
        Actions(world_frame.space, parts, orders),
        rewards,
        partial(LineTracker, line_m, setting.keys["chain"]["dt_s"]),
        lambda arrays: arrays["along_m"] >= length_m - 1.0,
    )


def _targets(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    return float(tracked["targets_reached"].sum())


def _speed(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    return float(tracked["speed_m_s"].max())


TARGETS = Score("targets", "targets that were visited", True, _targets)

TASKS = [
    Task(
        name="ReachInClutter",
        version=0,
        meaning="The tip of a chain with a fixed base visits places among discs that stand and that move.",
        file="reach-in-clutter.toml",
        control={"chains.0.tasks": [{"kind": "external", "speed_m_s": 0.5}]},
        design=_reach_design,
        score=TARGETS,
        methods={"targets": {}, "targets-unplanned": {"chains.0.tasks.0.planner": "none"}},
        is_single=True,
    ),
    Task(
        name="WindingCorridor",
        version=0,
        meaning="A leader takes a chain of robots through a corridor that turns back and forth, as fast as possible.",
        file="winding-corridor.toml",
        control={"chains.0.tasks": [{"kind": "external", "speed_m_s": 0.5}]},
        design=_corridor_design,
        score=Score("speed", "mean speed along the corridor in m/s", True, _speed),
        methods={"navigate": {}},
        is_single=True,
    ),
    Task(
        name="RailArm",
        version=0,
        meaning="The tool of an arm on a rail visits places around pillars, a shelf and a cart.",
        file="rail-arm.toml",
        control={"chains.0.tasks": [{"kind": "external", "connector": 4, "speed_m_s": 0.4}]},
        design=_reach_design,
        score=TARGETS,
        methods={"targets": {}, "targets-unplanned": {"chains.0.tasks.0.planner": "none"}},
        is_single=True,
    ),
]
