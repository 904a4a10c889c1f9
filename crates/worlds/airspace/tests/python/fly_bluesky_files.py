"""Flies scenario files in BlueSky without a window, and says where their aircraft are in the end, as JSON.

usage: fly_bluesky_files.py REQUEST

REQUEST is a JSON file: the folder that paths start at, the names of the files in it, and the seconds that each is flown.
The clock never stops: HOLD and FF have no effect. For each file the answer has the aircraft with latitude, longitude,
altitude in ft and true airspeed in m/s, and the pairs that lost separation at the end of any second.
"""

import contextlib
import json
import os
import shutil
import sys
import tempfile

import numpy as np

EARTH_M = 6371000.0
STEP_S = 1.0


def start(folder):
    """BlueSky in a folder of its own, whose scenarios are those of `folder`."""
    work = tempfile.mkdtemp()
    shutil.copytree(folder, os.path.join(work, "scenario"))
    import bluesky as bs

    bs.init(mode="sim", detached=True, workdir=work)
    from bluesky.tools import geo
    from bluesky.tools.geo import _geo

    # See fly_bluesky.py: the compiled bearings are not those of the module.
    for name in ("qdrdist", "qdrdist_matrix", "kwikdist", "kwikdist_matrix", "kwikqdrdist", "kwikqdrdist_matrix"):
        setattr(geo, name, getattr(_geo, name))
    keep_navigation_data()
    bs.stack.stack("PLUGIN LOAD SYNTHETIC")
    bs.stack.process()
    return bs, work


def keep_navigation_data():
    """Lets BlueSky read its tables once: it reads them anew with each reset, which takes longer than most flights."""
    from bluesky.navdatabase import navdatabase

    tables = navdatabase.load_navdata()
    copied = lambda table: {key: value[:] if isinstance(value, list) else value for key, value in table.items()}
    navdatabase.load_navdata = lambda: tuple(copied(table) for table in tables)


def lost_pairs(traf):
    """Pairs that are nearer than the larger of both zones, on a plane at their middle latitude."""
    n = len(traf.id)
    if n < 2:
        return set()
    lat, lon, alt = np.radians(traf.lat), np.radians(traf.lon), traf.alt
    between = lambda of: of[None, :] - of[:, None]
    dlon = (between(lon) + np.pi) % (2 * np.pi) - np.pi
    east = dlon * np.cos(0.5 * (lat[None, :] + lat[:, None]))
    gap = EARTH_M * np.hypot(between(lat), east)
    zone = np.maximum(traf.cd.rpz[None, :], traf.cd.rpz[:, None])
    height = np.maximum(traf.cd.hpz[None, :], traf.cd.hpz[:, None])
    lost = np.triu((gap < zone) & (np.abs(between(alt)) < height), 1)
    return {tuple(sorted((traf.id[i], traf.id[k]))) for i, k in zip(*np.where(lost))}


def fly(bs, name, until_s):
    from bluesky.core import simtime

    bs.sim.reset()
    bs.stack.stack(f"IC {name}")
    bs.stack.process()
    # Limits of types are left out, as airplanes have none here.
    bs.traf.perf.__dict__["limits"] = lambda tas, vs, alt, ax: (tas, vs, alt)
    losses = set()
    for _ in range(int(until_s / STEP_S)):
        simtime.setdt(STEP_S)
        bs.sim.state = bs.OP
        bs.sim.step()
        is_empty = not bs.traf.id and not bs.stack.get_scendata()[0]
        if bs.sim.state == bs.END or is_empty:
            break
        losses |= lost_pairs(bs.traf)
    traf = bs.traf
    ft = 0.3048
    aircraft = {
        acid: [float(traf.lat[k]), float(traf.lon[k]), float(traf.alt[k] / ft), float(traf.tas[k])]
        for k, acid in enumerate(traf.id)
    }
    return {"aircraft": aircraft, "losses": sorted(losses), "ended": bs.sim.state == bs.END}


if __name__ == "__main__":
    asked = json.load(open(sys.argv[1]))
    with contextlib.redirect_stdout(sys.stderr):
        bs, work = start(asked["folder"])
        flown = []
        for name in asked["files"]:
            print("FILE", name, flush=True)
            try:
                flown.append(fly(bs, name, asked["until_s"]))
            except Exception as error:  # A file that BlueSky itself cannot fly is told, and the next one is flown.
                flown.append({"aircraft": {}, "losses": [], "ended": False, "error": repr(error)})
        shutil.rmtree(work, ignore_errors=True)
    print(json.dumps(flown))
