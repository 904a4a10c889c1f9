"""Wrong input of every sort, and the message that each user sees."""

import pickle

import numpy as np
import pytest

import sidestep


def changed(external, **keys):
    return {**external, **keys}


@pytest.mark.parametrize(
    ("keys", "key", "words"),
    [
        ({"seeed": 3}, "seeed", "seed"),
        ({"world": "robot"}, None, "unknown world `robot`"),
        ({"seed": -1}, "seed", ""),
        ({"robots": [{"cuont": 2}]}, "robots.0.cuont", "count"),
        ({"robots": [{"count": 2, "sensors": ["snoar-8"]}]}, None, "snoar-8"),
        ({"cycles": None}, None, "leave a key out in place of None"),
        ({"seed": 2**70}, None, "too large"),
        ({"name": {1: 2}}, None, "the key 1 is no text"),
    ],
)
def test_a_dict_with_a_mistake_names_its_key(external, keys, key, words):
    with pytest.raises(sidestep.InputError) as raised:
        sidestep.Scenario(changed(external, **keys))
    error = raised.value
    assert isinstance(error, ValueError)
    assert words in str(error)
    assert error.line is None
    if key is not None:
        assert error.key == key
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.key) == (str(error), error.key)


def test_a_file_with_a_mistake_says_line_column_and_remedy(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text('format = 1\nworld = "robots"\ncycels = 5\n')
    with pytest.raises(sidestep.InputError, match="help: did you mean `cycles`") as raised:
        sidestep.Scenario(path)
    assert (raised.value.line, raised.value.column) == (3, 1)
    with pytest.raises(sidestep.InputError, match="no.toml"):
        sidestep.Scenario(tmp_path / "no.toml")


def test_a_text_in_place_of_a_path_is_not_repeated_and_told_where_it_belongs():
    text = 'format = 1\nworld = "robots"\n' + "# a map\n" * 5000
    with pytest.raises(sidestep.InputError, match="text=") as raised:
        sidestep.Scenario(text)
    assert len(str(raised.value)) < 300


@pytest.mark.parametrize(
    ("order", "values", "extra", "words"),
    [
        ("action", 99, {}, "one of 0 forward, 1 left"),
        ("action", np.nan, {}, "is NaN"),
        ("action", [0, 1], {}, r"needs an array of the shape \(5,\), not \(2,\)"),
        ("action", np.zeros((5, 1)), {}, r"not \(5, 1\)"),
        ("action", ["go"] * 5, {}, "must be numbers"),
        ("action", [0.5] * 5, {}, "it must be one of"),
        ("jump", 0, {}, "it takes action, trip, broadcast"),
        ("action", 0, {"agents": [99]}, "there is no robot 99"),
        ("action", 0, {"agents": [6]}, "robot 6 decides for itself"),
        ("action", [0, 0], {"agents": [True, False]}, "must be ids"),
        ("action", 0, {"agents": np.array([True] * 5)}, "must be ids"),
        ("action", 0, {"agents": [0.5]}, "must be ids"),
        ("action", 0, {"agents": [-1]}, "must be ids"),
        ("action", 0, {"team": "robot 2"}, "decides for itself"),
        ("action", 0, {"team": "robots"}, "the scenario has robot, robot 2"),
        ("action", 0, {"team": 7}, "there is no team 7; the scenario has 2"),
        ("broadcast", 2**53, {}, "a whole number from 0 to"),
    ],
)
def test_an_order_that_cannot_be_obeyed_is_refused_and_changes_nothing(external, order, values, extra, words):
    sim = sidestep.Simulation(external)
    before = sim.digest
    with pytest.raises(sidestep.OrderError, match=words):
        sim.order(order, values, **extra)
    assert sim.digest == before


@pytest.mark.parametrize("dtype", [np.int8, np.uint64, np.float32, bool, np.float64])
def test_arrays_of_any_type_stride_and_order_are_taken(external, dtype):
    values = np.array([0, 1, 0, 1, 1, 0, 0, 1, 0, 1], dtype=dtype)[::2]
    sims = [sidestep.Simulation(external) for _ in range(2)]
    sims[0].order("action", values)
    sims[1].order("action", [int(value) for value in values])
    assert sims[0].digest == sims[1].digest


def test_a_closed_simulation_says_so(external):
    sim = sidestep.Simulation(external)
    assert sim.close()["cycles"] == 0
    assert sim.close() is None
    for use in (sim.step, sim.observe, sim.checkpoint, sim.metrics, sim.snapshot):
        with pytest.raises(sidestep.ClosedError, match="the simulation is closed"):
            use()
    assert "closed" in repr(sim)


def test_a_checkpoint_of_another_scenario_is_refused(external):
    sim = sidestep.Simulation(external)
    other = sidestep.Simulation(changed(external, name="another"))
    with pytest.raises(sidestep.CheckpointError, match="belongs to scenario"):
        sim.restore(other.checkpoint())
    with pytest.raises(sidestep.CheckpointError, match="damaged|not a checkpoint"):
        sim.restore(sim.checkpoint()[:-3])


def test_a_folder_in_use_is_not_overwritten(external, tmp_path):
    sidestep.Simulation(external, out=tmp_path / "run").close()
    with pytest.raises(sidestep.InputError, match="run"):
        sidestep.Simulation(external, out=tmp_path / "run")
    sidestep.Simulation(external, out=tmp_path / "run", replace=True).close()


def test_rows_that_nobody_keeps_cannot_be_taken(external):
    with pytest.raises(sidestep.InputError, match="record=True"):
        sidestep.Simulation(external).tables()
    with pytest.raises(sidestep.InputError, match="workers: is 0"):
        sidestep.Simulation(external, workers=0)


def test_an_exception_of_a_deciding_function_comes_through_with_the_cycle(external):
    def fails_at_three(observed, state):
        state["n"] = state.get("n", 0) + 1
        if state["n"] > 3:
            raise KeyError("no plan")
        return 0

    sim = sidestep.Simulation(external)
    with pytest.raises(KeyError, match="no plan") as raised:
        sim.run(decide=fails_at_three)
    assert sim.cycle == 3
    notes = getattr(raised.value, "__notes__", ["deciding for cycle 3"])
    assert "deciding for cycle 3" in notes[0]
    assert "fails_at_three" in str(raised.traceback[-1])


def test_a_scenario_in_which_nobody_takes_orders_cannot_be_decided(external):
    scenario = changed(external, robots=[{"count": 2}])
    with pytest.raises(sidestep.OrderError, match="external"):
        sidestep.Simulation(scenario).run(decide=lambda observed, state: 0)


@pytest.mark.parametrize("number", [-1, 2**64])
def test_a_number_that_is_out_of_range_is_told_with_the_range(external, number):
    words = rf"{number} is out of range\n  help: give a whole number from 0 to"
    with pytest.raises(sidestep.InputError, match=words):
        sidestep.Simulation(external, seed=number)
    sim = sidestep.Simulation(external)
    with pytest.raises(sidestep.InputError, match=words):
        sim.step(number)
    with pytest.raises(sidestep.InputError, match=words):
        sim.run(number)
    with pytest.raises(TypeError, match="cannot be interpreted as an integer"):
        sim.step(0.5)


def test_a_seed_that_no_scenario_file_can_have_is_told(external):
    with pytest.raises(
        sidestep.InputError, match=r"seed: 9223372036854775808 is too large\n  help: give at most 2\^63 - 1"
    ):
        sidestep.Simulation(external, seed=2**63)
    sim = sidestep.Simulation(external, seed=2**63 - 1)
    assert pickle.loads(pickle.dumps(sim)).digest == sim.digest


def test_a_forgotten_return_is_told(external):
    sim = sidestep.Simulation(external)
    with pytest.raises(sidestep.OrderError, match="`robot` returned None; return its orders, {} for none"):
        sim.run(decide=lambda observed, state: None)
    assert sim.run(1, decide=lambda observed, state: {}) == 1


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda sim: sim.order("action", np.ma.array([0] * 5, mask=[0, 0, 1, 0, 0])), "masked"),
        (lambda sim: sim.order("action", np.array([1j, 0, 0, 0, 0])), "complex"),
        (lambda sim: sim.order("action", [0, 1], agents=[0, 0]), "0 twice"),
        (lambda sim: sim.step(-1), "cycles: -1 is out of range"),
        (lambda sim: sim.run(until=-3), "until: -3 is out of range"),
        (lambda sim: sidestep.Simulation(sim.scenario, workers=10**6), "workers: is 1000000"),
        (lambda sim: sidestep.Simulation(sim.scenario, workers=-1), "workers: -1 is out of range"),
        (lambda sim: sidestep.Simulation(sim.scenario, seed=-1), "seed: -1 is out of range"),
        (lambda sim: sidestep.sweep(sim.scenario, replicate=2).values("contacts", 9), "variant: is 9"),
        (lambda sim: sidestep.sweep(sim.scenario, replicate=1.5), "replicate: is 1.5"),
        (lambda sim: sidestep.collectives.minimize([2, 2], lambda joint: 0.0), "pairs: it is a function"),
    ],
)
def test_a_mistake_is_told_with_the_argument_and_its_value(external, call, words):
    sim = sidestep.Simulation(changed(external, cycles=5))
    with pytest.raises((sidestep.InputError, sidestep.OrderError), match=words):
        call(sim)


def test_a_masked_array_without_masked_values_is_an_array(external):
    sim = sidestep.Simulation(external)
    sim.order("action", np.ma.array([0] * 5, mask=[0] * 5))


def test_a_folder_without_a_run_has_no_tables_and_says_so(tmp_path):
    with pytest.raises(sidestep.InputError, match="no run and no sweep"):
        sidestep.read(tmp_path)


def test_a_function_that_advances_the_run_itself_is_refused(external):
    sim = sidestep.Simulation(external)

    def decide(_, __):
        sim.step()
        return [0] * 5

    with pytest.raises(sidestep.OrderError, match="advanced the run itself"):
        sim.run(5, decide=decide)


def test_an_episode_has_whole_cycles(external):
    envs = pytest.importorskip("sidestep.envs")
    with pytest.raises(sidestep.InputError, match="max_cycles: is 1.5"):
        envs.parallel_env(external, max_cycles=1.5)
    with pytest.raises(sidestep.InputError, match="max_cycles: is 0"):
        envs.Batch(external, 2, max_cycles=0)
