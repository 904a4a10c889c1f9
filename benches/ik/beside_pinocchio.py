#!/usr/bin/env python3
"""Inverse kinematics of poses: `sidestep ik` beside damped least squares with restarts on pinocchio.

    pip install pin cmeel-eigen numpy
    cargo build --release
    python benches/ik/beside_pinocchio.py [--poses 1000] [--arms ../shared/data/urdf] [--sidestep target/release/sidestep]

Each arm gets the same random poses that it can take: joint values drawn inside the limits, their pose by
pinocchio. Both sides start from the posture nearest to zero, then from random ones (at most 100), stay
inside the limits, and must come as near as the tolerances say. What Sidestep answers is judged by
pinocchio's forward kinematics. pinocchio's side is C++ (`beside_pinocchio.cpp`, compiled with -O2), with that of eight
settings (damping, length and number of steps) which is the quickest on 100 other poses among those that
solve the most; `python` is the same loop in Python with the same setting, on the first 100 poses, where
most of the time is the interpreter's. CPU time, one thread.
"""

import argparse
import csv
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import pinocchio as pin

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
ARMS = [
    "chain/iiwa7",
    "iiwa14_primitive_collision",
    "chain/panda",
    "chain/ur5",
    "z1",
    "chain/snake16_own",
    "REU_snake",
    "RSNAKE_snake",
    "pendulum5",
]
TOLERANCE_M, TOLERANCE_RAD, RESTARTS = 1e-4, 1e-3, 100
SETTINGS = list(itertools.product([1e-6, 1e-3], [1.0, 0.5], [40, 200]))


class Arm:
    """An arm as pinocchio reads it, with the joints between base and tip that Sidestep moves."""

    def __init__(self, path, sidestep):
        self.path = path
        self.model = pin.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        told = json.loads(run([sidestep, "fk", path, "--json"]))
        self.tip = told["tip_link"]
        self.frame = self.model.getFrameId(self.tip)
        self.names = [joint["name"] for joint in told["joint_info"]]

    def whole(self, values):
        """All joints' values, those of `values` by name and the others at rest."""
        q = pin.neutral(self.model)
        for name, value in zip(self.names, values):
            joint = self.model.joints[self.model.getJointId(name)]
            if joint.nq == joint.nv:
                q[joint.idx_q] = value
            else:
                q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        return q

    def range(self, name):
        joint = self.model.joints[self.model.getJointId(name)]
        if joint.nq != joint.nv:
            return -np.pi, np.pi
        return self.model.lowerPositionLimit[joint.idx_q], self.model.upperPositionLimit[joint.idx_q]

    def place(self, q):
        pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.frame].copy()

    def poses(self, count, seed):
        ranges = np.array([self.range(name) for name in self.names])
        draws = np.random.default_rng(seed).random((count, len(self.names)))
        return [self.place(self.whole(ranges[:, 0] + d * (ranges[:, 1] - ranges[:, 0]))) for d in draws]

    def is_met(self, target, values):
        at = self.place(self.whole(values))
        ranges = [self.range(name) for name in self.names]
        inside = all(
            lower - 1e-9 <= value <= upper + 1e-9 or upper - lower >= 2 * np.pi - 1e-9 and lower == -np.pi
            for value, (lower, upper) in zip(values, ranges)
        )
        off_m = np.linalg.norm(at.translation - target.translation)
        off_rad = np.linalg.norm(pin.log3(at.rotation.T @ target.rotation))
        return inside and off_m <= TOLERANCE_M * (1 + 1e-6) and off_rad <= TOLERANCE_RAD * (1 + 1e-6)


def run(command):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{command} failed")
    return done.stdout


def row(pose):
    return [*pose.translation, *pin.Quaternion(pose.rotation).coeffs()]


def by_sidestep(arm, poses, sidestep, folder):
    path = folder / "targets.csv"
    with open(path, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["x", "y", "z", "qx", "qy", "qz", "qw"])
        table.writerows(row(pose) for pose in poses)
    told = json.loads(
        run(
            [
                sidestep,
                "ik",
                arm.path,
                "--targets",
                path,
                "--json",
                "--restarts",
                RESTARTS,
                "--tolerance-m",
                TOLERANCE_M,
                "--tolerance-rad",
                TOLERANCE_RAD,
            ]
        )
    )
    answers = told["answers"]
    met = sum(a["reached"] and arm.is_met(pose, a["joints"]) for a, pose in zip(answers, poses))
    mean = lambda key: float(np.mean([a[key] for a in answers]))
    return {"solved": met, "us": told["cpu_us_per_target"], "steps": mean("iterations"), "starts": mean("starts")}


