"""Long runs as blocks, chosen tables, frames, and folders that are read table by table."""

import os

import numpy as np
import pytest

import sidestep


def rows_of(tables):
    """All rows of tables of one name. Within a block they are sorted by body, so that blocks differ in their order."""
    return sorted(row for table in tables for row in table.head(10**6))


def test_blocks_are_the_rows_of_the_run_as_they_come(external):
    whole = sidestep.Simulation(external, record=True)
    whole.run()
    sim = sidestep.Simulation(external)
    blocks, cycles = [], []
    for tables in sim.blocks(64):
        blocks.append(tables)
        cycles.append(sim.cycle)
    assert cycles == [64, 128, 192, 200]
    assert [len(block["trajectories"]) for block in blocks] == [448, 448, 448, 56]
    for name, table in whole.tables().items():
        assert rows_of(block[name] for block in blocks) == rows_of([table])
    assert sim.digest == whole.digest
    assert list(sim.blocks()) == [], "the run has ended"


def test_blocks_may_be_decided_left_and_gone_on_with(external):
    def decide(observed, state):
        state["calls"] = state.get("calls", 0) + 1
        return state["calls"] % 2

    alone = sidestep.Simulation(external)
    alone.run(decide=decide)
    sim, state = sidestep.Simulation(external), {}
    for tables in sim.blocks(30, decide=decide, state=state):
        assert set(tables) >= {"trajectories", "orders"}
        break
    assert (sim.cycle, state) == (30, {"calls": 30})
    for _ in sim.blocks(30, decide=decide, state=state):
        pass
    assert (sim.digest, state) == (alone.digest, {"calls": 200})
    # Without a state, functions keep theirs from block to block.
    sim = sidestep.Simulation(external)
    for _ in sim.blocks(30, decide=decide):
        pass
    assert sim.digest == alone.digest


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory is read from /proc")
def test_a_long_run_takes_the_memory_of_one_block():
    def resident():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    floor = {"world": "robots", "cycles": 40_000, "map": {"ascii": "......"}, "robots": [{"count": 3}]}
    sim, rows, most = sidestep.Simulation(floor), 0, None
    for tables in sim.blocks(1000):
        rows += len(tables["trajectories"])
        # Memory for the allocator and the first blocks comes once.
        first = most = most or resident()
        most = max(most, resident())
    assert rows == 120_000
    # All rows would take 120,000 x 28 bytes in columns alone, and as many again while they are made.
    assert most - first < 2_000_000


def test_only_the_tables_that_are_named_are_kept(external):
    sim = sidestep.Simulation(external, record=["events"])
    sim.run(50)
    whole = sidestep.Simulation(external, record=True)
    whole.run(50)
    tables = sim.tables()
    assert list(tables) == ["events"]
    assert tables["events"]["cycle"].tolist() == whole.tables()["events"]["cycle"].tolist()
    sim = sidestep.Simulation(external)
    sim.step(10)
    sim.record(["trajectories"])
    sim.step(10)
    assert set(sim.tables()["trajectories"]["cycle"]) == set(range(10, 20))


def test_frames_are_a_table_at_every_nth_cycle_whatever_the_steps(external):
    sims = [sidestep.Simulation(external) for _ in range(2)]
    for sim in sims:
        sim.record([], frames=7)
    sims[0].run(30)
    for _ in range(15):
        sims[1].step(2)
    frames = [sim.tables()["frames"] for sim in sims]
    assert sorted(set(frames[0]["cycle"])) == [0, 7, 14, 21, 28]
    assert frames[0].head(10**6) == frames[1].head(10**6)
    assert frames[0].units["velocity_x_m_s"] == "m/s"
    plain = sidestep.Simulation(external)
    plain.run(30)
    assert plain.digest == sims[0].digest, "looking changes nothing"


def test_a_frame_is_the_snapshot_as_a_table(external):
    sim = sidestep.Simulation(external)
    sim.step(5)
    frame, shot = sim.frame(), sim.snapshot()
    assert frame["cycle"].tolist() == [5] * 7
    for k, name in enumerate(("x_m", "y_m", "z_m")):
        assert frame[name].tolist() == shot["at_m"][:, k].tolist()
    assert (frame["kind"] == shot["kind"]).all() and (frame["condition"] == shot["condition"]).all()
    polars = pytest.importorskip("polars")
    assert polars.DataFrame(frame).height == 7


