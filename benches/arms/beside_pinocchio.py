#!/usr/bin/env python3
"""Arms among their own links and a few balls: what their runs reach, touch and ask of their joints, by pinocchio.

    pip install pin example-robot-data numpy
    cargo build --release
    python benches/arms/beside_pinocchio.py [--arms panda kinova snake16 bulky] [--model NAME=FILE.urdf] [--out DIR]

Each arm visits 24 places, which its tool has at random postures that touch nothing, in a run of 3,000 cycles for each.
Everything is judged from the recorded joint values, by code that shares nothing with Sidestep: pinocchio's forward
kinematics and the distances of its collision library coal, with meshes as their convex hulls. A place counts as
reached if the tool comes as near to it as the task allows; a penetration is a pair of bodies, of which no joint
connects the links and which are apart at the start, that overlaps by more than 0.1 mm; speeds, accelerations and jerks
are differences of recorded values against the limits of the run. Links of a model without collision shapes get those
that it draws.
"""

import argparse
import csv
import json
import math
import random
import re
import shutil
import subprocess
import sysconfig
import time
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
TARGETS = 24
CYCLES = 3000 * TARGETS
DT_S = 0.02
TOLERANCE_M = 0.01
#: Depth from which an overlap counts, m.
DEPTH_M = 1e-4
#: Balls of a scene, their radius in m, and their distance from the base as a share of the arm's reach.
BALLS, RADIUS_M, NEAREST, FARTHEST = 3, 0.05, 0.4, 0.9
#: Every so many cycles the bodies of an arm are checked.
EVERY = 5

#: Six joints, whose forearm is as thick as it is long.
BULKY = """<robot name="bulky">
<link name="base"><collision><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.12" length="0.2"/></geometry></collision></link>
<link name="shoulder"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="upper"><collision><origin xyz="0 0 0.22"/><geometry><box size="0.12 0.12 0.3"/></geometry></collision></link>
<link name="forearm"><collision><origin xyz="0 0 0.25"/><geometry><box size="0.3 0.25 0.3"/></geometry></collision></link>
<link name="wrist"><collision><origin xyz="0 0 0.06"/><geometry><cylinder radius="0.05" length="0.1"/></geometry></collision></link>
<link name="hand"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.16 0.1"/></geometry></collision></link>
<link name="tool"/>
{joints}
<joint name="mount" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0 0 0.15"/></joint></robot>"""
BULKY_JOINTS = [
    ("base", "shoulder", "0 0 0.3", "0 0 1", 2.9),
    ("shoulder", "upper", "0 0 0", "0 1 0", 1.9),
    ("upper", "forearm", "0 0 0.45", "0 1 0", 2.2),
    ("forearm", "wrist", "0 0 0.45", "0 0 1", 2.9),
    ("wrist", "hand", "0 0 0.12", "0 1 0", 1.9),
]


def bulky():
    """Returns the text of the arm with a bulky forearm."""
    joints = [
        f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/>'
        f'<axis xyz="{axis}"/><limit lower="-{limit}" upper="{limit}" effort="1" velocity="1.5"/></joint>'
        for i, (parent, child, at, axis, limit) in enumerate(BULKY_JOINTS)
    ]
    return BULKY.format(joints="\n".join(joints))


def prepare(name, file, folder):
    """Copies a model with its meshes to a folder, with collision shapes where it only draws its links."""
    folder.mkdir(parents=True)
    path = folder / f"{name}.urdf"
    if file is None:
        path.write_text(bulky(), encoding="utf-8")
        return path
    text = file.read_text(encoding="utf-8")
    if "<collision" not in text:
        drawn = re.compile(r"<visual>(.*?)</visual>", re.S)
        shape = lambda found: re.sub(r"<material.*?(/>|</material>)", "", found.group(1), flags=re.S)
        text = drawn.sub(lambda found: f"{found.group(0)}<collision>{shape(found)}</collision>", text)
    for mesh in sorted(set(re.findall(r'filename="package://([^"]+)"', text))):
        package, inside = mesh.split("/", 1)
        for above in file.parents:
            source = next((at for at in (above / package / inside, above / inside) if at.is_file()), None)
            if source is not None:
                (folder / mesh).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, folder / mesh)
                break
    path.write_text(text, encoding="utf-8")
    return path


