"""Vehicles that speak VDA 5050 version 2.1, for tests: they keep the standard, drive for random times, and have faults.

It reads its task as a line of JSON, prints `ready` when all vehicles are connected, runs until its standard input ends, and
prints what has happened as a line of JSON. The floor is its own: it knows which vehicle covers which box, whatever
messages say. Every message of vehicles and of the master control is checked: by the published schemas where
SIDESTEP_VDA5050_SCHEMAS names their folder, else by the fields that the standard's tables require.
"""

import json
import math
import os
import queue
import random
import sys
import threading
import time

import paho.mqtt.client as mqtt

VERSION = "2.1.0"
TICK_S = 0.004
STATE_INTERVAL_S = 0.3
# A vehicle that is off by less stands on a node.
STANDS_WITHIN_M = 0.05

HEADER = {"headerId": int, "timestamp": str, "version": str, "manufacturer": str, "serialNumber": str}
# Fields that the standard requires (tables of sections 6.6, 6.9, 6.10 and 6.14), with their types.
REQUIRED = {
    "order": {"orderId": str, "orderUpdateId": int, "nodes": list, "edges": list},
    "instantActions": {"actions": list},
    "connection": {"connectionState": str},
    "state": {
        "orderId": str,
        "orderUpdateId": int,
        "lastNodeId": str,
        "lastNodeSequenceId": int,
        "nodeStates": list,
        "edgeStates": list,
        "driving": bool,
        "actionStates": list,
        "batteryState": dict,
        "operatingMode": str,
        "errors": list,
        "safetyState": dict,
    },
}
REQUIRED_OF_ITEMS = {
    "nodes": {"nodeId": str, "sequenceId": int, "released": bool, "actions": list},
    "edges": {
        "edgeId": str,
        "sequenceId": int,
        "released": bool,
        "startNodeId": str,
        "endNodeId": str,
        "actions": list,
    },
    "actions": {"actionType": str, "actionId": str, "blockingType": str},
    "nodeStates": {"nodeId": str, "sequenceId": int, "released": bool},
    "errors": {"errorType": str, "errorLevel": str},
}


class Checker:
    """Checks messages, and remembers which were wrong."""

    def __init__(self):
        self.counts = {}
        self.invalid = []
        self.skipped = ""
        self.validators = self.read_schemas()
        self.lock = threading.Lock()

    def read_schemas(self):
        folder = os.environ.get("SIDESTEP_VDA5050_SCHEMAS")
        if not folder:
            self.skipped = "SIDESTEP_VDA5050_SCHEMAS names no folder with the schemas of VDA 5050 2.1.0"
            return {}
        try:
            from jsonschema import Draft202012Validator as Validator
        except ImportError as error:
            self.skipped = f"python with jsonschema is not here: {error}"
            return {}
        validators = {}
        for name in REQUIRED:
            with open(os.path.join(folder, f"{name}.schema"), encoding="utf-8") as file:
                validators[name] = Validator(json.load(file), format_checker=Validator.FORMAT_CHECKER)
        return validators

    def check(self, name, message):
        if self.validators:
            errors = [f"{list(e.absolute_path)}: {e.message}" for e in self.validators[name].iter_errors(message)]
        else:
            errors = list(self.missing(message, HEADER)) + list(self.missing(message, REQUIRED[name]))
            for key, required in REQUIRED_OF_ITEMS.items():
                for item in message.get(key, []):
                    errors += self.missing(item, required)
        if name == "order" and not errors:
            errors = list(self.order_errors(message))
        with self.lock:
            self.counts[name] = self.counts.get(name, 0) + 1
            if errors:
                self.invalid.append(f"{name}: {errors[0]}: {json.dumps(message)[:400]}")

    @staticmethod
    def missing(message, required):
        for key, kind in required.items():
            value = message.get(key)
            if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
                yield f"{key} is {value!r}"

    @staticmethod
    def order_errors(order):
        """What the standard says of orders and no schema can."""
        nodes, edges = order["nodes"], order["edges"]
        if len(edges) != len(nodes) - 1:
            yield "as many edges as nodes but one"
        numbers = [item["sequenceId"] for pair in zip(nodes, edges) for item in pair] + [nodes[-1]["sequenceId"]]
        if numbers != list(range(numbers[0], numbers[0] + len(numbers))) or numbers[0] % 2:
            yield f"sequence numbers {numbers}"
        for before, edge, after in zip(nodes, edges, nodes[1:]):
            if (edge["startNodeId"], edge["endNodeId"]) != (before["nodeId"], after["nodeId"]):
                yield "an edge that does not join its nodes"
            if edge["released"] != after["released"]:
                yield "an edge that is not released as its end is"
        released = [node["released"] for node in nodes]
        if released != sorted(released, reverse=True) or not released[0]:
            yield "a base that is not the beginning"


