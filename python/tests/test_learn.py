"""What is learned from columns is what the command learns from a CSV file of the same rows, whatever holds the columns."""

from __future__ import annotations

import csv
import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sidestep
from sidestep import learn

ROWS = 3000
Table = dict[str, Any]


def moves() -> Table:
    """Moves as lists: some values are missing, some out of range, and some actions are none."""
    rng = np.random.default_rng(5)
    code = rng.integers(0, 4, ROWS)
    ahead: list[float | None] = ((code == 0) + rng.normal(0, 0.1, ROWS)).tolist()
    turn = np.array([0.0, 90.0, -90.0, 0.0])[code] + rng.normal(0, 5, ROWS)
    turn[::97] = 500.0
    words = ["forward", "left", "right", "stay", "fly"]
    code[::89] = 4
    ahead[::101] = [None] * len(ahead[::101])
    return {
        "robot": rng.integers(0, 5, ROWS).tolist(),
        "action": [words[k] for k in code],
        "ahead_boxes": ahead,
        "left_boxes": rng.normal(0, 0.05, ROWS).tolist(),
        "turn_deg": turn.tolist(),
        "contact": (rng.uniform(size=ROWS) < 0.1).tolist(),
        "delay_cycles": rng.integers(0, 3, ROWS).tolist(),
    }


def readings() -> Table:
    rng = np.random.default_rng(6)
    there = rng.uniform(size=ROWS) < 0.7
    seen = there ^ (rng.uniform(size=ROWS) < 0.1)
    true_m = rng.uniform(0.1, 6.0, ROWS)
    reported_m = np.abs(true_m + rng.normal(0, 0.1, ROWS))
    reported_m[::103] = -1.0
    reported: list[str | None] = ["wall" if one else "nothing" for one in seen]
    reported[::107] = [None] * len(reported[::107])
    return {
        "cycle": (np.arange(ROWS) // 4).tolist(),
        "robot": rng.integers(0, 3, ROWS).tolist(),
        "true": ["wall" if one else "nothing" for one in there],
        "reported": reported,
        "true_distance_m": [m if one else None for m, one in zip(true_m.tolist(), there, strict=True)],
        "reported_distance_m": [m if one else None for m, one in zip(reported_m.tolist(), seen, strict=True)],
    }


def objects(table: Table) -> Any:
    return {name: np.array(column, dtype=object) for name, column in table.items()}


def arrays(table: Table) -> Any:
    """Arrays of one type each; None is NaN, or a word that is empty."""
    mixed = {name: [np.nan if cell is None else cell for cell in column] for name, column in table.items()}
    words = {
        name: ["" if cell is None else cell for cell in column]
        for name, column in table.items()
        if isinstance(column[1], str)
    }
    # Every second cell of a larger array: rows that are not beside each other.
    wide = {name: np.repeat(np.array(column), 2)[::2] for name, column in {**mixed, **words}.items()}
    return {name: column.astype(np.int16) if column.dtype == np.int64 else column for name, column in wide.items()}


def pandas_frame(table: Table) -> Any:
    return pytest.importorskip("pandas").DataFrame(objects(table))


def pandas_types(table: Table) -> Any:
    frame = pytest.importorskip("pandas").DataFrame(table)
    words = [name for name, column in table.items() if isinstance(column[1], str)]
    return frame.astype(dict.fromkeys(words, "category")).astype({"robot": "Int64"})


def masked(table: Table) -> Any:
    empty = {name: [cell is None for cell in column] for name, column in table.items()}
    filled = {name: [column[1] if cell is None else cell for cell in column] for name, column in table.items()}
    return {name: np.ma.masked_array(column, empty[name]) for name, column in filled.items()}


def polars_frame(table: Table) -> Any:
    return pytest.importorskip("polars").DataFrame(table)


def polars_types(table: Table) -> Any:
    polars = pytest.importorskip("polars")
    words = [polars.col(name).cast(polars.Categorical) for name, column in table.items() if isinstance(column[1], str)]
    frame = polars.DataFrame(table).with_columns(words)
    return polars.concat([frame.slice(0, 1000), frame.slice(1000, 1), frame.slice(1001)], rechunk=False)


def polars_columns(table: Table) -> Any:
    return dict(polars_frame(table).to_dict())


def pyarrow_table(table: Table) -> Any:
    pa = pytest.importorskip("pyarrow")
    whole = pa.table(table)
    # The first rows of a chunk are cut away: its bits and offsets begin in the middle.
    return pa.concat_tables([whole.slice(0, 13), whole.slice(13, 1000), whole.slice(1013)])


def pyarrow_types(table: Table) -> Any:
    pa = pytest.importorskip("pyarrow")
    columns = {}
    for name, column in table.items():
        array = pa.array(column)
        if array.type == pa.string():
            array = array.cast(pa.string_view()) if name == "action" else array.dictionary_encode()
        columns[name] = array.cast(pa.uint8()) if name in ("robot", "delay_cycles") else array
    return pa.table({**columns, "note": [None] * ROWS})


class Stream:
    """A table of pyarrow as nothing but an Arrow stream."""

    def __init__(self, table: Table) -> None:
        self.table = pyarrow_table(table)

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)


FORMS: dict[str, Callable[[Table], Any]] = {
    "lists": dict,
    "objects": objects,
    "arrays": arrays,
    "masked": masked,
    "pandas": pandas_frame,
    "pandas-types": pandas_types,
    "polars": polars_frame,
    "polars-types": polars_types,
    "polars-columns": polars_columns,
    "pyarrow": pyarrow_table,
    "pyarrow-types": pyarrow_types,
    "stream": Stream,
    "reader": lambda table: pyarrow_table(table).to_reader(),
}

