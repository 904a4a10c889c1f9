"""Many worlds at once: the bits of simulations alone, for any number of workers."""

import os
import select
import signal
import threading

import numpy as np
import pytest

import sidestep

SEEDS = [5, 6, 7, 1000, 2**62]


@pytest.fixture
def make(external):
    def make(**options):
        return sidestep.Batch(external, len(SEEDS), seeds=SEEDS, **options)

    return make


def actions(cycle):
    return np.arange(25).reshape(5, 5) * 7 % (cycle + 2) % 3


def test_each_world_has_the_bits_of_a_simulation_alone(make, external):
    sims = [sidestep.Simulation(external, seed=seed) for seed in SEEDS]
    batches = [make(workers=workers) for workers in (1, 2, 3)]
    out = batches[0].observe()
    for cycle in range(30):
        for row, sim in zip(actions(cycle), sims, strict=True):
            sim.order("action", row)
            sim.order("broadcast", cycle)
            sim.step()
        for batch in batches:
            batch.order("action", actions(cycle))
            batch.order("broadcast", cycle)
            batch.step()
            observed = batch.observe(out=out)
            assert observed is out
            for k, sim in enumerate(sims):
                for name, array in sim.observe().items():
                    assert (array == observed[name][k]).all(), (name, k)
    digests = [sim.digest for sim in sims]
    assert all(batch.digests == digests for batch in batches)
    assert batches[0].metrics() == [sim.metrics() for sim in sims]


@pytest.mark.parametrize("world", ["robots", "chain", "airspace"])
def test_worlds_of_every_sort_start_anew_by_mask(world, root):
    scenario = sidestep.Scenario(root / f"scenarios/{world}/default.toml")
    batch = sidestep.Batch(scenario, 3, workers=2)
    assert batch.seeds.tolist() == [scenario.seed, scenario.seed + 1, scenario.seed + 2]
    batch.step(7)
    batch.reset([9, 9, 40], mask=np.array([True, False, True]))
    batch.step(5)
    assert batch.seeds.tolist() == [9, scenario.seed + 1, 40]
    assert batch.cycles.tolist() == [5, 12, 5]
    assert not batch.is_over.any()
    for k, digest in enumerate(batch.digests):
        sim = sidestep.Simulation(scenario, seed=int(batch.seeds[k]))
        sim.step(int(batch.cycles[k]))
        assert sim.digest == digest, k


def test_worlds_that_a_mask_leaves_out_stand_still(make):
    batch = make(workers=2)
    before = batch.digests
    mask = np.array([True, False, True, False, True])
    batch.order("action", 0)
    batch.step(3, mask=mask)
    assert batch.cycles.tolist() == [3, 0, 3, 0, 3]
    assert [a == b for a, b in zip(before, batch.digests, strict=True)] == (~mask).tolist()
    # Orders for those that did not step are dropped.
    batch.step(1, mask=~mask)
    assert batch.digests[1] == make_idle(batch, 1)


def make_idle(batch, k):
    sim = sidestep.Simulation(batch.scenario, seed=int(batch.seeds[k]))
    sim.step(1)
    return sim.digest


@pytest.mark.parametrize(
    ("order", "values", "extra", "words"),
    [
        ("action", np.full((5, 5), 99), {}, "world 0: the order `action` to robot 0 is 99"),
        ("action", np.zeros((5, 4)), {}, r"needs an array of the shape \(5, 5\), not \(5, 4\)"),
        ("action", np.zeros(5), {}, r"\(5, 5\), not \(5,\)"),
        ("jump", 0, {}, "it takes action, trip, broadcast"),
        ("action", 0, {"team": "robot 2"}, "decides for itself"),
        ("action", 0, {"team": 7}, "there is no team 7; the scenario has 2"),
    ],
)
def test_a_wrong_order_is_refused_and_nobody_is_ordered_anything(make, order, values, extra, words):
    batch, other = make(), make()
    with pytest.raises(sidestep.OrderError, match=words):
        batch.order(order, values, **extra)
    batch.step()
    other.step()
    assert batch.digests == other.digests