class Floor:
    """Which vehicle covers which box, and in which order they came."""

    def __init__(self, box_m):
        self.box_m = box_m
        self.covered = {}
        self.entries = {}
        self.conflicts = []

    def box(self, position):
        return math.floor(position[0] / self.box_m), math.floor(position[1] / self.box_m)

    def enter(self, serial, position):
        box = self.box(position)
        other = self.covered.get(box)
        if other not in (None, serial):
            self.conflicts.append(f"{serial} enters {box} where {other} is")
        self.covered[box] = serial
        self.entries.setdefault(f"{box[0]}-{box[1]}", []).append(serial)

    def leave(self, serial, position):
        box = self.box(position)
        if self.covered.get(box) == serial:
            del self.covered[box]


class Vehicle:
    def __init__(self, task, spec, floor, checker):
        self.task = task
        self.serial = spec["serial"]
        self.faults = spec.get("faults", {})
        self.random = random.Random(f"{task['seed']}/{self.serial}")
        self.floor = floor
        self.checker = checker
        self.at = (spec["x"], spec["y"])
        floor.enter(self.serial, self.at)
        # Where it stood last, where it drives to, and from when to when.
        self.origin, self.target = self.at, None
        self.begins = self.arrives = 0.0
        self.visited = []
        self.received = queue.Queue()
        self.connection_header = 0
        self.client = None
        self.canceled = 0
        self.refused_until = 0.0
        self.has_refused = self.has_restarted = False
        self.offline_until = None
        self.last_node_id = ""
        self.reset()

    def reset(self):
        self.header = 0
        self.order_id, self.update = "", 0
        self.ahead = []
        self.last_sequence = 0
        self.errors = []
        self.actions = []
        self.next_state = 0.0

    def topic(self, name):
        return f"{self.task['interface']}/v2/{self.task['manufacturer']}/{self.serial}/{name}"

    def head(self, header):
        stamp = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime()) + ".00Z"
        return {
            "headerId": header,
            "timestamp": stamp,
            "version": VERSION,
            "manufacturer": self.task["manufacturer"],
            "serialNumber": self.serial,
        }

    def connection(self, state):
        self.connection_header += 1
        message = self.head(self.connection_header) | {"connectionState": state}
        self.checker.check("connection", message)
        return json.dumps(message)

    def connect(self):
        client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id=f"{self.serial}-{self.connection_header}")
        client.will_set(self.topic("connection"), self.connection("CONNECTIONBROKEN"), qos=1, retain=True)
        is_subscribed = threading.Event()
        client.on_message = lambda _client, _data, message: self.received.put((message.topic, message.payload))
        client.on_subscribe = lambda *_: is_subscribed.set()
        client.connect("127.0.0.1", self.task["port"], keepalive=30)
        client.loop_start()
        client.subscribe([(self.topic("order"), 0), (self.topic("instantActions"), 0)])
        if not is_subscribed.wait(30):
            raise TimeoutError("no answer from the broker")
        client.publish(self.topic("connection"), self.connection("ONLINE"), qos=1, retain=True)
        self.client = client

    def break_connection(self):
        """Loses the connection without a word: the broker publishes the last will."""
        self.client.socket().close()
        self.client.loop_stop()
        self.client = None

    def tick(self, now):
        if self.offline_until is not None:
            if now < self.offline_until:
                return
            self.offline_until = None
            self.received = queue.Queue()
            self.connect()
        while not self.received.empty():
            topic, payload = self.received.get()
            message = json.loads(payload)
            name = topic.rsplit("/", 1)[1]
            self.checker.check(name, message)
            self.on_order(message, now) if name == "order" else self.on_actions(message)
            self.next_state = 0.0
        if self.errors and now >= self.refused_until and self.has_refused:
            self.errors, self.refused_until, self.next_state = [], 0.0, 0.0
        self.drive(now)
        restart_at = self.faults.get("restart_after")
        if restart_at is not None and not self.has_restarted and len(self.visited) >= restart_at and self.target:
            self.has_restarted = True
            self.break_connection()
            self.offline_until = now + 0.3
            self.reset()
            return
        if now >= self.next_state:
            self.next_state = now + STATE_INTERVAL_S
            self.publish_state()

    def refuse(self, kind, now, seconds):
        self.has_refused = True
        self.refused_until = now + seconds
        self.errors = [{"errorType": kind, "errorLevel": "WARNING", "errorDescription": "refused by the test"}]

    def on_order(self, order, now):
        nodes = order["nodes"]
        refuse_after = self.faults.get("refuse_after")
        if (
            refuse_after is not None
            and len(self.visited) >= refuse_after
            and (not self.has_refused or now < self.refused_until)
        ):
            if not self.has_refused:
                self.refuse("orderError", now, self.faults.get("refuse_s", 1.0))
            return
        first = nodes[0]
        if order["orderId"] != self.order_id:
            if self.ahead:
                return self.refuse("orderError", now, 1e9)
            place = first["nodePosition"]
            off_m = math.dist(self.at, (place["x"], place["y"]))
            if off_m > max(STANDS_WITHIN_M, place.get("allowedDeviationXY", 0.0)):
                return self.refuse("noRouteError", now, 1e9)
            if not self.visited:
                self.visited.append(first["nodeId"])
            self.last_node_id, self.last_sequence = first["nodeId"], first["sequenceId"]
            self.actions = []
        else:
            if order["orderUpdateId"] <= self.update:
                return None
            base = [node for node in self.ahead if node["released"]]
            end = base[-1] if base else {"nodeId": self.last_node_id, "sequenceId": self.last_sequence}
            if (end["nodeId"], end["sequenceId"]) != (first["nodeId"], first["sequenceId"]):
                return self.refuse("orderUpdateError", now, 1e9)
            self.ahead = base
        self.errors = []
        self.order_id, self.update = order["orderId"], order["orderUpdateId"]
        self.ahead = self.ahead + nodes[1:]
        return None

    def on_actions(self, message):
        for action in message["actions"]:
            if action["actionType"] == "cancelOrder":
                self.canceled += 1
                self.ahead = []
            state = {"actionId": action["actionId"], "actionType": action["actionType"], "actionStatus": "FINISHED"}
            self.actions = [one for one in self.actions if one["actionId"] != state["actionId"]] + [state]

    def drive(self, now):
        if not self.ahead or not self.ahead[0]["released"]:
            return
        node = self.ahead[0]
        place = (node["nodePosition"]["x"], node["nodePosition"]["y"])
        if self.target is None:
            self.floor.enter(self.serial, place)
            self.target = place
            self.begins = now
            self.arrives = now + self.random.uniform(*self.task["edge_s"])
            return
        if place != self.target:
            self.floor.conflicts.append(f"{self.serial} is on its way to {self.target}, and told to go to {place}")
        if now < self.arrives:
            part = min(1.0, (now - self.begins) / (self.arrives - self.begins))
            self.at = tuple(a + part * (b - a) for a, b in zip(self.origin, self.target))
            return
        self.floor.leave(self.serial, self.origin)
        self.at = self.origin = place
        self.target = None
        self.visited.append(node["nodeId"])
        self.last_node_id, self.last_sequence = node["nodeId"], node["sequenceId"]
        self.ahead = self.ahead[1:]
        self.next_state = 0.0

    def publish_state(self):
        silent_after = self.faults.get("silent_after")
        if silent_after is not None and len(self.visited) > silent_after:
            return
        ahead = [{key: node[key] for key in ("nodeId", "sequenceId", "released")} for node in self.ahead]
        message = self.head(self.header) | {
            "orderId": self.order_id,
            "orderUpdateId": self.update,
            "lastNodeId": self.last_node_id,
            "lastNodeSequenceId": self.last_sequence,
            "nodeStates": ahead,
            "edgeStates": [],
            "agvPosition": {
                "x": self.at[0],
                "y": self.at[1],
                "theta": 0.0,
                "mapId": self.task["map_id"],
                "positionInitialized": True,
            },
            "driving": self.target is not None,
            "actionStates": self.actions,
            "batteryState": {"batteryCharge": 77.0, "charging": False},
            "operatingMode": "AUTOMATIC",
            "errors": self.errors,
            "safetyState": {"eStop": "NONE", "fieldViolation": False},
        }
        self.header += 1
        self.checker.check("state", message)
        if self.random.random() >= self.task["lost"]:
            self.client.publish(self.topic("state"), json.dumps(message), qos=0)

    def result(self):
        return {"serial": self.serial, "visited": self.visited, "canceled": self.canceled, "errors": self.errors}


