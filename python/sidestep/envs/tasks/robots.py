"""Tasks of the world ``robots``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ._features import Arrays, Feature, one_hot, scaled
from ._task import Actions, Design, RewardTerm, Score, Setting, Task, time_left

FORWARD = 0
#: Numbers of headings, counterclockwise from east, as steps.
STEPS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
#: The words by which sensors tell of bodies that move by themselves.
MOVERS = ("robot", "person")


# What robots observe.


def beams(setting: Setting, sensor: str) -> list[Feature]:
    """Returns two numbers for each beam of a sensor: how near something is, and whether that moves by itself."""
    classes = setting.spaces[f"{sensor}_class"]
    reports = setting.spaces[f"{sensor}_report"]
    class_words, report_words = classes.choices or [], reports.choices or []
    nearness = np.linspace(1.0, -1.0, len(class_words), dtype=np.float32)
    motion = np.array([_motion(word) for word in report_words], np.float32)
    count = classes.shape[0]
    distances = f"1 {class_words[0]}, -1 {class_words[-1]}"
    return [
        Feature(
            f"{sensor}_nearness",
            tuple(f"nearness of what beam {k} reports, counterclockwise from ahead: {distances}" for k in range(count)),
            lambda arrays: nearness[arrays[classes.name]],
        ),
        Feature(
            f"{sensor}_motion",
            tuple(f"what beam {k} reports: 1 what moves by itself, 0 what does not, -1 nothing" for k in range(count)),
            lambda arrays: motion[arrays[reports.name]],
        ),
    ]


def _motion(word: str) -> float:
    if word == "nothing":
        return -1.0
    return 1.0 if word in MOVERS else 0.0


def touch(setting: Setting) -> list[Feature]:
    """Returns the side on which the last action was stopped, and whether by something that moves by itself."""
    movers = [(word in MOVERS) for word in setting.spaces["contact"].choices or []]
    table = np.array(movers, np.float32)
    part = "1 where something that moves by itself stopped its last action"
    return [
        one_hot("contact_side", setting.spaces["contact_side"], ["front", "left", "back", "right"]),
        Feature("contact_motion", (part,), lambda arrays: table[arrays["contact"]]),
    ]


def goal(setting: Setting) -> list[Feature]:
    """Returns where a robot's goal is, and how far."""
    longest_side = int(setting.spaces["at_boxes"].high) + 1
    far_boxes = 2 * longest_side

    def direction(arrays: Arrays) -> NDArray[Any]:
        offset = arrays["goal_boxes"] - arrays["at_boxes"]
        own = in_own_frame(offset, arrays["heading"]) / longest_side
        return np.where(arrays["goal_boxes"][:, :1] < 0, 0.0, own)

    def steps(arrays: Arrays) -> NDArray[Any]:
        return np.where(arrays["goal_steps"] < 0, far_boxes, arrays["goal_steps"])

    sides = ("ahead", "to the left", "behind", "to the right")
    nearer = "whether the box {side} is nearer to its goal: 1 by a step, -1 farther, 0 where it does not fit"
    return [
        Feature("goal_nearer", tuple(nearer.format(side=side) for side in sides), lambda arrays: arrays["goal_nearer"]),
        Feature(
            "goal_direction",
            tuple(f"boxes to its goal {axis}, in units of {longest_side}" for axis in ("ahead", "to the left")),
            direction,
        ),
        scaled("goal_steps", "boxes of the shortest path to its goal past walls", steps, 0, far_boxes),
        scaled("busy_cycles", "cycles before it can act", lambda arrays: arrays["busy_cycles"], 0, 5),
    ]


def in_own_frame(offset: NDArray[Any], heading: NDArray[Any]) -> NDArray[Any]:
    """Returns offsets in columns and rows as boxes ahead and to the left."""
    ahead = STEPS[heading]
    # Column by column: NumPy's sums over an axis of two cost ten times as much.
    forward = ahead[:, 0] * offset[:, 0] + ahead[:, 1] * offset[:, 1]
    left = ahead[:, 0] * offset[:, 1] - ahead[:, 1] * offset[:, 0]
    return np.stack([forward, left], axis=1)


# What they may do.


def moves(setting: Setting, mask: Any) -> Actions:
    """Returns the actions of a robot, one each cycle."""
    words = next(space for space in setting.team.action_spaces if space.name == "action").choices or []
    return Actions(
        spaces.Discrete(len(words)),
        tuple(words),
        lambda actions, arrays: {"action": actions},
        partial(mask, len(words)),
    )


def mask_of_goals(choices: int, arrays: Arrays) -> NDArray[np.bool_]:
    """Returns which actions make sense: forward only where the body fits, and all only for robots that can act."""
    mask = np.ones((len(arrays["heading"]), choices), bool)
    mask[:, FORWARD] = (arrays["goal_nearer"][:, 0] != 0) | (arrays["goal_steps"] < 0)
    mask[(arrays["due"] == 0) | (arrays["busy_cycles"] > 0), : choices - 1] = False
    return mask


