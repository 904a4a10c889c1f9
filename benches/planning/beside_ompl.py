#!/usr/bin/env python3
"""Plans of arms: Sidestep beside RRT-Connect of OMPL.

    pip install ompl example-robot-data numpy
    python benches/planning/beside_ompl.py [--problems 100] [--arms ur5 panda iiwa14] [--seconds 3]

Each problem is an arm, a scene of balls, turned boxes and meshes within its reach, and two postures that touch nothing
and between which the straight path of the joints is blocked. Both planners get the same postures and ask the same
functions of this repository whether a posture, and whether a straight path between two, is free: hulls of the links'
meshes, or their primitives, against the obstacles and each other, by the crate parry3d-f64. So what differs is the
search alone. OMPL plans with the defaults of its Python package (RRT-Connect, then its path simplification), up to
`--seconds`; Sidestep with those of its runs, whose search ends after a number of samples. Times are CPU seconds of one
thread, of OMPL those of the search itself and of the checks: what the crossing from C++ to Python costs is taken out,
by measuring checks inside and outside of the module. The table counts the problems that any planner solves: of others
nobody knows whether there is a path. Both paths are judged by checks of many postures on them.
"""

import argparse
import math
import random
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ompl import base, geometric, util

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
MODULE = "sidestep_bench_planning"
#: Parts of a scene.
BALLS, BOXES, MESHES = 4, 4, 3
#: Distances of parts from the base, as a share of the arm's reach, and their sizes, m.
NEAREST, FARTHEST = 0.3, 0.9
SMALLEST_M, LARGEST_M = 0.05, 0.15
#: Largest joint value that is drawn where a joint has no limit, rad.
HALF_TURN = math.pi
#: Step between two postures of a path that is judged, rad or m.
JUDGED_STEP = 2e-3


@dataclass
class Arm:
    """An arm of the comparison: its files, its tip, and its reach in m."""

    urdf: Path
    tip: str
    srdf: Path | None
    reach_m: float


def models():
    """Returns the folder of arms of the package example-robot-data."""
    return Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots"


def copy_meshes(arm, folder):
    """Copies the meshes of an arm beside the scenes, where its model looks for them."""
    description = arm.urdf.parent.parent
    if description.parent == models():
        place = folder / "example-robot-data/robots" / description.name
        shutil.copytree(description / "meshes", place / "meshes", ignore=shutil.ignore_patterns("visual"))


def arms(shared):
    """Returns the arms by name: of the package example-robot-data, and of `../shared/data`."""
    ur = models() / "ur_description"
    panda = models() / "panda_description"
    return {
        "ur5": Arm(ur / "urdf/ur5_robot.urdf", "tool0", ur / "srdf/ur5.srdf", 0.95),
        "panda": Arm(panda / "urdf/panda.urdf", "panda_hand", panda / "srdf/panda.srdf", 0.95),
        "iiwa14": Arm(shared / "iiwa14_primitive_collision.urdf", "iiwa_link_7", None, 1.2),
    }


# Scenes


@dataclass
class Scene:
    """Obstacles: balls (center, radius), boxes (center, half extents, cosine and sine), meshes (center, corners, radius)."""

    balls: list
    boxes: list
    meshes: list


def place(draw, reach_m):
    """Returns a random place around the base, above the floor."""
    distance = reach_m * draw.uniform(NEAREST, FARTHEST)
    turn = draw.uniform(-math.pi, math.pi)
    rise = draw.uniform(-0.1, 0.45) * math.pi
    return [
        distance * math.cos(rise) * math.cos(turn),
        distance * math.cos(rise) * math.sin(turn),
        distance * math.sin(rise) + 0.2 * reach_m,
    ]


def scene(draw, reach_m):
    """Returns a random scene."""
    size = lambda: draw.uniform(SMALLEST_M, LARGEST_M)
    balls = [(place(draw, reach_m), size()) for _ in range(BALLS)]
    boxes = []
    for _ in range(BOXES):
        turn = draw.uniform(0.0, math.pi)
        boxes.append((place(draw, reach_m), [size() for _ in range(3)], [math.cos(turn), math.sin(turn)]))
    meshes = []
    for _ in range(MESHES):
        radius = size()
        corners = [[x * draw.uniform(0.6, 1.0) * radius for x in corner] for corner in ICOSAHEDRON]
        meshes.append((place(draw, reach_m), corners, radius))
    return Scene(balls, boxes, meshes)


