"""Computes the separation of airplanes from the rows of a table, and says it as JSON.

usage: separation.py TRAJECTORIES SEPARATION_M VERTICAL_M

Each row is a leg of constant speed, turn rate and climb. Nothing is used here but these columns:
a place is the integral of the velocity along the leg.
"""

import json
import sys

import numpy as np
import pyarrow.parquet as pq

LOOK_S = 0.01

table = pq.read_table(sys.argv[1]).to_pydict()
gap_m, vertical_m = map(float, sys.argv[2:])
ways = {}
for row in zip(*(table[name] for name in table)):
    leg = dict(zip(table, row))
    ways.setdefault(leg["airplane"], []).append(leg)
for legs in ways.values():
    legs.sort(key=lambda leg: (leg["from_s"], leg["until_s"]))


def places(legs, times):
    """Place and altitude at some times; NaN where the airplane is not in the air."""
    found = np.full((len(times), 3), np.nan)
    for leg in legs:
        during = (leg["from_s"] <= times) & (times <= leg["until_s"])
        s = times[during] - leg["from_s"]
        turn, heading, v = leg["turn_rad_s"], leg["heading_rad"], leg["speed_m_s"]
        if abs(turn) < 1e-9:
            x, y = v * s * np.cos(heading), v * s * np.sin(heading)
        else:
            x = v / turn * (np.sin(heading + turn * s) - np.sin(heading))
            y = v / turn * (np.cos(heading) - np.cos(heading + turn * s))
        found[during, 0] = leg["x_m"] + leg["drift_x_m_s"] * s + x
        found[during, 1] = leg["y_m"] + leg["drift_y_m_s"] * s + y
        found[during, 2] = leg["altitude_m"] + leg["climb_m_s"] * s
    return found


def apart(a, b, times):
    """Distances at some times; infinite where the two are not on one level in the air."""
    p, q = places(ways[a], times), places(ways[b], times)
    distances = np.hypot(*(q - p)[:, :2].T)
    on_one_level = np.abs(q[:, 2] - p[:, 2]) < vertical_m
    return np.where(on_one_level, distances, np.inf)


def pair(a, b):
    begin = max(ways[a][0]["from_s"], ways[b][0]["from_s"])
    end = min(ways[a][-1]["until_s"], ways[b][-1]["until_s"])
    if begin >= end:
        return None
    times = np.append(np.arange(begin, end, LOOK_S), end)
    distances = apart(a, b, times)
    k = int(np.argmin(distances))
    near = np.linspace(times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)], 20001)
    lost = distances < gap_m
    return {
        "airplanes": [a, b],
        "nearest_m": float(min(distances.min(), apart(a, b, near).min())),
        "losses": int(lost[0]) + int(np.sum(lost[1:] & ~lost[:-1])),
        "lost_s": float(np.sum(lost) * LOOK_S),
    }


# The legs of an airplane follow each other without a gap or a leap.
joints = 0
for legs in ways.values():
    for one, other in zip(legs, legs[1:]):
        end = places([one], np.array([one["until_s"]]))[0]
        assert abs(one["until_s"] - other["from_s"]) < 1e-6, (one, other)
        assert np.hypot(end[0] - other["x_m"], end[1] - other["y_m"]) < 1e-3, (one, other)
        assert abs(end[2] - other["altitude_m"]) < 1e-6, (one, other)
        joints += 1

names = sorted(ways)
pairs = [pair(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
print(
    json.dumps(
        {
            "joints": joints,
            "pairs": [p for p in pairs if p],
            "ends": {
                name: [legs[-1]["x_m"], legs[-1]["y_m"], legs[-1]["until_s"] - legs[-1]["from_s"]]
                for name, legs in ways.items()
            },
        }
    )
)