def mask_of_contacts(choices: int, arrays: Arrays) -> NDArray[np.bool_]:
    """Returns which actions make sense: forward not where a wall has just stopped it."""
    mask = np.ones((len(arrays["heading"]), choices), bool)
    mask[:, FORWARD] = ~((arrays["contact_side"] == 1) & (arrays["contact"] == 2))
    mask[arrays["due"] == 0, : choices - 1] = False
    return mask


# What they are rewarded for.


#: A rectangle of boxes: column, row, width, height.
Region = tuple[int, int, int, int]


def _inside(boxes: NDArray[Any], region: Region) -> NDArray[np.bool_]:
    first_col, first_row, width, height = region
    cols, rows = boxes[:, 0], boxes[:, 1]
    is_in_cols = (cols >= first_col) & (cols < first_col + width)
    return np.asarray(is_in_cols & (rows >= first_row) & (rows < first_row + height))


def _same_box(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray((a[:, 0] == b[:, 0]) & (a[:, 1] == b[:, 1]))


def _has_new_goal(before: Arrays, after: Arrays) -> NDArray[np.bool_]:
    return ~_same_box(before["goal_boxes"], after["goal_boxes"])


def _reached(regions: list[Region], before: Arrays, after: Arrays) -> NDArray[np.bool_]:
    """Returns who has come to its goal: to the very box, or into the region of its trip and now has a goal in another one."""
    old, new, at = before["goal_boxes"], after["goal_boxes"], after["at_boxes"]
    is_there = _same_box(at, old)
    for region in regions:
        is_there |= _inside(at, region) & _inside(old, region) & ~_inside(new, region)
    return np.asarray(is_there & ~_same_box(old, new) & (old[:, 0] >= 0))


def _measure_goal(regions: list[Region], before: Arrays, after: Arrays) -> NDArray[Any]:
    return _reached(regions, before, after).astype(float)


def _measure_progress(before: Arrays, after: Arrays) -> NDArray[Any]:
    known = (before["goal_steps"] >= 0) & (after["goal_steps"] >= 0)
    # The steps to another goal say nothing of the way to this one.
    same = known & ~_has_new_goal(before, after)
    nearer = before["goal_steps"] - after["goal_steps"]
    return np.where(same, np.clip(nearer, -2, 2), 0.0)


def _measure_contact(before: Arrays, after: Arrays) -> NDArray[Any]:
    # Where it does not act, the contact of its last action still stands.
    acts = before["due"] > 0
    if "busy_cycles" in before:
        acts = acts & (before["busy_cycles"] == 0)
    return ((after["contact"] > 0) & acts).astype(float)


def _measure_time(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.ones(len(after["heading"]))


def _measure_first_visit(before: Arrays, after: Arrays) -> NDArray[Any]:
    return after["first_visit"].astype(float)


def _measure_moved(before: Arrays, after: Arrays) -> NDArray[Any]:
    return np.asarray(np.abs(after["at_boxes"] - before["at_boxes"]).sum(axis=1), float)


def _goal_rewards(regions: list[Region]) -> dict[str, RewardTerm]:
    return {
        "goal": RewardTerm("1 where a goal was reached", 1.0, partial(_measure_goal, regions)),
        "progress": RewardTerm("boxes nearer to the goal, along the shortest path", 0.05, _measure_progress),
        "contact": RewardTerm("1 where something stopped the last action", -0.05, _measure_contact),
        "time": RewardTerm("1 in each cycle", -0.01, _measure_time),
    }


def _trips(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    return float(metrics["trips"])


def _finished(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    return float(metrics["tasks_finished"])


TRIPS = Score("trips", "trips of all robots", True, _trips)
DELIVERIES = Score("deliveries", "tasks that were finished", True, _finished)


def _goal_design(sensor: str, setting: Setting) -> Design:
    features = [*beams(setting, sensor), *touch(setting), *goal(setting), time_left()]
    behaviour = setting.keys["robots"][0].get("behaviour", {})
    # A trip of a shuttle ends anywhere in its region, an errand in its box.
    regions = [tuple(behaviour[end]) for end in ("a", "b")] if behaviour.get("kind") == "shuttle" else []
    return Design(features, moves(setting, mask_of_goals), _goal_rewards(regions))


# Exploration.


class VisitTracker:
    """The boxes that each robot has visited."""

    #: The side of the map of visits around a robot, in boxes: an odd number.
    SIDE = 9

    def __init__(self, side_boxes: int, rows: int) -> None:
        # A margin on all sides, so that windows need no bounds.
        self._margin = self.SIDE // 2
        self._width = side_boxes + 2 * self._margin
        # One map after the other, each row by row.
        self._visits = np.zeros(rows * self._width**2, np.float32)
        self._first = np.arange(rows) * self._width**2
        reach = np.arange(self._margin, -self._margin - 1, -1)
        ahead, left = (grid.ravel() for grid in np.meshgrid(reach, reach, indexing="ij"))
        # For each heading the offsets of the window's boxes, from ahead and left to behind and right.
        self._offsets = np.array(
            [(ahead * row + left * col) * self._width + ahead * col - left * row for col, row in STEPS.tolist()]
        )
        self.arrays = {
            "visits": np.zeros((rows, self.SIDE**2), np.float32),
            "first_visit": np.zeros(rows, bool),
        }

    def restart(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Forgets all visits but that of the start."""
        self._visits.reshape(len(mask), -1)[mask] = 0.0
        self._visit(mask, observed)
        self.arrays["first_visit"][mask] = False

    def advance(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        """Adds the present boxes."""
        self._visit(mask, observed)

    def _visit(self, mask: NDArray[np.bool_], observed: Arrays) -> None:
        col, row = observed["at_boxes"].T
        here = self._first + (row + self._margin) * self._width + col + self._margin
        rows = np.flatnonzero(mask)
        self.arrays["first_visit"][rows] = self._visits[here[rows]] == 0.0
        self._visits[here[rows]] = 1.0
        boxes = here[:, None] + self._offsets[observed["heading"]]
        np.take(self._visits, boxes, out=self.arrays["visits"], mode="clip")


def _exploration_design(setting: Setting) -> Design:
    side = int(setting.spaces["at_boxes"].high) + 1
    half = VisitTracker.SIDE // 2
    parts = tuple(
        f"1 if it has visited the box {ahead} ahead and {left} to the left, else 0"
        for ahead in range(half, -half - 1, -1)
        for left in range(half, -half - 1, -1)
    )
    features = [
        *beams(setting, "sonar-8"),
        *touch(setting),
        Feature("visits", parts, lambda arrays: arrays["visits"]),
        time_left(),
    ]
    rewards = {
        "first_visit": RewardTerm("1 for a box that it had not visited", 0.2, _measure_first_visit),
        "contact": RewardTerm("1 where something stopped the last action", -0.05, _measure_contact),
        "time": RewardTerm("1 in each cycle", -0.02, _measure_time),
    }
    return Design(features, moves(setting, mask_of_contacts), rewards, partial(VisitTracker, side))


def _coverage(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    return 100.0 * float(metrics["coverage"])


# Communication.

#: The words of a robot's own choice.
SYMBOLS = 4
#: The nearest senders that a robot observes.
MAX_SENDERS = 4


def _words(actions: NDArray[Any], arrays: Arrays) -> dict[str, NDArray[Any]]:
    """Returns the orders of actions and symbols: the broadcast word holds the symbol, the action, the heading and the place."""
    action, symbol = actions[:, 0].astype(np.int64), actions[:, 1].astype(np.int64)
    col, row = arrays["at_boxes"].astype(np.int64).T
    word = symbol | action << 2 | arrays["heading"].astype(np.int64) << 4 | col << 8 | row << 24
    return {"action": action, "broadcast": word}


def _heard(range_boxes: float, arrays: Arrays) -> NDArray[Any]:
    """Returns what the nearest senders tell: for each of them nine numbers, all 0 where there is none."""
    word = arrays["heard_word"]
    is_heard = arrays["heard_from"] >= 0
    place = np.stack([word >> 8 & 0xFFFF, word >> 24 & 0xFFFF], axis=2)
    offset = (place - arrays["at_boxes"][:, None, :]) * is_heard[:, :, None]
    distance = np.where(is_heard, np.abs(offset).sum(axis=2), np.iinfo(np.int64).max)
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :MAX_SENDERS]
    rows = np.arange(len(word))[:, None]
    heading = np.broadcast_to(arrays["heading"][:, None], nearest.shape)
    own = in_own_frame(offset[rows, nearest].reshape(-1, 2), heading.reshape(-1)).reshape(*nearest.shape, 2)
    chosen = word[rows, nearest]
    turn = ((chosen >> 4 & 3) - heading) % 4
    parts = [
        np.clip(own / range_boxes, -1.0, 1.0),
        np.array([1.0, 0.0, -1.0, 0.0])[turn][:, :, None],
        np.array([0.0, 1.0, 0.0, -1.0])[turn][:, :, None],
        ((chosen >> 2 & 3) == FORWARD)[:, :, None],
        np.eye(SYMBOLS)[chosen & (SYMBOLS - 1)],
    ]
    told = np.concatenate(parts, axis=2) * is_heard[rows, nearest][:, :, None]
    # Where there are fewer robots, the places of the others stay empty.
    missing = MAX_SENDERS - told.shape[1]
    return np.pad(told, ((0, 0), (0, missing), (0, 0))).reshape(len(word), -1)


def _radio_design(setting: Setting) -> Design:
    radio = setting.keys["radio"]
    range_boxes = radio["range_m"] / setting.keys["map"]["box_size_m"]
    told = [
        f"boxes ahead, in units of the range of {range_boxes:g}",
        "boxes to the left, the same",
        "cosine of its heading, seen from here",
        "sine of its heading, seen from here",
        "1 if it goes forward",
        *(f"1 if its symbol is {symbol}" for symbol in range(SYMBOLS)),
    ]
    parts = tuple(f"sender {k} from the nearest: {part}" for k in range(MAX_SENDERS) for part in told)
    features = [
        *beams(setting, "bumper-4"),
        *touch(setting),
        Feature("heard", parts, partial(_heard, range_boxes)),
        time_left(),
    ]
    words = next(space for space in setting.team.action_spaces if space.name == "action").choices or []
    actions = Actions(
        spaces.MultiDiscrete([len(words), SYMBOLS]),
        (*words, *(f"symbol {symbol}" for symbol in range(SYMBOLS))),
        _words,
        partial(_radio_mask, len(words)),
    )
    rewards = {
        "moved": RewardTerm("boxes moved", 0.1, _measure_moved),
        "contact": RewardTerm("1 where something stopped the last action", -0.6, _measure_contact),
        "time": RewardTerm("1 in each cycle", -0.01, _measure_time),
    }
    return Design(features, actions, rewards)


def _radio_mask(choices: int, arrays: Arrays) -> NDArray[np.bool_]:
    actions = mask_of_contacts(choices, arrays)
    return np.hstack([actions, np.ones((len(actions), SYMBOLS), bool)])


#: A contact costs as much as this way brings.
CONTACT_M = 1.5


def _way_less_contacts(metrics: Mapping[str, Any], tracked: Arrays) -> float:
    return float(metrics["distance_m"]) - CONTACT_M * float(metrics["contacts"])


TASKS = [
    Task(
        name="CorridorCounterflow",
        version=0,
        meaning="Robots go to and fro in one corridor, where they meet: as many trips as possible.",
        file="corridor-counterflow.toml",
        control={"robots.0.planner": {"method": "external"}},
        design=partial(_goal_design, "sonar-8"),
        score=TRIPS,
        methods={
            "pibt": {},
            "lacam": {"robots.0.planner": {"method": "lacam", "window": 10}},
            "random": {"robots.0.planner": None, "robots.0.behaviour": {"kind": "random"}},
            "shuttle": {"robots.0.planner": None},
        },
    ),
    Task(
        name="OfficeDeliveries",
        version=0,
        meaning="Robots carry things between the rooms of an office, among people and doors: as many deliveries as possible.",
        file="office-deliveries.toml",
        control={"robots.0.planner": {"method": "external"}},
        design=partial(_goal_design, "sonar-8"),
        score=DELIVERIES,
        methods={"pibt": {}, "lacam": {"robots.0.planner": {"method": "lacam", "window": 10}}},
    ),
    Task(
        name="WarehouseStream",
        version=0,
        meaning="Robots fetch goods from shelves without end: as many deliveries as possible.",
        file="warehouse-stream.toml",
        control={"robots.0.planner": {"method": "external"}},
        design=partial(_goal_design, "sonar-8"),
        score=DELIVERIES,
        methods={"pibt": {}, "lacam": {"robots.0.planner": {"method": "lacam", "window": 10}}},
    ),
    Task(
        name="Exploration",
        version=0,
        meaning="A robot with sonars that err covers as much of a floor as it can.",
        file="exploration.toml",
        control={"robots.0.behaviour": {"kind": "external"}},
        design=_exploration_design,
        score=Score("coverage", "share of the floor that was covered, in percent", True, _coverage),
        methods={"wander": {}, "random": {"robots.0.behaviour": {"kind": "random"}}},
        is_single=True,
    ),
    Task(
        name="RadioHall",
        version=0,
        meaning="Robots with bumpers alone roam a hall and tell each other over the radio where they go: far, without contacts.",
        file="radio-hall.toml",
        control={"robots.0.behaviour": {"kind": "external"}},
        design=_radio_design,
        score=Score(
            "way_less_contacts",
            f"way of all robots in m, less {CONTACT_M:g} m for each contact",
            True,
            _way_less_contacts,
        ),
        methods={
            "announce": {},
            "wander": {"robots.0.behaviour": {"kind": "wander", "turn_every": 20}},
            "random": {"robots.0.behaviour": {"kind": "random"}},
        },
    ),
]