class Judge:
    """An arm as pinocchio and coal see it."""

    def __init__(self, urdf, told, balls):
        self.model = pin.buildModelFromUrdf(str(urdf))
        self.data = self.model.createData()
        self.tip = self.model.getFrameId(told["tip_link"])
        self.names = [joint["name"] for joint in told["joint_info"]]
        self.shapes = pin.buildGeomFromUrdf(self.model, str(urdf), pin.COLLISION, package_dirs=[str(urdf.parent)])
        for shape in self.shapes.geometryObjects:
            if isinstance(shape.geometry, coal.BVHModelBase):
                shape.geometry.buildConvexRepresentation(True)
                shape.geometry = shape.geometry.convex
        self.placed = pin.GeometryData(self.shapes)
        self.balls = [(np.array(center), coal.Sphere(radius)) for center, radius in balls]
        count = range(len(self.shapes.geometryObjects))
        parents = [shape.parentJoint for shape in self.shapes.geometryObjects]
        apart = lambda a, b: a != b and self.model.parents[a] != b and self.model.parents[b] != a
        # Bodies that no joint of the arm moves against each other stay as they are.
        carriers = [self.carrier(parent) for parent in parents]
        moves = lambda i, j: carriers[i] != carriers[j] and apart(parents[i], parents[j])
        self.pairs = [(i, j) for i in count for j in count if i < j and moves(i, j)]
        self.moving = [i for i in count if parents[i] > 0]

    def carrier(self, joint):
        """Returns the outermost joint of the arm that carries a joint, 0 for none."""
        while joint > 0 and self.model.names[joint] not in self.names:
            joint = self.model.parents[joint]
        return joint

    def whole(self, values):
        """Returns pinocchio's configuration for the values of the arm's joints."""
        q = pin.neutral(self.model)
        q = np.clip(q, self.model.lowerPositionLimit, self.model.upperPositionLimit)
        for name, value in zip(self.names, values):
            joint = self.model.joints[self.model.getJointId(name)]
            if joint.nq == 2:
                q[joint.idx_q : joint.idx_q + 2] = math.cos(value), math.sin(value)
            else:
                q[joint.idx_q] = value
        return q

    def tool(self, values):
        """Returns where the tool is, m."""
        pin.framesForwardKinematics(self.model, self.data, self.whole(values))
        return self.data.oMf[self.tip].translation.copy()

    def overlaps(self, values):
        """Returns the depth in m of each pair of bodies that overlaps."""
        pin.updateGeometryPlacements(self.model, self.data, self.shapes, self.placed, self.whole(values))
        place = lambda i: coal.Transform3s(self.placed.oMg[i].rotation, self.placed.oMg[i].translation)
        geometry = lambda i: self.shapes.geometryObjects[i].geometry
        deep = {}
        request = coal.DistanceRequest()
        request.enable_signed_distance = True
        for i, j in self.pairs:
            apart = coal.distance(geometry(i), place(i), geometry(j), place(j), request, coal.DistanceResult())
            if apart < 0.0:
                deep[i, j] = -apart
        for number, (center, ball) in enumerate(self.balls):
            at = coal.Transform3s(np.eye(3), center)
            for i in self.moving:
                apart = coal.distance(geometry(i), place(i), ball, at, request, coal.DistanceResult())
                if apart < 0.0:
                    deep[i, -1 - number] = -apart
        return deep


def ranges(told):
    """Returns the range of each joint that postures are drawn from."""
    limits = [joint["limits"] or [-math.pi, math.pi] for joint in told["joint_info"]]
    return [(max(low, -math.pi), min(high, math.pi)) for low, high in limits]


def targets(judge, told, draw):
    """Returns places of the tool at random postures that touch nothing but what touches at the start."""
    exempt = judge.overlaps(told["joints"]).keys()
    places = []
    while len(places) < TARGETS:
        values = [draw.uniform(low, high) for low, high in ranges(told)]
        if not judge.overlaps(values).keys() - exempt:
            places.append(judge.tool(values).tolist())
    return places


def balls(judge, told, draw):
    """Returns balls around an arm that do not touch it at the start."""
    made = []
    drawn = [judge.tool([draw.uniform(*joint) for joint in ranges(told)]) for _ in range(100)]
    reach = max(math.hypot(*place) for place in drawn)
    while len(made) < BALLS:
        turn, rise = draw.uniform(-math.pi, math.pi), draw.uniform(-0.1, 0.45) * math.pi
        far = reach * draw.uniform(NEAREST, FARTHEST)
        flat = far * math.cos(rise)
        made.append(([flat * math.cos(turn), flat * math.sin(turn), far * math.sin(rise)], RADIUS_M))
        judge.balls = [(np.array(center), coal.Sphere(radius)) for center, radius in made]
        if any(pair[1] < 0 for pair in judge.overlaps(told["joints"])):
            made.pop()
    judge.balls = [(np.array(center), coal.Sphere(radius)) for center, radius in made]
    return made


# Runs


def scenario(urdf, told, places, around):
    """Returns the text of the run of an arm."""
    lines = ["format = 1", 'world = "chain"', f"cycles = {CYCLES}", "[chain]", "dimensions = 3", f"dt_s = {DT_S}"]
    for center, radius in around:
        lines += ["[[obstacles]]", f"at_m = {center}", f"radius_m = {radius}"]
    lines += ["[[chains]]", f'name = "arm"\narm = {{ urdf = "{urdf.name}", joints = {told["joints"]} }}']
    lines += ["radius_m = 0.02", "rod_radius_m = 0.01", "[[chains.tasks]]", 'kind = "targets"']
    lines += [f"connector = {len(told['connectors']) - 1}", f"targets_m = {places}", "speed_m_s = 0.4"]
    return "\n".join([*lines, f"tolerance_m = {TOLERANCE_M}", "patience_s = 8.0", ""])


