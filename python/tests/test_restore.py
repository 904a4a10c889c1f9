"""Going back to a checkpoint: a recording has one past."""

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


@pytest.fixture
def branched(external):
    """A simulation that has gone back from cycle 33 to 20, and on to 25 on another way; with both checkpoints."""
    sim = sidestep.Simulation(external)
    sim.record(frames=5)
    sim.step(20)
    before = sim.checkpoint()
    sim.step(13)
    left = sim.checkpoint()
    sim.restore(before)
    sim.order("action", 1)
    sim.step(5)
    return sim, before, left


def test_a_later_checkpoint_of_a_branch_that_was_left_is_refused_while_rows_are_kept(branched):
    sim, before, left = branched
    digest = sim.digest
    with pytest.raises(sidestep.CheckpointError) as raised:
        sim.restore(left)
    told = str(raised.value)
    assert "rows are kept from cycle 0 on, of one past: the run stands at cycle 25" in told
    assert "the checkpoint of cycle 33 is not known to be of this past" in told
    assert "take these rows before (`sim.tables()`), or restore it in a copy (`sim.copy()`)" in told
    assert (sim.cycle, sim.digest) == (25, digest)
    # The present state, and all that it came by.
    sim.restore(sim.checkpoint())
    own = sim.checkpoint()
    sim.step(5)
    for checkpoint in (own, before):
        sim.restore(checkpoint)
    sim.step(5)
    tables = sim.tables()
    for name, cycles in (("trajectories", range(25)), ("frames", range(0, 26, 5))):
        assert set(tables[name]["cycle"]) == set(cycles)
        assert len(tables[name]) == 7 * len(cycles)


def test_any_checkpoint_is_taken_where_no_rows_of_earlier_cycles_are_kept(branched, external):
    sim, before, left = branched
    copy = sim.copy()
    copy.restore(left)
    fresh = sidestep.Simulation(external, record=True)
    fresh.order("action", 2)
    sim.tables()
    for one in (sim, fresh):
        one.restore(left)
        one.step(5)
        one.restore(before)
        one.restore(one.checkpoint())
        one.step(5)
        with pytest.raises(sidestep.CheckpointError, match="rows are kept from cycle 20 on"):
            one.restore(left)
        tables = one.tables()
        assert set(tables["trajectories"]["cycle"]) == set(range(20, 25))
        assert len(tables["orders"]) == 0
        one.restore(left)
        one.step(5)
        assert set(one.tables()["trajectories"]["cycle"]) == set(range(33, 38))


def test_a_checkpoint_of_another_scenario_is_told_as_such_while_rows_are_kept(external):
    other = sidestep.Simulation(external, seed=8)
    other.step(9)
    sim = sidestep.Simulation(external, record=True)
    sim.step(5)
    with pytest.raises(sidestep.CheckpointError, match="belongs to scenario"):
        sim.restore(other.checkpoint())


def test_orders_of_several_checkpoints_of_a_cycle_come_back_each_with_its_own(external):
    sim = sidestep.Simulation(external, record=True)
    sim.step(10)
    before = sim.checkpoint()
    ordered = []
    for agent in (0, 1, 2):
        sim.restore(before)
        sim.order("action", 1, agents=[agent])
        ordered.append(sim.checkpoint())
        sim.step(3)
    for agent, checkpoint in enumerate(ordered):
        sim.restore(checkpoint)
        sim.step()
        sim.restore(checkpoint)
        assert sim.copy().checkpoint() == checkpoint
    sim.step()
    tables = sim.tables()
    assert tables["orders"]["agent"].tolist() == [2]
    assert len(tables["trajectories"]) == 11 * 7


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
        assert "restore it in a copy (`sim.copy()`), or in a new Simulation without a folder" in told
        with pytest.raises(sidestep.CheckpointError, match="damaged"):
            sim.restore(before[:-1])
        # The remedies.
        for branch in (sim.copy(), sidestep.Simulation(external)):
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
