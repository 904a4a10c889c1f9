"""Robots with two wheels as nodes of ROS 2, without any code of Sidestep: `zenoh-ros2-sdk` for the network, `rosbags` for types
and CDR, and a few lines of physics.

    plant.py CONFIG

CONFIG is a JSON object: `port`, at which the router listens; `domain`; `map`, rows of `.` and `#` from the north; `box_m`;
`starts`, a column, a row and a heading in degrees for each robot; `radius_m`; `walls`, further squares that the map of the
robots does not have, by column and row; `stamped`, whether commands are TwistStamped; `rays` of a laser; `drift_m`, the standard
deviation of what localization is off, which changes within a quarter of a minute; `pace`, seconds of the robots in a second at most;
`goals`, whether goals can be sent; `beacon`, the definition of RobotBeacon, whose topics are heard; `stop_after`, steps without a
command after which a base stops. Wheels slip, lasers and localization are noisy. Lines on standard input:

    silence   stop sending measurements; answers when the last command of each robot is zero
    speak     send them again
    report    answer with what has happened so far
    track     answer with the true poses, [seconds, x, y, yaw] at each step, of each robot
    goal ROBOT FRAME X Y DEGREES   send a goal
    end       end
"""

import json
import math
import sys
import threading
import time

import numpy as np
import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber, ZenohSession

CONFIG = json.loads(sys.argv[1])
PORT = CONFIG["port"]
AT = {"domain_id": CONFIG["domain"], "router_port": PORT}
BOX_M = CONFIG["box_m"]
RADIUS_M = CONFIG["radius_m"]
STEP_S = 0.05
RAYS = CONFIG.get("rays", 360)
PACE = CONFIG.get("pace", 1.0)
DRIFT_M = CONFIG.get("drift_m", 0.0)
DRIFT_S = 15.0
MAX_RANGE_M = 8.0
# Of the scanner on its robot.
MOUNT_M = 0.05
# The longest wait for a command.
MAX_WAIT_S = 1.0
# Longer than anything here takes, on a machine that has much else to do.
DEADLINE_S = 120.0

TYPES = get_typestore(Stores.ROS2_JAZZY)
BEACON = "sidestep_msgs/msg/RobotBeacon"
if "beacon" in CONFIG:
    TYPES.register(get_types_from_msg(CONFIG["beacon"], BEACON))
STOP_AFTER = CONFIG.get("stop_after")
RANDOM = np.random.default_rng(7)


def topic(kind, name, type_name, *more):
    """A publisher or a subscriber of a topic."""
    return kind(
        name,
        type_name,
        *more,
        msg_definition=TYPES.generate_msgdef(type_name)[0],
        type_hash=TYPES.hash_rihs01(type_name),
        **AT,
    )


def squares():
    """The lower-left corners of all walls, in meters."""
    rows = CONFIG["map"][::-1]
    width = len(rows[0])
    walls = [(c, r) for r, row in enumerate(rows) for c, cell in enumerate(row) if cell == "#"]
    walls += [(c, r) for c in range(-1, width + 1) for r in (-1, len(rows))]
    walls += [(c, r) for c in (-1, width) for r in range(len(rows))]
    walls += [tuple(wall) for wall in CONFIG.get("walls", [])]
    return np.array(walls, dtype=float) * BOX_M


SQUARES = squares()


class Robot:
    """One robot: its true pose, and its topics."""

    def __init__(self, number, start):
        column, row, degrees = start
        self.name = f"robot_{number}"
        self.at = np.array([(column + 0.5) * BOX_M, (row + 0.5) * BOX_M])
        self.yaw = math.radians(degrees)
        self.start = (*self.at, self.yaw)
        self.velocity = (0.0, 0.0)
        self.timeouts = 0
        self.commands = 0
        self.commands_before = 0
        self.fastest = [0.0, 0.0]
        self.touches = 0
        self.is_touching = False
        self.drift = np.zeros(2)
        self.track = []
        self.steps_alone = 0
        self.beacon = None
        if "beacon" in CONFIG:
            self.told = topic(ROS2Subscriber, f"/{self.name}/beacon", BEACON, self.on_beacon)
        self.odom = topic(ROS2Publisher, f"/{self.name}/odom", "nav_msgs/msg/Odometry")
        self.scan = topic(ROS2Publisher, f"/{self.name}/scan", "sensor_msgs/msg/LaserScan")
        self.bumper = topic(ROS2Publisher, f"/{self.name}/bumper", "std_msgs/msg/Bool")
        kind = "TwistStamped" if CONFIG.get("stamped") else "Twist"
        if CONFIG.get("goals"):
            self.goal = topic(ROS2Publisher, f"/{self.name}/goal_pose", "geometry_msgs/msg/PoseStamped")
        self.heard = topic(ROS2Subscriber, f"/{self.name}/cmd_vel", f"geometry_msgs/msg/{kind}", self.on_command)

    def on_beacon(self, message):
        self.beacon = {
            "robot": int(message.robot),
            "at": [int(message.column), int(message.row), int(message.heading)],
            "has_word": bool(message.has_word),
            "done": int(message.done) if message.has_done else None,
            "digest": bytes(bytearray(message.digest)).hex(),
        }

    def on_command(self, message):
        message = getattr(message, "twist", message)
        self.velocity = (message.linear.x, message.angular.z)
        self.fastest = [max(a, abs(b)) for a, b in zip(self.fastest, self.velocity, strict=True)]
        self.commands += 1

    def is_answered(self):
        return self.velocity == (0.0, 0.0) or self.commands > self.commands_before

    def advance(self, others):
        self.steps_alone = 0 if self.commands > self.commands_before else self.steps_alone + 1
        if STOP_AFTER and self.steps_alone > STOP_AFTER and self.velocity != (0.0, 0.0):
            self.velocity = (0.0, 0.0)
            self.timeouts += 1
        self.commands_before = self.commands
        speed, rate = self.velocity
        slip = 1.0 - RANDOM.uniform(0.0, 0.2, 2)
        self.yaw += rate * slip[1] * STEP_S
        way = speed * slip[0] * STEP_S * np.array([math.cos(self.yaw), math.sin(self.yaw)])
        goal = self.at + way
        self.is_touching = touches(goal, others)
        if self.is_touching and speed:
            self.touches += 1
        else:
            self.at = goal
        # A walk that comes back (of Ornstein and Uhlenbeck).
        share = STEP_S / DRIFT_S
        self.drift += RANDOM.normal(0.0, DRIFT_M * math.sqrt(2 * share), 2) - share * self.drift


