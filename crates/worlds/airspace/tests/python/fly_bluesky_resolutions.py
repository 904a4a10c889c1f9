"""Flies pairs of airplanes in BlueSky with its MVP by speed, by both and by vertical speed, and says what came of each, as
JSON.

usage: fly_bluesky_resolutions.py CASES

CASES is a JSON file: the limits, and by commands of RMETHH, RMETHV or PRIORULES, with `;` between several, a list of cases, each two airplanes
[x, y, heading, altitude, rate of climb] in meters, degrees and m/s. One with a rate climbs from the start to `top_m`.
"""

import contextlib
import json
import math
import sys

import fly_bluesky
import numpy as np
from fly_bluesky import EARTH_M


def created(bs, limits, commands, pair):
    from bluesky.tools.aero import fpm, ft
    from bluesky.traffic import autopilot

    # An autopilot of BlueSky holds a calibrated airspeed.
    autopilot.vcasormach2tas = lambda speed, altitude: np.full_like(altitude, limits["v_m_s"])

    # Straight on, to way-points far away.
    far = 1e5
    goals = [(x + far * math.cos(math.radians(h)), y + far * math.sin(math.radians(h))) for x, y, h, _, _ in pair]
    fly_bluesky.created(bs, limits, [(x, y, h, *goal) for (x, y, h, _, _), goal in zip(pair, goals)])
    traf, perf, n = bs.traf, bs.traf.perf, len(pair)
    perf.__dict__["limits"] = lambda tas, vs, alt, ax: (tas, vs, alt)
    low, high = limits["speeds_m_s"]
    fits = lambda value, mask: np.full(len(perf.vmin), value)[slice(None) if mask is None else mask]
    type(perf._refobj)._construct_v_limits = lambda _, mask=None: (fits(low, mask), fits(high, mask))
    perf.vmin, perf.vmax = np.full(n, low), np.full(n, high)
    perf.vsmin, perf.vsmax = np.full(n, -limits["climb_max_m_s"]), np.full(n, limits["climb_max_m_s"])
    perf.__dict__["acceleration"] = lambda: np.full(n, limits["acceleration_m_s2"])
    perf.axmax = np.full(n, limits["acceleration_m_s2"])
    traf.alt[:] = [altitude for _, _, _, altitude, _ in pair]
    traf.selalt[:] = traf.ap.alt[:] = traf.aporasas.alt[:] = traf.alt
    settings = [commands, f"ZONEDH {limits['vertical_m'] / ft!r}", "RFACV 1.05"]
    for k, (_, _, _, _, climb) in enumerate(pair):
        if climb:
            settings += [f"ALT A{k:03d} {limits['top_m'] / ft!r}", f"VS A{k:03d} {climb / fpm!r}"]
            traf.vs[k] = climb
    for command in settings:
        bs.stack.stack(command)
    bs.stack.process()


def fly(bs, limits, commands, pair):
    created(bs, limits, commands, pair)
    traf = bs.traf
    v, gap_m, high_m = limits["v_m_s"], limits["separation_m"], limits["vertical_m"]
    start_m = [altitude for _, _, _, altitude, _ in pair]
    nearest_m, off_level_m, off_speeds_m_s = math.inf, 0.0, np.zeros(len(pair))
    for _ in range(int(limits["until_s"] / limits["step_s"])):
        bs.sim.step()
        bs.sim.state = bs.OP
        (x0, x1), (y0, y1) = (np.radians(traf.lon) * EARTH_M, np.radians(traf.lat) * EARTH_M)
        if abs(traf.alt[0] - traf.alt[1]) < high_m:
            nearest_m = min(nearest_m, math.hypot(x0 - x1, y0 - y1))
        off_level_m = max(off_level_m, abs(traf.alt[0] - start_m[0]))
        off_speeds_m_s = np.maximum(off_speeds_m_s, abs(traf.tas - v))
    return {
        "is_lost": bool(nearest_m < gap_m),
        "off_level_m": round(float(off_level_m), 2),
        "off_speed_m_s": round(float(off_speeds_m_s.max()), 3),
        "off_speeds_m_s": [round(float(speed), 3) for speed in off_speeds_m_s],
        "back_m": round(float(abs(traf.alt[0] - start_m[0])), 2),
        "back_m_s": round(float(max(abs(traf.tas - v))), 3),
    }


if __name__ == "__main__":
    asked = json.load(open(sys.argv[1]))
    bs = fly_bluesky.start()
    with contextlib.redirect_stdout(sys.stderr):
        flown = {
            commands: [fly(bs, asked["limits"], commands, pair) for pair in cases]
            for commands, cases in asked["cases"].items()
        }
    print(json.dumps(flown))
