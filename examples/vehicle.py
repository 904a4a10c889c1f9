"""A vehicle: it decides for one robot of a fleet, over the public wire (docs/src/wire/).

    sidestep fleet scenarios/robots/fleet.toml --nodes 5 --clock realtime --listen tcp/127.0.0.1:7600
    sidestep node scenarios/robots/fleet.toml --robot 5 --connect tcp/127.0.0.1:7600 --vehicle tcp/127.0.0.1:7700
    python examples/vehicle.py --robot 5 --connect tcp/127.0.0.1:7700

It needs `pip install eclipse-zenoh rosbags`. It goes ahead until its sensors report something near, and then turns away.
"""

import argparse
import json
import pathlib
import time

import numpy as np
import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MESSAGES = pathlib.Path(__file__).resolve().parents[1] / "docs" / "src" / "wire"
NO_CONTACT = 255

types = get_typestore(Stores.EMPTY)
for file in MESSAGES.glob("*.msg"):
    types.register(get_types_from_msg(file.read_text(), f"sidestep_msgs/msg/{file.stem}"))
Control = types.types["sidestep_msgs/msg/RobotControl"]


def decide(about, percept):
    """Returns the name of an action: away from what is near, ahead where nothing is."""
    bearings = np.concatenate([sensor.bearings_deg for sensor in about.sensors])
    is_near = (percept.observations != 0) & (percept.classes == 0)
    ahead = is_near & (abs((bearings + 180) % 360 - 180) <= 45)
    if percept.contact_kind == NO_CONTACT and not ahead.any():
        return "forward"
    left = is_near & (bearings % 360 > 0) & (bearings % 360 < 180)
    return "right" if left.sum() > (is_near & ~left).sum() else "left"


options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--robot", type=int, required=True)
options.add_argument("--connect", required=True, help="the endpoint of its node, e.g. tcp/127.0.0.1:7700")
options.add_argument("--cycles", type=int, help="end after so many answers")
args = options.parse_args()

config = zenoh.Config.from_json5(json.dumps({"mode": "client", "connect": {"endpoints": [args.connect]}}))
with zenoh.open(config) as session:
    key = f"sidestep/v1/robot/{args.robot}"
    about = next(reply.ok.payload.to_bytes() for reply in session.get(f"{key}/description"))
    about = types.deserialize_cdr(about, "sidestep_msgs/msg/RobotDescription")
    percepts = session.declare_subscriber(f"{key}/percept")
    answered = 0
    while args.cycles is None or answered < args.cycles:
        percept = types.deserialize_cdr(percepts.recv().payload.to_bytes(), "sidestep_msgs/msg/RobotPercept")
        action = about.actions.index(decide(about, percept))
        control = Control(percept.robot, percept.cycle, action, 0, False, 0, percept.memory)
        session.put(f"{key}/control", bytes(types.serialize_cdr(control, "sidestep_msgs/msg/RobotControl")))
        answered += 1
