#!/usr/bin/env python3
"""Targets that one chain reaches in empty space, by its base, and those that OMPL reaches.

    pip install numpy pyarrow ompl
    cargo build --release
    python benches/reach/beside_ompl.py [--seeds 1] [--only rail] [--snakes] [--ompl] [--program target/release/sidestep]

Each world (`worlds.py`) is one chain whose own body is solid: on a rail, a plane, in a box or free, with 2, 5, 12 and 25
links, or between two fixed ends with 5, 12 and 25, in the plane and in space, with 24 targets; `--snakes` are 20 free
chains of many proportions with 16 targets each. `sidestep run` goes to them one after the other.

A row tells the targets reached, CPU against simulated seconds, and the highest speeds of the initiator and of any
connector, computed here from the recorded positions: the initiator may reach 0.5 m/s, and the others 1 m/s. With `--ompl` each target that was not reached is one more problem for OMPL: RRT-Connect gets 60 s from
the posture in which Sidestep began to go there (`ompl_paths.py`). Targets that Sidestep reaches are reachable by that.
"""

import argparse
import json
import subprocess
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from worlds import DT_S, MOST_CYCLES, SPEED_M_S, World, snakes, straight_world, two_ended_world

ROOT = Path(__file__).resolve().parent.parent.parent
#: A run that takes longer counts as one that does not end, seconds.
TIMEOUT_S = 120
#: Rounding of recorded positions, as a fraction of a speed.
ROUNDING = 1e-6


@dataclass
class Outcome:
    """What came of the targets of a world."""

    world: World
    reached: int = 0
    cpu_s: float = 0.0
    simulated_s: float = 0.0
    #: Highest speeds of the initiator and of any connector.
    led_m_s: float = 0.0
    fastest_m_s: float = 0.0
    #: Targets that were not reached, each with the posture from which the chain began to go there.
    missed: list = field(default_factory=list)
    ended: bool = True

    def row(self):
        world = self.world
        count = len(world.targets)
        real_time = self.cpu_s / max(self.simulated_s, DT_S)
        excess = max(self.led_m_s, 0.5 * self.fastest_m_s) / SPEED_M_S
        too_fast = "  too fast" if excess > 1.0 + ROUNDING else ""
        slow = "  slower than real time" if real_time > 1.0 else ""
        unended = "" if self.ended else "  did not end"
        return (
            f"{world.name:20} {self.reached:3} of {count}  {self.cpu_s:7.2f} s of CPU for {self.simulated_s:7.1f} s  "
            f"{self.led_m_s:.3f}, {self.fastest_m_s:.3f} m/s{too_fast}{slow}{unended}"
        )


def run_world(world, program, cycles=MOST_CYCLES):
    """Runs a world, and reads its recorded tables."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder, "scenario.toml")
        scenario.write_text(world.text(cycles), encoding="utf-8")
        out = Path(folder, "out")
        command = [program, "run", scenario, "--out", out, "--json", "--quiet", "--workers", "1"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        except subprocess.TimeoutExpired:
            return Outcome(world, cpu_s=TIMEOUT_S, ended=False)
        if done.returncode != 0:
            raise SystemExit(f"{world.name}: {done.stderr}")
        told = json.loads(done.stdout)
        positions = recorded_positions(out, world)
        events = parquet.read_table(out / "events").to_pylist()
    moves_m = np.linalg.norm(np.diff(positions, axis=0), axis=2)
    outcome = Outcome(world, cpu_s=told["cpu_s"], simulated_s=told["cycles"] * DT_S)
    outcome.led_m_s = float(moves_m[:, world.leader].max(initial=0.0)) / DT_S
    outcome.fastest_m_s = float(moves_m.max(initial=0.0)) / DT_S
    outcome.ended = told["cycles"] < cycles
    posture = positions[0]
    for event in sorted(events, key=lambda event: event["cycle"]):
        if event["event"] == "target":
            outcome.reached += 1
        elif event["event"] == "target-given-up":
            outcome.missed.append((int(event["value"]), posture))
        else:
            continue
        posture = positions[min(event["cycle"] + 1, len(positions) - 1)]
    return outcome


def recorded_positions(out, world):
    """Returns the places of the connectors before each cycle, and after the last one."""
    table = parquet.read_table(out / "trajectories")
    order = np.lexsort((table["connector"].to_numpy(), table["cycle"].to_numpy()))
    axes = ["x_m", "y_m", "z_m"][: world.dimensions]
    columns = [table[axis].to_numpy()[order] for axis in axes]
    return np.stack(columns, axis=1).reshape(-1, len(world.points), world.dimensions)


def all_worlds(seeds, only):
    """Returns the worlds of the table."""
    for seed in range(1, seeds + 1):
        for base in ("fixed", "rail", "plane", "box", "free"):
            for dimensions in (2, 3):
                for links in (2, 5, 12, 25):
                    if base == only or (only is None and base != "fixed"):
                        yield straight_world(base, links, dimensions, seed)
        for dimensions in (2, 3):
            for links in (5, 12, 25):
                if only in (None, "two ends"):
                    yield two_ended_world(links, dimensions, seed)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--only", help="one base: rail, plane, box, free, fixed or 'two ends'")
    parser.add_argument("--snakes", action="store_true", help="20 free chains of many proportions instead")
    parser.add_argument("--ompl", action="store_true", help="asks OMPL for the targets that were not reached")
    parser.add_argument("--program", default=ROOT / "target/release/sidestep")
    args = parser.parse_args()
    worlds = snakes(1) if args.snakes else all_worlds(args.seeds, args.only)
    reached = count = reachable = 0
    for world in worlds:
        outcome = run_world(world, args.program)
        reached += outcome.reached
        count += len(world.targets)
        print(outcome.row(), flush=True)
        if args.ompl:
            reachable += outcome.reached + ask_ompl(outcome)
    of_reachable = f"; {reachable} are reachable" if args.ompl else ""
    print(f"{reached} of {count} targets reached{of_reachable}")


def ask_ompl(outcome):
    """Returns how many of the targets that were missed OMPL reaches."""
    from ompl_paths import find_path

    found = 0
    for number, posture in outcome.missed:
        started = time.process_time()
        verdict = find_path(outcome.world, posture, outcome.world.targets[number])
        found += verdict == "reached"
        target = [float(x) for x in outcome.world.targets[number]]
        print(f"    target {number} {target}: OMPL: {verdict} in {time.process_time() - started:.1f} s", flush=True)
    return found


if __name__ == "__main__":
    main()