LEARNERS: dict[str, tuple[Callable[[], Table], list[str], Callable[[Any], learn.Learned]]] = {
    "effector": (moves, ["--box", "0.25"], lambda table: learn.effector(table, box_m=0.25)),
    "sensor": (readings, ["--range", "6.5", "--beam"], lambda table: learn.sensor(table, range_m=6.5, beam=True)),
}


def cell(value: Any) -> Any:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else value


def of_command(command: str, kind: str, table: Table, folder: Path, *args: str) -> tuple[dict[str, Any], str]:
    """Returns the report and the profile that the command makes of a file with these rows."""
    file, profile = folder / "rows.csv", folder / "profile.toml"
    with file.open("w", newline="") as text:
        writer = csv.writer(text)
        writer.writerow(table)
        writer.writerows([cell(value) for value in row] for row in zip(*table.values(), strict=True))
    line = [command, "learn", kind, "--csv", file, *args]
    done = subprocess.run([*line, "--json", "--profile", profile, "--name", "mine"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), profile.read_text()


DAMAGE = re.compile(r"damaged rows were left out, the first: [^\"]*")


def general(words: str) -> str:
    """Returns words without the names of a table and of its first damaged row."""
    words = re.sub(r"(source = |profile = )\"[^\"]*\"", "", words)
    return DAMAGE.sub("damaged rows", words)


@pytest.mark.parametrize("kind", LEARNERS)
def test_columns_of_any_kind_are_learned_from_like_a_file_of_the_same_rows(
    kind: str, command: str, tmp_path: Path
) -> None:
    rows, args, learner = LEARNERS[kind]
    table = rows()
    report, profile = of_command(command, kind, table, tmp_path, *args)
    del report["source"]
    for form, make in FORMS.items():
        try:
            columns = make(table)
        except pytest.skip.Exception:
            continue
        learned = learner(columns)
        of_columns = learned.report
        del of_columns["source"]
        for one in (of_columns, report):
            one["warnings"] = [general(warning) for warning in one["warnings"]]
        assert of_columns == report, form
        assert general(learned.profile("mine")) == general(profile), form
    assert report["left_out"]["unexplained"] > 10


def test_errors_name_the_column_the_row_and_the_value() -> None:
    good = {"action": ["forward"] * 3, "ahead_boxes": [1.0] * 3, "left_boxes": [0] * 3, "turn_deg": [0] * 3}
    wrong = [
        ("action", ["forward", "fly", "fly"], r"column `action`, row 1 \(from 0\): `fly` is not an action\n.*forward"),
        ("ahead_boxes", [1.0, np.nan, None], r"column `ahead_boxes`, row 1 \(from 0\): the value is missing"),
        ("ahead_boxes", ["1.0", "x", "y"], r"column `ahead_boxes`, row 1 \(from 0\): `x` is not a finite number"),
        ("turn_deg", [0, 361, 361], r"column `turn_deg`, row 1 \(from 0\): 361 is more than .*\n.*-360 to 360"),
        ("turn_deg", [[0, 1]] * 3, r"the column `turn_deg` has the shape \(3, 2\)\n.*one value per row"),
        ("robot", [0.0, 1.5, 2.5], r"column `robot`, row 0 \(from 0\): `0.0` is not a whole number"),
    ]
    for name, column, words in wrong:
        with pytest.raises(sidestep.InputError, match=words) as told:
            learn.effector({**good, name: column})
        assert "line" not in str(told.value)
    with pytest.raises(sidestep.InputError, match='choose one of them, e.g. name="a"'):
        learn.effector({**good, "effector": ["a", "b", "b"]})
    with pytest.raises(sidestep.InputError, match="columns are missing: `left_boxes`, `turn_deg`"):
        learn.effector({"action": ["forward"], "ahead_boxes": [1]})


def test_a_table_without_rows_and_types_that_are_neither_numbers_nor_words_are_told() -> None:
    pa = pytest.importorskip("pyarrow")
    empty = {name: column[:0] for name, column in moves().items()}
    for form in (dict, polars_frame, pyarrow_table):
        with pytest.raises(sidestep.InputError, match="no displacements"):
            learn.effector(form(empty))
    table = pa.table({"action": ["forward"], "ahead_boxes": [[1]], "left_boxes": [0], "turn_deg": [0]})
    with pytest.raises(sidestep.InputError, match="the column `ahead_boxes` has the type"):
        learn.effector(table)
    with pytest.raises(sidestep.InputError, match="more than one column `action`"):
        pandas = pytest.importorskip("pandas")
        learn.effector(pandas.DataFrame([["forward", "left"]], columns=["action", "action"]))


def test_fields_of_packed_records_and_empty_columns_are_read_as_they_are() -> None:
    plain = moves()
    turns = np.array(plain["turn_deg"])
    packed = np.zeros(ROWS, [("pad", "i1"), ("turn_deg", "f8")])
    packed["turn_deg"] = turns
    assert not packed["turn_deg"].flags.aligned
    expected = learn.effector({**plain, "turn_deg": turns}).report
    assert learn.effector({**plain, "turn_deg": packed["turn_deg"]}).report == expected
    empty = {
        name: np.array([], "U7" if name == "action" else float) for name in ("action", "ahead_boxes", "left_boxes")
    }
    with pytest.raises(sidestep.InputError):
        learn.effector({**empty, "turn_deg": np.array([])})
