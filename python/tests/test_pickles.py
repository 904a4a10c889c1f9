"""What has data travels: to other processes, and as copies that go on with the same bits."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sidestep
from sidestep import learn
from sidestep.envs import Env, VectorEnv, parallel_env

FLOOR = {
    "world": "robots",
    "cycles": 50,
    "map": {"ascii": "......\n......\n......"},
    "robots": [{"count": 2, "behaviour": {"kind": "external"}}],
}
ONE: dict[str, Any] = {**FLOOR, "robots": [{"count": 1, "behaviour": {"kind": "external"}}]}
HOW: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "deepcopy": copy.deepcopy,
}

how = pytest.mark.parametrize("copied", HOW.values(), ids=HOW.keys())


def recorded(seed: int) -> dict[str, sidestep.Table]:
    """Runs in another process, too, which finds it by its name."""
    sim = sidestep.Simulation(FLOOR, seed=seed, record=True)
    sim.order("action", [0, 1])
    sim.run(20)
    return sim.tables()


def equal(one: sidestep.Table, other: sidestep.Table) -> bool:
    facts = [(t.name, t.columns, t.units, t.meanings, t.about, len(t)) for t in (one, other)]
    # By their text, in which missing numbers (NaN) are equal.
    return facts[0] == facts[1] and all(repr(one[name].tolist()) == repr(other[name].tolist()) for name in one.columns)


@how
def test_a_table_is_copied_with_all_its_rows_and_what_is_said_of_them(copied: Callable[[Any], Any]) -> None:
    tables = recorded(3)
    assert {"trajectories", "events", "series"} <= tables.keys()
    for name, again in copied(tables).items():
        assert equal(tables[name], again), name
        assert again.head() == tables[name].head()


def test_a_task_of_a_process_pool_returns_what_it_recorded() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        [there] = pool.map(recorded, [5])
    here = recorded(5)
    assert here.keys() == there.keys()
    assert all(equal(here[name], there[name]) for name in here)


def test_damaged_rows_are_told() -> None:
    maker, (name, about, rows, checksum) = recorded(1)["events"].__reduce__()  # type: ignore[misc]
    assert equal(maker(name, about, rows, checksum), recorded(1)["events"])
    cut = [rows[:length] for length in range(0, len(rows), 97)]
    flipped = [rows[:at] + bytes([rows[at] ^ 0x40]) + rows[at + 1 :] for at in range(0, len(rows), 97)]
    for damaged in [*cut, *flipped, b"junk" * 20]:
        with pytest.raises(sidestep.InputError, match="unchanged"):
            maker(name, about, damaged, checksum)


def test_a_state_that_a_batch_cannot_continue_from_is_told() -> None:
    maker, (scenario, seeds, workers, states) = sidestep.Batch(FLOOR, 2).__reduce__()  # type: ignore[misc]
    for wrong in ([states[0], states[1][:-3]], [states[0], b"junk"], states[:1]):
        with pytest.raises(sidestep.InputError, match="states"):
            maker(scenario, seeds, workers, wrong)


@how
def test_teams_and_spaces_are_copied(copied: Callable[[Any], Any]) -> None:
    scenarios = [FLOOR, "scenarios/airspace/default.toml", "scenarios/chain/default.toml"]
    for scenario in scenarios:
        for team in sidestep.Simulation(scenario).teams:
            again = copied(team)
            assert (repr(again), again.agents.tolist()) == (repr(team), team.agents.tolist())
            for one, other in zip(
                team.observation_spaces + team.action_spaces,
                again.observation_spaces + again.action_spaces,
                strict=True,
            ):
                facts = [(s.name, s.shape, s.dtype, s.choices, s.low, s.high, s.meaning) for s in (one, other)]
                assert facts[0] == facts[1]


@how
def test_worlds_of_a_batch_go_on_with_the_same_bits(copied: Callable[[Any], Any]) -> None:
    batch = sidestep.Batch(FLOOR, 3, seeds=[4, 5, 5], workers=2)
    batch.order("action", [[0, 1], [1, 0], [2, 0]])
    batch.step(7)
    again = copied(batch)
    assert (again.seeds.tolist(), again.cycles.tolist()) == ([4, 5, 5], [7, 7, 7])
    for one in (batch, again):
        one.order("action", [[0, 0], [0, 1], [1, 1]])
        one.step(5)
    assert again.digests == batch.digests


@how
def test_an_arm_is_copied_and_its_copy_reaches_the_same(copied: Callable[[Any], Any], tmp_path: Path) -> None:
    text = Path("scenarios/chain/arm.urdf").read_text()
    file = tmp_path / "arm.urdf"
    file.write_text(text)
    arm = sidestep.Arm(file)
    again = copied(arm)
    assert repr(again) == repr(arm)
    joints = [0.2] * len(arm.joints)
    assert np.array_equal(sidestep.fk(again, joints).tip, sidestep.fk(arm, joints).tip)
    # Elsewhere there is no such file.
    packed = pickle.dumps(arm)
    file.unlink()
    assert np.array_equal(sidestep.fk(pickle.loads(packed), joints).tip, sidestep.fk(arm, joints).tip)


@how
def test_the_results_of_a_sweep_are_copied(copied: Callable[[Any], Any]) -> None:
    sweep = sidestep.sweep(FLOOR, replicate=3)
    again = copied(sweep)
    assert again.output == sweep.output
    assert equal(again.results, sweep.results) and equal(again.bands, sweep.bands)


MOVES = {"action": ["forward"] * 40, "ahead_boxes": [1, 1, 1, 0] * 10, "left_boxes": [0] * 40, "turn_deg": [0] * 40}
READINGS = {
    "true": ["wall"] * 200,
    "reported": ["wall"] * 190 + ["nothing"] * 10,
    "true_distance_m": np.linspace(0.5, 5.0, 200),
    "reported_distance_m": [*np.linspace(0.6, 4.9, 190), *[None] * 10],
}


@how
def test_what_was_learned_is_copied(copied: Callable[[Any], Any]) -> None:
    for learned in (learn.effector(MOVES), learn.sensor(READINGS, range_m=6.0, beam=True)):
        again = copied(learned)
        assert (again.kind, repr(again), str(again)) == (learned.kind, repr(learned), str(learned))
        assert again.report == learned.report
        other = learn.effector(MOVES).profile("other")
        for text in (None, other):
            assert again.profile("mine", text) == learned.profile("mine", text)


def test_damaged_texts_of_what_was_learned_are_told() -> None:
    maker, (kind, report, text, profile) = learn.effector(MOVES).__reduce__()  # type: ignore[misc]
    wrong = [("wheel", report, profile), (kind, report[:-9], profile), (kind, report, profile[:99]), (kind, report, "")]
    for kind, report, profile in wrong:
        with pytest.raises(sidestep.InputError, match="unchanged"):
            maker(kind, report, text, profile)


@how
@pytest.mark.parametrize(
    "make",
    [lambda: parallel_env(FLOOR), lambda: Env(ONE), lambda: VectorEnv(ONE, 2)],
    ids=["parallel", "one", "vector"],
)
def test_environments_are_copied_in_the_middle_of_an_episode_and_go_on_alike(
    make: Callable[[], Any], copied: Callable[[Any], Any]
) -> None:
    env = make()
    env.reset(seed=3)

    def step(one: Any) -> Any:
        action = {agent: 0 for agent in one.agents} if hasattr(one, "agents") else 0 * one.action_space.sample()
        return one.step(action)

    step(env)
    again = copied(env)
    for _ in range(3):
        assert repr(step(env)) == repr(step(again))
    assert repr(env.reset()) == repr(again.reset()), "the same next episode"


def test_supersuit_makes_many_environments_for_stable_baselines() -> None:
    supersuit = pytest.importorskip("supersuit")
    vector = supersuit.pettingzoo_env_to_vec_env_v1(parallel_env(FLOOR))
    many = supersuit.concat_vec_envs_v1(vector, 2, num_cpus=1, base_class="gymnasium")
    observed, _ = many.reset(seed=1)
    assert all(len(values) == 4 for values in observed.values())
