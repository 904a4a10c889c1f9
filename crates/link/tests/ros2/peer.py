"""A node of ROS 2 that shares no code with Sidestep: `zenoh-ros2-sdk` for the network, `rosbags` for types and CDR.

    peer.py PORT DOMAIN NAMESPACE WHAT

It connects to the router at the port of this machine, does WHAT, and prints one JSON object.
"""

import json
import sys
import threading
import time

import numpy as np
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk import (
    ROS2Publisher,
    ROS2ServiceClient,
    ROS2Subscriber,
    ZenohSession,
    get_service_info,
    get_topic_info,
    get_topic_names_and_types,
)
from zenoh_ros2_sdk.qos import QosDurability, QosProfile
from zenoh_ros2_sdk.utils import compute_service_type_hash

PORT = int(sys.argv[1])
DOMAIN = int(sys.argv[2])
NAMESPACE = sys.argv[3].rstrip("/")
AT = {"domain_id": DOMAIN, "router_port": PORT}
# Longer than anything here takes, on a machine that has much else to do.
DEADLINE_S = 120.0

TYPES = get_typestore(Stores.ROS2_JAZZY)
TRIGGER_HASH = compute_service_type_hash(
    # The package refuses a request without any text, and counts a comment as none.
    "std_srvs/srv/Trigger",
    "# nothing",
    "bool success\nstring message",
)


def wait_for(what, holds):
    """Returns what holds, once it does."""
    until = time.monotonic() + DEADLINE_S
    while time.monotonic() < until:
        found = holds()
        if found:
            return found
        time.sleep(0.02)
    raise TimeoutError(what)


def plain(value):
    """Returns a message as plain data."""
    if hasattr(value, "__dataclass_fields__"):
        fields = [name for name in value.__dataclass_fields__ if name != "__msgtype__"]
        return {name: plain(getattr(value, name)) for name in fields}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return str(value)
    return value


class Topic:
    """The messages of a topic as they arrive."""

    def __init__(self, name, type_name, qos=None):
        self.messages = []
        self.changed = threading.Condition()
        self.subscriber = ROS2Subscriber(
            name,
            type_name,
            self.add,
            msg_definition=TYPES.generate_msgdef(type_name)[0],
            type_hash=TYPES.hash_rihs01(type_name),
            qos=qos,
            **AT,
        )

    def add(self, message):
        with self.changed:
            self.messages.append(plain(message))
            self.changed.notify_all()

    def wait_for(self, count):
        """Waits until a number of messages has arrived, and returns all."""
        with self.changed:
            done = self.changed.wait_for(lambda: len(self.messages) >= count, DEADLINE_S)
        if not done:
            raise TimeoutError(f"{self.subscriber.topic}: {len(self.messages)} of {count}")
        return list(self.messages)


class Services:
    """The services of the run."""

    def __init__(self):
        self.clients = {}

    def call(self, name):
        if name not in self.clients:
            self.clients[name] = ROS2ServiceClient(
                f"{NAMESPACE}/sidestep/{name}",
                "std_srvs/srv/Trigger",
                request_definition="uint8 structure_needs_at_least_one_member",
                response_definition="bool success\nstring message",
                type_hash=TRIGGER_HASH,
                timeout=DEADLINE_S,
                **AT,
            )
        response = self.clients[name].call(structure_needs_at_least_one_member=0)
        if response is None:
            raise TimeoutError(f"the service {name} does not answer")
        return plain(response)