def icosahedron():
    """Returns corners on the unit sphere, and the faces as triples of them."""
    golden = (1.0 + math.sqrt(5.0)) / 2.0
    norm = math.hypot(1.0, golden)
    corners = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            corners += [[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]
    corners = [[x / norm for x in corner] for corner in corners]
    edge = min(math.dist(corners[0], other) for other in corners[1:]) * 1.01
    near = lambda *abc: all(math.dist(corners[i], corners[j]) < edge for i in abc for j in abc)
    count = range(len(corners))
    faces = [(i, j, k) for i in count for j in count for k in count if i < j < k and near(i, j, k)]
    return corners, faces


ICOSAHEDRON, FACES = icosahedron()


def write_model(arm, made, folder):
    """Writes the arm's URDF with the meshes of a scene as links that float, and returns its path."""
    text = Path(arm.urdf).read_text(encoding="utf-8")
    root = re.search(r'<link\s+name="([^"]+)"', text).group(1)
    extra = []
    for number, (center, corners, _) in enumerate(made.meshes):
        path = folder / f"mesh{number}.stl"
        lines = ["solid mesh"]
        for face in FACES:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(repr(x) for x in corners[i]) for i in face]
            lines += ["endloop", "endfacet"]
        path.write_text("\n".join([*lines, "endsolid mesh"]), encoding="utf-8")
        at = " ".join(repr(x) for x in center)
        extra.append(
            f'<link name="mesh{number}"><collision><geometry><mesh filename="{path}"/></geometry></collision></link>'
            f'<joint name="float{number}" type="floating"><parent link="{root}"/>'
            f'<child link="mesh{number}"/><origin xyz="{at}"/></joint>'
        )
    path = folder / "scene.urdf"
    path.write_text(text.replace("</robot>", "".join(extra) + "</robot>"), encoding="utf-8")
    return path


# Problems


@dataclass
class Problem:
    """A scene with an arm in it, as the module holds it, and two postures of that arm."""

    made: Scene
    native: object
    start: list
    goal: list


def ranges(native):
    """Returns the range of each joint that postures are drawn from."""
    return [(max(low, -HALF_TURN), min(high, HALF_TURN)) for low, high in native.limits()]


def problem(module, arm, number, folder):
    """Returns the problem of a number: the first draw of scenes and postures that is one."""
    draw = random.Random(f"{arm.urdf.stem} {number}")
    while True:
        made = scene(draw, arm.reach_m)
        urdf = write_model(arm, made, folder)
        build = lambda start: module.Scene(urdf, arm.srdf, arm.tip, start, made.balls, made.boxes)
        joints = ranges(build([]))
        for _ in range(20):
            start, goal = ([draw.uniform(*joint) for joint in joints] for _ in range(2))
            native = build(start)
            is_one = not native.starts_inside() and native.is_free(goal)
            if is_one and not native.is_path_free(start, goal):
                return Problem(made, native, start, goal)


def length(path):
    """Returns the length of a path in the space of the joints."""
    return sum(math.dist(a, b) for a, b in zip(path, path[1:]))


def is_clear(native, path):
    """Returns whether all of a path is free, by postures near each other."""
    for a, b in zip(path, path[1:]):
        steps = max(1, math.ceil(math.dist(a, b) / JUDGED_STEP))
        for step in range(1, steps + 1):
            if not native.is_free([x + (y - x) * step / steps for x, y in zip(a, b)]):
                return False
    return True


# Planners


@dataclass
class Found:
    """A path, none if there was none, and the CPU seconds of its search."""

    path: list | None
    seconds: float


def by_sidestep(given, seed):
    """Plans with Sidestep."""
    path, seconds = given.native.plan(given.goal, seed)
    return Found([given.start, *path] if path is not None else None, seconds)


class Crossing:
    """Checks of the module for OMPL, and the seconds that they take seen from Python."""

    def __init__(self, native, joints):
        self.native = native
        self.count = joints
        self.seconds = 0.0

    def values(self, state):
        """Returns the joint values of a state."""
        return [state[i] for i in range(self.count)]

    def is_valid(self, state):
        """Returns whether a state is free."""
        started = time.thread_time()
        is_free = self.native.is_free(self.values(state))
        self.seconds += time.thread_time() - started
        return is_free

    def is_motion_valid(self, a, b):
        """Returns whether a straight path is free."""
        started = time.thread_time()
        is_free = self.native.is_path_free(self.values(a), self.values(b))
        self.seconds += time.thread_time() - started
        return is_free


