"""Reads tables with pyarrow and polars and says what is in them, as JSON.

usage: read_tables.py PARTS_FOLDER EXPORTED_PARQUET EXPORTED_CSV
"""

import json
import sys

import polars
import pyarrow.parquet as pq

parts, parquet, csv = sys.argv[1:4]

whole = pq.read_table(parts)
exported = pq.read_table(parquet)
assert whole.equals(exported), "one file holds the rows of all parts, in their order"
assert whole.schema.equals(exported.schema)

frame = polars.read_parquet(f"{parts}/*.parquet")
assert frame.equals(polars.read_parquet(parquet))
text = polars.read_csv(csv, infer_schema_length=None)
assert text.columns == frame.columns
for name in frame.columns:
    same = text[name].cast(frame[name].dtype)
    assert same.equals(frame[name]), f"{name}: text comes back to the same values"

who = frame.columns[1]
per_body = frame.group_by(who).agg(polars.len().alias("rows"), polars.col("cycle").max())
per_body = per_body.sort(who)
values = {k.decode(): v.decode() for k, v in pq.read_metadata(parquet).metadata.items()}
print(
    json.dumps(
        {
            "rows": exported.num_rows,
            "types": {field.name: str(field.type) for field in exported.schema},
            "rows_per_body": per_body["rows"].to_list(),
            "last_cycles": per_body["cycle"].to_list(),
            "keys": {k: v for k, v in values.items() if k.startswith("sidestep.")},
        }
    )
)