def graph():
    """What is in the graph, by liveliness tokens alone."""
    wanted = f"{NAMESPACE}/markers"

    def names():
        found = dict(get_topic_names_and_types(**AT))
        return found if wanted in found else None

    found = wait_for("the topics", names)
    topics = {}
    for name, types in found.items():
        info = get_topic_info(name, verbose=True, **AT)
        (publisher,) = info.publishers
        qos = QosProfile.decode(publisher.qos)
        topics[name] = {
            "types": types,
            "node": publisher.node_name,
            "namespace": publisher.node_namespace,
            "hash": publisher.type_hash,
            "expected_hash": TYPES.hash_rihs01(types[0]),
            "reliability": qos.reliability.name,
            "durability": qos.durability.name,
            "depth": qos.history_depth,
        }
    services = {}
    for name in ["pause", "resume", "step", "reset"]:
        info = get_service_info(f"{NAMESPACE}/sidestep/{name}", verbose=True, **AT)
        (server,) = info.servers
        services[name] = {"types": info.service_types, "hash": server.type_hash}
    session = ZenohSession.get_instance(router_port=PORT)
    replies = session.liveliness.get(f"@ros2_lv/{DOMAIN}/*/*/*/NN/**", timeout=2.0)
    nodes = [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]
    return {
        "topics": topics,
        "services": services,
        "service_hash": TRIGGER_HASH,
        "nodes": [parts[6:] for parts in nodes],
    }


def steps():
    """Three cycles, one by one, of a run that is paused."""
    topics = {
        "clock": Topic("/clock", "rosgraph_msgs/msg/Clock"),
        "odom": Topic(f"{NAMESPACE}/robot_0/odom", "nav_msgs/msg/Odometry"),
        "truth": Topic(f"{NAMESPACE}/robot_0/ground_truth", "geometry_msgs/msg/PoseStamped"),
        "scan": Topic(f"{NAMESPACE}/robot_0/sonar_8", "sensor_msgs/msg/LaserScan"),
        "bumper": Topic(f"{NAMESPACE}/robot_0/bumper", "std_msgs/msg/Bool"),
        "tf": Topic("/tf", "tf2_msgs/msg/TFMessage"),
        "markers": Topic(f"{NAMESPACE}/markers", "visualization_msgs/msg/MarkerArray"),
    }
    services = Services()
    answers = [services.call("step") for _ in range(3)]
    return {
        "answers": answers,
        "topics": {name: topic.wait_for(3) for name, topic in topics.items()},
    }


def late():
    """What those get who join when the map and the fixed frames were sent long ago."""
    latched = QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1)
    the_map = Topic(f"{NAMESPACE}/map", "nav_msgs/msg/OccupancyGrid", latched)
    frames = Topic("/tf_static", "tf2_msgs/msg/TFMessage", latched)
    return {"map": the_map.wait_for(1), "tf_static": frames.wait_for(1)}


def services():
    """Pause, step, reset and resume, and what they do to the clock."""
    clock = Topic("/clock", "rosgraph_msgs/msg/Clock")
    run = Services()
    # The first cycles may have passed before anybody listened.
    answers = {"step while time passes": run.call("step")}
    clock.wait_for(2)
    answers["pause"] = run.call("pause")
    # Cycles before the pause were sent before the answer; one more step shows that nothing else came after it.
    answers["step"] = run.call("step")
    paused_at = int(answers["pause"]["message"].split()[-1])
    wait_for("the step", lambda: seconds(clock) and seconds(clock)[-1] >= paused_at + 1)
    times = seconds(clock)
    answers["reset"] = run.call("reset")
    wait_for("the reset", lambda: seconds(clock)[-1] == 0)
    answers["resume"] = run.call("resume")
    wait_for("time to pass again", lambda: seconds(clock)[-1] >= 2)
    return {"answers": answers, "times": times, "paused_at": paused_at}


def seconds(clock):
    with clock.changed:
        return [m["clock"]["sec"] + m["clock"]["nanosec"] / 1e9 for m in clock.messages]


def reset_between_steps():
    """The three cycles that a run has, and a reset after the first."""
    run = Services()
    run.call("step")
    reset = run.call("reset")
    return {"reset": reset, "steps": [run.call("step") for _ in range(2)]}


def velocities():
    """A box ahead, a quarter turn to the left, nothing, and what is no velocity."""
    odom = Topic(f"{NAMESPACE}/robot_0/odom", "nav_msgs/msg/Odometry")
    publisher, types = publisher_of("robot_0/cmd_vel", "geometry_msgs/msg/Twist")
    vector = types["geometry_msgs/msg/Vector3"]
    run = Services()
    for ahead_m_s, turn_rad_s in [(0.25, 0.0), (0.0, 1.5), (0.01, 0.0), (float("nan"), 0.0)]:
        linear = vector(x=ahead_m_s, y=0.0, z=0.0)
        publisher.publish(linear=linear, angular=vector(x=0.0, y=0.0, z=turn_rad_s))
        run.call("step")
    return {"odom": odom.wait_for(4)}


