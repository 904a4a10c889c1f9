"""Writes a bag with the package rosbags, of a robot that is simulated here with known errors.

usage: write_bag.py wheels BAG [FORM]   legs of half a meter and quarter turns: odometry and motion capture
       write_bag.py scanner BAG [FORM]  rounds in a room of 8 x 6 m: transforms and scans, and the map beside it

FORM is mcap with packed chunks, sqlite with packed messages, or file: SQLite, packed as a whole.

Says what was put in, as JSON.
"""

import json
import math
import random
import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_HUMBLE)
types = store.types
chance = random.Random(7)
START_S = 1_700_000_000


def stamp(t):
    ns = START_S * 10**9 + round(t * 1e9)
    return types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9), ns


def header(t, frame):
    return types["std_msgs/msg/Header"](stamp=stamp(t)[0], frame_id=frame)


def turned(yaw):
    quaternion = types["geometry_msgs/msg/Quaternion"]
    return quaternion(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def pose(x, y, yaw):
    point = types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
    return types["geometry_msgs/msg/Pose"](position=point, orientation=turned(yaw))


def transform(t, parent, child, x, y, rotation):
    vector = types["geometry_msgs/msg/Vector3"](x=x, y=y, z=0.0)
    inner = types["geometry_msgs/msg/Transform"](translation=vector, rotation=rotation)
    message = types["geometry_msgs/msg/TransformStamped"]
    return message(header=header(t, parent), child_frame_id=child, transform=inner)


class Bag:
    def __init__(self, path, form):
        plugin = StoragePlugin.MCAP if form == "mcap" else StoragePlugin.SQLITE3
        mode = {
            "mcap": CompressionMode.STORAGE,
            "sqlite": CompressionMode.MESSAGE,
            "file": CompressionMode.FILE,
        }[form]
        self.writer = Writer(path, version=9, storage_plugin=plugin)
        self.writer.set_compression(mode, CompressionFormat.ZSTD)
        self.writer.open()
        self.connections = {}

    def write(self, topic, t, message):
        kind = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=store)
        self.writer.write(self.connections[topic], stamp(t)[1], store.serialize_cdr(message, kind))


def odometry(t, x, y, yaw):
    zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    covariance = np.zeros(36)
    twist = types["geometry_msgs/msg/TwistWithCovariance"](
        twist=types["geometry_msgs/msg/Twist"](linear=zero, angular=zero), covariance=covariance
    )
    return types["nav_msgs/msg/Odometry"](
        header=header(t, "odom"),
        child_frame_id="base_link",
        pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose(x, y, yaw), covariance=covariance),
        twist=twist,
    )


def drawn(table):
    outcomes, weights = zip(*table)
    return chance.choices(outcomes, weights)[0]


def wheels(bag):
    """Each leg and turn takes a second, and a pause of a quarter follows."""
    forward, turn = [(1, 0.85), (0, 0.10), (2, 0.05)], [(1, 0.92), (0, 0.08)]
    claimed, true, t0 = [0.0, 0.0, 0.5], [3.0, 1.0, -2.0], 0.0
    step = {"odom": 0.05, "truth": 0.04}
    due = {"odom": 0.0, "truth": 0.01}
    for k in range(1500):
        is_turn = k % 4 == 3
        side = chance.choice([1, -1])
        made = drawn(turn if is_turn else forward)

        def after(start, share, factor):
            x, y, yaw = start
            if is_turn:
                return x, y, yaw + side * share * factor * math.pi / 2
            way = 0.5 * share * factor
            return x + way * math.cos(yaw), y + way * math.sin(yaw), yaw

        while min(due.values()) < t0 + 1.25:
            stream = min(due, key=due.get)
            t = due[stream]
            share = min(max(t - t0, 0.0), 1.0)
            if stream == "odom":
                bag.write("/odom", t, odometry(t, *after(claimed, share, 1)))
            else:
                captured = types["geometry_msgs/msg/PoseStamped"]
                message = captured(header=header(t, "map"), pose=pose(*after(true, share, made)))
                bag.write("/vicon/pose", t, message)
            due[stream] = t + step[stream]
        claimed, true, t0 = after(claimed, 1.0, 1), after(true, 1.0, made), t0 + 1.25
    return {"forward": forward, "turn": turn, "turns": 1500 // 4}


def to_wall(x, y, direction):
    """The range from a place in the room to its wall."""
    c, s = math.cos(direction), math.sin(direction)
    along_x = ((8 - x) if c > 0 else -x) / c if c else math.inf
    along_y = ((6 - y) if s > 0 else -y) / s if s else math.inf
    return min(along_x, along_y)


def scanner(bag, folder):
    missed, not_there, range_max = 0.06, 0.02, 3.5
    # The scanner hangs upside down before the middle of the robot: its bearings run clockwise.
    upside_down = types["geometry_msgs/msg/Quaternion"](x=1.0, y=0.0, z=0.0, w=0.0)
    message = types["tf2_msgs/msg/TFMessage"]
    bag.write("/tf_static", 0.0, message([transform(0.0, "base_link", "laser", 0.2, 0.0, upside_down)]))
    bag.write("/tf", 0.0, message([transform(0.0, "map", "odom", 4.0, 3.0, turned(math.pi / 2))]))
    for k in range(1200):
        t = 0.1 * k
        angle = 0.05 * t
        # A circle around the origin of `odom`, which is the middle of the room and turned by a quarter.
        x, y, yaw = 1.5 * math.cos(angle), 1.5 * math.sin(angle), angle + math.pi / 2
        bag.write("/tf", t, message([transform(t, "odom", "base_link", x, y, turned(yaw))]))
        in_map, heading = (4.0 - y, 3.0 + x), yaw + math.pi / 2
        eye = in_map[0] + 0.2 * math.cos(heading), in_map[1] + 0.2 * math.sin(heading)
        ranges = []
        for beam in range(36):
            expected = to_wall(*eye, heading - math.radians(-180 + 10 * beam))
            if expected < range_max:
                seen = math.inf if chance.random() < missed else expected + chance.gauss(0, 0.01)
            else:
                seen = chance.uniform(0.3, 3.4) if chance.random() < not_there else math.inf
            ranges.append(seen)
        scan = types["sensor_msgs/msg/LaserScan"](
            header=header(t, "laser"),
            angle_min=-math.pi,
            angle_max=math.radians(170),
            angle_increment=math.radians(10),
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.12,
            range_max=range_max,
            ranges=np.array(ranges, dtype=np.float32),
            intensities=np.array([], dtype=np.float32),
        )
        bag.write("/scan", t, scan)
    write_map(folder)
    return {"missed": missed, "not_there": not_there}


def write_map(folder):
    """The room with a wall of one pixel around it, 5 cm a pixel."""
    width, height = 162, 122
    rows = [
        bytes(0 if row in (0, height - 1) or col in (0, width - 1) else 254 for col in range(width))
        for row in range(height)
    ]
    (folder / "room.pgm").write_bytes(f"P5\n{width} {height}\n255\n".encode() + b"".join(rows))
    (folder / "room.yaml").write_text(
        "image: room.pgm\nresolution: 0.05\norigin: [-0.05, -0.05, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )


what, path = sys.argv[1], Path(sys.argv[2])
bag = Bag(path, sys.argv[3] if len(sys.argv) > 3 else "mcap")
said = wheels(bag) if what == "wheels" else scanner(bag, path.parent)
bag.writer.close()
print(json.dumps(said))