def compiled(folder):
    prefix = Path(pin.__file__).parents[4] / "cmeel.prefix"
    if not prefix.is_dir():
        prefix = next(p for p in Path(pin.__file__).parents if (p / "cmeel.prefix").is_dir()) / "cmeel.prefix"
    program = folder / "pinocchio"
    subprocess.run(
        [
            os.environ.get("CXX", "g++"),
            "-std=c++17",
            "-O2",
            "-DNDEBUG",
            "-w",
            "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
            "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
            HERE / "beside_pinocchio.cpp",
            "-o",
            program,
            f"-I{prefix}/include",
            f"-I{prefix}/include/eigen3",
            f"-L{prefix}/lib",
            f"-Wl,-rpath,{prefix}/lib",
            f"-Wl,-rpath-link,{prefix}/lib",
            "-lpinocchio_default",
            "-lboost_serialization",
        ],
        check=True,
    )
    return program


def by_cpp(program, arm, poses, setting, folder):
    path = folder / "poses.txt"
    np.savetxt(path, [row(pose) for pose in poses], fmt="%.17g")
    damping, length, steps = setting
    model = folder / "model.txt"
    arm.model.saveToText(str(model))
    return json.loads(
        run(
            [
                program,
                model,
                arm.tip,
                path,
                RESTARTS,
                steps,
                damping,
                length,
                TOLERANCE_M,
                TOLERANCE_RAD,
            ]
        )
    )


def by_python(arm, poses, setting):
    """The loop of `beside_pinocchio.cpp`."""
    damping, length, most = setting
    model, data, generator = arm.model, arm.data, np.random.default_rng(7)
    bounded = [j for j in list(model.joints)[1:] if j.nq == j.nv]

    def clamp(q):
        for j in bounded:
            q[j.idx_q] = min(max(q[j.idx_q], model.lowerPositionLimit[j.idx_q]), model.upperPositionLimit[j.idx_q])
        return q

    def drawn():
        q = pin.neutral(model)
        for j in list(model.joints)[1:]:
            if j.nq == j.nv:
                lower, upper = model.lowerPositionLimit[j.idx_q], model.upperPositionLimit[j.idx_q]
                q[j.idx_q] = lower + generator.random() * (upper - lower)
            else:
                angle = (2 * generator.random() - 1) * np.pi
                q[j.idx_q : j.idx_q + 2] = np.cos(angle), np.sin(angle)
        return q

    def descend(target, q):
        for k in range(most + 1):
            pin.forwardKinematics(model, data, q)
            at = pin.updateFramePlacement(model, data, arm.frame)
            error = at.actInv(target)
            off_m = np.linalg.norm(at.translation - target.translation)
            if off_m <= TOLERANCE_M and np.linalg.norm(pin.log3(error.rotation)) <= TOLERANCE_RAD:
                return True
            J = -pin.Jlog6(error.inverse()) @ pin.computeFrameJacobian(model, data, q, arm.frame, pin.LOCAL)
            v = -J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), pin.log6(error).vector)
            q = clamp(pin.integrate(model, q, v * length))
        return False

    started, solved = time.process_time(), 0
    for target in poses:
        starts = (clamp(pin.neutral(model)) if k == 0 else drawn() for k in range(RESTARTS + 1))
        solved += any(descend(target, q) for q in starts)
    return {"solved": solved, "us": 1e6 * (time.process_time() - started) / len(poses)}


def chosen(program, arm, folder):
    """The quickest setting among those that solve the most of 100 other poses."""
    poses = arm.poses(100, 8)
    tried = [(by_cpp(program, arm, poses, setting, folder), setting) for setting in SETTINGS]
    return min(tried, key=lambda one: (-one[0]["solved"], one[0]["us"]))[1]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--poses", type=int, default=1000)
    options.add_argument("--arms", type=Path, default=ROOT.parent / "shared/data/urdf")
    options.add_argument("--sidestep", type=Path, default=ROOT / "target/release/sidestep")
    asked = options.parse_args()
    sidestep = asked.sidestep.resolve()
    folder = Path(tempfile.mkdtemp())
    program = compiled(folder)
    print(f"{asked.poses} poses each, tolerances {TOLERANCE_M} m and {TOLERANCE_RAD} rad, {RESTARTS} restarts")
    print("| arm | joints | Sidestep solved | us | steps | pinocchio solved | us | steps | setting | python us |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|---|--:|")
    for name in ARMS:
        arm = Arm(asked.arms / f"{name}.urdf", sidestep)
        poses = arm.poses(asked.poses, 15)
        setting = chosen(program, arm, folder)
        ours, theirs = by_sidestep(arm, poses, sidestep, folder), by_cpp(program, arm, poses, setting, folder)
        in_python = by_python(arm, poses[:100], setting)
        share = lambda found: f"{100 * found['solved'] / len(poses):.1f} %"
        print(
            f"| {name} | {len(arm.names)} | {share(ours)} | {ours['us']:.0f} | {ours['steps']:.0f} | {share(theirs)} "
            f"| {theirs['us']:.0f} | {theirs['steps']:.0f} | {setting[0]:g}, {setting[1]:g}, {setting[2]} "
            f"| {in_python['us']:.0f} |",
            flush=True,
        )
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