def run(command):
    """Runs a command and returns what it prints."""
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


def recorded(folder, sidestep, count):
    """Returns the joint values of a recorded run, a row for each cycle."""
    run(
        [
            sidestep,
            "export",
            folder,
            "--to",
            "csv",
            "--table",
            "joints",
            "--out",
            folder.with_suffix(".csv"),
            "-q",
            "--replace",
        ]
    )
    files = [folder.with_suffix(".csv"), *folder.with_suffix(".csv").glob("*.csv")]
    with next(file for file in files if file.is_file()).open(encoding="utf-8") as file:
        values = [float(row["value"]) for row in csv.DictReader(file)]
    return np.array(values).reshape(-1, count)


def reached(judge, values, places):
    """Returns how many places the tool comes to, in their order."""
    tools = np.array([judge.tool(row) for row in values])
    return sum(np.linalg.norm(tools - place, axis=1).min() <= TOLERANCE_M for place in places)


def rates(values):
    """Returns the highest speed, acceleration and jerk of each joint."""
    values = np.vstack([np.repeat(values[:1], 3, axis=0), values])
    return [np.abs(np.diff(values, order, axis=0)).max(axis=0) / DT_S**order for order in (1, 2, 3)]


def row(name, file, given):
    """Runs an arm and returns its line of the table."""
    folder = given.out / name
    shutil.rmtree(folder, ignore_errors=True)
    urdf = prepare(name, file, folder)
    told = json.loads(run([given.sidestep, "fk", urdf, "--json"]))
    # Away from zero, where many arms are stretched or touch themselves.
    told = json.loads(run([given.sidestep, "fk", urdf, "--json", f"--joints={start(urdf, told)}"]))
    judge = Judge(urdf, told, [])
    draw = random.Random(name)
    around = balls(judge, told, draw)
    places = targets(judge, told, draw)
    path = folder / "run.toml"
    path.write_text(scenario(urdf, told, places, around), encoding="utf-8")
    started = time.time()
    summary = json.loads(run([given.sidestep, "run", path, "--out", folder / "run", "--json", "--workers", "1"]))
    wall_s = time.time() - started
    values = recorded(folder / "run", given.sidestep, len(told["joint_info"]))
    exempt = judge.overlaps(values[0]).keys()
    deepest = 0.0
    penetrations = set()
    for posture in values[::EVERY]:
        for pair, depth in judge.overlaps(posture).items():
            if pair not in exempt and depth > DEPTH_M:
                penetrations.add(pair)
                deepest = max(deepest, depth)
    metrics = summary["metrics"]
    told_limits = json.loads((folder / "run/summary.json").read_text(encoding="utf-8"))["per_agent"][0]["joint_limits"]
    limits = np.array([[limit[key] for key in ("speed", "acceleration", "jerk")] for limit in told_limits])
    shares = [float((used / allowed).max()) for used, allowed in zip(rates(values), limits.T)]
    return (
        f"| {name} | {reached(judge, values, places)} of {TARGETS} | {metrics['vetoes']} | {len(penetrations)} |"
        f" {1e3 * deepest:.1f} | {' | '.join(f'{share:.3f}' for share in shares)} | {len(values) * DT_S:.0f} |"
        f" {wall_s:.1f} |"
    )


def start(urdf, told):
    """Returns joint values for the start: the first draw that touches only what always does."""
    judge = Judge(urdf, told, [])
    draw = random.Random(7)
    always = None
    drawn = [[draw.uniform(low, high) for low, high in ranges(told)] for _ in range(200)]
    for values in drawn:
        pairs = judge.overlaps(values).keys()
        always = pairs if always is None else always & pairs
    for values in drawn:
        if judge.overlaps(values).keys() == always:
            return ",".join(repr(value) for value in values)
    raise SystemExit(f"{urdf.name}: no posture is free")


def main():
    """Prints the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--arms", nargs="+", default=["panda", "kinova", "snake16", "bulky"])
    options.add_argument("--model", nargs="*", default=[], help="more arms, NAME=FILE.urdf, with their meshes below")
    options.add_argument("--shared", type=Path, default=ROOT.parent / "shared/data/urdf", help="folder of more arms")
    options.add_argument("--sidestep", type=Path, default=ROOT / "target/release/sidestep")
    options.add_argument("--out", type=Path, default=ROOT / "target/bench-arms")
    given = options.parse_args()
    models = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots"
    files = {
        "panda": models / "panda_description/urdf/panda.urdf",
        "kinova": models / "kinova_description/robots/kinova.urdf",
        "snake16": given.shared / "chain/snake16_own.urdf",
        "bulky": None,
    }
    files.update((name, Path(file)) for name, file in (model.split("=", 1) for model in given.model))
    names = [*given.arms, *(name for name in files if name not in given.arms and f"{name}=" in " ".join(given.model))]
    print("| arm | reached | vetoes | penetrating pairs | mm | v | a | j | simulated s | s |")
    print("|-|-|-|-|-|-|-|-|-|-|")
    for name in names:
        print(row(name, files[name], given), flush=True)


if __name__ == "__main__":
    main()