class EdgeCheck(base.MotionValidator):
    """Lets OMPL ask whether a straight path is free."""

    def __init__(self, information, crossing):
        super().__init__(information)
        self.crossing = crossing

    def checkMotion(self, a, b):  # noqa: N802 (the name of OMPL)
        """Returns whether all of a straight path is free."""
        return self.crossing.is_motion_valid(a, b)


def by_ompl(given, seed, seconds):
    """Plans with RRT-Connect of OMPL, and simplifies the path as its set-up class does."""
    joints = ranges(given.native)
    limits = given.native.limits()
    space = base.RealVectorStateSpace(len(joints))
    bounds = base.RealVectorBounds(len(joints))
    for i, ((low, high), drawn) in enumerate(zip(limits, joints)):
        bounds.setLow(i, low if math.isfinite(low) else drawn[0])
        bounds.setHigh(i, high if math.isfinite(high) else drawn[1])
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    crossing = Crossing(given.native, len(joints))
    setup.setStateValidityChecker(crossing.is_valid)
    information.setMotionValidator(EdgeCheck(information, crossing))
    ends = []
    for posture in (given.start, given.goal):
        state = space.allocState()
        for i, value in enumerate(posture):
            state[i] = value
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(information))
    setup.setup()
    crossing.seconds = 0.0
    inside = given.native.checks_s
    started = time.thread_time()
    solved = setup.solve(seconds)
    if solved:
        setup.simplifySolution()
    total = time.thread_time() - started
    used = total - crossing.seconds + (given.native.checks_s - inside)
    if not setup.haveExactSolutionPath():
        return Found(None, used)
    states = setup.getSolutionPath().getStates()
    return Found([[state[i] for i in range(len(joints))] for state in states], used)


# The table


def row(name, planner, results, judged):
    """Returns a line of the table, of those problems of an arm that any planner solves; lengths of those that all do."""
    solvable = [any(found.path is not None for found in one) for one in zip(*results.values())]
    common = [all(found.path is not None for found in one) for one in zip(*results.values())]
    asked = [found for found, is_one in zip(results[planner], solvable) if is_one]
    solved = [found for found in asked if found.path is not None]
    times = sorted(1e3 * found.seconds for found in asked)
    lengths = sorted(length(found.path) for found, is_one in zip(results[planner], common) if is_one)
    at = lambda all, share: all[min(len(all) - 1, math.ceil(share * len(all)) - 1)]
    return (
        f"| {name} | {planner} | {len(solved)} of {len(asked)} | {at(times, 0.5):.1f} | {at(times, 0.95):.1f} |"
        f" {at(lengths, 0.5):.2f} | {np.mean(lengths):.2f} | {judged} |"
    )


def load(target):
    """Builds the module and returns it."""
    command = ["cargo", "build", "--release", "--manifest-path", HERE / "Cargo.toml"]
    subprocess.run([*command, "--target-dir", target], check=True)
    made = next((target / "release").glob(f"*{MODULE}.so"))
    folder = target / "python"
    folder.mkdir(exist_ok=True)
    shutil.copy(made, folder / f"{MODULE}.abi3.so")
    sys.path.insert(0, str(folder))
    return __import__(MODULE)


def main():
    """Prints the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--problems", type=int, default=100, help="for each arm")
    options.add_argument("--arms", nargs="+", default=["ur5", "panda", "iiwa14"])
    options.add_argument("--shared", type=Path, default=ROOT.parent / "shared/data/urdf", help="folder of more arms")
    options.add_argument("--seconds", type=float, default=3.0, help="time of OMPL for each problem")
    options.add_argument("--target", type=Path, default=ROOT / "target/bench-planning")
    given = options.parse_args()
    module = load(given.target)
    util.setLogLevel(util.LOG_NONE)
    known = arms(given.shared)
    print("| arm | planner | solved | median ms | 95 % ms | median rad | mean rad | paths that touch something |")
    print("|-|-|-|-|-|-|-|-|")
    for name in given.arms:
        planners = {"Sidestep": by_sidestep, "OMPL": lambda p, seed: by_ompl(p, seed, given.seconds)}
        results = {planner: [] for planner in planners}
        touching = dict.fromkeys(planners, 0)
        with tempfile.TemporaryDirectory() as folder:
            copy_meshes(known[name], Path(folder))
            asked = [problem(module, known[name], number, Path(folder)) for number in range(given.problems)]
        for number, one in enumerate(asked):
            for planner, plan in planners.items():
                found = plan(one, number + 1)
                results[planner].append(found)
                touching[planner] += found.path is not None and not is_clear(one.native, found.path)
        for planner in planners:
            print(row(name, planner, results, touching[planner]), flush=True)


if __name__ == "__main__":
    main()
