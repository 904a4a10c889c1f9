"""Tasks of the world ``airspace``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ._features import Arrays, Feature, rotated, scaled, vector
from ._task import Actions, Design, RewardTerm, Score, Setting, Task, time_left

#: The nearest others that an airplane observes.
MAX_NEIGHBORS = 6
#: Places that are farther are as far.
FAR_M = 10_000.0
#: Times that are longer are as long.
LONG_S = 120.0
#: A way-point beyond it stands for none, of an airplane that keeps a heading.
NO_WAY_POINT_M = 1e11


def _in_own_frame(vectors: NDArray[Any], arrays: Arrays) -> NDArray[Any]:
    """Returns vectors east and north as ahead and to the left."""
    heading_rad = arrays["heading_rad"]
    return rotated(vectors, -(heading_rad[:, None] if vectors.ndim == 3 else heading_rad))


def _way_point(arrays: Arrays) -> NDArray[Any]:
    return _in_own_frame(arrays["way_point_m"], arrays)


def _neighbors(arrays: Arrays) -> NDArray[Any]:
    """Returns ten numbers for each of the nearest others; all are 0 where there is none."""
    chosen = {name: arrays[name][:, :MAX_NEIGHBORS] for name in arrays if name.startswith("neighbor_")}
    is_there = chosen["neighbor_id"] >= 0
    own = _in_own_frame(chosen["neighbor_place_m"], arrays)
    distance_m = np.sqrt((own * own).sum(axis=2))
    turn_rad = chosen["neighbor_heading_rad"] - arrays["heading_rad"][:, None]
    direction = np.stack([np.cos(turn_rad), np.sin(turn_rad)], axis=2)
    velocity_m_s = chosen["neighbor_speed_m_s"][:, :, None] * direction
    velocity_m_s[:, :, 0] -= arrays["speed_m_s"][:, None]
    closing = (own * velocity_m_s).sum(axis=2)
    speed_2 = np.maximum((velocity_m_s * velocity_m_s).sum(axis=2), 1e-9)
    approach_s = np.clip(-closing / speed_2, 0.0, LONG_S)
    nearest = own + approach_s[:, :, None] * velocity_m_s
    separation_m = np.maximum(chosen["neighbor_separation_m"], 1.0)
    miss = np.sqrt((nearest * nearest).sum(axis=2)) / separation_m
    parts = [
        np.ones_like(distance_m),
        own[:, :, 0] / np.maximum(distance_m, FAR_M),
        own[:, :, 1] / np.maximum(distance_m, FAR_M),
        direction[:, :, 0],
        direction[:, :, 1],
        np.clip(separation_m / np.maximum(distance_m, 1.0), 0.0, 1.0),
        1.0 - approach_s / LONG_S,
        np.clip(1.0 - miss / 2.0, -1.0, 1.0),
        np.clip(chosen["neighbor_above_m"] / 600.0, -1.0, 1.0),
        chosen["neighbor_minds"],
    ]
    told = np.stack(parts, axis=2) * is_there[:, :, None]
    return told.reshape(len(is_there), -1)


def _features(setting: Setting) -> list[Feature]:
    high = setting.spaces["turn_rate_rad_s"].high
    told = (
        "1 where there is one",
        f"place ahead, in units of {FAR_M:g} m or its distance if that is more",
        "place to the left, the same",
        "cosine of its heading, seen from here",
        "sine of its heading, seen from here",
        "separation over distance, 1 at most",
        f"1 if the closest approach is now, 0 if it is in {LONG_S:g} s or later",
        "1 for a closest approach of 0, 0 at twice the separation, -1 from four times on",
        "how far it is above, in units of 600 m",
        "1 if it minds others, else 0",
    )
    parts = tuple(f"neighbor {k} from the nearest: {part}" for k in range(MAX_NEIGHBORS) for part in told)
    speed = scaled("speed", "airspeed in m/s", lambda arrays: arrays["speed_m_s"], 0.0, 100.0)
    return [
        vector("way_point", "way to the next way-point", _way_point, FAR_M, "ahead left"),
        vector("way_point_direction", "way to the next way-point", _way_point, 1.0, "ahead left"),
        scaled("turn_rate", "turn rate in rad/s", lambda arrays: arrays["turn_rate_rad_s"], -high, high),
        speed,
        scaled("delay", "delay in s", lambda arrays: arrays["delay_s"], 0.0, 200.0),
        Feature("neighbors", parts, _neighbors),
        time_left(),
    ]


def _actions(setting: Setting) -> Actions:
    """Returns the choice of the action that is tried first; the shield goes on with those that turn alike."""
    ranking = next(space for space in setting.team.action_spaces if space.name == "ranking")
    count = ranking.shape[0]
    to_way_point = count - 1
    numbers = np.arange(count)
    order = []
    for first in range(count):
        # Straight on is in the middle of the turns, and nearest to the way to the way-point.
        near = (to_way_point - 1) / 2.0 if first == to_way_point else float(first)
        cost = np.abs(numbers - near)
        cost[to_way_point] = count
        cost[first] = -1.0
        order.append(np.argsort(cost, kind="stable"))
    table = np.array(order)

    def orders(actions: NDArray[Any], arrays: Arrays) -> dict[str, NDArray[Any]]:
        return {"ranking": table[actions]}

    _, _, words = ranking.meaning.partition("; ")
    parts = tuple(word.split(" ", 1)[1] for word in words.split("; "))
    return Actions(spaces.Discrete(count), parts, orders, partial(_mask, count))


def _mask(count: int, arrays: Arrays) -> NDArray[np.bool_]:
    """Returns which actions make sense: an airplane that does not decide has only the way to its way-point."""
    mask = np.ones((len(arrays["due"]), count), bool)
    mask[arrays["due"] == 0, : count - 1] = False
    return mask


def _acts(before: Arrays, after: Arrays) -> NDArray[np.bool_]:
    return np.asarray((before["due"] > 0) & (after["due"] > 0))


def _has_arrived(before: Arrays, after: Arrays) -> NDArray[np.bool_]:
    return np.asarray((before["due"] > 0) & (after["due"] == 0))


def _measure_arrival(before: Arrays, after: Arrays) -> NDArray[Any]:
    return _has_arrived(before, after).astype(float)


def _measure_delay(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.where(_acts(before, after), after["delay_s"] - before["delay_s"], 0.0)


def _measure_near(before: Arrays, after: Arrays) -> NDArray[Any]:
    distance_m = np.sqrt((after["neighbor_place_m"] * after["neighbor_place_m"]).sum(axis=2))
    is_near = (after["neighbor_id"] >= 0) & (distance_m < after["neighbor_separation_m"])
    return np.asarray(is_near.any(axis=1), float)


def _measure_progress(before: Arrays, after: Arrays) -> NDArray[Any]:
    """Kilometers nearer to the way-point."""
    was_m = np.sqrt((before["way_point_m"] * before["way_point_m"]).sum(axis=1))
    is_m = np.sqrt((after["way_point_m"] * after["way_point_m"]).sum(axis=1))
    same = before["way_points_left"] == after["way_points_left"]
    known = _acts(before, after) & same & (was_m < NO_WAY_POINT_M) & (is_m < NO_WAY_POINT_M)
    return np.where(known, (was_m - is_m) / 1000.0, 0.0)


def _measure_time(before: Arrays, after: Arrays) -> NDArray[Any]:
    return (before["due"] > 0).astype(float)


def _design(setting: Setting) -> Design:
    rewards = {
        "arrival": RewardTerm("1 where an airplane has arrived", 1.0, _measure_arrival),
        "progress": RewardTerm("kilometers nearer to the next way-point", 0.05, _measure_progress),
        "delay": RewardTerm("seconds of further delay at the arrival", -0.02, _measure_delay),
        "separation": RewardTerm("1 where another one is nearer than the separation", -1.0, _measure_near),
        "time": RewardTerm("1 in each cycle in the air", -0.005, _measure_time),
    }
    return Design(_features(setting), _actions(setting), rewards, is_active=lambda arrays: arrays["due"] > 0)


#: A loss of separation counts as much as so much more delay, in percent.
LOSS_PERCENT = 10.0


def _cost(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    delay_percent = metrics["mean_delay_percent"]
    missing = metrics["airplanes"] - metrics["arrived"]
    # One that has not arrived counts as one that takes twice as long.
    share_missing = missing / metrics["airplanes"]
    arrived_percent = 0.0 if delay_percent is None else float(delay_percent)
    losses = float(metrics["losses_of_separation"])
    return float(arrived_percent * (1.0 - share_missing) + 100.0 * share_missing + LOSS_PERCENT * losses)


DELAY = Score(
    "delay",
    f"mean delay in percent, with 100 % for those that do not arrive, and {LOSS_PERCENT:g} % more for each loss of separation",
    False,
    _cost,
)
METHODS: dict[str, dict[str, Any]] = {
    "pc": {},
    "mvp": {"airspace.method": "mvp"},
    "orca": {"airspace.method": "orca"},
    "straight": {"airspace.method": "none"},
}
CONTROL = {"airspace.method": "external"}


def _flight(name: str, file: str, meaning: str) -> Task:
    return Task(name, 0, meaning, file, CONTROL, _design, DELAY, METHODS)


TASKS = [
    _flight(
        "Superconflict",
        "superconflict.toml",
        "Airplanes on a circle are each bound for the opposite point; a shield keeps them apart: little delay.",
    ),
    _flight(
        "CrossingStreams",
        "crossing-streams.toml",
        "Streams of airplanes cross, and a shield keeps them apart: little delay.",
    ),
    _flight(
        "MixedSpeeds", "mixed-speeds.toml", "Airplanes of different speeds meet others that avoid nobody: little delay."
    ),
    _flight(
        "NoisySurveillance",
        "noisy-surveillance.toml",
        "Airplanes without a shield see each other by late reports that err: no losses of separation, little delay.",
    ),
]
