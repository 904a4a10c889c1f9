"""Compiling and starting large scenarios: other threads go on, and Ctrl-C is heard."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time

import pytest

import sidestep

# A fraction of a second of compiling.
CROWD = {
    "world": "airspace",
    "cycles": 10,
    "airspace": {"generator": {"kind": "random", "n": 30_000}},
}


@pytest.fixture(scope="module")
def crowd():
    return sidestep.Scenario(CROWD)


def ticks_amid(work):
    """Returns how often another thread of Python did something during work: not in its first and last tenth."""
    ticks, is_over = [], threading.Event()

    def tick():
        while not is_over.wait(0.002):
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        began = time.perf_counter()
        work()
        ended = time.perf_counter()
    finally:
        is_over.set()
        thread.join()
    tenth = (ended - began) / 10
    return sum(began + tenth < at < ended - tenth for at in ticks)


def test_other_threads_go_on_while_a_scenario_compiles():
    assert ticks_amid(lambda: sidestep.Scenario(CROWD)) > 1


def test_other_threads_go_on_while_a_file_compiles(tmp_path):
    path = tmp_path / "crowd.toml"
    path.write_text("format = 1\n" + sidestep.Scenario(CROWD).text.replace("format = 1\n", ""))
    assert ticks_amid(lambda: sidestep.Scenario(path)) > 1


@pytest.mark.parametrize(
    "work",
    [
        lambda crowd: crowd.set(seed=5),
        lambda crowd: sidestep.Simulation(crowd, seed=5),
        lambda crowd: pickle.loads(pickle.dumps(crowd)),
        lambda crowd: pickle.loads(pickle.dumps(sidestep.Simulation(crowd))),
        lambda crowd: [copy.copy(sidestep.Simulation(crowd)) for _ in range(4)],
    ],
    ids=["set", "seed", "unpickle", "rebuild", "copy"],
)
def test_other_threads_go_on_while_a_scenario_is_made_anew(crowd, work):
    assert ticks_amid(lambda: work(crowd)) > 1


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_ends_the_compiling_of_a_scenario():
    program = textwrap.dedent(
        """
        import signal, sidestep, time
        crowd = lambda n: {"world": "airspace", "airspace": {"generator": {"kind": "superconflict", "n": n}}}
        began = time.process_time()

        def stop(*_):
            # Nothing but compiling takes this much of a processor from here on.
            if time.process_time() - began > 0.3:
                signal.signal(signal.SIGINT, signal.SIG_IGN)
                raise KeyboardInterrupt

        signal.signal(signal.SIGINT, stop)
        print("compiling", flush=True)
        try:
            sidestep.Scenario(crowd(100_000))
            print("compiled", flush=True)
        except KeyboardInterrupt:
            print("stopped", sidestep.Scenario(crowd(8)).agents, flush=True)
        """
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as run:
        try:
            assert run.stdout.readline() == "compiling\n"
            # It would take many minutes.
            told = told_under_signals(run, 3000)
        finally:
            run.kill()
    assert told == "stopped 8\n"


def told_under_signals(run, most):
    """Returns the output of a program that gets SIGINT again and again until it ends, at most `most` times."""
    for _ in range(most):
        run.send_signal(signal.SIGINT)
        try:
            return run.communicate(timeout=0.02)[0]
        except subprocess.TimeoutExpired:
            pass
    raise AssertionError(f"{most} signals did not end it")
