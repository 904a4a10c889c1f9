"""Recorded runs as data sets of Minari."""

import numpy as np
import pytest

import sidestep

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
minari = pytest.importorskip("minari", reason="minari is not installed, so data sets are not tested")
pytest.importorskip("h5py", reason="h5py is not installed, so data sets are not tested")
pytest.importorskip("jax", reason="jax is not installed, so data sets are not tested")


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "sets"))


def record(folder, scenario, seed, cycles=12):
    sim = sidestep.Simulation(scenario, seed=seed, out=folder)
    actions = np.random.default_rng(seed).integers(0, 4, (cycles, 5))
    for row in actions:
        sim.order("action", row)
        sim.step()
    sim.close()
    return actions


def test_a_recorded_run_is_an_episode_with_what_the_caller_saw_and_ordered(tmp_path, external, own_folder):
    folders = [tmp_path / "one", tmp_path / "two"]
    actions = [record(folder, external, seed) for folder, seed in zip(folders, (3, 4), strict=True)]
    made = sidestep.to_minari(folders, "sidestep/walk-v0", rewards={"contact": -1.0}, author="nobody")
    assert made.total_episodes == 2 and made.total_steps == 24
    again = minari.load_dataset("sidestep/walk-v0")
    for episode, expected, seed in zip(again.iterate_episodes(), actions, (3, 4), strict=True):
        np.testing.assert_array_equal(episode.actions["action"], expected)
        sim = sidestep.Simulation(external, seed=seed)
        contacts = []
        for k, row in enumerate(expected):
            np.testing.assert_array_equal(episode.observations["at_boxes"][k], sim.observe()["at_boxes"])
            sim.order("action", row)
            sim.step()
            contacts.append((sim.observe()["contact"] > 0).mean())
        np.testing.assert_allclose(episode.rewards, -np.array(contacts))
        assert episode.truncations.tolist() == [False] * 11 + [True] and not episode.terminations.any()


def test_what_is_no_run_of_a_caller_is_refused(tmp_path, external, own_folder):
    with pytest.raises(sidestep.InputError, match="has no run"):
        sidestep.to_minari(tmp_path, "sidestep/none-v0")
    own = sidestep.Simulation({**external, "robots": [{"count": 2}]}, out=tmp_path / "own")
    own.step(3)
    own.close()
    with pytest.raises(sidestep.InputError, match="was given an order\n  help: record a run that a caller controls"):
        sidestep.to_minari(tmp_path / "own", "sidestep/none-v0")
    with pytest.raises(sidestep.InputError, match="runs: there are none"):
        sidestep.to_minari([], "sidestep/none-v0")


def test_minaris_collector_takes_a_task(own_folder):
    from sidestep.envs import tasks

    env = minari.DataCollector(tasks.make("Exploration-v0", max_cycles=5))
    for _ in range(2):
        env.reset(seed=1)
        ended = False
        while not ended:
            _, _, terminated, truncated, _ = env.step(0)
            ended = terminated or truncated
    made = env.create_dataset("sidestep/exploration-v0", author="nobody")
    assert made.total_steps == 10
