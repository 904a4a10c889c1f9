"""Steps a second and memory beside other simulators, on the task of theirs that is nearest.

    python python/benches/beside.py

One world with 10, 100 and 1,000 robots at one density; all of them observe and get a random action in every step. It counts agent-steps per
CPU second of one thread, the best of several tries, and the peak of memory of a process that runs these alone, with what it
imports. Packages that are not installed (``vmas``, ``pogema``, ``mpe2``) are left out, and named.

They are not the same task, so the figures tell the order of magnitude and no more:

* Sidestep: robots on a grid of boxes; eight beams each that err as measured, actions that err, contacts, all rules kept to the
  bit. Arrays are `Simulation.order`, `step` and `observe`; dicts are PettingZoo's interface.
* VMAS (scenario `navigation`): discs in continuous space, forces and collisions by pairs, a lidar of 12 rays. It is made to step
  thousands of small worlds at once on a GPU; one large world on a processor is its worst case, so 32 worlds of 10 are shown, too.
* Tasks of ``sidestep.envs.tasks``: observations of float32 from -1 to 1, rewards of named terms and masks, as learners take them.
* MPE (``simple_spread``): discs in the plane, by PettingZoo's dicts. CartPole: Gymnasium's vector of 256, an environment of one agent.
* POGEMA: robots on a grid that see the cells within 5 of them, without errors; moves that would collide are canceled.
"""

from __future__ import annotations

import importlib.util
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np

import sidestep

#: Robots, and the side of their floor in boxes.
SIZES = ((10, 20), (100, 60), (1000, 190))
#: Seconds that a try takes at least.
TRY_S = 1.0


def rate(step: Callable[[], object], agents: int) -> float:
    """Returns agent-steps per CPU second, the best of three tries."""
    step()
    rates = []
    for _ in range(3):
        steps, started = 0, time.process_time()
        while (took := time.process_time() - started) < TRY_S:
            step()
            steps += 1
        rates.append(agents * steps / took)
    return max(rates)


def floor(count: int, side: int) -> dict[str, object]:
    robots = {"count": count, "sensors": ["sonar-8"], "effector": "nomad", "behaviour": {"kind": "external"}}
    return {"world": "robots", "cycles": 10**9, "map": {"ascii": "\n".join(["." * side] * side)}, "robots": [robots]}


def ours() -> Iterator[tuple[str, int, float]]:
    rng = np.random.default_rng(1)
    for count, side in SIZES:
        sim = sidestep.Simulation(floor(count, side), seed=1)

        def arrays(sim: sidestep.Simulation = sim, count: int = count) -> None:
            sim.order("action", rng.integers(0, 3, count))
            sim.step()
            sim.observe()

        yield "Sidestep, arrays", count, rate(arrays, count)
    batch = sidestep.Batch(floor(10, 20), 32)

    def worlds() -> None:
        batch.order("action", rng.integers(0, 3, (32, 10)))
        batch.step()
        batch.observe()

    yield "Sidestep, 32 worlds of 10", 320, rate(worlds, 320)
    if importlib.util.find_spec("pettingzoo") is None:
        print("left out: Sidestep by dicts, since pettingzoo is not installed")
        return
    from sidestep.envs import parallel_env

    for count, side in SIZES:
        env = parallel_env(floor(count, side))
        env.reset(seed=1)

        def dicts(env: object = env, count: int = count) -> None:
            env.step(dict(zip(env.agents, rng.integers(0, 3, count).tolist(), strict=True)))

        yield "Sidestep, PettingZoo's dicts", count, rate(dicts, count)


