"""Reads a bag of the motions of arms with the package rosbags, and says what is in it, as JSON.

usage: read_trajectory.py BAG
"""

import json
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def seconds(time):
    return time.sec + time.nanosec * 1e-9


topics, trajectories, states = {}, {}, {}
with AnyReader([Path(sys.argv[1])], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
    last_ns = 0
    for connection, time_ns, data in bag.messages():
        assert time_ns >= last_ns, "messages are in the order of their times"
        last_ns = time_ns
        topics.setdefault(connection.topic, connection.msgtype)
        message = bag.deserialize(data, connection.msgtype)
        if connection.msgtype == "trajectory_msgs/msg/JointTrajectory":
            trajectories[connection.topic] = {
                "joints": list(message.joint_names),
                "times": [seconds(point.time_from_start) for point in message.points],
                "positions": [point.positions.tolist() for point in message.points],
                "velocities": [point.velocities.tolist() for point in message.points],
                "accelerations": [point.accelerations.tolist() for point in message.points],
            }
        else:
            state = states.setdefault(connection.topic, {"times": [], "positions": []})
            state["times"].append(seconds(message.header.stamp))
            state["positions"].append(message.position.tolist())
            state["joints"] = list(message.name)
json.dump({"topics": topics, "trajectories": trajectories, "states": states}, sys.stdout)
