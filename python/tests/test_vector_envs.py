"""Many environments at once, by the tests that Gymnasium ships, beside environments alone."""

import numpy as np
import pytest

import sidestep

pytest.importorskip("pettingzoo")
gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env, data_equivalence  # noqa: E402
from gymnasium.utils.env_match import check_environments_match  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402
from test_envs import AIRPLANES, CHAINS  # noqa: E402

from sidestep.envs import Batch, Env, VectorEnv, parallel_env  # noqa: E402


def one(external, **keys):
    robots = {**external["robots"][0], "count": 1}
    return {**external, "robots": [robots, external["robots"][1]], **keys}


SCENARIOS = {
    "robots": lambda external: one(external),
    "chain": lambda external: {**CHAINS, "chains": [{**CHAINS["chains"][0], "count": 1}]},
    "airspace": lambda external: {
        **AIRPLANES,
        "airspace": {**AIRPLANES["airspace"], "generator": {"kind": "superconflict", "n": 1}},
    },
}


@pytest.mark.parametrize("mode", list(AutoresetMode)[:2])
@pytest.mark.parametrize("world", SCENARIOS)
def test_it_matches_environments_one_by_one(world, mode, external):
    scenario, options = SCENARIOS[world](external), {"max_cycles": 7}
    ours = VectorEnv(scenario, 5, autoreset_mode=mode, workers=2, **options)
    alone = [lambda: Env(scenario, **options)] * 5
    theirs = SyncVectorEnv(alone, autoreset_mode=mode)
    theirs.action_space.seed(4)
    assert data_equivalence(theirs.reset(seed=4), ours.reset(seed=4))
    for _ in range(30):
        acted = theirs.action_space.sample()
        assert data_equivalence(theirs.step(acted), ours.step(acted))
    # Gymnasium's own checker compares vectors of one.
    single = SyncVectorEnv(alone[:1], autoreset_mode=mode)
    check_environments_match(single, VectorEnv(scenario, 1, autoreset_mode=mode, **options), 20)


def test_one_environment_passes_its_checker(external):
    check_env(Env(one(external)), skip_render_check=True)
    env = Env(one(external), render_mode="rgb_array", width=100)
    env.reset(seed=1)
    assert env.render().shape[1:] == (100, 3)
    env.close()
    with pytest.raises(sidestep.InputError, match="5 agents take orders\n  help: use parallel_env"):
        Env(external)


@pytest.mark.parametrize("copy", [True, False])
def test_it_passes_the_checker_of_vector_environments(external, copy):
    env = VectorEnv(one(external), 4, max_cycles=10, copy=copy)
    assert env.unwrapped is env
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    first, _ = env.reset(seed=4)
    assert env.observation_space.contains(first)
    first = {name: array.copy() for name, array in first.items()}
    env.action_space.seed(1)
    for _ in range(30):
        observed, rewards, terminations, truncations, infos = env.step(env.action_space.sample())
        assert env.observation_space.contains(observed)
        assert (rewards.shape, rewards.dtype) == ((4,), np.float64)
        for flags in (terminations, truncations):
            assert (flags.shape, flags.dtype) == ((4,), bool)
        # Worlds that restart tell their seeds.
        assert set(infos) <= {"seed", "_seed"}
    assert data_equivalence(first, env.reset(seed=4)[0])
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(VectorEnv(one(external), 4, max_cycles=5))
    wrapped.reset(seed=1)
    for _ in range(5):
        *_, infos = wrapped.step(wrapped.action_space.sample())
    assert infos["episode"]["l"].tolist() == [5] * 4


