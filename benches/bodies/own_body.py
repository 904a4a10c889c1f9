#!/usr/bin/env python3
"""Whether chains of many proportions overlap or pass through themselves, from the recorded positions alone.

    pip install numpy pyarrow
    cargo build --release
    python benches/bodies/own_body.py [--seeds 16] [--program target/release/sidestep]

Each row is a kind of base in the plane or in space: free, fixed, or on a rail. Each of its runs is a chain of 4 to 24 rods
whose radius is 0.5 to 50 % of a rod, which goes to random targets for 20 s. Two rods that share no connector overlap when
their axes come nearer than their radii; a run counts with its deepest overlap in any cycle. They pass through each other when,
between two cycles, the triple product of their ends changes its sign while they meet (in space), or when they cross (in the
plane). Nothing here uses the library.
"""

import argparse
import subprocess
import tempfile
from itertools import product
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

ROOT = Path(__file__).resolve().parent.parent.parent
ROD_M = 0.3
DT_S = 0.02
CYCLES = 1000
#: An overlap below this is rounding of the recorded positions.
ROUNDING_M = 1e-9


def scenario(base, dimensions, seed):
    """Returns a scenario, and the radius of its rods in m."""
    draws = np.random.default_rng([seed, dimensions, len(base)])
    rods = int(draws.integers(4, 25))
    # Even in its logarithm, from 0.5 to 50 % of a rod.
    radius_m = round(float(ROD_M * np.exp(draws.uniform(np.log(0.005), np.log(0.5)))), 5)
    length_m = rods * ROD_M
    zeros = [0.0] * (dimensions - 1)
    mobility = {
        "free": None,
        "fixed": '"fixed"',
        "rail": f"{{ on_segment = [{[-3.0, *zeros]}, {[3.0, *zeros]}] }}",
    }[base]
    held = f"[[chains.limits]]\nconnector = {rods}\nmobility = {mobility}\n" if mobility else ""
    targets = draws.normal(size=(40, dimensions))
    targets *= (length_m * draws.uniform(0.1, 0.9, (40, 1))) / np.linalg.norm(targets, axis=1, keepdims=True)
    up = np.eye(dimensions)[-1]
    points = [[float(x) for x in (rods - i) * ROD_M * up] for i in range(rods + 1)]
    text = (
        f'format = 1\nworld = "chain"\nseed = {seed}\ncycles = {CYCLES}\n'
        f"[chain]\ndimensions = {dimensions}\ndt_s = {DT_S}\n"
        f"[[chains]]\npoints_m = {points}\nrod_m = {ROD_M}\nradius_m = {radius_m}\nrod_radius_m = {radius_m}\n{held}"
        f'[[chains.tasks]]\nkind = "targets"\ntargets_m = {np.round(targets, 4).tolist()}\n'
        f"tolerance_m = 0.02\nspeed_m_s = 1.0\n"
    )
    return text, radius_m


def recorded_positions(out, dimensions):
    """Returns positions of the shape (cycles, connectors, dimensions)."""
    table = parquet.read_table(out / "trajectories")
    order = np.lexsort((table["connector"].to_numpy(), table["cycle"].to_numpy()))
    axes = ["x_m", "y_m", "z_m"][:dimensions]
    columns = [table[axis].to_numpy()[order] for axis in axes]
    connectors = int(table["connector"].to_numpy().max()) + 1
    positions = np.stack(columns, axis=1).reshape(-1, connectors, dimensions)
    return np.pad(positions, ((0, 0), (0, 0), (0, 3 - dimensions)))


def segment_distances_m(p0, p1, q0, q1):
    """Returns the distances of segments, of the shape (n, 3) each."""
    nearest = np.full(len(p0), np.inf)
    # The nearest two points are at an end of one of the segments, or inside of both.
    for point, (a, b) in ((p0, (q0, q1)), (p1, (q0, q1)), (q0, (p0, p1)), (q1, (p0, p1))):
        along = b - a
        squared = np.einsum("ij,ij->i", along, along)
        fraction = np.clip(np.einsum("ij,ij->i", point - a, along) / squared, 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(point - a - fraction[:, None] * along, axis=1))
    fractions = line_fractions(p0, p1, q0, q1)
    is_inside = np.all((fractions >= 0.0) & (fractions <= 1.0), axis=0)
    on_p = p0 + fractions[0][:, None] * (p1 - p0)
    on_q = q0 + fractions[1][:, None] * (q1 - q0)
    inner = np.linalg.norm(on_p - on_q, axis=1)
    return np.where(is_inside, np.minimum(nearest, inner), nearest)


