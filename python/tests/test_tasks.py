"""Tasks: what they promise to learners, by the checkers of the libraries whose interfaces they have."""

import copy
import pickle
import re
import subprocess

import numpy as np
import pytest

import sidestep

gymnasium = pytest.importorskip("gymnasium")
pettingzoo = pytest.importorskip("pettingzoo")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402
from pettingzoo.test import parallel_api_test, parallel_seed_test  # noqa: E402

from sidestep.envs import tasks  # noqa: E402

TASKS = list(tasks.TASKS)
TEAMS = [name for name, task in tasks.TASKS.items() if not task.is_single]
ALONE = [name for name, task in tasks.TASKS.items() if task.is_single]


def allowed(rng, batch, infos):
    """Draws actions among those that the masks allow."""
    if "action_mask" not in infos or batch.single_action_space.shape != ():
        return batch.action_space.sample()
    masks = infos["action_mask"]
    return (rng.random(masks.shape) * masks).argmax(axis=-1)


def greedy(observed, masks, batch):
    """Goes to the goal by what a robot observes of it: ahead, if that is nearer, else it turns there."""
    names = [name for name, _ in batch.observation_parts]
    first = names.index("goal_nearer")
    ahead, left, _, right = observed[:, first : first + 4].T
    return np.where(ahead > 0, 0, np.where(left > 0, 1, np.where(right > 0, 2, 1)))


@pytest.mark.parametrize("name", TASKS)
def test_gymnasium_makes_each_and_its_checker_passes(name):
    env = gymnasium.make(f"sidestep.envs:sidestep/{name}", render_mode="rgb_array", width=200)
    assert env.spec.id == f"sidestep/{name}"
    check_env(env.unwrapped, skip_render_check=True)
    env.reset(seed=1)
    image = env.render()
    assert image.shape == (150, 200, 3)
    env.step(env.action_space.sample())
    assert env.render().shape == image.shape, "films need frames of one size"
    # Bodies are drawn: some of it is neither white nor the gray of letters and walls.
    colors = image.reshape(-1, 3).astype(int)
    assert (np.ptp(colors, axis=1) > 40).sum() > 20, "bodies have colors"


@pytest.mark.parametrize("name", TEAMS)
def test_the_tests_of_pettingzoo_pass(name):
    parallel_api_test(tasks.parallel_env(name), num_cycles=40)
    parallel_seed_test(lambda: tasks.parallel_env(name), num_cycles=10)


@pytest.mark.parametrize("name", TASKS)
def test_observations_are_floats_in_bounds_with_a_meaning_for_each_number(name):
    batch = tasks.batch_env(name, 3)
    parts = batch.observation_parts
    assert len(parts) == batch.single_observation_space.shape[0] == batch.encoder.size
    assert len(set(parts)) == len(parts), "no two numbers mean the same"
    batch.action_space.seed(1)
    observed, infos = batch.reset(seed=1)
    rng = np.random.default_rng(1)
    changed = np.zeros(len(parts), bool)
    first = observed.copy()
    for _ in range(60):
        observed, *_, infos = batch.step(allowed(rng, batch, infos))
        assert batch.observation_space.contains(observed)
        assert observed.dtype == np.float32
        changed |= (observed != first).any(axis=(0, 1))
    names = [name for name, _ in parts]
    assert changed[names.index("time_left")] and changed.sum() > 1, "something happens beside the time"


