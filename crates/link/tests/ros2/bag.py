"""Reads a bag by `rosbags`, which shares no code with Sidestep.

    bag.py FOLDER

Prints the type and the number of messages of each topic, and the last message of each in plain data.
"""

import json
import sys

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def plain(value):
    """Returns a message as plain data, long lists by their length."""
    if hasattr(value, "__dataclass_fields__"):
        fields = [name for name in value.__dataclass_fields__ if name != "__msgtype__"]
        return {name: plain(getattr(value, name)) for name in fields}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value] if len(value) < 20 else len(value)
    return value


def main():
    topics = {}
    with Reader(sys.argv[1]) as reader:
        # By the definitions in the bag alone: an empty store knows no types.
        types = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            new = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            types.register({name: fields for name, fields in new.items() if name not in types.fielddefs})
        for connection, time_ns, data in reader.messages():
            topic = topics.setdefault(connection.topic, {"type": connection.msgtype, "count": 0})
            topic["count"] += 1
            topic["last"] = plain(types.deserialize_cdr(data, connection.msgtype))
            topic["last_ns"] = time_ns
    print(json.dumps(topics))


main()