def line_fractions(p0, p1, q0, q1):
    """Returns where lines are nearest to each other, as fractions of the segments; far outside for parallels."""
    u, v, w = p1 - p0, q1 - q0, p0 - q0
    a, b, c = (np.einsum("ij,ij->i", x, y) for x, y in ((u, u), (u, v), (v, v)))
    d, e = (np.einsum("ij,ij->i", x, w) for x in (u, v))
    parallel = a * c - b * b < 1e-12 * a * c
    divisor = np.where(parallel, 1.0, a * c - b * b)
    fractions = np.stack([(b * e - c * d) / divisor, (a * e - b * d) / divisor])
    return np.where(parallel, 2.0, fractions)


def triple_products(p0, p1, q0, q1):
    """Returns six times the signed volumes between segments: their sign tells on which side one passes the other."""
    return np.einsum("ij,ij->i", p1 - p0, np.cross(q0 - p0, q1 - p0))


def check_pair(positions, i, j, dimensions, keep_m):
    """Returns the deepest overlap of rods i and j in m, and how often one passes through the other."""
    ends = [positions[:, k] for k in (i, i + 1, j, j + 1)]
    distances = segment_distances_m(*ends)
    overlap_m = max(0.0, keep_m - float(distances.min()))
    if dimensions == 2:
        return overlap_m, int(np.count_nonzero(distances < ROUNDING_M))
    volumes = triple_products(*ends)
    before, after = volumes[:-1], volumes[1:]
    flips = np.flatnonzero(before * after < 0.0)
    # Where they are in one plane, with the motion between two cycles taken as straight.
    fraction = (before[flips] / (before[flips] - after[flips]))[:, None]
    met = [end[flips] + fraction * (end[flips + 1] - end[flips]) for end in ends]
    fractions = line_fractions(*met)
    crosses = np.all((fractions >= 0.0) & (fractions <= 1.0), axis=0)
    return overlap_m, int(np.count_nonzero(crosses))


def check_run(program, base, dimensions, seed):
    """Returns the deepest overlap of a run, how often rods pass through each other, and the way of its tip, in m."""
    text, radius_m = scenario(base, dimensions, seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scenario.toml")
        path.write_text(text, encoding="utf-8")
        out = Path(folder, "out")
        command = [program, "run", path, "--out", out, "--quiet", "--workers", "1"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(f"{base} {dimensions}-D, seed {seed}: {done.stderr}")
        positions = recorded_positions(out, dimensions)
    rods = positions.shape[1] - 1
    pairs = [(i, j) for i in range(rods) for j in range(i + 2, rods)]
    checked = [check_pair(positions, i, j, dimensions, 2.0 * radius_m) for i, j in pairs]
    way_m = float(np.linalg.norm(np.diff(positions[:, 0], axis=0), axis=1).sum())
    return max(m for m, _ in checked), sum(n for _, n in checked), way_m


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--program", default=ROOT / "target/release/sidestep")
    args = parser.parse_args()
    print("base       runs  overlap  deepest [m]  pass through  way of the tip [m, mean]")
    for base, dimensions in product(("free", "fixed", "rail"), (2, 3)):
        runs = [check_run(args.program, base, dimensions, seed) for seed in range(1, args.seeds + 1)]
        overlaps = sum(overlap_m > ROUNDING_M for overlap_m, _, _ in runs)
        passes = sum(count > 0 for _, count, _ in runs)
        deepest_m = max(overlap_m for overlap_m, _, _ in runs)
        way_m = sum(way_m for _, _, way_m in runs) / len(runs)
        name = f"{base} {dimensions}-D"
        print(f"{name:9} {len(runs):5} {overlaps:8} {deepest_m:12.6f} {passes:13} {way_m:26.2f}", flush=True)


if __name__ == "__main__":
    main()