def publisher_of(name, type_name):
    """A publisher of a topic, once somebody listens."""
    publisher = ROS2Publisher(
        f"{NAMESPACE}/{name}",
        type_name,
        msg_definition=TYPES.generate_msgdef(type_name)[0],
        type_hash=TYPES.hash_rihs01(type_name),
        **AT,
    )
    wait_for("the subscription", lambda: publisher.pub.matching_status.matching)
    return publisher, publisher.session_mgr.store.types


def goals():
    """A goal of another frame, one in a wall, one that is none, two that can be, and 40 steps."""
    truth = Topic(f"{NAMESPACE}/robot_0/ground_truth", "geometry_msgs/msg/PoseStamped")
    publisher, types = publisher_of("robot_0/goal_pose", "geometry_msgs/msg/PoseStamped")
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    west = (0.0, 0.0, 1.0, 0.0)
    for frame, x, y, turn in [
        ("robot_0/odom", 3.125, 0.625, west),
        ("map", 1.875, 0.625, west),
        ("map", 3.125, 0.625, (0.0, 0.0, 0.0, 0.0)),
        ("map", 1.0, 0.625, west),
        ("map", 3.125, 0.625, west),
    ]:
        point = types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
        orientation = types["geometry_msgs/msg/Quaternion"](*turn)
        pose = types["geometry_msgs/msg/Pose"](position=point, orientation=orientation)
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
        publisher.publish(header=header, pose=pose)
    run = Services()
    for _ in range(40):
        run.call("step")
    return {"truth": truth.wait_for(40)}


def trajectory():
    """Three trajectories that cannot be, one that can, and 30 steps."""
    states = Topic(f"{NAMESPACE}/chain_0/joint_states", "sensor_msgs/msg/JointState")
    type_name = "trajectory_msgs/msg/JointTrajectory"
    publisher, types = publisher_of("chain_0/joint_trajectory", type_name)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    none = np.array([])
    for names, values in [
        (["bend", "wrist"], [1.0, -0.5]),
        (["bend", "turn"], [1.0, -7.0]),
        (["bend", "turn"], [1.0]),
        (["bend", "turn"], [1.0, -0.5]),
    ]:
        point = types["trajectory_msgs/msg/JointTrajectoryPoint"](
            positions=np.array(values),
            velocities=none,
            accelerations=none,
            effort=none,
            time_from_start=types["builtin_interfaces/msg/Duration"](sec=2, nanosec=0),
        )
        publisher.publish(header=header, joint_names=names, points=[point])
    run = Services()
    for _ in range(30):
        run.call("step")
    return {"joints": states.wait_for(30)}


def joints():
    """The first step of a paused run of chains."""
    states = Topic(f"{NAMESPACE}/chain_0/joint_states", "sensor_msgs/msg/JointState")
    frames = Topic("/tf", "tf2_msgs/msg/TFMessage")
    answer = Services().call("step")
    return {"answer": answer, "joints": states.wait_for(1), "tf": frames.wait_for(1)}


def airplanes():
    """The first step of a paused run of airplanes."""
    poses = Topic(f"{NAMESPACE}/airplane_0/pose", "geometry_msgs/msg/PoseStamped")
    markers = Topic(f"{NAMESPACE}/markers", "visualization_msgs/msg/MarkerArray")
    answer = Services().call("step")
    return {"answer": answer, "pose": poses.wait_for(1), "markers": markers.wait_for(1)}


WHAT = {
    "graph": graph,
    "steps": steps,
    "late": late,
    "services": services,
    "reset_between_steps": reset_between_steps,
    "velocities": velocities,
    "goals": goals,
    "trajectory": trajectory,
    "joints": joints,
    "airplanes": airplanes,
}

if __name__ == "__main__":
    print(json.dumps(WHAT[sys.argv[4]]()))
    ZenohSession.get_instance(router_port=PORT).close()