def touches(at, others):
    nearest = np.clip(at, SQUARES, SQUARES + BOX_M)
    if np.any(np.hypot(*(nearest - at).T) < RADIUS_M):
        return True
    return any(np.hypot(*(other - at)) < 2 * RADIUS_M for other in others)


def ranges(at, yaw, others):
    """What a laser at a place measures: squares by their slabs, robots as discs."""
    near = np.abs(SQUARES + BOX_M / 2 - at).max(axis=1) < MAX_RANGE_M + BOX_M
    squares = SQUARES[near]
    angles = yaw + np.arange(RAYS) * (2 * math.pi / RAYS)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        low = (squares[None] - at) / rays[:, None]
        high = (squares[None] + BOX_M - at) / rays[:, None]
    enter = np.minimum(low, high).max(axis=2)
    leave = np.maximum(low, high).min(axis=2)
    hits = np.where((enter <= leave) & (enter > 0), enter, np.inf).min(axis=1, initial=np.inf)
    for other in others:
        off = other - at
        along = rays @ off
        half = RADIUS_M**2 - (off @ off - along**2)
        hit = np.where((half > 0) & (along > 0), along - np.sqrt(np.maximum(half, 0)), np.inf)
        hits = np.minimum(hits, hit)
    noisy = hits + RANDOM.normal(0.0, 0.01, RAYS)
    return np.where(noisy < MAX_RANGE_M, noisy, np.inf).astype(np.float32)