@pytest.mark.parametrize(
    ("use", "words"),
    [
        (lambda sim: sim.record(["event"]), "there is no table `event`\n  help: give some of trajectories, events"),
        (lambda sim: sim.record("events"), "is no list of tables"),
        (lambda sim: sim.record(False), "leave it out"),
        (lambda sim: sim.record(frames=0), "give 1 or more cycles"),
        (lambda sim: [sim.record(), sim.record()], "are kept already"),
        (lambda sim: sim.blocks(0), "a block of 0 cycles"),
    ],
)
def test_what_cannot_be_recorded_is_told(external, use, words):
    with pytest.raises(sidestep.InputError) as raised:
        use(sidestep.Simulation(external))
    assert words in str(raised.value)


def test_rows_of_a_folder_are_not_kept_twice(external, tmp_path):
    with sidestep.Simulation(external, out=tmp_path / "run") as sim:
        for use in (sim.record, sim.blocks):
            with pytest.raises(sidestep.InputError, match="go to a folder"):
                use()


def test_a_table_of_a_folder_is_read_when_it_is_asked_for(external, tmp_path):
    with sidestep.Simulation(external, out=tmp_path / "run") as sim:
        sim.run()
    (part,) = (tmp_path / "run/events").glob("*.parquet")
    part.write_bytes(b"no table")
    tables = sidestep.read(tmp_path / "run")
    assert set(tables) == {"trajectories", "events", "orders", "series"}
    assert len(tables["trajectories"]) == 1400
    assert tables["trajectories"] is tables["trajectories"], "it is read once"
    with pytest.raises(sidestep.InputError, match="events"):
        tables["events"]
    with pytest.raises(KeyError, match="no table `event`"):
        tables["event"]
    with pytest.raises(sidestep.InputError, match="there is no table `event`"):
        sidestep.read(tmp_path / "run", ["event"])
    with pytest.raises(sidestep.InputError, match="nowhere"):
        sidestep.read(tmp_path / "nowhere")


def test_the_first_rows_are_pythons_own_values(external):
    sim = sidestep.Simulation(external, record=True)
    sim.run(20)
    tables = sim.tables()
    first = tables["trajectories"].head(2)
    assert [row[:2] for row in first] == [(0, 0), (1, 0)]
    assert all(isinstance(row[-1], str) for row in first)
    assert tables["events"].head(0) == []
    assert len(tables["trajectories"].head(10**6)) == 140


def test_a_table_is_sliced_selected_and_turned_into_what_others_use() -> None:
    sim = sidestep.Simulation(
        {"world": "robots", "cycles": 9, "map": {"ascii": "....."}, "robots": [{"count": 2}]}, record=True
    )
    sim.run()
    table = sim.tables()["trajectories"]
    assert table[2:5]["cycle"].tolist() == table["cycle"][2:5].tolist()
    assert table[-3:].head() == table.head(len(table))[-3:]
    assert (len(table[5:2]), len(table[:0]), len(table[:])) == (0, 0, len(table))
    assert table[["body", "cycle"]].columns == ["body", "cycle"]
    assert {name: values.tolist() for name, values in dict(table).items()} == {
        name: table[name].tolist() for name in table.columns
    }
    with pytest.raises(TypeError, match="from_arrow"):
        list(table)
    with pytest.raises(TypeError, match="head"):
        table[0]  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="step"):
        table[::2]
    with pytest.raises(KeyError, match="no column `cylce`"):
        table[["cylce"]]
    pandas = pytest.importorskip("pandas")
    frames = [pandas.DataFrame(dict(table))]
    if hasattr(pandas.DataFrame, "from_arrow"):
        frames.append(pandas.DataFrame.from_arrow(table))
    for frame in frames:
        assert frame["cycle"].tolist() == table["cycle"].tolist()
    with pytest.raises(TypeError, match="from_arrow"):
        pandas.DataFrame(table)
