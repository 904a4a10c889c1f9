"""A planner of your own for a team of robots, beside PIBT; and the same planner learns: python python/examples/planner.py

Two rooms are joined by two corridors in which nobody can pass. Robots go along the paths that are cheapest by a table of
prices, of entering a box with a heading. With equal prices they meet head on in the corridors.
"""

import argparse

import numpy as np

import sidestep
from sidestep import stats

HALL = "......##########......\n......................\n......##########......\n"
FLOOR = "#" * 24 + "\n" + "".join(f"#{row}#\n" for row in (HALL * 2).split()) + "#" * 24
SHUTTLE = {"kind": "shuttle", "a": [1, 1, 3, 6], "b": [20, 1, 3, 6]}
FORWARD, LEFT, RIGHT, STAY = range(4)
STEPS = [(1, 0), (0, 1), (-1, 0), (0, -1)]  # east, north, west, south
WALLS = np.array([[box == "#" for box in row] for row in FLOOR.split()[::-1]]).T


def costs(prices, goal):
    cost = np.full(WALLS.shape, np.inf)
    cost[goal] = 0.0
    while True:  # the cheapest way from each box, until no way is cheaper any more
        ways = [np.roll(prices[:, :, h] + cost, (-east, -north), (0, 1)) for h, (east, north) in enumerate(STEPS)]
        if (cheaper := np.minimum(cost, np.min(ways, axis=0))).tolist() == cost.tolist():
            return cost
        cost = cheaper


def planner(prices, draws, known):
    def plan(observed, state):
        at = [(int(col), int(row)) for col, row in observed["at_boxes"]]
        taken, actions = set(at), np.full(len(at), STAY)
        for robot in draws.permutation(len(at)):
            goal = tuple(int(n) for n in observed["goal_boxes"][robot])
            known[goal] = known[goal] if goal in known else costs(prices, goal)
            boxes = [(at[robot][0] + east, at[robot][1] + north) for east, north in STEPS]
            scores = [prices[box][heading] + known[goal][box] for heading, box in enumerate(boxes)]
            first, second = np.argsort(scores)[:2]  # the second is for who finds its way taken, now and then
            heading = (
                second if boxes[first] in taken and np.isfinite(scores[second]) and draws.random() < 0.5 else first
            )
            turn = (heading - observed["heading"][robot]) % 4
            actions[robot] = RIGHT if turn == 3 else LEFT if turn else STAY if boxes[heading] in taken else FORWARD
            taken.add(boxes[heading] if actions[robot] == FORWARD else at[robot])
        return actions

    return plan


def trips(method, seeds, prices=None):
    team = {"count": 10, "effector": "nomad", "behaviour": SHUTTLE, "planner": {"method": method}}
    world = sidestep.Scenario({"world": "robots", "cycles": 400, "map": {"ascii": FLOOR}, "robots": team})
    counts = []
    for seed in seeds:
        sim = sidestep.Simulation(world, seed=seed)
        sim.run(decide=None if prices is None else planner(prices, np.random.default_rng(seed), {}))
        counts.append(float(sim.metrics()["trips"]))
    return counts


options = argparse.ArgumentParser()
options.add_argument("--rounds", type=int, default=20, help="tries of other prices")
options.add_argument("--runs", type=int, default=20, help="seeds to judge with")
given = options.parse_args()
rounds, runs = given.rounds, given.runs
ones = np.where(WALLS[:, :, None], np.inf, np.ones((*WALLS.shape, 4)))
best, most, draws = ones, sum(trips("external", range(1000, 1004), ones)), np.random.default_rng(1)
for _ in range(rounds):  # other prices of going east or west along some rows
    tried = best.copy()
    for row, heading in zip(draws.integers(1, 7, 3), draws.choice([0, 2], 3), strict=True):
        tried[:, row, heading] *= draws.choice([0.25, 4.0])
    if (count := sum(trips("external", range(1000, 1004), tried))) > most:
        best, most = tried, count
results = {"pibt": trips("pibt", range(1, runs + 1))}
results |= {"before": trips("external", range(1, runs + 1), ones), "after": trips("external", range(1, runs + 1), best)}
print(*(f"{name}: {np.mean(counts):.1f} trips" for name, counts in results.items()), sep="\n")
gain = stats.paired(results["after"], results["before"])
low, high = gain.interval or (gain.difference, gain.difference)
print(f"gain by learning: {gain.difference:.1f} [{low:.1f}, {high:.1f}] trips in {runs} pairs")
