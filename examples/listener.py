"""A listener: it prints states and events of a fleet, over the public wire (docs/src/wire/).

    sidestep fleet scenarios/airspace/multirotors.toml --no-server --publish tcp/127.0.0.1:7700
    python examples/listener.py --connect tcp/127.0.0.1:7700

It needs `pip install eclipse-zenoh rosbags`. Each line is a JSON object, until the fleet has ended. Events that have not come
are asked for, so that each is there once.
"""

import argparse
import json
import pathlib
import queue

import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MESSAGES = pathlib.Path(__file__).resolve().parents[1] / "docs" / "src" / "wire"
KEY = "sidestep/v1/fleet"

types = get_typestore(Stores.EMPTY)
for file in MESSAGES.glob("*.msg"):
    types.register(get_types_from_msg(file.read_text(), f"sidestep_msgs/msg/{file.stem}"))


def decode(payload, message):
    return types.deserialize_cdr(payload.to_bytes(), f"sidestep_msgs/msg/{message}")


def ask(session, what, message):
    """Returns the answer to a query; None if there is none."""
    answers = [decode(reply.ok.payload, message) for reply in session.get(f"{KEY}/{what}") if reply.ok is not None]
    return answers[0] if answers else None


def say(**line):
    print(json.dumps(line), flush=True)


class Events:
    """Events in the order of their numbers."""

    def __init__(self, session):
        self.session = session
        self.next = 0

    def catch_up(self, number):
        """Asks for the events before a number that have not come."""
        while self.next < number:
            missed = ask(self.session, f"events?from={self.next}", "FleetEvents")
            if missed is None:
                say(lost=[self.next, number])
                self.next = number
                return
            self.print(missed.events)
            # Without an answer nobody has them any more.
            self.next = max(self.next, missed.next if len(missed.events) == 0 else 0)

    def print(self, events):
        for event in events:
            if event.number >= self.next:
                text = {"kind": event.kind, "body": event.body, "other": event.other, "text": event.text}
                say(event=event.number, cycle=event.cycle, **text)
                self.next = event.number + 1


def print_state(state):
    at = {body.name: [round(x_m, 2) for x_m in body.position_m.tolist()] for body in state.bodies}
    say(cycle=state.cycle, time_s=state.time_s, at_m=at, is_over=state.is_over)


options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--connect", required=True, help="the endpoint of --publish, e.g. tcp/127.0.0.1:7700")
args = options.parse_args()

config = zenoh.Config.from_json5(json.dumps({"mode": "client", "connect": {"endpoints": [args.connect]}}))
with zenoh.open(config) as session:
    arrivals = queue.SimpleQueue()
    events = session.declare_subscriber(f"{KEY}/events", lambda it: arrivals.put(decode(it.payload, "FleetEvents")))
    states = session.declare_subscriber(f"{KEY}/state", lambda it: arrivals.put(decode(it.payload, "FleetState")))
    about = ask(session, "description", "FleetDescription")
    say(scenario=about.scenario, world=about.world, seed=about.seed, clock=about.clock, agent=about.agent)
    # The present state, which was published before this listener came.
    arrivals.put(ask(session, "state", "FleetState"))
    log = Events(session)
    while True:
        arrival = arrivals.get()
        if hasattr(arrival, "bodies"):
            log.catch_up(arrival.next_event)
            print_state(arrival)
            if arrival.is_over:
                break
        else:
            log.catch_up(arrival.events[0].number)
            log.print(arrival.events)
