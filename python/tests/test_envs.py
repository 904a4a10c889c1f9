"""Environments, by the tests that PettingZoo ships."""

import numpy as np
import pytest

import sidestep

pytest.importorskip("pettingzoo")
pytest.importorskip("gymnasium")

from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test  # noqa: E402
from pettingzoo.utils import parallel_to_aec  # noqa: E402

from sidestep.envs import parallel_env  # noqa: E402


@pytest.fixture
def make(external):
    def make(**options):
        return parallel_env({**external, "cycles": 60}, **options)

    return make


CHAINS = {
    "world": "chain",
    "cycles": 60,
    "obstacles": [{"at_m": [1.0, 0.2], "radius_m": 0.3}],
    "chains": [
        {"connectors": 6, "count": 2, "apart_m": [0.0, 0.8], "rod_m": 0.3, "tasks": [{"kind": "external"}]}
    ],
}
AIRPLANES = {
    "world": "airspace",
    "cycles": 60,
    "airspace": {
        "method": "external",
        "generator": {"kind": "superconflict", "n": 5, "radius_m": 4000.0},
    },
}


@pytest.mark.parametrize("scenario", [CHAINS, AIRPLANES], ids=["chain", "airspace"])
def test_the_other_worlds_pass_the_tests_of_the_interface(scenario):
    parallel_api_test(parallel_env(scenario), num_cycles=100)
    parallel_seed_test(lambda: parallel_env(scenario), num_cycles=30)


def test_airplanes_under_a_shield_keep_their_separation_whatever_is_ordered():
    shielded = {**AIRPLANES, "cycles": 200}
    env = parallel_env(shielded)
    env.reset(seed=5)
    for space in env.action_spaces.values():
        space.seed(3)
    while env.agents:
        actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        env.step(actions)
    assert env.sim.metrics()["losses_of_separation"] == 0


def test_it_passes_the_tests_of_its_interface(make):
    parallel_api_test(make(), num_cycles=200)
    parallel_api_test(make(orders=["action", "broadcast"]), num_cycles=100)
    parallel_seed_test(make, num_cycles=50)
    api_test(parallel_to_aec(make()), num_cycles=100)


def test_what_is_observed_lies_in_its_space(make):
    env = make()
    observations, _ = env.reset(seed=4)
    for _ in range(20):
        for agent in env.agents:
            assert env.observation_space(agent).contains(observations[agent])
        actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        observations, *_ = env.step(actions)


def test_an_episode_is_cut_at_its_last_cycle_and_not_called_over(make):
    env = make(max_cycles=5)
    env.reset(seed=1)
    for k in range(5):
        agents = list(env.agents)
        _, _, terminations, truncations, _ = env.step(dict.fromkeys(agents, 3))
        assert not any(terminations.values())
        assert all(truncations.values()) == (k == 4)
    assert env.agents == []
    with pytest.raises(sidestep.InputError, match="call reset first"):
        env.step({})


def test_rewards_are_sums_of_terms_or_a_function_and_unknown_ones_are_errors(make):
    both = make(rewards={"contact": -2.0, "moved": 0.5})
    own = make(rewards=lambda before, after: after["heading"].astype(float))
    for env in (both, own):
        env.reset(seed=2)
    for _ in range(30):
        old = both.sim.observe()
        actions = dict.fromkeys(both.agents, 0)
        _, rewards, *_ = both.step(actions)
        new = both.sim.observe()
        moved = np.abs(new["at_boxes"] - old["at_boxes"]).sum(axis=1)
        expected = 0.5 * moved - 2.0 * (new["contact"] > 0)
        assert list(rewards.values()) == expected.tolist()
        _, rewards, *_ = own.step(actions)
        assert list(rewards.values()) == own.sim.observe()["heading"].tolist()
    with pytest.raises(sidestep.InputError, match="one of contact, moved, turned"):
        make(rewards={"speed": 1.0})
    for weight in (float("nan"), float("inf"), "-1"):
        with pytest.raises(sidestep.InputError, match="give a finite number"):
            make(rewards={"contact": weight})
    for wrong in (1.0, [1.0, 2.0]):
        env = make(rewards=lambda before, after, wrong=wrong: wrong)
        env.reset(seed=1)
        with pytest.raises(sidestep.InputError, match=r"the shape \(5,\)"):
            env.step(dict.fromkeys(env.agents, 0))
    with pytest.raises(sidestep.InputError, match="there is no agent `robot_77`"):
        both.step({**dict.fromkeys(both.agents, 0), "robot_77": 0})
    with pytest.raises(sidestep.InputError, match="call reset first"):
        make().step({})
    with pytest.raises(sidestep.InputError, match="give 1 or more"):
        make(max_cycles=0)
    assert make(orders="action").action_space("robot_0").n == 4
    with pytest.raises(sidestep.InputError, match="some of action, trip, broadcast"):
        make(orders=["jump"])
    with pytest.raises(sidestep.InputError, match="rgb_array"):
        make(render_mode="human")
    with pytest.raises(sidestep.InputError, match="no agent of this scenario takes orders"):
        parallel_env({"world": "robots", "map": {"ascii": "...."}, "robots": [{"count": 1}]})


def test_a_copy_goes_on_with_the_same_bits(make):
    env = make()
    env.reset(seed=3)
    for _ in range(10):
        env.step(dict.fromkeys(env.agents, 0))
    other = env.copy()
    for one in (env, other):
        for _ in range(10):
            one.step(dict.fromkeys(one.agents, 0))
    assert env.sim.digest == other.sim.digest
    env.reset()
    other.reset()
    assert env.sim.digest == other.sim.digest
    assert (env.state() == other.state()).all()


def test_it_is_drawn(make):
    env = make(render_mode="rgb_array", width=160)
    env.reset(seed=1)
    assert env.render().shape[1:] == (160, 3)
    assert make().render() is None
