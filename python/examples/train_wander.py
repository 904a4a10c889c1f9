"""Trains a small policy that goes as far as `wander` and touches less, with NumPy alone, by an evolution strategy.

    python python/examples/train_wander.py              trains, then judges over 100 fresh seeds
    python python/examples/train_wander.py --steps 5    a quick look

The policy is linear: a score for going on and one for turning, from the reports of a robot's eight sonars now and
before, from contacts, and from its last action. A turn to the right is a turn to the left in a mirror, so both share
their weights.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sidestep
from sidestep import stats

HALL = """
........................................
........................................
....####..........######..........##....
....####..........######..........##....
........................................
..............##..............##........
..............##..............##........
........................................
....##....##..........######............
....##....##..........######......####..
..................................####..
........................................
............####............##..........
............####............##..........
........................................
........................................
"""
#: Contacts cost as much as this way brings.
CONTACT_M = 1.5
#: The numbers of the beams in a mirror: they are counted counterclockwise from ahead.
MIRROR = [0, 7, 6, 5, 4, 3, 2, 1]
FORWARD, LEFT, RIGHT = 0, 1, 2


def scenario(kind: str, cycles: int = 300) -> sidestep.Scenario:
    """Returns the hall, with robots of this behavior."""
    robots = {"count": 20, "sensors": ["sonar-8"], "effector": "nomad", "behaviour": {"kind": kind}}
    return sidestep.Scenario(
        {
            "world": "robots",
            "cycles": cycles,
            "map": {"ascii": HALL},
            "robots": [robots],
            "people": {"count": 5},
        }
    )


def features(observed: dict[str, NDArray[Any]], state: dict[str, Any]) -> list[NDArray[Any]]:
    """Returns the features that a policy sees, of the shape (robots, features): as they are, and in a mirror."""
    n = len(observed["contact"])
    nearness = np.eye(4)[observed["sonar-8_class"]]
    # Bodies that move by themselves, near and at a medium distance.
    moving = (observed["sonar-8_report"] >= 3)[:, :, None] * nearness[:, :, :2]
    before = state.get("nearness", nearness)
    last = np.eye(3)[state.get("action", np.zeros(n, dtype=int))]
    front = (observed["contact_side"] == 1)[:, None]
    touched = (observed["contact"] > 0)[:, None]
    one = np.ones((n, 1))

    def seen(beams: list[int], turns: list[int]) -> NDArray[Any]:
        ahead = [beams[7], beams[0], beams[1]]
        parts = [nearness[:, beams], moving[:, beams], before[:, ahead], last[:, turns], touched, front, one]
        return np.hstack([part.reshape(n, -1) for part in parts])

    state["nearness"] = nearness
    return [seen(list(range(8)), [FORWARD, LEFT, RIGHT]), seen(MIRROR, [FORWARD, RIGHT, LEFT])]


def first_weights() -> NDArray[Any]:
    """Returns weights to begin with, of the shape (2, features): go on, but turn where something is near ahead."""
    weights = np.zeros((2, 66))
    weights[0, -1] = 1.0  # go on
    weights[0, 0] = -2.0  # not where it is near ahead
    weights[1, 4 * 7] = -0.5  # turn left, unless it is nearer to the left than to the right
    weights[1, 4 * 1] = -1.0
    weights[1, 8 * 4 + 8 * 2 + 3 * 4 + LEFT] = 1.0  # turn on
    return weights


def run(weights: NDArray[Any], seed: int, cycles: int) -> tuple[float, float]:
    """Returns contacts and way in m of a run in which the policy decides."""

    def decide(observed: dict[str, NDArray[Any]], state: dict[str, Any]) -> NDArray[Any]:
        seen, mirrored = features(observed, state)
        scores = np.stack([0.5 * (seen + mirrored) @ weights[0], seen @ weights[1], mirrored @ weights[1]])
        state["action"] = scores.argmax(axis=0)
        action: NDArray[Any] = state["action"]
        return action

    sim = sidestep.Simulation(scenario("external", cycles), seed=seed)
    sim.run(decide=decide)
    metrics = sim.metrics()
    return metrics["contacts"], metrics["distance_m"]


def fitness(task: tuple[NDArray[Any], int, int]) -> float:
    """Returns the way in m, less the cost of contacts: the quantity that the strategy raises."""
    contacts, distance_m = run(*task)
    return distance_m - CONTACT_M * contacts


def train(steps: int, pairs: int, cycles: int, pool: ProcessPoolExecutor) -> tuple[NDArray[Any], list[float]]:
    """Returns the trained weights, and the fitness of the middle of the population at each step."""
    rng = np.random.default_rng(1)
    weights, spread, rate, momentum = first_weights(), 0.15, 0.25, np.zeros((2, 66))
    curve = []
    for step in range(steps):
        # Each pair, in opposite directions, is tried with a seed of its own: fresh luck, but the same for both.
        noise = rng.standard_normal((pairs, 2, 66))
        seeds = 1_000_000 + step * pairs + np.arange(pairs)
        tasks = [
            (weights + sign * spread * one, int(seed), cycles)
            for one, seed in zip(noise, seeds, strict=True)
            for sign in (1.0, -1.0)
        ]
        found = np.array(list(pool.map(fitness, tasks, chunksize=4))).reshape(pairs, 2)
        curve.append(float(found.mean()))
        difference = found[:, 0] - found[:, 1]
        difference /= np.abs(difference).mean() + 1e-9
        momentum = 0.7 * momentum + np.einsum("p,pij->ij", difference, noise) / pairs
        weights = weights + rate * momentum * (1.0 - 0.7 * step / steps)
        print(f"step {step + 1:3} of {steps}: {curve[-1]:7.1f} m less contacts", flush=True)
    return weights, curve


def judge(weights: NDArray[Any], seeds: range, cycles: int, pool: ProcessPoolExecutor) -> dict[str, stats.Paired]:
    """Compares the policy with `wander` on the same seeds, none of which it was trained on."""
    wander = sidestep.sweep(scenario("wander", cycles), replicate=len(seeds), seed=seeds[0])
    tasks = [weights] * len(seeds), seeds, [cycles] * len(seeds)
    own = np.array(list(pool.map(run, *tasks, chunksize=5)))
    return {
        "contacts": stats.paired(own[:, 0], wander.values("contacts")),
        "distance_m": stats.paired(own[:, 1], wander.values("distance_m")),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=60, help="steps of the strategy [60]")
    parser.add_argument("--pairs", type=int, default=24, help="pairs of trials in a step [24]")
    parser.add_argument("--cycles", type=int, default=300, help="cycles of a trial [300]")
    parser.add_argument("--runs", type=int, default=100, help="fresh seeds to judge with [100]")
    parser.add_argument("--out", default="policy.npy", help="file for the weights [policy.npy]")
    args = parser.parse_args()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        weights, _ = train(args.steps, args.pairs, args.cycles, pool)
        np.save(args.out, weights)
        fresh = range(5_000_000, 5_000_000 + args.runs)
        for metric, found in judge(weights, fresh, args.cycles, pool).items():
            assert found.interval is not None
            low, high = found.interval
            print(
                f"{metric}: {found.difference:+.1f} [{low:+.1f}, {high:+.1f}] against wander in {found.n} pairs, "
                f"lower in {found.lower}, higher in {found.higher}"
            )


if __name__ == "__main__":
    main()
