"""Environments, by the tests that PettingZoo ships."""

import numpy as np
import pytest

import sidestep

pytest.importorskip("pettingzoo")
pytest.importorskip("gymnasium")

from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test  # noqa: E402
from pettingzoo.utils import parallel_to_aec  # noqa: E402

from sidestep.envs import TERMS, Airspace, Chain, Robots, airspace_v0, chain_v0, parallel_env, robots_v0  # noqa: E402


@pytest.fixture
def make(external):
    def make(**options):
        return parallel_env({**external, "cycles": 60}, **options)

    return make


CHAINS = {
    "world": "chain",
    "cycles": 60,
    "obstacles": [{"at_m": [1.0, 0.2], "radius_m": 0.3}],
    "chains": [{"connectors": 6, "count": 2, "apart_m": [0.0, 0.8], "rod_m": 0.3, "tasks": [{"kind": "external"}]}],
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


def test_environments_have_versioned_names_and_refuse_other_worlds(make):
    for env, kind, module in (
        (make(), Robots, robots_v0),
        (parallel_env(CHAINS), Chain, chain_v0),
        (parallel_env(AIRPLANES), Airspace, airspace_v0),
    ):
        name = module.__name__.rpartition(".")[2]
        assert type(env) is kind is module.parallel_env
        assert env.metadata["name"] == name
        assert type(env.copy()) is kind
        turns = module.env(env.scenario)
        turns.reset(seed=1)
        assert turns.agent_selection == env.possible_agents[0]
    with pytest.raises(sidestep.InputError, match="its world is `chain`, not `robots`"):
        robots_v0.parallel_env(CHAINS)


def test_progress_is_what_an_agent_has_come_on(make):
    env = parallel_env(AIRPLANES, rewards={"progress": 1.0})
    env.reset(seed=3)
    # Straight ahead they fly toward the middle, which is their next way-point or lies before it.
    _, gains, *_ = env.step({agent: np.zeros((), np.float32) for agent in env.agents})
    speed_m_s = env.sim.observe()["speed_m_s"]
    assert np.allclose(list(gains.values()), speed_m_s * env.sim.snapshot()["time_s"], rtol=1e-3)
    chain = parallel_env(CHAINS, rewards={"progress": 1.0}, orders=["to_m"])
    chain.reset(seed=1)
    ahead = chain.sim.observe()["joints_m"][:, -1].astype(np.float32) + np.float32([1.0, 0.0])
    _, gains, *_ = chain.step(dict(zip(chain.agents, ahead, strict=True)))
    assert list(gains.values()) == chain.sim.observe()["done_share"].tolist()
    with pytest.raises(
        sidestep.InputError, match="it needs .*way_points_left.* or `done_share`, which no agent observes"
    ):
        make(rewards={"progress": 1.0})
    assert all(term.meaning and term.forms for term in TERMS.values())


def test_an_airplane_that_has_landed_earns_nothing_for_it():
    """Its observation is padding."""
    env = parallel_env(AIRPLANES, rewards={"progress": 1.0, "delay": -1.0}, orders=["velocity_m_s"], max_cycles=500)
    env.reset(seed=5)
    most, has_landed = 0.0, False
    while env.agents and not has_landed:
        before = env.sim.observe()
        ahead = np.where(before["due"][:, None] > 0, before["way_point_m"], 1.0).astype(np.float32)
        _, gains, *_ = env.step(dict(zip(env.agents, ahead, strict=True)))
        gains, after = np.array(list(gains.values())), env.sim.observe()
        landed = (before["due"] > 0) & (after["due"] == 0)
        assert (gains[landed] == 0.0).all()
        has_landed = bool(landed.any())
        most = max(most, np.abs(gains).max())
    assert has_landed and most < 1000.0, "no gain is the distance of a way-point"


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
    with pytest.raises(sidestep.InputError, match="max_cycles: is 0"):
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


def test_a_critic_that_sees_all_has_the_space_of_what_it_sees(make):
    from pettingzoo.test.state_test import state_test

    state_test(parallel_to_aec(make()), make())
    env = make()
    first = env.state()
    assert env.state_space.contains(first), "before the first reset, too"
    env.reset(seed=1)
    assert env.state().shape == first.shape == env.state_space.shape
