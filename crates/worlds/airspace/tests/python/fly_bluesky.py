"""Flies cases in BlueSky with its MVP, by heading only, and says what came of each, as JSON.

usage: fly_bluesky.py CASES

CASES is a JSON file: the limits, and a list of cases, each a list of airplanes [x, y, heading, goal
x, goal y] in meters and degrees. BlueSky detects conflicts with `STATEBASED`. The bearings are those
of its Python module `_geo`: in the wheel of 1.1.1 the compiled `kwikqdrdist_matrix` gives both of two
airplanes the same bearing, so that only one of them sees the conflict.
"""

import contextlib
import json
import math
import sys
import tempfile

import numpy as np

EARTH_M = 6371000.0


def start():
    """BlueSky without a window and without a network, in a folder of its own."""
    with contextlib.redirect_stdout(sys.stderr):
        import bluesky as bs

        bs.init(mode="sim", detached=True, workdir=tempfile.mkdtemp())
    from bluesky.tools import geo
    from bluesky.tools.geo import _geo

    for name in ("qdrdist", "qdrdist_matrix", "kwikdist", "kwikdist_matrix", "kwikqdrdist", "kwikqdrdist_matrix"):
        setattr(geo, name, getattr(_geo, name))
    return bs


def created(bs, limits, airplanes):
    """Airplanes that fly with one speed and turn with one rate, each to its way-point."""
    from bluesky.core import simtime
    from bluesky.tools.aero import g0, nm

    def do(*commands):
        for command in commands:
            bs.stack.stack(command)
        bs.stack.process()

    v, omega = limits["v_m_s"], math.radians(limits["omega_max_deg_s"])
    zone_m = limits["separation_m"] * limits["margin"]
    bs.sim.reset()
    simtime.setdt(limits["step_s"])
    do(
        "CDMETHOD STATEBASED",
        "RESO MVP",
        "RMETHH HDG",
        f"ZONER {zone_m / nm!r}",
        "RFACH 1.05",
        f"DTLOOK {limits['look_ahead_s']!r}",
    )
    degrees = lambda m: math.degrees(m / EARTH_M)
    for k, (x, y, heading, _, _) in enumerate(airplanes):
        bs.traf.cre(f"A{k:03d}", "B744", degrees(y), degrees(x), (90.0 - heading) % 360.0, 1000.0, v)
    # The model of a B744 knows no such speed; it would fly faster.
    n, perf = len(airplanes), bs.traf.perf
    fits = lambda value, mask: np.full(len(perf.vmin), value)[slice(None) if mask is None else mask]
    type(perf._refobj)._construct_v_limits = lambda _, mask=None: (fits(0.0, mask), fits(1e3, mask))
    perf.__dict__["limits"] = lambda tas, vs, alt, ax: (np.full_like(tas, v), vs, alt)
    perf.vmin, perf.vmax = np.zeros(n), np.full(n, 1e3)
    bs.traf.tas[:] = bs.traf.gs[:] = bs.traf.ap.tas[:] = v
    bank = math.degrees(math.atan(v * omega / g0))
    bs.traf.ap.bankdef[:] = math.radians(bank)
    bs.traf.gseast[:] = v * np.sin(np.radians(bs.traf.hdg))
    bs.traf.gsnorth[:] = v * np.cos(np.radians(bs.traf.hdg))
    for k, (_, _, _, x, y) in enumerate(airplanes):
        do(f"ADDWPT A{k:03d} {degrees(y)!r} {degrees(x)!r}", f"BANK A{k:03d} {bank!r}", f"LNAV A{k:03d} ON")


def closest(before, now, ids):
    """Distances of pairs of airplanes that fly straight from one place to another: least, and last."""
    p, q = (np.array([at[i] for i in ids]) for at in (before, now))
    from_m, to_m = p[None] - p[:, None], q[None] - q[:, None]
    way = to_m - from_m
    length = np.maximum((way**2).sum(-1), 1e-12)
    part = np.clip(-(from_m * way).sum(-1) / length, 0.0, 1.0)[..., None]
    apart = lambda v: np.sqrt((v**2).sum(-1)) + np.diag(np.full(len(ids), np.inf))
    return apart(from_m + part * way), apart(to_m)


def fly(bs, limits, airplanes):
    created(bs, limits, airplanes)
    traf, step_s, gap_m = bs.traf, limits["step_s"], limits["separation_m"]
    goals = np.array(airplanes)[:, 3:]
    places = lambda: {int(name[1:]): np.radians([traf.lon[k], traf.lat[k]]) * EARTH_M for k, name in enumerate(traf.id)}
    before, lost, nearest_m, losses, flown_s = places(), set(), math.inf, 0, []
    for step in range(1, int(limits["until_s"] / step_s) + 1):
        bs.sim.step()
        # Without a clock to wait for, the simulation would pause at the end of its fast time.
        bs.sim.state = bs.OP
        now = places()
        ids = sorted(now)
        least, last = closest(before, now, ids)
        nearest_m = min(nearest_m, least.min())
        for i, j in zip(*np.where(np.triu(least < gap_m))):
            losses += (ids[i], ids[j]) not in lost
        lost = {(ids[i], ids[j]) for i, j in zip(*np.where(np.triu(last < gap_m)))}
        near = lambda k, i: math.hypot(*(goals[i] - now[i])) < limits["tolerance_m"]
        # LNAV ends where BlueSky takes the way-point for passed.
        done = [k for k, name in enumerate(traf.id) if near(k, int(name[1:])) or not traf.swlnav[k]]
        for k in reversed(done):
            flown_s.append(step * step_s)
            traf.delete(k)
        before = places()
        if not before:
            break
    return {
        "losses": losses,
        "nearest_m": round(nearest_m, 3),
        "arrived": len(flown_s),
        "mean_flown_s": round(float(np.mean(flown_s)), 2) if flown_s else None,
    }


if __name__ == "__main__":
    asked = json.load(open(sys.argv[1]))
    bs = start()
    with contextlib.redirect_stdout(sys.stderr):
        flown = [fly(bs, asked["limits"], airplanes) for airplanes in asked["cases"]]
    print(json.dumps(flown))
