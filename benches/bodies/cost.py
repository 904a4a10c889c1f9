#!/usr/bin/env python3
"""What the own body of a chain costs: processor time of whole runs with it, over that of the same runs without.

    cargo build --release
    python benches/bodies/cost.py [--repeats 5] [--program target/release/sidestep]

Chains in a line, of 10,000 and 100,000 connectors and of rods of 0.05 and 0.1 m, are led to three targets around two
corners; then shipped scenarios, whose chains move otherwise without an own body. Of each run the least time of the repeats
counts, less that of a run of one cycle, which is what reading and starting takes. The exponent is that with which the time
of a cycle grows from the shorter chain to the longer one.
"""

import argparse
import math
import resource
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SHIPPED = ["serpentine", "snake3d", "hemmed-in", "default"]

LINE = """\
format = 1
world = "chain"
seed = 1
[chain]
dimensions = 3
dt_s = 0.02
[[chains]]
connectors = {connectors}
rod_m = {rod_m}
rod_radius_m = 0.008
radius_m = 0.02
[[chains.tasks]]
kind = "targets"
speed_m_s = 0.5
targets_m = [[8.0, 1.0, 0.5], [4.0, 12.0, 3.0], [20.0, 20.0, 3.0]]
"""


def run_s(program, scenario, is_solid, cycles=None):
    """Returns the processor seconds of a run."""
    command = [program, "run", scenario, "--workers", "1", "--quiet"]
    command += ["--set", f"chain.self_collision={str(is_solid).lower()}"]
    if cycles is not None:
        command += ["--cycles", str(cycles)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def moving_s(arguments, scenario, is_solid, cycles=None):
    """Returns the processor seconds of the cycles of a run but the first."""
    repeats = range(arguments.repeats)
    whole_s = min(run_s(arguments.program, scenario, is_solid, cycles) for _ in repeats)
    start_s = min(run_s(arguments.program, scenario, is_solid, 1) for _ in repeats)
    return whole_s - start_s


def print_row(name, solid_s, open_s):
    print(f"{name:32} {solid_s:8.3f} {open_s:8.3f} {solid_s / open_s:6.2f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--program", default=str(ROOT / "target/release/sidestep"))
    arguments = parser.parse_args()
    print(f"{'chain':32} {'solid s':>8} {'open s':>8} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "line.toml"
        for rod_m in [0.05, 0.1]:
            cycle_s = []
            for connectors, cycles in [(10_000, 2000), (100_000, 2000)]:
                scenario.write_text(LINE.format(connectors=connectors, rod_m=rod_m))
                solid_s = moving_s(arguments, scenario, True, cycles)
                open_s = moving_s(arguments, scenario, False, cycles)
                cycle_s.append(solid_s / cycles)
                print_row(f"{connectors:,} in a line, {rod_m} m", solid_s, open_s)
            print(f"  exponent {math.log10(cycle_s[1] / cycle_s[0]):.3f}")
    for name in SHIPPED:
        scenario = ROOT / f"scenarios/chain/{name}.toml"
        print_row(f"{name}.toml", moving_s(arguments, scenario, True), moving_s(arguments, scenario, False))


if __name__ == "__main__":
    main()
