"""Progress of long calls, as functions and bars are told of it."""

import sys
from concurrent.futures import ThreadPoolExecutor

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