def our_tasks() -> Iterator[tuple[str, int, float]]:
    from sidestep.envs import tasks

    for name, worlds in (("CorridorCounterflow-v0", 256), ("Exploration-v0", 256), ("Superconflict-v0", 32)):
        batch = tasks.batch_env(name, worlds, copy=False)
        batch.reset(seed=1)
        batch.action_space.seed(1)
        drawn = [batch.action_space.sample() for _ in range(16)]
        turn = iter(range(10**9))

        def step(batch: tasks.TaskBatch = batch, drawn: list[object] = drawn, turn: Iterator[int] = turn) -> None:
            batch.step(drawn[next(turn) % len(drawn)])

        agents = worlds * len(batch.agents)
        yield f"Sidestep, {name}", agents, rate(step, agents)


def mpe() -> Iterator[tuple[str, int, float]]:
    from mpe2 import simple_spread_v3

    rng = np.random.default_rng(1)
    env = simple_spread_v3.parallel_env(N=10, max_cycles=10**9)
    env.reset(seed=1)

    def step() -> None:
        env.step(dict(zip(env.agents, rng.integers(0, 5, 10).tolist(), strict=True)))

    yield "MPE, simple_spread", 10, rate(step, 10)


def cart_pole() -> Iterator[tuple[str, int, float]]:
    import gymnasium

    env = gymnasium.make_vec("CartPole-v1", num_envs=256)
    env.reset(seed=1)
    yield "CartPole, a vector of 256", 256, rate(lambda: env.step(env.action_space.sample()), 256)


def vmas() -> Iterator[tuple[str, int, float]]:
    import torch
    from vmas import make_env

    torch.set_num_threads(1)
    for count, worlds in ((10, 1), (100, 1), (10, 32)):
        side_m = 0.35 * count**0.5
        env = make_env(
            "navigation", num_envs=worlds, device="cpu", continuous_actions=False, seed=1, n_agents=count,
            world_spawning_x=side_m, world_spawning_y=side_m, enforce_bounds=False, collisions=True,
        )  # fmt: skip
        env.reset()

        def step(env: object = env, count: int = count, worlds: int = worlds) -> None:
            env.step([torch.randint(0, 5, (worlds,)) for _ in range(count)])

        name = "VMAS" if worlds == 1 else f"VMAS, {worlds} worlds of {count}"
        yield name, count * worlds, rate(step, count * worlds)


def pogema() -> Iterator[tuple[str, int, float]]:
    from pogema import GridConfig, pogema_v0

    rng = np.random.default_rng(1)
    for count, side in SIZES:
        config = GridConfig(
            num_agents=count, size=side, density=0.0, obs_radius=5, seed=1, max_episode_steps=10**9,
            on_target="restart",
        )  # fmt: skip
        env = pogema_v0(config)
        env.reset()

        def step(env: object = env, count: int = count) -> None:
            env.step(rng.integers(0, 5, count).tolist())

        yield "POGEMA", count, rate(step, count)


#: The figures by simulator, and the package that they need.
FIGURES = {
    "Sidestep": ("sidestep", ours),
    "Sidestep's tasks": ("gymnasium", our_tasks),
    "VMAS": ("vmas", vmas),
    "POGEMA": ("pogema", pogema),
    "MPE": ("mpe2", mpe),
    "CartPole": ("gymnasium", cart_pole),
}


def measure(name: str) -> None:
    """Prints the figures of a simulator, and the peak of memory of this process."""
    try:
        for what, agents, found in FIGURES[name][1]():
            print(f"{what:<34} {agents:>6} agents {found:>14,.0f} agent-steps per CPU second", flush=True)
    except Exception as error:  # Another version of it, or of its needs: that is said, and the others go on.
        print(f"left out: {name}, which does not run here: {type(error).__name__}: {error}")
        return
    peak_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"{name + ', peak of memory':<34} {peak_kib / 1024:>21,.0f} MiB", flush=True)


def main() -> None:
    for name, (package, _) in FIGURES.items():
        if importlib.util.find_spec(package) is None:
            print(f"left out: {name}, since it is not installed (pip install {package}, in an environment of its own)")
            continue
        # A process each: what one imports is not in the memory of the next.
        subprocess.run([sys.executable, __file__, name], check=False)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        measure(sys.argv[1])
    else:
        main()