def test_wrong_input_says_what_would_be_right(make, external):
    batch = make()
    for call, words in [
        (lambda: sidestep.Batch(external, 0), "worlds: is 0"),
        (lambda: sidestep.Batch(external, 2, workers=0), "workers: is 0\n  help: give a number from 1 to 1024"),
        (lambda: sidestep.Batch(external, 2, workers=100_000), "workers: is 100000"),
        (lambda: sidestep.Batch(external, 2**62), "worlds: is"),
        (lambda: sidestep.Batch(external, -1), "-1 is out of range"),
        (lambda: batch.step(-1), "-1 is out of range"),
        (lambda: sidestep.Batch(external, 2, seeds=[1]), "2 worlds, and not as many seeds"),
        (lambda: sidestep.Batch(external, 1, seeds=[-1]), "whole numbers of at least 0"),
        (lambda: batch.reset([1, 2]), "an array of 5 seeds"),
        (lambda: batch.step(mask=np.ones(4, bool)), r"not \(4,\) truth values"),
        (lambda: batch.step(mask=[True] * 5), "they are not truth values"),
        (lambda: batch.reset(SEEDS, mask=np.ones(5)), "they are not truth values"),
        (lambda: batch.observe(out={}), r"out.sonar-8_report: it is missing"),
        (lambda: batch.observe(out={}), r"help: give .* C order of the shape \(5, 5, 8\), int64"),
    ]:
        with pytest.raises(sidestep.InputError, match=words):
            call()
    out = batch.observe()
    for wrong in (out["contact"].astype(np.float64), out["contact"][:4], np.asfortranarray(out["contact"])):
        with pytest.raises(sidestep.InputError, match="out.contact"):
            batch.observe(out={**out, "contact": wrong})
    out["contact"].flags.writeable = False
    with pytest.raises(sidestep.InputError, match="out.contact"):
        batch.observe(out=out)
    with pytest.raises(TypeError):
        sidestep.Batch(external, 2, wokers=2)


def test_a_seed_that_finds_no_place_is_named_and_the_world_stays(external):
    one = {
        "world": "robots",
        "map": {"ascii": "....\n....\n####"},
        "robots": [{"count": 2, "size": 2, "behaviour": {"kind": "external"}}],
    }
    fits, cramped = [], []
    for seed in range(40):
        try:
            sidestep.Simulation({**one, "seed": seed})
            fits.append(seed)
        except sidestep.InputError:
            cramped.append(seed)
    assert cramped
    batch = sidestep.Batch({**one, "seed": fits[0]}, 2, seeds=fits[:2])
    before = batch.digests
    with pytest.raises(sidestep.InputError, match=f"world 1 cannot start with seed {cramped[0]}"):
        batch.reset([fits[2], cramped[0]])
    assert batch.seeds.tolist() == [fits[2], fits[1]]
    assert batch.digests[1] == before[1]


def test_two_threads_may_use_a_batch_in_turn(make):
    batch, alone = make(workers=2), make()
    threads = [threading.Thread(target=batch.step, args=(50,)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    alone.step(100)
    assert batch.digests == alone.digests


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_has_workers_of_its_own(make):
    batch, alone = make(workers=2), make()
    batch.step(10)
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            batch.step(10)
            os.write(writer, "".join(batch.digests).encode())
        finally:
            # In any case, the child is no second run of the tests.
            os._exit(0)
    os.close(writer)
    ready, _, _ = select.select([reader], [], [], 120)
    if not ready:
        os.kill(child, signal.SIGKILL)
    with open(reader) as pipe:
        told = pipe.read()
    os.waitpid(child, 0)
    alone.step(20)
    assert told == "".join(alone.digests)
