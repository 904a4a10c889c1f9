"""The cost of Python: figures beside the bars that the package is held to. Ratios are of one run.

    python python/benches/bars.py

Needs polars for the table, and gymnasium and pettingzoo for the environments, and Ray for its tasks; leaves out the
parts without their package.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import sidestep
from sidestep import _engines


def robots(count: int, side: int, **keys: object) -> dict[str, object]:
    """A floor of side x side boxes with external robots of eight beams."""
    return {
        "world": "robots",
        "cycles": 10**9,
        "map": {"ascii": "\n".join(["." * side] * side)},
        "robots": [{"count": count, "sensors": ["sonar-8"], "behaviour": {"kind": "external"}}],
        **keys,
    }


def best(work: Callable[[], object], times: int = 7) -> float:
    """Returns the least CPU seconds of several tries."""
    took = []
    for _ in range(times):
        started = time.process_time()
        work()
        took.append(time.process_time() - started)
    return min(took)


def told(what: str, figure: str, bar: str) -> None:
    print(f"{what:<58} {figure:>24}   bar {bar}")


def steps() -> None:
    sim = sidestep.Simulation(robots(100, 60))
    n = 2000
    alone = best(lambda: sim.step(n)) / n

    def one_by_one() -> None:
        for _ in range(n):
            sim.step()

    single = best(one_by_one) / n
    figure = f"{(single - alone) * 1e6:.1f} us ({alone * 1e6:.1f} alone)"
    told("step() of 100 robots, more than the same cycle in Rust", figure, "10 us")


def behavior() -> None:
    outside = sidestep.Simulation(robots(1000, 150))
    forward = {"kind": "random", "weights": {"forward": 1}}
    own = [{"count": 1000, "sensors": ["sonar-8"], "behaviour": forward}]
    inside = sidestep.Simulation({**robots(1000, 150), "robots": own})
    n = 200
    zeros = np.zeros(1000)

    def run() -> None:
        for _ in range(n):
            outside.observe()
            outside.order("action", zeros)
            outside.step()

    # In turns, so that other work on the machine slows both down.
    pairs = [(best(run, 1) / n, best(lambda: inside.step(n), 1) / n) for _ in range(9)]
    python, rust = (min(took) for took in zip(*pairs, strict=True))
    assert outside.digest == inside.digest, "both drive forward alike"
    figure = f"{(python - rust) * 1e6:.0f} us (+ {rust * 1e6:.0f} in Rust)"
    told("arrays of a behavior, 1,000 agents, more than in Rust", figure, "50 us")


def classes() -> None:
    """An object that decides for each agent, beside one function in arrays."""

    class Ahead:
        def __init__(self, agent: int) -> None:
            pass

        def decide(self, observed: dict[str, object]) -> int:
            return 0

    zeros, took, n = np.zeros(100), [], 200
    for decide in (lambda observed, state: zeros, sidestep.each(Ahead)):
        sim = sidestep.Simulation(robots(100, 60))
        took.append(best(lambda sim=sim, decide=decide: sim.run(sim.cycle + n, decide=decide)) / n)
    figure = f"{(took[1] - took[0]) / 100 * 1e6:.2f} us"
    told("a class per agent, more than arrays, an agent and cycle", figure, "none, it is told")


def threads() -> None:
    """Two threads with a simulation each, beside one thread with one: the lock of Python is released."""
    sims, walls = [sidestep.Simulation(robots(100, 60)) for _ in range(2)], []
    for _ in range(7):
        for together in (1, 2):
            workers = [threading.Thread(target=sim.step, args=(3000,)) for sim in sims[:together]]
            started = time.perf_counter()
            for worker in workers:
                worker.start()
            for worker in workers:
                worker.join()
            walls.append((together, time.perf_counter() - started))
    one, two = (min(wall for each, wall in walls if each == together) for together in (1, 2))
    told("two threads with a simulation each, beside one", f"{two / one:.2f} times as long", "1.0, on two free cores")


def interrupts() -> None:
    """The time from Ctrl-C until the caller has its exception."""
    program = (
        "import sidestep, sys, time\n"
        f"sim = sidestep.Simulation({robots(1000, 150)!r})\n"
        "for _ in range(10):\n"
        "    try:\n"
        "        print('running', flush=True)\n"
        "        sim.run()\n"
        "    except KeyboardInterrupt:\n"
        "        print(time.monotonic(), flush=True)\n"
    )
    took = []
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        for _ in range(10):
            assert run.stdout.readline() == "running\n"
            time.sleep(0.2)
            sent = time.monotonic()
            run.send_signal(signal.SIGINT)
            took.append(float(run.stdout.readline()) - sent)
    told("Ctrl-C in a run of 1,000 robots, the longest of ten", f"{max(took) * 1e3:.0f} ms", "50 ms")


def worlds() -> None:
    actions = np.zeros((256, 10))
    rates, walls = [], []
    batches = [sidestep.Batch(robots(10, 12), 256, workers=workers) for workers in (1, 2)]
    outs = [batch.observe() for batch in batches]
    # Threads that have nothing in common show the speed of the machine's cores at that time.
    halves = [sidestep.Batch(robots(10, 12), 128) for _ in range(2)]
    half_outs = [batch.observe() for batch in halves]

    def run(batch: sidestep.Batch, out: dict[str, np.ndarray], actions: np.ndarray) -> None:
        for _ in range(20):
            batch.order("action", actions)
            batch.step()
            batch.observe(out=out)

    def run_halves() -> None:
        works = zip(halves, half_outs, (actions[:128], actions[128:]), strict=True)
        threads = [threading.Thread(target=run, args=work) for work in works]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    ways = [lambda k=k: run(batches[k], outs[k], actions) for k in (0, 1)]
    # In turns, so that other work on the machine slows all of them down.
    for _ in range(40):
        for k, way in enumerate([*ways, run_halves]):
            cpu, wall = time.process_time(), time.perf_counter()
            way()
            took = time.process_time() - cpu, time.perf_counter() - wall
            rates.append((k, 256 * 10 * 20 / took[0]))
            walls.append((k, took[1]))
    rate = max(rate for k, rate in rates if k == 0)
    one, two, apart = (min(wall for each, wall in walls if each == k) for k in (0, 1, 2))
    figure = f"{rate / 1e6:.2f} million"
    told("256 worlds x 10 robots, agent-steps per CPU second", figure, "2 million")
    told("the same, 2 workers beside one", f"{one / two:.2f} times", "1.8 times")
    told("two threads of 128 worlds beside one of 256", f"{one / apart:.2f} times", "none, it is what the cores give")


def resets() -> None:
    scenario = sidestep.Scenario(robots(10, 12))
    n = 200
    batch = sidestep.Batch(scenario, 1)

    def restart() -> None:
        for seed in range(2, n + 2):
            batch.reset([seed])

    def reseed() -> None:
        for seed in range(2, n + 2):
            sidestep.Simulation(scenario, seed=seed)

    def compile_all() -> None:
        for seed in range(2, n + 2):
            sidestep.Simulation(scenario.set(seed=seed))

    fresh, quick, whole = best(restart) / n, best(reseed) / n, best(compile_all) / n
    figure = f"{fresh * 1e3:.3f} ms, {fresh / whole:.2f} of it"
    told("a fresh start of a world of 10 robots; beside compiling", figure, "0.2 ms, 0.20")
    figure = f"{quick * 1e3:.3f} ms, {quick / whole:.2f} of it"
    told("a Simulation of 10 robots by seed; beside compiling", figure, "0.2 ms, 0.20")


def table() -> None:
    try:
        import polars as pl
        import pyarrow as pa
    except ImportError:
        print("left out: a table to polars, since polars or pyarrow is not installed")
        return
    sim = sidestep.Simulation(robots(1000, 150), record=["trajectories"])
    sim.step(10_000)
    rows = sim.tables()["trajectories"]
    words = [
        name for name, ty in zip(rows.columns, pa.table(rows).schema.types, strict=True) if pa.types.is_dictionary(ty)
    ]
    plain = [name for name in rows.columns if name not in words]
    numbers = rows.select(plain)
    ours = [column.chunk(0).buffers()[1].address for column in pa.table(rows).select(plain)]
    theirs = [column.chunk(0).buffers()[1].address for column in pl.DataFrame(rows).select(plain).to_arrow()]
    same = sum(one == other for one, other in zip(ours, theirs, strict=True))
    took = best(lambda: pl.DataFrame(numbers))
    figure = f"{took * 1e3:.2f} ms, {same} of {len(plain)} columns at the same address"
    told(f"{len(rows):,} rows to polars, numbers", figure, "10 ms, no copy")
    both, labels = best(lambda: pl.DataFrame(rows)), pa.table(rows.select(words))
    own = best(lambda: pl.DataFrame(Stream(labels)))
    figure = f"{both * 1e3:.1f} ms ({own * 1e3:.1f} of a dictionary of pyarrow)"
    told(f"the same with {len(words)} column of words, which polars numbers anew", figure, "10 ms")


class Stream:
    """A table of pyarrow as nothing but an Arrow stream."""

    def __init__(self, table: object) -> None:
        self.table = table

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)  # type: ignore[attr-defined]


def environments() -> None:
    try:
        from sidestep.envs import parallel_env
    except ImportError:
        return
    for count, side in ((10, 20), (100, 60), (1000, 150)):
        env = parallel_env(robots(count, side))
        env.reset(seed=1)
        actions = dict.fromkeys(env.agents, 0)
        zeros = np.zeros(count)
        n = max(20, 5000 // count)

        def with_dicts(env=env, actions=actions, n=n) -> None:
            for _ in range(n):
                env.step(actions)

        def with_arrays(env=env, zeros=zeros, n=n) -> None:
            for _ in range(n):
                env.sim.order("action", zeros)
                env.sim.step()
                env.sim.observe()

        dicts, arrays = best(with_dicts) / n, best(with_arrays) / n
        figure = f"{(dicts - arrays) / count * 1e6:.2f} us, {count / dicts:,.0f}/s"
        told(f"PettingZoo, {count} agents: dicts per agent; agent-steps", figure, "1 us")


def sweeps() -> None:
    """Tasks of one cell each, on one process and on Ray; and longer ones on two processes against one."""
    floor = {**robots(20, 40), "cycles": 3000}
    floor["robots"] = [{"count": 20, "sensors": ["sonar-8"], "effector": "nomad"}]
    spawn = multiprocessing.get_context("spawn")
    usual, _engines.TASK_S = _engines.TASK_S, 0.0
    with ProcessPoolExecutor(1, mp_context=spawn) as pool:
        sidestep.sweep(floor, replicate=2, engine=pool)
        took = sidestep.sweep(floor, replicate=60, engine=pool).output["took"]
    told("a task of one run on a process, beside its simulation", overhead(took), "15 ms")
    if importlib.util.find_spec("ray"):
        ray = importlib.import_module("ray")
        ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False, object_store_memory=120_000_000)
        sidestep.sweep(floor, replicate=2, engine="ray")
        took = sidestep.sweep(floor, replicate=60, engine="ray").output["took"]
        ray.shutdown()
        told("a task of one run on Ray, beside its simulation", overhead(took), "15 ms")
    _engines.TASK_S = usual
    walls = []
    for workers in (1, 2):
        with ProcessPoolExecutor(workers, mp_context=spawn) as pool:
            sidestep.sweep(floor, replicate=2 * workers, engine=pool)
            swept = sidestep.sweep(floor, set={"cycles": 20_000}, replicate=40, engine=pool)
        walls.append(swept.output["took"]["wall_s"])
    told("a sweep on two processes against one", f"{walls[0] / walls[1]:.2f} times as fast", "1.8 times")


def overhead(took: dict[str, float]) -> str:
    return f"{took['overhead_ms_per_run']:.1f} ms (+ {took['simulation_s_per_run'] * 1e3:.0f} to run)"


def loading() -> None:
    program = (
        "import time, numpy\n"
        "resident = lambda: int(open('/proc/self/statm').read().split()[1]) * 4096 / 2**20\n"
        "before, started = resident(), time.perf_counter()\n"
        "import sidestep\n"
        "print((time.perf_counter() - started) * 1e3, resident() - before)"
    )
    runs = [
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True) for _ in range(5)
    ]
    took, size = min(tuple(map(float, run.stdout.split())) for run in runs)
    told("import sidestep, beside NumPy", f"{took:.0f} ms, {size:.1f} MB", "100 ms, 15 MB")


#: A program that learns from as many rows as its last argument says. It prints the CPU seconds, and the memory in MB
#: beside the columns at its peak.
LEARNING = """
import resource, sys, numpy as np
from sidestep import learn
rng, n = np.random.default_rng(1), int(sys.argv[2])
code = rng.integers(0, 4, n)
moves = {
    "action": np.array(["forward", "left", "right", "stay"])[code],
    "ahead_boxes": (code == 0) + rng.normal(0.0, 0.1, n),
    "left_boxes": rng.normal(0.0, 0.05, n),
    "turn_deg": np.array([0.0, 90.0, -90.0, 0.0])[code] + rng.normal(0.0, 5.0, n),
}
there = rng.uniform(size=n) < 0.8
true_m = rng.uniform(0.1, 6.0, n)
readings = {
    "true": np.array(["nothing", "wall"])[there.astype(int)],
    "reported": np.array(["nothing", "wall"])[(there ^ (rng.uniform(size=n) < 0.05)).astype(int)],
    "true_distance_m": true_m,
    "reported_distance_m": np.abs(true_m + rng.normal(0.0, 0.05, n)),
}
del code, there, true_m
# What was needed to make the columns may be more than what learning needs: it is filled to the peak before.
used = lambda: resource.getrusage(resource.RUSAGE_SELF)
resident = int(open("/proc/self/statm").read().split()[1]) * resource.getpagesize()
filled = np.ones(max(0, used().ru_maxrss * 1024 - resident), np.uint8)
before = used()
if sys.argv[1] == "effector":
    learn.effector(moves)
else:
    learn.sensor(readings)
after = used()
took_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
print(took_s, (after.ru_maxrss - before.ru_maxrss) * 1024 / 1e6)
"""


def learning() -> None:
    """Error models from 10 million rows of arrays, in a process of its own, which has a peak of its own."""
    for kind in ("effector", "sensor"):
        line = [sys.executable, "-c", LEARNING, kind, "10000000"]
        done = subprocess.run(line, capture_output=True, text=True, check=True)
        took_s, size_mb = map(float, done.stdout.split())
        figure = f"{took_s:.1f} CPU s, {size_mb:.0f} MB"
        told(
            f"an {kind} of 10 million rows, beside the columns" if kind == "effector" else f"a {kind} of as many",
            figure,
            "5 CPU s, 300 MB",
        )


if __name__ == "__main__":
    for part in (
        steps, behavior, classes, worlds, resets, table, threads, interrupts, environments, sweeps, loading, learning,
    ):  # fmt: skip
        part()
