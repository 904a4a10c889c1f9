"""Going back to a checkpoint: what was recorded is of one past."""

import pytest

import sidestep

SCENARIOS = [
    "scenarios/robots/default.toml",
    "scenarios/chain/default.toml",
    "scenarios/airspace/default.toml",
]


def cells(table):
    """The cells of a table by column; numbers that are missing are equal to each other."""
    return {name: [v if v == v else None for v in table[name]] for name in table.columns}


def as_lists(tables):
    return {name: cells(table) for name, table in tables.items()}


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_rows_in_memory_are_those_of_a_run_that_never_went_the_other_way(scenario, root):
    straight, astray = (sidestep.Simulation(root / scenario, workers=2) for _ in range(2))
    for sim in (straight, astray):
        sim.record(frames=7)
        sim.step(20)
    before = astray.checkpoint()
    astray.step(13)
    astray.restore(before)
    for sim in (straight, astray):
        sim.step(30)
    assert astray.digest == straight.digest
    assert astray.agent_metrics() == straight.agent_metrics()
    ours, theirs = as_lists(astray.tables()), as_lists(straight.tables())
    assert ours == theirs
    assert sorted(set(ours["frames"]["cycle"])) == [0, 7, 14, 21, 28, 35, 42, 49]


def test_rows_that_were_handed_over_stay_with_their_owner(external):
    sim = sidestep.Simulation(external)
    sim.record(["trajectories"], frames=10)
    sim.step(20)
    before = sim.checkpoint()
    sim.step(15)
    sim.tables()
    sim.restore(before)
    sim.step(5)
    tables = sim.tables()
    assert set(tables["trajectories"]["cycle"]) == set(range(20, 25))
    assert set(tables["frames"]["cycle"]) == {20}


def test_orders_that_wait_in_a_checkpoint_come_back_with_their_rows(external):
    straight, astray = (sidestep.Simulation(external, record=True) for _ in range(2))
    for sim in (straight, astray):
        sim.step(10)
        sim.order("action", 1, agents=[0, 2])
    before = astray.checkpoint()
    astray.order("action", 2)
    astray.step(5)
    astray.order("action", 0)
    for _ in range(2):
        astray.restore(before)
        astray.step()
        astray.order("action", 2)
        astray.step(3)
    straight.step()
    straight.order("action", 2)
    straight.step(3)
    assert astray.digest == straight.digest
    rows = as_lists(astray.tables())
    assert rows == as_lists(straight.tables())
    assert rows["orders"]["agent"] == [0, 2, 0, 1, 2, 3, 4]


def test_an_order_after_the_checkpoint_leaves_no_row(external):
    sim = sidestep.Simulation(external, record=True)
    sim.step(10)
    before = sim.checkpoint()
    sim.order("action", 1)
    sim.restore(before)
    sim.step()
    assert len(sim.tables()["orders"]) == 0


def test_a_run_folder_refuses_another_past_and_says_what_to_do(external, tmp_path):
    with sidestep.Simulation(external, out=tmp_path / "run") as sim:
        sim.step(50)
        before = sim.checkpoint()
        sim.restore(before)
        sim.order("action", 1)
        with pytest.raises(sidestep.CheckpointError, match="of another state there"):
            sim.restore(before)
        sim.step(30)
        with pytest.raises(sidestep.CheckpointError) as raised:
            sim.restore(before)
        told = str(raised.value)
        assert f"the folder {tmp_path / 'run'}, which holds one past" in told
        assert "it stands at cycle 80, and the checkpoint is of cycle 50" in told
        assert "restore it in a copy (`sim.copy()`)" in told
        with pytest.raises(sidestep.CheckpointError, match="damaged"):
            sim.restore(before[:-1])
        # The remedy.
        branch = sim.copy()
        branch.restore(before)
        assert (branch.cycle, sim.cycle) == (50, 80)
        sim.run()
        digest = sim.digest
    quiet = sidestep.Simulation(external)
    quiet.step(50)
    quiet.order("action", 1)
    quiet.run()
    assert digest == quiet.digest
    cycles = list(sidestep.read(tmp_path / "run")["trajectories"]["cycle"])
    assert len(cycles) == 200 * 7
    assert set(cycles) == set(range(200))
