"""A planner of your own for a team of robots, beside PIBT; and the same planner learns where to go which way.

    python python/examples/planner.py                   flies both, learns, and judges over 20 fresh seeds
    python python/examples/planner.py --rounds 5        a quick look

Two rooms are joined by two corridors in which nobody can pass. The planner sends each robot along a path that is cheapest
by a table of prices, of entering a box in a direction. All prices are 1 at first, so robots meet head on in the corridors.
It learns by trying other prices, and keeps those with which more goods arrive.
"""

from __future__ import annotations

import argparse
import heapq
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sidestep
from sidestep import stats

FLOOR = """
......##########......
......................
......##########......
......##########......
......................
......##########......
"""
FORWARD, LEFT, RIGHT, STAY = range(4)
STEPS = [(1, 0), (0, 1), (-1, 0), (0, -1)]


def scenario(method: str) -> sidestep.Scenario:
    """Returns the two rooms, with robots that carry goods to and fro, led by a planner."""
    goods = {"kind": "shuttle", "a": [0, 0, 3, 6], "b": [19, 0, 3, 6]}
    team = {"count": 10, "effector": "nomad", "behaviour": goods, "planner": {"method": method}}
    return sidestep.Scenario({"world": "robots", "cycles": 400, "map": {"ascii": FLOOR}, "robots": team})


class Planner:
    """Leads each robot along its cheapest path, and past others where it can."""

    def __init__(self, prices: NDArray[np.float64], seed: int = 0) -> None:
        """``prices[col, row, heading]`` is what it costs to enter a box with a heading; infinite for walls."""
        self.prices = prices
        self.cols, self.rows = prices.shape[0], prices.shape[1]
        self.costs: dict[tuple[int, int], NDArray[np.float64]] = {}
        self.draws = np.random.default_rng(seed)

    def cost(self, goal: tuple[int, int]) -> NDArray[np.float64]:
        """Returns the cost of the cheapest path from each box to a goal."""
        if goal not in self.costs:
            cost = np.full((self.cols, self.rows), np.inf)
            cost[goal] = 0.0
            queue = [(0.0, goal)]
            while queue:
                here, at = heapq.heappop(queue)
                for heading, (east, north) in enumerate(STEPS):
                    before = (at[0] - east, at[1] - north)
                    there = here + self.prices[at[0], at[1], heading]
                    inside = 0 <= before[0] < self.cols and 0 <= before[1] < self.rows
                    if inside and np.isfinite(self.prices[before[0], before[1], 0]) and there < cost[before]:
                        cost[before] = there
                        heapq.heappush(queue, (there, before))
            self.costs[goal] = cost
        return self.costs[goal]

    def __call__(self, observed: dict[str, NDArray[Any]], state: Any) -> NDArray[np.int64]:
        """Returns the next action of each robot."""
        places = [(int(col), int(row)) for col, row in observed["at_boxes"]]
        taken = set(places)
        actions = np.full(len(places), STAY)
        for robot in self.draws.permutation(len(places)):
            goal = tuple(int(n) for n in observed["goal_boxes"][robot])
            (col, row), turned = places[robot], int(observed["heading"][robot])
            ahead = [(col + east, row + north) for east, north in STEPS]
            cost = self.cost((goal[0], goal[1]))
            inside = [0 <= c < self.cols and 0 <= r < self.rows for c, r in ahead]
            scores = [
                self.prices[box[0], box[1], h] + cost[box] + 0.1 * ((h - turned) % 4 != 0) if ok else np.inf
                for h, (box, ok) in enumerate(zip(ahead, inside, strict=True))
            ]
            # Whoever finds its way taken tries the next best one now and then.
            ways = [int(h) for h in np.argsort(scores) if np.isfinite(scores[h])]
            rank = 0 if ahead[ways[0]] not in taken or self.draws.random() < 0.5 else min(1, len(ways) - 1)
            heading = ways[rank]
            if heading != turned:
                actions[robot] = RIGHT if (turned - heading) % 4 == 1 else LEFT
            elif ahead[heading] not in taken:
                actions[robot] = FORWARD
                taken.add(ahead[heading])
        return actions


def walls_and_ones() -> NDArray[np.float64]:
    """Returns the prices before anything is learned."""
    rows = FLOOR.split()[::-1]
    prices = np.ones((len(rows[0]), len(rows), 4))
    prices[[[box == "#" for box in row] for row in zip(*rows, strict=True)]] = np.inf
    return prices


def trips(method: str, seeds: range, prices: NDArray[np.float64] | None = None) -> list[float]:
    """Returns the trips of a run with each seed; with prices, this planner leads."""
    planned = scenario(method)
    counts = []
    for seed in seeds:
        sim = sidestep.Simulation(planned, seed=seed)
        sim.run(decide=None if prices is None else Planner(prices, seed))
        counts.append(float(sim.metrics()["trips"]))
    return counts


def learn(rounds: int) -> NDArray[np.float64]:
    """Returns the prices with which most goods arrived, of those tried: along a row, a heading may cost more or less."""
    draws = np.random.default_rng(1)
    train = range(1000, 1004)
    best = walls_and_ones()
    most = sum(trips("external", train, best))
    for number in range(1, rounds + 1):
        tried = best.copy()
        for _ in range(3):
            row, heading = draws.integers(tried.shape[1]), 2 * draws.integers(2)
            tried[:, row, heading] *= draws.choice([0.25, 4.0])
        count = sum(trips("external", train, tried))
        if count > most:
            best, most = tried, count
        print(f"round {number} of {rounds}: {most / len(train):.1f} trips")
    return best


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=20, help="tries of other prices")
    options.add_argument("--runs", type=int, default=20, help="seeds to judge with")
    given = options.parse_args()
    seeds = range(1, given.runs + 1)
    by_pibt = trips("pibt", seeds)
    before = trips("external", seeds, walls_and_ones())
    after = trips("external", seeds, learn(given.rounds))
    for name, counts in {"pibt": by_pibt, "before": before, "after": after}.items():
        print(f"{name}: {np.mean(counts):.1f} trips")
    gain = stats.paired(after, before)
    low, high = gain.interval or (gain.difference, gain.difference)
    print(f"gain by learning: {gain.difference:.1f} [{low:.1f}, {high:.1f}] trips in {given.runs} pairs")


if __name__ == "__main__":
    main()
