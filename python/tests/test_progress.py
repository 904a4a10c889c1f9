"""Progress of long calls, as functions and bars are told of it."""

import pathlib
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import sidestep

FLOOR = {"world": "robots", "cycles": 50, "map": {"ascii": "......\n......"}, "robots": {"count": 2}}


def test_a_run_tells_its_cycles_to_the_end(external):
    for options in ({}, {"decide": lambda observed, state: 0 * observed["contact"]}):
        told = []
        sim = sidestep.Simulation(external)
        sim.run(40, progress=lambda done, total, told=told: told.append((done, total)), **options)
        assert told[-1] == (40, 40)
        assert [done for done, _ in told] == sorted({done for done, _ in told})


@pytest.mark.parametrize("engine", ["local", "executor"])
def test_a_sweep_tells_its_runs_to_the_end(engine):
    told = []
    with ThreadPoolExecutor(2) as pool:
        chosen = "local" if engine == "local" else pool
        sidestep.sweep(FLOOR, replicate=7, engine=chosen, progress=lambda *now: told.append(now))
    assert told[-1] == (7, 7)
    assert [done for done, _ in told] == sorted(done for done, _ in told)


def test_an_exception_of_the_function_ends_the_call():
    def stop(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        sidestep.sweep(FLOOR, replicate=5, progress=stop)
    sim = sidestep.Simulation(FLOOR)
    with pytest.raises(RuntimeError, match="enough"):
        sim.run(progress=stop)
    assert sim.cycle > 0, "it goes on from where it is"
    sim.run()


def test_true_is_a_bar_of_tqdm_and_other_things_are_refused(capfd):
    pytest.importorskip("tqdm", reason="tqdm is not installed, so its bars are not tested")
    sidestep.sweep(FLOOR, replicate=3, progress=True)
    assert "3/3" in capfd.readouterr().err
    with pytest.raises(sidestep.InputError, match="progress: is 5\n  help: give True for a bar"):
        sidestep.sweep(FLOOR, replicate=3, progress=5)


def test_without_tqdm_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with pytest.raises(ImportError, match="pip install 'tqdm>=4.64'; or give a function as progress"):
        sidestep.Simulation(FLOOR).run(progress=True)


def moves(rows: int) -> dict[str, object]:
    return {
        "action": np.full(rows, "forward"),
        "ahead_boxes": np.ones(rows),
        "left_boxes": np.zeros(rows),
        "turn_deg": np.zeros(rows),
    }


def test_learning_tells_the_rows_that_are_read(tmp_path: pathlib.Path) -> None:
    rows = 300_000
    told: list[tuple[int, int]] = []
    learned = sidestep.learn.effector(moves(rows), box_m=0.5, progress=lambda *now: told.append(now))
    assert learned.report["probabilities"][0]["of"] == rows
    assert told[-1] == (rows, rows) and all(done <= total == rows for done, total in told)
    words = {
        "true": ["wall"] * 9,
        "reported": ["wall"] * 9,
        "true_distance_m": [1.0] * 9,
        "reported_distance_m": [1.0] * 9,
    }
    sidestep.learn.sensor(
        words, edges_m=[2.0], classes=["near", "far"], range_m=4.0, progress=lambda *now: told.append(now)
    )
    assert told[-1] == (9, 9)
    # The recording of a run has rows, too.
    scenario = {**FLOOR, "record": {"calibration": True}}
    with sidestep.Simulation(scenario, out=tmp_path / "run") as sim:
        sim.run()
    sidestep.learn.effector(tmp_path / "run", progress=lambda *now: told.append(now))
    assert told[-1][0] == told[-1][1] > 9


def test_an_exception_of_the_function_ends_learning() -> None:
    def stop(done: int, total: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        sidestep.learn.effector(moves(1_000_000), progress=stop)