class Messages:
    """The messages of a moment, of the types that a publisher knows."""

    def __init__(self, store, seconds):
        self.types = store.types
        self.stamp = self.make("builtin_interfaces/msg/Time", int(seconds), int(seconds % 1 * 1e9))

    def make(self, name, *fields):
        return self.types[name](*fields)

    def header(self, frame):
        return self.make("std_msgs/msg/Header", self.stamp, frame)

    def parts(self, at, yaw, kind):
        where = self.make(f"geometry_msgs/msg/{kind}", float(at[0]), float(at[1]), 0.0)
        half = yaw / 2
        turn = self.make("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(half), math.cos(half))
        return where, turn

    def frame(self, parent, child, at, yaw):
        transform = self.make("geometry_msgs/msg/Transform", *self.parts(at, yaw, "Vector3"))
        header = self.header(parent)
        return self.make("geometry_msgs/msg/TransformStamped", header, child, transform)


class Plant:
    """All robots, and their time."""

    def __init__(self):
        self.robots = [Robot(n, start) for n, start in enumerate(CONFIG["starts"])]
        self.frames = topic(ROS2Publisher, "/tf_static", "tf2_msgs/msg/TFMessage")
        self.steps = 0
        self.is_silent = False
        self.has_ended = False

    def run(self):
        while not self.has_ended:
            due = time.monotonic() + STEP_S / PACE
            self.advance()
            time.sleep(max(0.0, due - time.monotonic()))
            self.wait_for_commands()

    def wait_for_commands(self):
        """Waits for an answer to each robot that moves, but not for long: on a busy machine time passes more slowly for all."""
        until = time.monotonic() + MAX_WAIT_S
        while time.monotonic() < until and not self.is_silent:
            if all(robot.is_answered() for robot in self.robots):
                return
            time.sleep(0.002)

    def advance(self):
        for robot in self.robots:
            robot.advance([other.at for other in self.robots if other is not robot])
        self.steps += 1
        for robot in self.robots:
            robot.track.append((self.steps * STEP_S, *robot.at, robot.yaw))
        if self.is_silent:
            return
        # Those who join late hear these again: the package has no latched publishers.
        if self.steps % 10 == 1:
            self.send_frames()
        for robot in self.robots:
            self.send(robot)

    def send_frames(self):
        messages = Messages(self.frames.session_mgr.store, self.steps * STEP_S)
        frames = []
        for robot in self.robots:
            x, y, yaw = robot.start
            frames.append(messages.frame("map", f"{robot.name}/odom", (x, y), yaw))
            frames.append(messages.frame(f"{robot.name}/base", f"{robot.name}/laser", (MOUNT_M, 0.0), 0.0))
        self.frames.publish(transforms=frames)

    def send(self, robot):
        messages = Messages(robot.odom.session_mgr.store, self.steps * STEP_S)
        x, y, yaw = robot.start
        dx, dy = robot.at + robot.drift + RANDOM.normal(0.0, 0.004, 2) - (x, y)
        at = (
            math.cos(yaw) * dx + math.sin(yaw) * dy,
            math.cos(yaw) * dy - math.sin(yaw) * dx,
        )
        turned = robot.yaw - yaw + RANDOM.normal(0.0, 0.004)
        pose = messages.make("geometry_msgs/msg/Pose", *messages.parts(at, turned, "Point"))
        nothing = np.zeros(36)
        zero = messages.make("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
        twist = messages.make("geometry_msgs/msg/Twist", zero, zero)
        scanner = robot.at + MOUNT_M * np.array([math.cos(robot.yaw), math.sin(robot.yaw)])
        others = [other.at for other in self.robots if other is not robot]
        robot.scan.publish(
            header=messages.header(f"{robot.name}/laser"),
            angle_min=0.0,
            angle_max=2 * math.pi * (RAYS - 1) / RAYS,
            angle_increment=2 * math.pi / RAYS,
            time_increment=0.0,
            scan_time=STEP_S,
            range_min=0.02,
            range_max=MAX_RANGE_M,
            ranges=ranges(scanner, robot.yaw, others),
            intensities=np.array([], dtype=np.float32),
        )
        robot.odom.publish(
            header=messages.header(f"{robot.name}/odom"),
            child_frame_id=f"{robot.name}/base",
            pose=messages.make("geometry_msgs/msg/PoseWithCovariance", pose, nothing),
            twist=messages.make("geometry_msgs/msg/TwistWithCovariance", twist, nothing),
        )
        robot.bumper.publish(data=robot.is_touching)

    def silence(self):
        """Stops measurements, and waits until each robot that was commanded stands by its last command."""
        self.is_silent = True
        until = time.monotonic() + DEADLINE_S
        while time.monotonic() < until:
            if all(robot.velocity == (0.0, 0.0) for robot in self.robots):
                break
            time.sleep(0.02)
        return {"velocities": [robot.velocity for robot in self.robots]}

    def send_goal(self, number, frame, *numbers):
        robot = self.robots[int(number)]
        publisher = robot.goal
        until = time.monotonic() + DEADLINE_S
        while not publisher.pub.matching_status.matching and time.monotonic() < until:
            time.sleep(0.02)
        x, y, degrees = map(float, numbers)
        messages = Messages(publisher.session_mgr.store, self.steps * STEP_S)
        pose = messages.make("geometry_msgs/msg/Pose", *messages.parts((x, y), math.radians(degrees), "Point"))
        publisher.publish(header=messages.header(frame), pose=pose)
        return "sent"

    def report(self):
        return [
            {
                "at_m": robot.at.tolist(),
                "touches": robot.touches,
                "velocity": robot.velocity,
                "fastest": robot.fastest,
                "commands": robot.commands,
                "timeouts": robot.timeouts,
                "beacon": robot.beacon,
            }
            for robot in self.robots
        ]


def main():
    config = zenoh.Config.from_json5(
        json.dumps(
            {
                "mode": "router",
                "listen": {"endpoints": [f"tcp/127.0.0.1:{PORT}"]},
                "scouting": {"multicast": {"enabled": False}},
            }
        )
    )
    router = zenoh.open(config)
    plant = Plant()
    thread = threading.Thread(target=plant.run)
    thread.start()
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        word = line.strip()
        if word == "silence":
            print(json.dumps(plant.silence()), flush=True)
        elif word == "speak":
            plant.is_silent = False
            print(json.dumps("speaks"), flush=True)
        elif word == "track":
            print(json.dumps([robot.track for robot in plant.robots]), flush=True)
        elif word.startswith("goal "):
            print(json.dumps(plant.send_goal(*word.split()[1:])), flush=True)
        elif word == "report":
            print(json.dumps(plant.report()), flush=True)
        else:
            break
    plant.has_ended = True
    thread.join()
    ZenohSession.get_instance(router_port=PORT).close()
    router.close()


if __name__ == "__main__":
    main()
