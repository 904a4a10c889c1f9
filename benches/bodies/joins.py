#!/usr/bin/env python3
"""How many broken chains join again among balls.

    cargo build --release
    python benches/bodies/joins.py [--seeds 12] [--program target/release/sidestep]

Each run is a chain of 31 connectors along the first axis, four of which are thrown about by 3 m (the standard deviation of
each coordinate). Balls of 0.5 m lie at random beside the chain. With `--comes` the parts are too few for the gap, and the end
behind it has to come, too.
"""

import argparse
import json
import random
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
BALL_M = 0.5
#: Least distance of the middle of a ball from the chain: it may not lie on the chain at the start.
ASIDE_M = 0.65


def scenario(dimensions, balls, seed, comes):
    """Returns the scenario of a chain that breaks."""
    draws = random.Random(1000 * balls + seed)
    obstacles = ""
    placed = 0
    while placed < balls:
        at_m = [draws.uniform(-10.0, -3.0), *(draws.uniform(-3.0, 3.0) for _ in range(dimensions - 1))]
        if sum(x * x for x in at_m[1:]) ** 0.5 < ASIDE_M:
            continue
        obstacles += f"[[obstacles]]\nat_m = {at_m}\nradius_m = {BALL_M}\n"
        placed += 1
    zeros = [0.0] * dimensions
    apart_m = [-3.0, 1.0, *zeros[2:]] if comes else zeros
    may_come = "last" if comes else "nobody"
    return (
        f'format = 1\nworld = "chain"\nseed = {seed}\ncycles = 3000\n'
        f"[chain]\ndimensions = {dimensions}\ndt_s = 0.02\nself_collision = false\n{obstacles}"
        f"[[chains]]\nconnectors = 31\nat_m = {zeros}\nrod_m = [0.4, 0.5]\nradius_m = 0.05\nrod_radius_m = 0.02\n"
        f"[[chains.changes]]\nat_s = 0.5\nscatter = [12, 15]\nby_m = 3.0\napart_m = {apart_m}\n"
        f'[[chains.changes]]\nat_s = 2.0\nreform = true\nmay_come = "{may_come}"\nspeed_m_s = 1.0\n'
        f'[[chains.tasks]]\nkind = "script"\nscript = "wait 40 repeat 6 [ forward 1 turn 30 ]"\n'
    )


def run(program, text):
    """Returns the metrics of a run."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scenario.toml")
        path.write_text(text, encoding="utf-8")
        command = [program, "run", path, "--out", Path(folder, "out"), "--json", "--quiet"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)["metrics"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--comes", action="store_true", help="parts are missing, and an end has to come")
    parser.add_argument("--program", default=ROOT / "target/release/sidestep")
    args = parser.parse_args()
    for dimensions in (2, 3):
        for balls in (0, 1, 3, 6, 12):
            told = [
                run(args.program, scenario(dimensions, balls, seed, args.comes)) for seed in range(1, args.seeds + 1)
            ]
            joined = sum(metrics["reformed"] for metrics in told)
            inside = sum(metrics["penetrations"] for metrics in told)
            print(
                f"{dimensions}-D, {balls:2} balls: {joined:2} of {len(told)} joined; {inside} penetrations", flush=True
            )


if __name__ == "__main__":
    main()