@pytest.mark.parametrize("name", TASKS)
def test_the_scenario_file_is_one_that_the_command_takes(name, command):
    done = subprocess.run([command, "check", str(tasks.TASKS[name].path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", TASKS)
def test_seeds_in_are_seeds_used(name):
    batch = tasks.batch_env(name, 3)
    _, infos = batch.reset(seed=40)
    assert infos["seed"].tolist() == batch.worlds.seeds.tolist() == [40, 41, 42]
    _, infos = batch.reset()
    assert len({*infos["seed"].tolist(), 40, 41, 42}) == 6, "further episodes have other seeds"


@pytest.mark.parametrize("name", ["CorridorCounterflow-v0", "ReachInClutter-v0", "Superconflict-v0"])
def test_actions_and_seeds_alone_make_the_episode(name):
    def play(worlds, workers):
        batch = tasks.batch_env(name, worlds, workers=workers)
        space = batch.single_action_space
        rng = np.random.default_rng(5)
        returns = np.zeros(batch._shape)
        batch.reset(seed=7)
        for _ in range(30):
            one = rng.random((1, batch._shape[1], *space.shape))
            one = 2 * one - 1 if space.shape else (one * space.n).astype(np.int64)
            _, rewards, *_ = batch.step(np.repeat(one, worlds, axis=0))
            returns += rewards
        return returns[0], batch.worlds.digests[0]

    alone, digest = play(1, 1)
    among, same = play(3, 2)
    assert digest == same
    np.testing.assert_array_equal(alone, among)


def total(name, act, cycles=150, worlds=4, **options):
    """Returns the mean reward of an agent and episode."""
    batch = tasks.batch_env(name, worlds, max_cycles=cycles, **options)
    observed, infos = batch.reset(seed=1)
    sums = np.zeros(batch._shape)
    going = np.ones(worlds, bool)
    for _ in range(cycles):
        observed, rewards, terminated, truncated, infos = batch.step(act(batch, observed))
        sums += rewards * going[:, None]
        going &= ~(terminated | truncated)
    return sums.mean()


def stay(batch, observed):
    space = batch.single_action_space
    if isinstance(space, gymnasium.spaces.Box):
        return np.zeros((*batch._shape, *space.shape))
    if isinstance(space, gymnasium.spaces.MultiDiscrete):
        return np.broadcast_to([3, 0], (*batch._shape, 2))
    words = batch.design.actions.parts
    return np.full(batch._shape, words.index("stay"))


@pytest.mark.parametrize("name", ["CorridorCounterflow-v0", "WarehouseStream-v0", "OfficeDeliveries-v0"])
def test_a_robot_that_goes_to_its_goals_earns_more_than_one_that_stands(name):
    alone = {"keys": {"robots.0.count": 1}}

    def go(batch, observed):
        rows = observed.reshape(-1, observed.shape[2])
        return greedy(rows, None, batch).reshape(batch._shape)

    assert total(name, stay, **alone) < 0
    assert total(name, go, **alone) > 2


def test_chains_that_go_to_their_targets_earn_more_than_those_that_stand():
    def go(batch, observed):
        target = [name for name, _ in batch.observation_parts].index("target_near")
        return observed[:, :, target : target + 2]

    assert total("ReachInClutter-v0", go, 300) > total("ReachInClutter-v0", stay, 300) + 0.5

    def ahead(batch, observed):
        way = observed[:, :, :2]
        return way / np.linalg.norm(way, axis=2, keepdims=True)

    assert total("WindingCorridor-v0", ahead, 300) > 0 > total("WindingCorridor-v0", stay, 300)


def test_airplanes_that_fly_to_their_way_points_earn_more_than_those_that_circle():
    def go(batch, observed):
        return np.full(batch._shape, batch.single_action_space.n - 1)

    def circle(batch, observed):
        return np.zeros(batch._shape, np.int64)

    for name in ("Superconflict-v0", "MixedSpeeds-v0"):
        assert total(name, go, 200) > total(name, circle, 200) + 1


def test_airplanes_that_have_arrived_leave_the_agents():
    env = tasks.parallel_env("MixedSpeeds-v0")
    env.reset(seed=2)
    way_point = env.action_space(env.possible_agents[0]).n - 1
    everybody, ends = set(env.agents), {}
    while env.agents:
        acting = set(env.agents)
        seen, rewards, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, way_point))
        assert acting == set(seen) == set(rewards) == set(infos)
        for agent in acting:
            if terminated[agent]:
                assert agent not in env.agents
                assert rewards[agent] > 0, "it has arrived"
                ends[agent] = infos[agent]
    assert set(ends) == everybody
    last = list(ends.values())[-1]
    assert last["metrics"]["arrived"] == last["metrics"]["airplanes"]
    assert last["score"] >= last["metrics"]["mean_delay_percent"]


def test_a_cut_episode_is_truncated_and_one_that_is_done_is_terminated():
    env = tasks.make("WindingCorridor-v0", max_cycles=5)
    env.reset(seed=1)
    for k in range(5):
        _, _, terminated, truncated, infos = env.step(np.zeros(2))
        assert (terminated, truncated) == (False, k == 4)
    assert infos["score"] == 0.0 and infos["metrics"]["vetoes"] == 0
    with pytest.raises(sidestep.InputError, match="the episode has ended, or none has begun\n  help: call reset"):
        env.step(np.zeros(2))
    done = tasks.make("ReachInClutter-v0")
    done.reset(seed=1)
    done.batch._tracker._is_visited[:] = True
    done.batch._tracker.arrays["targets_reached"][:] = 8
    assert done.step(np.zeros(2))[2:4] == (True, False)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_worlds_restart_in_the_next_or_in_the_same_step(mode):
    env = tasks.vector_env("CorridorCounterflow-v0", 20, max_cycles=3, autoreset_mode=mode)
    assert env.metadata["autoreset_mode"] is mode and env.num_envs == 20 and env.batch.num_worlds == 2
    first, _ = env.reset(seed=3)
    actions = np.zeros(20, np.int64)
    for _ in range(3):
        observed, rewards, terminated, truncated, infos = env.step(actions)
    assert truncated.all() and not terminated.any()
    assert np.isfinite(infos["score"]).all() and infos["metrics"][0]["trips"] == 0
    left = [name for name, _ in env.batch.observation_parts].index("time_left")
    if mode is AutoresetMode.SAME_STEP:
        assert (observed[:, left] == 1).all() and all(last[left] == -1 for last in infos["final_obs"])
        assert infos["_seed"].all() and len(set(infos["seed"].tolist())) == 2
    else:
        assert (observed[:, left] == -1).all() and "final_obs" not in infos
        observed, rewards, *_, infos = env.step(actions)
        assert (observed[:, left] == 1).all() and not rewards.any() and infos["_seed"].all()


def test_rewards_are_terms_with_weights_by_name():
    both = tasks.batch_env("Exploration-v0", 2, rewards={"first_visit": 1.0, "time": -0.5})
    both.reset(seed=1)
    _, rewards, *_ = both.step(np.zeros((2, 1), np.int64))
    parts = both.reward_parts()
    assert set(parts) == {"first_visit", "time"}
    np.testing.assert_allclose(sum(parts.values()), rewards)
    with pytest.raises(sidestep.InputError, match="rewards.speed: there is no such term\n  help: one of first_visit"):
        tasks.make("Exploration-v0", rewards={"speed": 1})
    with pytest.raises(sidestep.InputError, match="rewards.time: its weight is nan"):
        tasks.make("Exploration-v0", rewards={"time": float("nan")})


def test_goals_that_are_rewarded_are_trips_that_are_counted():
    batch = tasks.batch_env("WarehouseStream-v0", 2, keys={"robots.0.count": 1})
    observed, infos = batch.reset(seed=4)
    goals, ended = np.zeros(2), False
    while not ended:
        rows = observed.reshape(-1, observed.shape[2])
        observed, _, _, truncated, infos = batch.step(greedy(rows, None, batch).reshape(batch._shape))
        goals += batch.reward_parts()["goal"].sum(axis=1)
        ended = truncated.any()
    # Each trip has two goals, and the one that is under way has reached one at most.
    trips = np.array([one["trips"] for one in infos["metrics"]])
    assert (trips > 3).all()
    assert set((goals - 2 * trips).tolist()) <= {0.0, 1.0}


def test_masks_are_in_infos_and_where_asked_for_in_observations():
    env = tasks.make("Exploration-v0", mask=True)
    observed, infos = env.reset(seed=1)
    assert set(observed) == {"observation", "action_mask"}
    np.testing.assert_array_equal(observed["action_mask"], infos["action_mask"])
    np.testing.assert_array_equal(env.action_masks(), infos["action_mask"].astype(bool))
    assert env.observation_space.contains(observed)
    # Into a wall, and again: the second time makes no sense.
    blocked = False
    for _ in range(60):
        observed, *_ = env.step(0)
        blocked = blocked or observed["action_mask"][0] == 0
    assert blocked


def test_an_airplane_that_arrives_is_terminated_in_its_row():
    env = tasks.vector_env("MixedSpeeds-v0", 9)
    env.reset(seed=2)
    ends = np.zeros(9, int)
    for _ in range(250):
        *_, terminated, truncated, infos = env.step(np.full(9, 14))
        ends += terminated
        if "_score" in infos:
            break
    assert (infos["active"] == 0).all() and infos["metrics"][0]["arrived"] == infos["metrics"][0]["airplanes"]
    assert ends.min() >= 1, "each has ended, not the last alone"


def test_wrong_input_names_the_argument():
    with pytest.raises(sidestep.InputError, match="did you mean `ReachInClutter-v0`"):
        tasks.make("ReachInCluter-v0")
    with pytest.raises(sidestep.InputError, match="width: is -3"):
        tasks.make("Exploration-v0", width=-3)
    with pytest.raises(sidestep.InputError, match="is no dict"):
        tasks.make("Exploration-v0", rewards=lambda before, after: 0)
    reach = tasks.make("ReachInClutter-v0")
    reach.reset(seed=1)
    for wrong in (np.zeros(3), "left", None):
        with pytest.raises(sidestep.InputError, match=re.escape("give numbers of the shape (2,)")):
            reach.step(wrong)
    rows = tasks.vector_env("CrossingStreams-v0", 24)
    rows.reset(seed=1)
    with pytest.raises(sidestep.InputError, match=re.escape("give numbers of the shape (24,)")):
        rows.step(np.zeros(12, int))
    with pytest.raises(sidestep.InputError, match="policy `mine`: it returned None for 1 observations"):
        sidestep.compare("Exploration-v0", methods={"mine": lambda observed, masks: None}, runs=1)
    with pytest.raises(
        sidestep.InputError, match="task: there is no `Nothing-v0`\n  help: one of CorridorCounterflow-v0"
    ):
        tasks.make("Nothing-v0")
    with pytest.raises(
        sidestep.InputError, match="num_envs: 7 is no multiple of the 10 agents of a world\n  help: give 10"
    ):
        tasks.vector_env("CorridorCounterflow-v0", 7)
    with pytest.raises(sidestep.InputError, match="render_mode: there is no `video`"):
        tasks.make("Exploration-v0", render_mode="video")
    env = tasks.parallel_env("CorridorCounterflow-v0")
    with pytest.raises(sidestep.InputError, match="no episode is in progress"):
        env.step({})
    env.reset(seed=1)
    with pytest.raises(sidestep.InputError, match="`robot_0` has no action"):
        env.step({})
    with pytest.raises(sidestep.InputError, match="there is no agent `robot_77`"):
        env.step({**dict.fromkeys(env.agents, 0), "robot_77": 0})
    batch = tasks.batch_env("CorridorCounterflow-v0", 1)
    batch.reset(seed=1)
    with pytest.raises(
        sidestep.InputError, match=re.escape("their shape is (3,)\n  help: give an array of the shape (1, 10)")
    ):
        batch.step(np.zeros(3, int))
    with pytest.raises(sidestep.InputError, match="one is no choice\n  help: give whole numbers from 0 to 3"):
        batch.step(np.full((1, 10), 4))
    with pytest.raises(sidestep.InputError, match="give whole numbers from 0 to 3 and 0 to 3"):
        radio = tasks.batch_env("RadioHall-v0", 1)
        radio.reset(seed=1)
        radio.step(np.full((1, 12, 2), 7))
    with pytest.raises(sidestep.InputError, match="numbers of the type float64 are no choices"):
        env.step(dict.fromkeys(env.agents, 1.9))
    with pytest.raises(sidestep.InputError, match="is_active: no episode is in progress\n  help: call reset first"):
        tasks.vector_env("Superconflict-v0", 8).step(np.zeros(8, int))
    with pytest.raises(sidestep.InputError, match="action_masks: no episode is in progress"):
        tasks.make("Exploration-v0").action_masks()
    with pytest.raises(sidestep.InputError, match="one is not a finite number"):
        arm = tasks.batch_env("RailArm-v0", 1)
        arm.reset(seed=1)
        arm.step(np.full((1, 1, 3), np.nan))


def test_copies_and_pickles_go_on_alike():
    env = tasks.parallel_env("RadioHall-v0")
    env.reset(seed=6)
    draws = np.random.default_rng(2)
    actions = {agent: np.array([draws.integers(4), draws.integers(4)]) for agent in env.agents}
    env.step(actions)
    for other in (env.copy(), copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        seen = other.step(actions)
        assert other.batch.worlds.digests != env.batch.worlds.digests
    expected = env.step(actions)
    assert other.batch.worlds.digests == env.batch.worlds.digests
    for agent in env.agents:
        np.testing.assert_array_equal(seen[0][agent], expected[0][agent])
    assert seen[1] == expected[1]


def test_arrays_are_handed_to_others_without_a_copy():
    batch = tasks.batch_env("CorridorCounterflow-v0", 2, copy=False)
    observed, _ = batch.reset(seed=1)
    shared = np.from_dlpack(observed)
    assert np.shares_memory(shared, observed)


def test_each_arrival_is_rewarded_also_where_the_next_goal_is_near():
    for name in ("CorridorCounterflow-v0", "OfficeDeliveries-v0"):
        batch = tasks.batch_env(name, 2, keys={"robots.0.count": 1}, max_cycles=400)
        observed, infos = batch.reset(seed=4)
        goals = np.zeros(2)
        for _ in range(400):
            rows = observed.reshape(-1, observed.shape[2])
            observed, _, _, _, infos = batch.step(greedy(rows, None, batch).reshape(batch._shape))
            goals += batch.reward_parts()["goal"].sum(axis=1)
        trips = np.array([one["trips"] for one in infos["metrics"]])
        assert (trips > 2).all()
        # To a goal and back is a trip of a shuttle, and of a task with two errands.
        assert set((goals - 2 * trips).tolist()) <= {0.0, 1.0, 2.0}, name


def test_the_middle_of_the_corridor_is_as_far_from_both_walls():
    from sidestep.envs.tasks.chain import LINE_STEP_M, middle_line

    legs = [
        {"straight_m": 2.0},
        {"radius_m": 1.5, "turn_deg": 90},
        {"straight_m": 1.0},
        {"radius_m": 1.5, "turn_deg": -180},
    ]
    line = middle_line({"legs": legs})
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    np.testing.assert_allclose(steps, LINE_STEP_M, rtol=2e-3)
    length = 2.0 + 1.5 * np.pi / 2 + 1.0 + 1.5 * np.pi
    assert len(line) == int(length / LINE_STEP_M) + 1
    # Two to the east, around to the north, one on, and around to the right: there it heads south.
    np.testing.assert_allclose(line[-1], [6.5, 2.5], atol=LINE_STEP_M)


def test_fewer_robots_or_connectors_leave_places_empty():
    for keys in ({"robots.0.count": 3}, {"robots.0.count": 1}):
        batch = tasks.batch_env("RadioHall-v0", 1, keys=keys)
        observed, _ = batch.reset(seed=1)
        assert observed.shape == (1, keys["robots.0.count"], tasks.batch_env("RadioHall-v0", 1).encoder.size)
        batch.step(batch.action_space.sample())
    short = tasks.make("WindingCorridor-v0", keys={"chains.0.connectors": 2})
    assert short.observation_space.contains(short.reset(seed=1)[0])
    own = tasks.make("ReachInClutter-v0", keys={"chains.0.tasks.0.targets_m": [[1.0, 1.0], [0.0, 1.5]]})
    own.reset(seed=1)
    assert own.batch._now_arrays["target_m"].tolist() == [[1.0, 1.0]]


def test_parts_of_rewards_are_those_of_the_last_rewards_also_at_restarts():
    for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
        batch = tasks.batch_env("CorridorCounterflow-v0", 2, max_cycles=3, autoreset_mode=mode)
        batch.reset(seed=1)
        batch.action_space.seed(1)
        for _ in range(8):
            _, rewards, *_ = batch.step(batch.action_space.sample())
            np.testing.assert_allclose(sum(batch.reward_parts().values()), rewards)


def test_a_contact_that_still_stands_is_not_counted_again():
    batch = tasks.batch_env("RadioHall-v0", 2, keys={"robots.0.period": 3}, rewards={"contact": 1.0})
    batch.reset(seed=2)
    batch.action_space.seed(2)
    total, ended = np.zeros(2), False
    while not ended:
        _, rewards, _, truncated, infos = batch.step(batch.action_space.sample())
        total += rewards.sum(axis=1)
        ended = truncated.all()
    assert total.tolist() == [one["contacts"] for one in infos["metrics"]]


def test_agents_that_come_later_or_leave_early_have_whole_episodes():
    plane = {"at_m": [-2000.0, 0.0], "heading_deg": 0.0, "way_points_m": [[2000.0, 0.0]]}
    later = {**plane, "at_m": [-2000.0, 3000.0], "way_points_m": [[2000.0, 3000.0]], "appears_s": 300.0}
    keys = {"airspace.generator": None, "airplanes": [plane, later]}
    env = tasks.parallel_env("MixedSpeeds-v0", keys=keys, max_cycles=40)
    env.reset(seed=1)
    seen, ends = set(), {}
    while env.agents:
        seen |= set(env.agents)
        _, _, terminated, truncated, _ = env.step(dict.fromkeys(env.agents, 14))
        ends |= {agent: (terminated[agent], truncated[agent]) for agent in terminated}
    assert seen <= {"airplane_0", "airplane_1"} and ends["airplane_0"] == (True, False)
    alone = tasks.parallel_env("MixedSpeeds-v0", keys={**keys, "airplanes": [later]})
    _, infos = alone.reset(seed=5)
    assert alone.agents == ["airplane_0"] and infos["airplane_0"]["seed"] == 5


# Scores, and boards of them.


def way_point_policy(observed, masks):
    return np.full(len(observed), masks.shape[1] - 1)


def test_policies_and_scripted_methods_are_judged_on_the_same_seeds():
    task = tasks.find_task("Superconflict-v0")
    ours = tasks.judge(task, way_point_policy, runs=4, seed=9)
    theirs = tasks.judge_method(task, "straight", runs=4, seed=9)
    assert ours.seeds.tolist() == theirs.seeds.tolist() == [9, 10, 11, 12]
    best = tasks.judge_method(task, "pc", runs=4, seed=9)
    assert best.beats(theirs) and not theirs.beats(best)
    with pytest.raises(sidestep.InputError, match="of another task or of other seeds"):
        best.compare(tasks.judge_method(task, "pc", runs=3, seed=9))


def test_policies_and_methods_are_compared_seed_by_seed():
    found = sidestep.compare(
        "sidestep/Superconflict-v0", methods={"pc": "pc", "way-point": way_point_policy, "straight": "straight"}, runs=3
    )
    assert [one["method"] for one in found["methods"]] == ["pc", "way-point", "straight"]
    pairs = found["methods"][1]["first_less_this"]
    assert pairs["verdict"] == "beats it" and pairs["interval"][1] < 0
    assert re.search(r"^pc +1\.\d+ \[.*\nway-point .* pc beats it: +-", str(found), re.M)
    assert str(found) in found._repr_html_().replace("&#x27;", "'")
    task = tasks.find_task("Exploration-v0")
    assert len(sidestep.compare(task, runs=2)["methods"]) == len(task.methods)
    with pytest.raises(sidestep.InputError, match="method: there is no `bees`\n  help: one of wander, random"):
        sidestep.compare(task, methods=["bees"], runs=1)
    with pytest.raises(sidestep.InputError, match="the scenario is no task"):
        sidestep.compare({"world": "airspace"}, methods={"mine": way_point_policy})


def test_a_policy_whose_arithmetic_depends_on_the_batch_is_recorded_as_it_was_judged(tmp_path):
    def moody(observed, masks):
        # The last bits of a sum over all rows, as matrix products have them.
        return observed[:, 2:4] * (1.0 + 1e-7 * len(observed))

    board = tasks.write_leaderboard(tmp_path / "board", "ReachInClutter-v0", {"moody": moody}, runs=2, recorded=2)
    assert len(board.runs) == 2


def test_a_leaderboard_is_written_read_and_replayed(tmp_path, command):
    task = tasks.find_task("ReachInClutter-v0")

    def toward(observed, masks):
        return observed[:, 2:4].astype(np.float64)

    weights = tmp_path / "weights.txt"
    weights.write_text("none")
    board = tasks.write_leaderboard(
        tmp_path / "board", task, {"toward": toward, "targets": "targets"}, runs=3, recorded=1, files=[weights]
    )
    assert set(board.ranking) == {"toward", "targets"}
    again = tasks.Leaderboard.read(tmp_path / "board")
    assert str(again) == str(board) and "ReachInClutter-v0" in str(board)
    assert (tmp_path / "board/files/weights.txt").exists()
    assert len(board.runs) == 2
    for run in board.runs:
        done = subprocess.run([command, "replay", str(run)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        digest = board.judgments[run.parent.name].digests[0]
        assert digest in done.stdout + done.stderr
    with pytest.raises(sidestep.InputError, match="exists already"):
        tasks.write_leaderboard(tmp_path / "board", task, {"targets": "targets"}, runs=1)
    with pytest.raises(sidestep.InputError, match="entries: `../out` is no name of a folder"):
        tasks.write_leaderboard(tmp_path / "other", task, {"../out": "targets"}, runs=1)
    with pytest.raises(sidestep.InputError, match="files: .*nothing.pt is not there"):
        tasks.write_leaderboard(
            tmp_path / "other", task, {"targets": "targets"}, runs=1, files=[tmp_path / "nothing.pt"]
        )
    assert not list(tmp_path.glob("*other*")), "nothing is left of a board that was refused"
    with pytest.raises(sidestep.InputError, match="is no leaderboard"):
        tasks.Leaderboard.read(tmp_path)


# Libraries of learners, where they are installed.


def test_stable_baselines_learns_on_it():
    sb3 = pytest.importorskip("stable_baselines3")
    env = tasks.sb3_env("CorridorCounterflow-v0", 20, max_cycles=8)
    env.seed(3)
    observed = env.reset()
    for _ in range(8):
        observed, rewards, ended, infos = env.step(np.zeros(20, np.int64))
    assert ended.all() and infos[0]["TimeLimit.truncated"]
    assert not np.array_equal(infos[0]["terminal_observation"], observed[0])
    assert env.env_method("action_masks", indices=[1])[0].dtype == bool
    assert env.has_attr("action_masks"), "by this name sb3-contrib asks for masks"
    sb3.PPO("MlpPolicy", env, n_steps=16, batch_size=64, n_epochs=1, device="cpu").learn(320)


def test_torchrl_checks_it():
    pytest.importorskip("torchrl")
    from torchrl.envs.utils import check_env_specs

    for name in ("CorridorCounterflow-v0", "ReachInClutter-v0", "RadioHall-v0"):
        env = tasks.torchrl_env(name, 3)
        env.set_seed(1)
        check_env_specs(env)
        rollout = env.rollout(5)
        assert rollout["agents", "observation"].shape[:2] == (3, 5)