def test_without_autoreset_a_mask_starts_worlds_anew(external):
    env = VectorEnv(one(external), 3, max_cycles=4, autoreset_mode="Disabled")
    other = VectorEnv(one(external), 3, max_cycles=9, autoreset_mode=AutoresetMode.DISABLED)
    zeros = np.zeros(3, int)
    for each in (env, other):
        each.reset(seed=1)
        for _ in range(4):
            *_, truncations, _ = each.step(zeros)
    assert truncations.tolist() == [False] * 3
    with pytest.raises(sidestep.InputError, match="the episode of world 0 has ended"):
        env.step(zeros)
    mask = np.array([True, False, True])
    env.reset(options={"reset_mask": mask})
    with pytest.raises(sidestep.InputError, match="the episode of world 1 has ended"):
        env.step(zeros)
    other.reset(options={"reset_mask": mask})
    for _ in range(4):
        *_, truncations, _ = other.step(zeros)
    assert other.batch.worlds.cycles.tolist() == [4, 8, 4]
    assert truncations.tolist() == [False, False, False]
    *_, truncations, _ = other.step(zeros)
    assert truncations.tolist() == [False, True, False]
    with pytest.raises(sidestep.InputError, match="there is no such option"):
        env.reset(options={"mask": mask})
    for wrong in (np.zeros(3, bool), np.ones(2, bool), np.ones(3)):
        with pytest.raises(sidestep.InputError, match="give 3 truth values"):
            env.reset(options={"reset_mask": wrong})


@pytest.mark.parametrize("mode", list(AutoresetMode)[:2])
def test_worlds_of_many_agents_have_the_episodes_of_environments_alone(external, mode):
    terms = {"contact": -1.0, "moved": 0.5}
    options = {"rewards": terms, "max_cycles": 6, "orders": ["action", "broadcast"]}
    batch = Batch(external, 3, workers=2, autoreset_mode=mode, **options)
    envs = [parallel_env(external, **options) for _ in range(3)]
    observed, _ = batch.reset(seed=11)
    expected = [env.reset(seed=11 + k)[0] for k, env in enumerate(envs)]
    batch.action_space.seed(5)
    for _ in range(20):
        for k, env in enumerate(envs):
            for row, agent in enumerate(env.possible_agents):
                mine = {name: array[k, row] for name, array in observed.items()}
                assert data_equivalence(mine, expected[k][agent]), (k, agent)
        acted = batch.action_space.sample()
        observed, rewards, _, truncations, infos = batch.step(acted)
        assert batch.observation_space.contains(observed)
        for k, env in enumerate(envs):
            if not env.agents:
                expected[k], _ = env.reset()
                assert (rewards[k] == 0).all()
                continue
            actions = {
                agent: {name: array[k, row] for name, array in acted.items()} for row, agent in enumerate(env.agents)
            }
            expected[k], gains, _, cut, _ = env.step(actions)
            assert rewards[k].tolist() == list(gains.values())
            assert truncations[k] == all(cut.values())
            if truncations[k] and mode is AutoresetMode.SAME_STEP:
                assert infos["_final_obs"][k]
                for name, array in infos["final_obs"].items():
                    last = [expected[k][agent][name] for agent in env.possible_agents]
                    assert (array[k] == np.array(last)).all()
                expected[k], _ = env.reset()


def test_the_agents_of_many_worlds_are_environments_of_one_policy(external):
    rows, worlds = VectorEnv(external, 15, max_cycles=4), Batch(external, 3, max_cycles=4)
    assert rows.num_envs == 15 and rows.action_space.shape == (15,)
    seen, expected = rows.reset(seed=2)[0], worlds.reset(seed=2)[0]
    for _ in range(6):
        actions = rows.action_space.sample()
        assert rows.observation_space.contains(seen)
        for name, array in seen.items():
            np.testing.assert_array_equal(array, expected[name].reshape(array.shape))
        seen, rewards, terminated, truncated, _ = rows.step(actions)
        expected, by_world, *_, ends, _ = worlds.step(actions.reshape(3, 5))
        np.testing.assert_array_equal(rewards, by_world.ravel())
        np.testing.assert_array_equal(truncated, np.repeat(ends, 5))


