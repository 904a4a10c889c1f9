"""Reads a bag with the package rosbags, which knows ROS's own definitions, and says what is in it, as JSON.

usage: read_bag.py BAG
"""

import json
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

topics, odometry, truth, scans, frames = {}, [], [], [], set()
with AnyReader([Path(sys.argv[1])], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
    for connection, time_ns, data in bag.messages():
        topic = topics.setdefault(connection.topic, {"type": connection.msgtype, "messages": 0})
        topic["messages"] += 1
        message = bag.deserialize(data, connection.msgtype)
        if connection.topic == "/robot_0/odom":
            at = message.pose.pose.position
            stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert stamp_ns == time_ns, (stamp_ns, time_ns)
            odometry.append([at.x, at.y, message.twist.twist.linear.x])
        elif connection.topic == "/robot_0/ground_truth":
            truth.append([message.pose.position.x, message.pose.position.y])
        elif connection.msgtype == "sensor_msgs/msg/LaserScan":
            scans.append([message.header.frame_id, len(message.ranges), float(message.angle_min)])
        elif connection.msgtype == "tf2_msgs/msg/TFMessage":
            frames.update((t.header.frame_id, t.child_frame_id) for t in message.transforms)
json.dump(
    {
        "topics": topics,
        "odometry": odometry,
        "truth": truth,
        "scans": scans[:1],
        "frames": sorted(frames),
    },
    sys.stdout,
)
