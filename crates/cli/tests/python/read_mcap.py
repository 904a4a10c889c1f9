"""Reads a recording for viewers with the mcap library and says what is in it, as JSON.

usage: read_mcap.py RECORDING TRAJECTORIES X Y   (columns of the table, or `boxes` for robots)
"""

import json
import math
import sys

import pyarrow.parquet as pq
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

recording, trajectories = sys.argv[1:3]

topics, times, cycles, levels = {}, [], [], {}
positions, frames, entities = {}, {}, 0
with open(recording, "rb") as stream:
    reader = make_reader(stream, decoder_factories=[DecoderFactory()])
    summary = reader.get_summary()
    statistics = summary.statistics
    attachments = {a.name: a.data for a in reader.iter_attachments()}
    metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    cycle_s = float(metadata["sidestep"]["cycle_s"])
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        topic = topics.setdefault(channel.topic, {"schema": schema.name, "messages": 0})
        topic["messages"] += 1
        times.append(message.log_time)
        if channel.topic == "/tf":
            cycle = round(message.log_time / 1e9 / cycle_s)
            cycles.append(cycle)
            for t in decoded.transforms:
                at = t.translation
                positions[cycle, t.child_frame_id] = (at.x, at.y, at.z)
                assert t.parent_frame_id == "world"
                assert t.timestamp.seconds * 10**9 + t.timestamp.nanos == message.log_time
        elif channel.topic.startswith("/poses/"):
            frames.setdefault(channel.topic, set()).add(len(decoded.poses))
        elif channel.topic.startswith("/scan/"):
            assert len(decoded.ranges) > 1 and decoded.end_angle > decoded.start_angle
        elif channel.topic == "/scene":
            entities = max(entities, len(decoded.entities))
        elif channel.topic == "/map":
            assert len(decoded.data) % decoded.column_count == 0
            topic["cells"] = len(decoded.data)
            at, turn = decoded.pose.position, decoded.pose.orientation
            topic["plane"] = [at.x, at.y, 2 * math.atan2(turn.z, turn.w)]
        elif channel.topic == "/log":
            assert decoded.name and decoded.message.startswith(decoded.name)
            levels[decoded.level] = levels.get(decoded.level, 0) + 1

# Every position of the table is in the recording, to the bit where the map is not turned.
table = pq.read_table(trajectories)
world = metadata["sidestep"]["world"]
rows = table.to_pydict()
compared, compared_rows = 0, table.num_rows
if world == "robots":
    # Robots of two boxes and one, people of one: the middle of their boxes.
    box_m = float(sys.argv[3])
    plane = topics["/map"]["plane"]
    size = {int(k): int(v) for k, v in json.loads(sys.argv[4]).items()}
    for cycle, body, col, row in zip(rows["cycle"], rows["body"], rows["col_boxes"], rows["row_boxes"]):
        at = positions.get((cycle, f"robot/{body}"))
        if at is not None:
            x, y = [(k + 0.5 * size[body]) * box_m for k in (col, row)]
            if plane[2] == 0.0:
                middle = [plane[0] + x, plane[1] + y]
                assert list(at[:2]) == middle, (cycle, body, at, middle)
            else:
                s, c = math.sin(plane[2]), math.cos(plane[2])
                middle = [plane[0] + c * x - s * y, plane[1] + s * x + c * y]
                assert math.dist(at[:2], middle) < 1e-9, (cycle, body, at, middle)
            compared += 1
else:
    parts = "connector" if world == "chain" else None
    of = rows["chain" if parts else "airplane"]
    dimensions = [rows[axis] for axis in ("x_m", "y_m", "z_m") if axis in rows]
    # Of an airplane's legs, only the first one of a cycle starts where the frame shows it.
    starts = rows.get("from_s")
    compared_rows = 0
    for k, cycle in enumerate(rows["cycle"]):
        if starts and abs(starts[k] - cycle * cycle_s) > 1e-9:
            continue
        compared_rows += 1
        name = f"connector/{of[k]}/{rows['connector'][k]}" if parts else f"airplane/{of[k]}"
        at = positions.get((cycle, name))
        if at is not None:
            assert list(at[: len(dimensions)]) == [axis[k] for axis in dimensions], (cycle, name)
            compared += 1

print(
    json.dumps(
        {
            "topics": topics,
            "messages": statistics.message_count,
            "chunks": statistics.chunk_count,
            "sorted": times == sorted(times),
            "cycles": cycles,
            "compared": compared,
            "rows": compared_rows,
            "entities": entities,
            "levels": levels,
            "pose_counts": {topic: sorted(counts) for topic, counts in frames.items()},
            "attachments": sorted(attachments),
            "scenario": attachments["scenario.toml"].decode(),
            "metadata": metadata["sidestep"],
        }
    )
)