class Witness:
    """Listens to all, and sends what nobody should believe."""

    def __init__(self, task):
        self.task = task
        self.wills = 0
        self.client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id="witness")
        is_subscribed = threading.Event()
        self.client.on_message = self.on_message
        self.client.on_subscribe = lambda *_: is_subscribed.set()
        self.client.connect("127.0.0.1", task["port"], keepalive=30)
        self.client.loop_start()
        self.client.subscribe(f"{task['interface']}/v2/#", qos=1)
        if not is_subscribed.wait(30):
            raise TimeoutError("no answer from the broker")
        self.is_done = not task["forges"]

    def on_message(self, _client, _data, message):
        name = message.topic.rsplit("/", 1)[1]
        text = message.payload.decode(errors="replace")
        if name == "connection" and "CONNECTIONBROKEN" in text:
            self.wills += 1
        if name == "state" and not self.is_done and '"lastNodeSequenceId": 4' in text:
            self.is_done = True
            self.forge(message.topic, json.loads(text))

    def forge(self, topic, state):
        """Sends states that do not fit what a vehicle has said: each has its reason to be dropped."""
        levels = topic.split("/")
        unknown = "/".join(levels[:3] + ["nobody", "state"])
        later = state["headerId"] + 1000
        forged = [
            (topic, "{ this is no JSON"),
            (topic, json.dumps(state)),
            (topic, json.dumps({key: value for key, value in state.items() if key != "errors"})),
            (topic, json.dumps(state | {"headerId": later, "orderId": "of-somebody-else"})),
            (topic, json.dumps(state | {"headerId": later + 1, "lastNodeSequenceId": 5000})),
            (topic, json.dumps(state | {"headerId": later + 2, "version": "3.0.0"})),
            (unknown, json.dumps(state | {"serialNumber": "nobody"})),
        ]
        for target, payload in forged:
            self.client.publish(target, payload, qos=1)


def main():
    task = json.loads(sys.stdin.readline())
    checker = Checker()
    floor = Floor(task["box_m"])
    witness = Witness(task)
    vehicles = [Vehicle(task, spec, floor, checker) for spec in task["vehicles"]]
    for vehicle in vehicles:
        vehicle.connect()
    print("ready", flush=True)
    has_ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), has_ended.set()), daemon=True).start()
    while not has_ended.is_set():
        now = time.monotonic()
        for vehicle in vehicles:
            vehicle.tick(now)
        time.sleep(TICK_S)
    result = {
        "vehicles": [vehicle.result() for vehicle in vehicles],
        "conflicts": floor.conflicts,
        "entries": floor.entries,
        "checked": checker.counts,
        "invalid": checker.invalid,
        "skipped": checker.skipped,
        "wills": witness.wills,
    }
    print(json.dumps(result), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()
