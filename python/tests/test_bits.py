"""Promises D1 and D2: one digest, from Python and from the command."""

import copy
import json
import pathlib
import pickle
import subprocess

import numpy as np
import pytest

import sidestep

SCENARIOS = [
    "scenarios/robots/default.toml",
    "scenarios/chain/default.toml",
    "scenarios/airspace/default.toml",
]


def decide(observed, state):
    """Turns left where something is reported ahead or touched, else goes ahead; says the time."""
    state["calls"] = state.get("calls", 0) + 1
    blocked = (observed["sonar-8_report"][:, 0] > 0) | (observed["contact"] > 0)
    return {"action": np.where(blocked, 1, 0), "broadcast": state["calls"]}


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_command_and_python_give_one_digest_whatever_the_workers(scenario, root, command):
    told = subprocess.run(
        [command, "run", root / scenario, "--cycles", "60", "--seed", "5", "--json"],
        check=True,
        capture_output=True,
        text=True,
    )
    digest = json.loads(told.stdout)["digest"]
    for workers in (1, 2):
        sim = sidestep.Simulation(root / scenario, seed=5, workers=workers)
        sim.run(60)
        assert sim.digest == digest, f"{workers} workers"


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_copies_pickles_and_checkpoints_continue_with_the_same_bits(scenario, root):
    sim = sidestep.Simulation(root / scenario)
    sim.step(20)
    others = [sim.copy(), copy.deepcopy(sim), pickle.loads(pickle.dumps(sim))]
    restored = sidestep.Simulation(root / scenario)
    restored.restore(sim.checkpoint())
    sim.step(20)
    for other in [*others, restored]:
        assert other.cycle == 20
        other.step(20)
        assert other.digest == sim.digest


def test_a_pickle_takes_the_files_of_its_scenario_along(tmp_path):
    (tmp_path / "floor.txt").write_text("......\n......\n")
    text = 'format = 1\nworld = "robots"\nmap.file = "floor.txt"\n[[robots]]\ncount = 2\n'
    (tmp_path / "s.toml").write_text(text)
    sim = sidestep.Simulation(tmp_path / "s.toml")
    sim.step(5)
    stored = pickle.dumps(sim)
    for file in tmp_path.iterdir():
        file.unlink()
    again = pickle.loads(stored)
    again.step(5)
    sim.step(5)
    assert again.digest == sim.digest


def test_a_run_that_python_decided_is_replayed_by_the_command_from_its_orders(external, command, tmp_path):
    folder = tmp_path / "run"
    with sidestep.Simulation(external, out=folder) as sim:
        sim.run(decide=decide)
        digest = sim.digest
    told = subprocess.run([command, "replay", folder], check=True, capture_output=True, text=True)
    assert digest in told.stdout
    orders = sidestep.read(folder)["orders"]
    assert len(orders) == 200 * 5 * 2
    assert set(orders["order"]) == {"action", "broadcast"}


def test_a_decided_run_is_the_same_after_any_copy(external):
    sim = sidestep.Simulation(external)
    sim.run(100, decide=decide)
    other = pickle.loads(pickle.dumps(sim))
    sim.run(decide=decide, state={"calls": 100})
    other.run(decide=decide, state={"calls": 100})
    assert (other.cycle, other.digest) == (200, sim.digest)


def test_a_folder_of_python_is_that_of_the_command(root, command, tmp_path):
    scenario = root / SCENARIOS[0]
    subprocess.run(
        [command, "run", scenario, "--cycles", "100", "--out", tmp_path / "a", "--quiet"],
        check=True,
    )
    with sidestep.Simulation(sidestep.Scenario(scenario).set(cycles=100), out=tmp_path / "b") as sim:
        sim.run()
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.parquet"))
    assert files
    for file in map(pathlib.Path, files):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes(), file


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_seed_beside_the_scenario_and_one_within_it_are_the_same_run(scenario, root):
    """Their checkpoints fit each other, and so do their texts when a caller asks for them."""
    made = sidestep.Scenario(root / scenario)
    beside, within = sidestep.Simulation(made, seed=11), sidestep.Simulation(made.set(seed=11))
    beside.step(5)
    within.restore(beside.checkpoint())
    beside.restore(within.checkpoint())
    again = sidestep.Simulation(beside.scenario, seed=12)
    other = pickle.loads(pickle.dumps(again))
    for sim in (beside, within):
        sim.step(5)
    assert beside.digest == within.digest
    assert beside.scenario.text == within.scenario.text
    assert (other.scenario.seed, other.digest) == (12, again.digest)
    assert made.seed != 11


@pytest.fixture
def led():
    """Robots with goals, led from outside."""
    return {
        "world": "robots",
        "cycles": 120,
        "map": {"ascii": "............\n............\n............"},
        "robots": {
            "count": 4,
            "effector": "nomad",
            "behaviour": {"kind": "shuttle", "a": [0, 0, 2, 3], "b": [10, 0, 2, 3]},
            "planner": {"method": "external"},
        },
    }


def straight(observed, state):
    """Sends each robot along its row to its goal."""
    east = np.sign(observed["goal_boxes"][:, 0] - observed["at_boxes"][:, 0])
    wanted = np.where(east < 0, 2, 0)
    return np.where(observed["heading"] == wanted, 0, 1)


def test_a_planner_in_python_is_told_goals_and_its_run_is_replayed_by_the_command(led, command, tmp_path):
    folder = tmp_path / "led"
    with sidestep.Simulation(led, seed=4, out=folder) as sim:
        observed = sim.observe()
        assert observed["goal_boxes"].shape == (4, 2)
        assert (observed["goal_boxes"][:, 0] <= 1).all(), "the first goal is end a"
        assert (observed["busy_cycles"] == 0).all()
        sim.run(decide=straight)
        metrics, digest = sim.metrics(), sim.digest
    assert metrics["trips"] > 0
    assert metrics["plans"] == 120
    told = subprocess.run([command, "replay", folder], check=True, capture_output=True, text=True)
    assert digest in told.stdout
    again = sidestep.Simulation(led, seed=4, workers=3)
    again.run(decide=straight)
    assert again.digest == digest


def test_actions_that_a_planner_cannot_mean_are_refused_with_the_right_ones(led):
    sim = sidestep.Simulation(led, seed=4)
    with pytest.raises(sidestep.OrderError, match="one of 0 forward"):
        sim.run(decide=lambda observed, state: np.full(4, 9))
    with pytest.raises(sidestep.OrderError, match="an array of the shape"):
        sim.run(decide=lambda observed, state: np.zeros(3, int))
