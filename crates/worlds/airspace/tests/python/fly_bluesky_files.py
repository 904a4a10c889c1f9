"""Flies scenario files in BlueSky without a window, and says where their aircraft are in the end, as JSON.

usage: fly_bluesky_files.py REQUEST

REQUEST is a JSON file: the folder that paths start at, the names of the files in it, and the seconds that each is flown.
The clock never stops: HOLD and FF have no effect. MVP resolves by headings only, as Sidestep's does, and types have no
limits. For each file the answer has the aircraft with latitude, longitude, altitude in ft and true airspeed in m/s, the
pairs that lost separation at the end of any second, the pairs that came nearer than twice a zone with their smallest
distance in m, and the commands that BlueSky itself refused.
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
MAX_HOLDS = 10


def start(folder):
    """BlueSky in a folder of its own, whose scenarios are those of `folder`."""
    work = tempfile.mkdtemp()
    scenarios = os.path.join(work, "scenario")
    shutil.copytree(folder, scenarios)
    name_in_small_letters(scenarios)
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


def name_in_small_letters(folder):
    """Gives the ending `.scn` to all scenarios: BlueSky looks for no other, so `X.SCN` is no file where case counts."""
    for parent, _, names in os.walk(folder):
        for name in names:
            stem, end = os.path.splitext(name)
            if end.lower() == ".scn" and end != ".scn":
                os.rename(os.path.join(parent, name), os.path.join(parent, stem + ".scn"))


def resolve_by_headings():
    """Lets MVP keep the speed that an aircraft has, whatever RMETHH and RMETHV say."""
    from bluesky.traffic.asas.mvp import MVP

    every = MVP.resolve

    def by_headings(self, conf, ownship, intruder):
        self.swresohoriz, self.swresospd, self.swresohdg, self.swresovert = True, False, True, False
        track, _, vertical, level = every(self, conf, ownship, intruder)
        # Without the largest speed of its type, to which BlueSky slows an aircraft down that resolves.
        return track, ownship.gs, vertical, level

    MVP.resolve = by_headings


def listen_for_refusals(refused):
    """Adds what BlueSky says about a command that it cannot carry out to a list."""
    from bluesky.stack import simstack

    def echo(text="", flags=0, *_, **__):
        if flags:
            refused.append(str(text).strip().splitlines()[0][:120] if str(text).strip() else "")

    simstack.echo = echo


def keep_navigation_data():
    """Lets BlueSky read its tables once: it reads them anew with each reset, which takes longer than most flights."""
    from bluesky.navdatabase import navdatabase

    tables = navdatabase.load_navdata()
    copied = lambda table: {key: value[:] if isinstance(value, list) else value for key, value in table.items()}
    navdatabase.load_navdata = lambda: tuple(copied(table) for table in tables)


def near_pairs(traf):
    """Pairs on one level that are nearer than two of the larger zone, on a plane at their middle latitude: their
    distance in m, and whether they are nearer than that zone."""
    n = len(traf.id)
    if n < 2:
        return {}
    lat, lon, alt = np.radians(traf.lat), np.radians(traf.lon), traf.alt
    between = lambda of: of[None, :] - of[:, None]
    dlon = (between(lon) + np.pi) % (2 * np.pi) - np.pi
    east = dlon * np.cos(0.5 * (lat[None, :] + lat[:, None]))
    gap = EARTH_M * np.hypot(between(lat), east)
    zone = np.maximum(traf.cd.rpz[None, :], traf.cd.rpz[:, None])
    height = np.maximum(traf.cd.hpz[None, :], traf.cd.hpz[:, None])
    near = np.triu((gap < 2.0 * zone) & (np.abs(between(alt)) < height), 1)
    return {
        tuple(sorted((traf.id[i], traf.id[k]))): (float(gap[i, k]), bool(gap[i, k] < zone[i, k]))
        for i, k in zip(*np.where(near))
    }


def fly(bs, name, until_s, refused):
    from bluesky.core import simtime

    refused.clear()
    bs.sim.reset()
    bs.stack.stack(f"IC {os.path.splitext(name)[0]}.scn")
    bs.stack.process()
    # Limits of types are left out, as airplanes have none here.
    bs.traf.perf.__dict__["limits"] = lambda tas, vs, alt, ax: (tas, vs, alt)
    losses = set()
    nearest = {}
    for _ in range(int(until_s / STEP_S)):
        simtime.setdt(STEP_S)
        # A step in which a file says HOLD takes no time, and is taken again.
        for _ in range(MAX_HOLDS):
            bs.sim.state = bs.OP
            bs.sim.step()
            if bs.sim.state != bs.HOLD:
                break
        is_empty = not bs.traf.id and not bs.stack.get_scendata()[0]
        if bs.sim.state == bs.END or is_empty:
            break
        for pair, (gap_m, is_lost) in near_pairs(bs.traf).items():
            nearest[pair] = min(gap_m, nearest.get(pair, gap_m))
            if is_lost:
                losses.add(pair)
    traf = bs.traf
    ft = 0.3048
    aircraft = {
        acid: [float(traf.lat[k]), float(traf.lon[k]), float(traf.alt[k] / ft), float(traf.tas[k])]
        for k, acid in enumerate(traf.id)
    }
    return {
        "aircraft": aircraft,
        "losses": sorted(losses),
        "nearest": sorted((*pair, gap_m) for pair, gap_m in nearest.items()),
        "refused": refused[:20],
        "ended": bs.sim.state == bs.END,
    }


if __name__ == "__main__":
    asked = json.load(open(sys.argv[1]))
    with contextlib.redirect_stdout(sys.stderr):
        bs, work = start(asked["folder"])
        resolve_by_headings()
        refused = []
        listen_for_refusals(refused)
        flown = []
        for name in asked["files"]:
            print("FILE", name, flush=True)
            try:
                flown.append(fly(bs, name, asked["until_s"], refused))
            except Exception as error:  # A file that BlueSky itself cannot fly is told, and the next one is flown.
                flown.append({"aircraft": {}, "losses": [], "nearest": [], "refused": [], "error": repr(error)})
        shutil.rmtree(work, ignore_errors=True)
    print(json.dumps(flown))
