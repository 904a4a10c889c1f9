"""Kinematics, learning, statistics and collectives: the command's answers, from arrays to arrays."""

import inspect
import itertools
import json
import pickle
import re
import subprocess

import numpy as np
import pytest

import sidestep
from sidestep import collectives, learn, stats


@pytest.fixture
def urdf(root):
    return root / "scenarios/chain/arm.urdf"


def told(command, *args):
    done = subprocess.run([command, *map(str, args), "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_forward_kinematics_is_that_of_the_command(urdf, command):
    arm = sidestep.Arm(urdf)
    joints = np.linspace(-0.3, 0.4, len(arm.joints))
    words = told(command, "fk", urdf, "--joints", ",".join(map(str, joints)))
    placed = sidestep.fk(arm, joints)
    np.testing.assert_array_equal(placed.tip[0], words["tip"])
    np.testing.assert_array_equal(placed.rotation[0], words["rotation"])
    np.testing.assert_array_equal(placed.connectors[0], words["connectors"])
    assert placed.inside_limits[0] == (not words["outside_limits"])
    assert arm.joints == [joint["name"] for joint in words["joint_info"]]
    many = sidestep.fk(arm, [joints] * 5)
    assert many.rotation.shape == (5, 3, 3)
    np.testing.assert_array_equal(many.tip, np.repeat(placed.tip, 5, axis=0))


def test_inverse_kinematics_is_that_of_the_command_whatever_the_workers(urdf, command):
    arm = sidestep.Arm(urdf)
    low, high = np.clip(arm.limits, -3.0, 3.0).T
    rng = np.random.default_rng(1)
    places = sidestep.fk(arm, rng.uniform(low, high, (20, len(arm.joints))))
    found = sidestep.ik(arm, places.tip, workers=2)
    assert found.reached.all() and found.reasons == [None] * 20
    np.testing.assert_allclose(sidestep.fk(arm, found.joints).tip, places.tip, atol=1e-6)
    np.testing.assert_array_equal(found.joints, sidestep.ik(arm, places.tip, workers=1).joints)
    one = told(command, "ik", urdf, "--target", ",".join(map(str, places.tip[0])))
    np.testing.assert_array_equal(found.joints[0], one["joints"])
    turned = sidestep.ik(arm, places.tip[:3], quaternion=places.quaternion[:3], solutions=2)
    assert turned.reached.all() and max(turned.error_rad) < 1e-6


def test_motions_of_arms_are_those_that_the_command_exports(root, command, tmp_path):
    scenario = root / "scenarios/chain/arm.toml"
    told(command, "run", scenario, "--cycles", "60", "--out", tmp_path / "run")
    told(command, "export", tmp_path / "run", "--to", "trajectory", "--every", "2", "--out", tmp_path / "out")
    written = json.loads((tmp_path / "out/reacher.json").read_text())
    [arm] = sidestep.trajectories(tmp_path / "run", every=2)
    assert (arm.chain, arm.name, arm.joints) == (0, "reacher", written["joint_names"])
    for name in ("positions", "velocities", "accelerations"):
        np.testing.assert_array_equal(getattr(arm, name), [point[name] for point in written["points"]])
    np.testing.assert_allclose(np.diff(arm.times_s), 0.04)
    with pytest.raises(sidestep.InputError, match="every"):
        sidestep.trajectories(tmp_path / "run", every=0)


def test_targets_out_of_reach_say_why(urdf):
    found = sidestep.ik(urdf, [[0.0, 0.0, 99.0]], restarts=3)
    assert not found.reached[0] and found.error_m[0] > 90
    assert found.reasons[0]


ARM_ERRORS = [
    ({"targets": [1, 2]}, "targets: has the shape (1, 2)"),
    ({"targets": [[0, 0, float("nan")]]}, "targets: row 0 is"),
    ({"targets": "far"}, "targets: are not numbers"),
    ({"targets": [0, 0, 1], "rpy": [0, 0, 0], "quaternion": [0, 0, 0, 1]}, "give one of them"),
    ({"targets": [0, 0, 1], "rpy": [0, 0]}, "rpy: has the shape (1, 2)"),
    ({"targets": [0, 0, 1], "quaternion": [0, 0, 0, 0]}, "targets:"),
    ({"targets": [0, 0, 1], "free": ["rz"]}, "free: a turn is free, and none is asked for"),
    ({"targets": [0, 0, 1], "free": ["up"]}, "`up` is none of x, y, z"),
    ({"targets": [0, 0, 1], "engine": "fast"}, "`fast` is none of auto"),
    ({"targets": [0, 0, 1], "start": [0]}, "start: has rows of 1 numbers"),
    ({"targets": [0, 0, 1], "solutions": 0}, "solutions: is 0"),
    ({"targets": [0, 0, 1], "obstacles": [[0, 0, 1]]}, "obstacles: has the shape (1, 3)"),
]


@pytest.mark.parametrize(("options", "words"), ARM_ERRORS, ids=[words for _, words in ARM_ERRORS])
def test_wrong_targets_are_errors_that_name_the_argument(options, words, urdf):
    with pytest.raises(sidestep.InputError) as caught:
        sidestep.ik(urdf, **options)
    assert words in str(caught.value)


def test_a_link_that_is_not_there_is_named(urdf):
    with pytest.raises(sidestep.InputError, match="tip: .* has no link `hand`"):
        sidestep.Arm(urdf, tip="hand")


def calibrated(tmp_path):
    scenario = {
        "world": "robots",
        "cycles": 400,
        "map": {"ascii": "..........\n..........\n..........\n.........."},
        "record": {"calibration": True},
        "robots": [{"count": 3, "effector": "nomad", "sensors": ["sonar-8"]}],
    }
    with sidestep.Simulation(scenario, out=tmp_path / "run") as sim:
        sim.run()
    return tmp_path / "run"


def test_what_is_learned_from_arrays_is_what_the_command_learns_from_the_run(command, tmp_path):
    run = calibrated(tmp_path)
    tables = sidestep.read(run)
    options = ["--edges", "0.3,1.5", "--classes", "near,medium,far"]
    shape = {"edges_m": [0.3, 1.5], "classes": ["near", "medium", "far"]}
    for kind, name, args, of in [
        ("effector", "motions", [], learn.effector),
        ("sensor", "readings", options, lambda table: learn.sensor(table, **shape)),
    ]:
        words = told(command, "learn", kind, "--run", run, *args)
        of_run, of_columns = of(run).report, of(tables[name]).report
        assert of_run == words
        for report in (of_run, of_columns):
            del report["source"]
        assert of_columns == of_run
        assert of_run["probabilities"][0]["of"] > 0


def test_a_table_of_moves_is_asked_for_its_box_and_damage_takes_the_intervals():
    moves = {"action": ["forward"] * 100, "ahead_boxes": [1] * 100, "left_boxes": [0] * 100, "turn_deg": [0] * 100}
    assert any("--box" in words for words in learn.effector(moves).report["warnings"])
    known = learn.effector(moves, box_m=0.25)
    assert known.report["warnings"] == [] and "box_m = 0.25" in known.profile("mine")
    moves["ahead_boxes"] = [1] * 90 + [None] * 10
    assert learn.effector(moves, box_m=0.25).report["probabilities"][0]["interval"] is None
    accepted = learn.effector(moves, box_m=0.25, max_unexplained=0.2)
    assert accepted.report["probabilities"][0]["interval"] is not None
    assert accepted.report["left_out"] == {"samples": 100, "left_out": 10, "unexplained": 10}


def test_the_beam_model_of_ranges_is_learned():
    rng = np.random.default_rng(3)
    true = rng.uniform(0.5, 5.0, 2000)
    ranges = true + rng.normal(0.0, 0.05, 2000)
    no_echo = rng.uniform(size=2000) < 0.1
    readings = {
        "true": ["wall"] * 2000,
        "reported": ["nothing" if lost else "wall" for lost in no_echo],
        "true_distance_m": true,
        "reported_distance_m": [None if lost else m for lost, m in zip(no_echo, ranges, strict=True)],
    }
    learned = learn.sensor(readings, range_m=6.0, beam=True)
    values = {one["name"]: one["value"] for one in learned.report["beam"]["parameters"]}
    assert abs(values["max"] - 0.1) < 0.02 and abs(values["sigma_hit_m"] - 0.05) < 0.005
    assert "[sensors.lidar-beam]" in learned.profile("lidar")


def test_what_is_learned_becomes_part_of_a_scenario(tmp_path):
    polars = pytest.importorskip("polars")
    moves = polars.DataFrame(
        {"action": ["forward"] * 50, "ahead_boxes": [1] * 45 + [0] * 5, "left_boxes": [0] * 50, "turn_deg": [0.0] * 50}
    )
    learned = learn.effector(moves)
    (tmp_path / "mine.toml").write_text(learned.profile("mine"))
    text = (
        'format = 1\nworld = "robots"\nprofiles = ["mine.toml"]\nmap.ascii = "........"\n'
        '[robots]\ncount = 2\neffector = "mine"\n'
    )
    assert sidestep.Scenario(text=text, base=tmp_path).agents == 2
    both = learned.profile("other", learned.profile("mine"))
    assert "[effectors.mine]" in both and "[effectors.other]" in both
    assert "forward" in str(learned)


def test_columns_that_do_not_fit_are_named():
    with pytest.raises(sidestep.InputError, match="their lengths differ: action has 2, ahead_boxes has 1"):
        learn.effector({"action": ["forward"] * 2, "ahead_boxes": [1]})
    with pytest.raises(sidestep.InputError, match="there is none of .*action"):
        learn.effector({"aktion": ["forward"]})
    with pytest.raises(sidestep.InputError, match="left_boxes"):
        learn.effector({"action": ["forward"], "ahead_boxes": [1]})


def test_statistics_are_those_of_a_sweep():
    floor = {
        "world": "robots",
        "cycles": 100,
        "map": {"ascii": "........\n........"},
        "robots": {"count": 2, "effector": "nomad"},
    }
    options = {"vary": {"robots.count": [2, 6]}, "baseline": {"robots.count": 2}}
    swept = sidestep.sweep(floor, **options, replicate=12)
    few, many = swept.values("distance_m", 0), swept.values("distance_m", 1)
    summary = {metric["name"]: metric for metric in swept.summary["metrics"]}["distance_m"]
    mean = stats.mean(many)
    numbers = summary["variants"][1]["values"]["numbers"]
    assert (mean.mean, mean.sd) == (numbers["mean"], numbers["sd"])
    assert list(mean.interval) == numbers["interval"]
    assert list(mean.bootstrap) == numbers["bootstrap"]
    difference = stats.paired(many, few)
    assert difference.n == 12 and difference.higher == 12
    assert difference.interval.low < (many - few).mean() < difference.interval.high
    assert difference.p_value < 0.001


def test_missing_values_are_counted_and_not_averaged():
    assert stats.mean([1.0, np.nan, 3.0, np.inf])[:1] == (2.0,)
    assert stats.mean([1.0, np.nan, 3.0, np.inf]).missing == 2
    assert stats.mean([]) == (None, None, None, None, 0, 0)
    assert stats.paired([1.0, np.nan, 3.0], [0.0, 1.0, 2.5]).incomplete == 1
    assert stats.paired([-1.0, 2.0], [0.0, 1.0]).ratio is None


def test_pairs_that_are_equal_but_for_rounding_prove_nothing():
    turned = [14.285714348, 14.285714349, 14.285714348, 14.285714347, 14.285714348]
    found = stats.paired(turned, [0.0] * 5)
    assert (found.p_value, found.sign_p_value, found.interval, found.bootstrap) == (None,) * 4
    assert stats.mean(turned)[2:4] == (None, None)
    four = stats.paired([3.0, 4.5, 3.5, 4.0], [1.0, 1.2, 1.1, 1.3])
    assert four.interval is not None and (four.p_value, four.sign_p_value) == (None, None)


def test_the_stopping_rule_looks_at_rounds():
    rule = stats.StoppingRule(0.1, max_runs=40)
    values = np.tile([1.0, 2.0], 20)
    runs = rule.next(values[:10]).runs
    assert 10 < runs <= 40 and rule.next(values[: runs - 1]).runs == runs
    assert rule.next(values).reason == "the maximum of runs is reached; the interval is wider than wanted"


STATS_ERRORS = [
    (lambda: stats.mean("abc"), "values: are not numbers"),
    (lambda: stats.mean([[1.0]]), "values: have the shape"),
    (lambda: stats.paired([1.0], [1.0, 2.0]), "1 and 2 values are no pairs"),
    (lambda: stats.proportion(3, 2), "there cannot be 3 successes in 2 trials"),
    (lambda: stats.quantile([1.0], 1.0), "q: is 1.0"),
    (lambda: stats.StoppingRule(0.0), "half_width: is 0.0"),
    (lambda: stats.StoppingRule(0.1, min_runs=1), "min_runs: is 1"),
]


@pytest.mark.parametrize(("ask", "words"), STATS_ERRORS, ids=[words for _, words in STATS_ERRORS])
def test_wrong_values_are_errors(ask, words):
    with pytest.raises(sidestep.InputError) as caught:
        ask()
    assert words in str(caught.value)


def test_no_player_alone_can_do_better_and_an_objective_comes_near():
    rng = np.random.default_rng(3)
    own = [rng.uniform(0, 0.2, 3) for _ in range(4)]
    pairs = {(a, b): np.eye(3) for a in range(4) for b in range(a)}

    def cost(joint):
        alone = sum(own[k][x] for k, x in enumerate(joint))
        return alone + sum(table[joint[a], joint[b]] for (a, b), table in pairs.items())

    exact = collectives.minimize(own, pairs)
    assert exact.converged
    sampled = collectives.minimize(objective=cost, strategies=[3] * 4, block=60, seed=2)
    assert exact.cost == pytest.approx(cost(exact.joint))
    for player, strategy in np.ndindex(4, 3):
        other = exact.joint.copy()
        other[player] = strategy
        assert cost(other) >= exact.cost - 1e-12
    assert sampled.cost == pytest.approx(cost(sampled.joint))
    assert sampled.cost < exact.cost + 0.2
    again = collectives.minimize(objective=cost, strategies=[3] * 4, block=60, seed=2)
    assert (again.joint.tolist(), again.rounds) == (sampled.joint.tolist(), sampled.rounds)
    for q in exact.q:
        assert q.sum() == pytest.approx(1.0)
    assert exact.bound <= exact.cost
    assert sampled.bound is None


def test_no_two_players_can_do_better_after_a_local_search():
    rng = np.random.default_rng(5)
    own = [rng.uniform(0, 1, 4) for _ in range(5)]
    pairs = {(a, b): rng.uniform(0, 1, (4, 4)) for a in range(5) for b in range(a)}
    rounds = collectives.minimize(own, pairs, cooling=0.3, local_search="none")
    searched = collectives.minimize(own, pairs, cooling=0.3)
    assert searched.bound <= searched.cost <= rounds.cost

    def cost(joint):
        alone = sum(own[k][x] for k, x in enumerate(joint))
        return alone + sum(table[joint[a], joint[b]] for (a, b), table in pairs.items())

    for (a, b), x, y in itertools.product(pairs, range(4), range(4)):
        other = searched.joint.copy()
        other[[a, b]] = x, y
        assert cost(other) >= searched.cost - 1e-12


def test_what_an_objective_raises_is_raised():
    def objective(joint):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        collectives.minimize(objective=objective, strategies=[2, 2])


GAME_ERRORS = [
    ({"own": [[1.0], []]}, "a player has no strategy"),
    ({"own": [[1.0, 2.0]] * 2, "pairs": {(0, 0): np.eye(2)}}, "these are no two players"),
    ({"own": [[1.0, 2.0]] * 2, "pairs": {(0, 1): np.eye(3)}}, "has the shape (3, 3)"),
    ({"own": [[1.0, np.inf]]}, "a cost that is not finite"),
    ({"own": [[1.0]], "step": 0.0}, "step: is 0"),
    ({"own": [[1.0]], "cooling": 2.0}, "cooling: is 2"),
    ({"own": [[1.0]], "update": "slow"}, "`slow` is none of newton or brouwer"),
    ({"objective": len}, "an objective needs numbers of strategies"),
    ({"objective": len, "strategies": [2], "estimator": "exact"}, "has no closed form"),
    ({"objective": len, "strategies": [2], "local_search": "pairs"}, "is no sum over pairs"),
    ({"strategies": [2]}, "tables need each player's own costs"),
]


@pytest.mark.parametrize(("options", "words"), GAME_ERRORS, ids=[words for _, words in GAME_ERRORS])
def test_games_that_are_none_are_errors(options, words):
    with pytest.raises(sidestep.InputError) as caught:
        collectives.minimize(**options)
    assert words in str(caught.value)


@pytest.mark.parametrize(("name", "kind"), [(name, "ik") for name in ("engine", "body")] + [
    (name, "minimize") for name in ("estimator", "update", "order", "utility", "choice", "local_search")
])  # fmt: skip
def test_the_words_of_an_argument_are_those_of_its_type(name, kind, urdf):
    function = {"ik": sidestep.ik, "minimize": collectives.minimize}[kind]
    given = {"ik": {"arm": urdf, "targets": [0, 0, 1]}, "minimize": {"own": [[0.0, 1.0]]}}[kind]
    words = [word for word in re.findall(r"[\w-]+", str(inspect.signature(function).parameters[name].annotation))]
    words = [word for word in words if word not in ("Literal", "None")]
    with pytest.raises(sidestep.InputError) as caught:
        function(**given, **{name: "no such word"})
    listed = f"{', '.join(words[:-1])} or {words[-1]}"
    assert f"`no such word` is none of {listed}" in str(caught.value)


RESULTS = [
    lambda arm: stats.mean([1.0, 2.0, 4.0]),
    lambda arm: stats.proportion(3, 4),
    lambda arm: stats.quantile(range(100), 0.5),
    lambda arm: stats.paired([1.0, 2.0, 4.0], [2.0, 3.0, 6.0]),
    lambda arm: stats.correlation([1, 2, 3, 5], [1, 4, 9, 2]),
    lambda arm: stats.StoppingRule(1.0).next([1.0, 2.0]),
    lambda arm: sidestep.fk(arm),
    lambda arm: sidestep.ik(arm, [0.0, 0.0, 0.9], restarts=1),
    lambda arm: collectives.minimize([[0.0, 1.0]]),
]


@pytest.mark.parametrize("make", RESULTS)
def test_results_have_named_fields_that_cannot_be_set_and_are_unpacked_in_order(make, urdf):
    result = make(urdf)
    fields = type(result)._fields
    assert all(value is getattr(result, name) for name, value in zip(fields, result, strict=True))
    with pytest.raises(AttributeError):
        setattr(result, fields[0], None)
    assert len(pickle.loads(pickle.dumps(result))) == len(fields)


def test_numbers_out_of_range_are_told_with_the_range(urdf):
    arm = sidestep.Arm(urdf)
    for call, words in [
        (lambda: sidestep.ik(arm, [0.3, 0, 0.3], restarts=-1), "restarts: is -1"),
        (lambda: sidestep.ik(arm, [0.3, 0, 0.3], seed=2**64), "give a number from 0 to"),
        (lambda: sidestep.ik(arm, [0.3, 0, 0.3], workers=0), "workers: is 0"),
        (lambda: sidestep.ik(arm, [0.3, 0, 0.3], obstacles=[[0, 0, np.nan, 1]]), "not numbers"),
        (lambda: collectives.minimize([[0.0, 1.0]], seed=-1), "seed: is -1"),
        (lambda: collectives.minimize([[0.0, 1.0]], block=0), "block: is 0"),
    ]:
        with pytest.raises(sidestep.InputError, match=words):
            call()


def test_joints_of_a_table_are_found_by_their_names_whatever_their_order() -> None:
    arm = sidestep.Arm("scenarios/chain/arm.urdf")
    values = np.linspace(0.1, 0.4, 3 * len(arm.joints)).reshape(3, -1)
    by_name = {joint: values[:, k] for k, joint in reversed(list(enumerate(arm.joints)))}
    expected = sidestep.fk(arm, values).tip
    assert np.array_equal(sidestep.fk(arm, by_name).tip, expected)
    pandas = pytest.importorskip("pandas")
    assert np.array_equal(sidestep.fk(arm, pandas.DataFrame(by_name)).tip, expected)
    assert np.array_equal(
        sidestep.fk(arm, pandas.Series({k: v[0] for k, v in by_name.items()}).to_dict()).tip, expected[:1]
    )
    for wrong, words in ((values[:2, 1], "lengths differ"), (["a", "b", "c"], "not numbers")):
        with pytest.raises(sidestep.InputError, match=words):
            sidestep.fk(arm, {**by_name, arm.joints[1]: wrong})
    del by_name[arm.joints[1]]
    with pytest.raises(sidestep.InputError, match=f"no column `{arm.joints[1]}`"):
        sidestep.fk(arm, by_name)
