"""Solves the games of `cargo bench -p sidestep-airspace --bench optima -- --games FILE` with toulbar2.

    pip install pytoulbar2
    python benches/optima/beside_toulbar2.py FILE

It prints, by number of airplanes, how often toulbar2 agrees with the least cost that the bench knows, and its time.
"""

import json
import math
import sys
import time

import pytoulbar2

#: Digits after the point of the costs that toulbar2 computes with: its costs are whole numbers.
DIGITS = 3
#: Seconds for each game.
TIMEOUT_S = 20


def solve(game):
    """Returns the least cost, or None if the time was not enough, and the seconds that it took."""
    # Costs far above the best joint action known are all equally bad, and keep sums within 64 bits.
    limit = 10 * game["least"] + 1000.0
    network = pytoulbar2.CFN(limit, resolution=DIGITS)
    for player, own in enumerate(game["own"]):
        network.AddVariable(f"x{player}", range(len(own)))
        network.AddFunction([player], [min(cost, limit) for cost in own])
    for a, b, costs in game["pairs"]:
        network.AddFunction([a, b], [min(cost, limit) for cost in costs])
    started = time.process_time()
    solved = network.Solve(timeLimit=TIMEOUT_S)
    seconds = time.process_time() - started
    return (solved[1] if solved and not network.Limit else None), seconds


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        games = json.load(file)
    for players in sorted({len(game["own"]) for game in games}):
        same = proved = 0
        times = []
        better = []
        for game in (game for game in games if len(game["own"]) == players):
            cost, seconds = solve(game)
            times.append(seconds)
            if cost is None:
                continue
            proved += 1
            # Each cost is rounded to a digit, in the sum as often as there are costs.
            slack = 10.0**-DIGITS * (players + len(game["pairs"]))
            same += abs(cost - game["least"]) <= slack
            if cost < game["least"] - slack:
                better.append(cost / game["least"])
        times.sort()
        print(
            f"{players} airplanes: proved {proved} of {len(times)} in {TIMEOUT_S} s, {same} equal to ours, "
            f"{len(better)} better than ours; median {1e3 * times[len(times) // 2]:.1f} ms, "
            f"longest {1e3 * times[-1]:.0f} ms"
        )
        if better:
            print(f"  better by at most {100 * (1 - min(better)):.2f} %")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main()