def test_unknown_options_and_wrong_values_are_errors(external):
    with pytest.raises(TypeError, match="wokers"):
        Batch(external, 2, wokers=2)
    with pytest.raises(TypeError, match="reward"):
        VectorEnv(one(external), 2, reward={})
    nobody = {**external, "robots": [{"count": 2}]}
    several = {**external, "robots": [external["robots"][0], {**external["robots"][0], "sensors": []}]}
    for call, words in [
        (lambda: Batch(external, 2, rewards={"speed": 1.0}), "one of contact, moved, turned"),
        (lambda: Batch(external, 2, max_cycles=0), "max_cycles: is 0"),
        (lambda: Batch(external, 2, orders=["jump"]), "some of action, trip, broadcast"),
        (lambda: Batch(external, 2, autoreset_mode="Never"), "one of NextStep, SameStep, Disabled"),
        (lambda: Batch(nobody, 2), "no agent of this scenario takes orders"),
        (lambda: Batch(several, 2), "2 teams take orders"),
        (lambda: Batch(several, 2, team="robots"), "no team `robots` takes orders"),
        (lambda: VectorEnv(external, 2), "2 is no multiple of the 5 agents of a world\n  help: give 5, for example"),
        (lambda: Batch(external, 2).step(np.zeros((2, 5))), "call reset first"),
        (lambda: Batch(external, 2).reset(seed=[1]), "1 seeds for 2 worlds"),
    ]:
        with pytest.raises(sidestep.InputError, match=words):
            call()
    batch = Batch(several, 2, team=1, orders=["action", "trip"])
    batch.reset(seed=1)
    for actions, words in [
        (np.zeros((2, 5)), "give a dict of action, trip"),
        ({"action": np.zeros((2, 5))}, "`trip` is missing"),
        ({"action": 0, "trip": 0, "jump": 0}, "there is no order `jump`"),
    ]:
        with pytest.raises(sidestep.InputError, match=words):
            batch.step(actions)
    with pytest.raises(sidestep.OrderError, match=r"\(2, 5\), not \(5, 2\)"):
        batch.step({"action": np.zeros((5, 2)), "trip": 0})
    own = Batch(external, 2, rewards=lambda before, after: 1.0)
    own.reset(seed=1)
    with pytest.raises(sidestep.InputError, match=r"the shape \(10,\)"):
        own.step(np.zeros((2, 5)))


@pytest.mark.parametrize("mode", list(AutoresetMode)[:2])
def test_arrays_that_are_not_copied_stay_for_one_more_step(external, mode):
    env = Batch(one(external), 3, max_cycles=4, copy=False, autoreset_mode=mode)
    before, _ = env.reset(seed=1)
    for _ in range(12):
        kept = {name: array.copy() for name, array in before.items()}
        after, *_ = env.step(np.zeros((3, 1), int))
        for name, array in before.items():
            assert not np.shares_memory(array, after[name]), name
            np.testing.assert_array_equal(array, kept[name])
        before = after


def needs(name):
    return pytest.importorskip(name, reason=f"{name} is not installed, so it is not tested with it")


def test_torchrl_takes_it(external):
    torch, torchrl = needs("torch"), needs("torchrl")
    from torchrl.envs import GymWrapper, PettingZooWrapper
    from torchrl.envs.utils import check_env_specs

    single = GymWrapper(Env(one(external), max_cycles=10))
    check_env_specs(single)
    assert single.rollout(20)["next", "reward"].shape == (10, 1)
    many = PettingZooWrapper(parallel_env(external, max_cycles=10))
    check_env_specs(many)
    came = many.rollout(20)
    assert came["next", "robot", "reward"].shape == (10, 5, 1)
    assert torch.isfinite(came["next", "robot", "reward"]).all()
    assert torchrl.__version__


def test_rllib_takes_it(external):
    needs("torch")
    needs("ray.rllib")
    from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv

    env = ParallelPettingZooEnv(parallel_env(external, max_cycles=5))
    observed, _ = env.reset(seed=3)
    assert set(observed) == set(env.par_env.possible_agents)
    for k in range(5):
        actions = {agent: env.action_space[agent].sample() for agent in observed}
        observed, rewards, terminations, truncations, _ = env.step(actions)
        assert set(rewards) == set(actions)
        assert truncations["__all__"] == (k == 4) and not terminations["__all__"]
