"""Watching, observing and recording."""

import os
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

import sidestep


def test_observations_have_the_shapes_types_and_bounds_of_their_spaces(external):
    sim = sidestep.Simulation(external)
    for k, team in enumerate(sim.teams):
        observed = sim.observe(k)
        assert list(observed) == [space.name for space in team.observation_spaces]
        for space in team.observation_spaces:
            array = observed[space.name]
            assert array.shape == (len(team), *space.shape)
            assert array.dtype == np.dtype(space.dtype)
            assert (array >= space.low).all() and (array <= space.high).all()
            assert space.meaning


def test_observing_watching_and_inspecting_change_nothing(external):
    quiet, watched = (sidestep.Simulation(external) for _ in range(2))
    for _ in range(30):
        quiet.step()
        watched.observe()
        watched.snapshot()
        watched.inspect("robot", 3)
        watched.metrics()
        watched.step()
    assert watched.digest == quiet.digest


def test_a_snapshot_is_arrays_of_all_bodies(external):
    shot = sidestep.Simulation(external).snapshot()
    assert shot["at_m"].shape == (7, 3)
    assert shot["turn"].shape == (7, 4)
    assert np.allclose(np.linalg.norm(shot["turn"], axis=1), 1.0)
    assert set(shot["kind"]) == {"robot"}
    assert list(shot["number"]) == list(range(7))


def test_a_picture_shows_the_present_state(external):
    sim = sidestep.Simulation(external)
    before = sim.render(200)
    assert before.shape[1:] == (200, 3)
    assert before.dtype == np.uint8
    sim.order("action", 0)
    sim.step(3)
    assert (sim.render(200) != before).any()
    assert sim.render(100).shape[1] == 100
    with pytest.raises(sidestep.InputError, match="1 to 4096"):
        sim.render(0)


def test_an_inspection_tells_what_a_robot_perceives(external):
    told = sidestep.Simulation(external).inspect("robot", 0)
    assert [section["title"] for section in told["sections"]][:2] == ["Now", "Perceives"]
    assert sidestep.Simulation(external).inspect("robot", 99) is None
    with pytest.raises(sidestep.InputError, match="there is no kind `robots`"):
        sidestep.Simulation(external).inspect("robots", 0)


def test_tables_go_to_arrow_without_a_copy_of_the_numbers(external):
    pa = pytest.importorskip("pyarrow")
    sim = sidestep.Simulation(external, record=True)
    sim.run(50)
    rows = sim.tables()
    table = rows["trajectories"]
    arrow = pa.table(table)
    assert arrow.num_rows == len(table) == 50 * 7
    again = pa.table(table)
    address = [t["cycle"].chunk(0).buffers()[1].address for t in (arrow, again)]
    assert address[0] == address[1]
    assert arrow.schema.field("cycle").metadata[b"meaning"].endswith(b"cycle")
    assert list(table["cycle"]) == arrow["cycle"].to_pylist()
    # Words are compared as arrays, so that they can be masks.
    is_north = table["heading"] == "north"
    assert 0 < is_north.sum() == list(table["heading"]).count("north") < len(table)
    # Rows are handed over once.
    sim.run(60)
    assert set(sim.tables()["trajectories"]["cycle"]) == set(range(50, 60))


def test_tables_go_to_polars(external):
    pl = pytest.importorskip("polars")
    sim = sidestep.Simulation(external, record=True)
    sim.run(50)
    frame = pl.DataFrame(sim.tables()["trajectories"])
    assert frame.height == 350
    assert "cycle" in frame.columns


def test_rows_in_memory_are_those_of_a_folder(external, tmp_path):
    kept = sidestep.Simulation(external, record=True)
    kept.run()
    with sidestep.Simulation(external, out=tmp_path / "run") as stored:
        stored.run()
    folder, memory = sidestep.read(tmp_path / "run"), kept.tables()
    assert set(folder) == set(memory)
    for name, table in memory.items():
        assert folder[name].columns == table.columns
        for column in table.columns:
            # Equal where both have no value, too.
            np.testing.assert_array_equal(folder[name][column], table[column], f"{name}.{column}")


def test_two_threads_may_share_a_simulation_and_run_two_at_once(external):
    alone = sidestep.Simulation(external)
    alone.run()
    shared = sidestep.Simulation(external)
    own = [sidestep.Simulation(external) for _ in range(2)]

    def work(k):
        for _ in range(100):
            shared.step()
            own[k].step(2)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(2)]
    interval = sys.getswitchinterval()
    # Threads change places wherever they can, so that a step lost between reading and advancing shows.
    sys.setswitchinterval(1e-6)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert shared.cycle == 200
    assert {shared.digest, own[0].digest, own[1].digest} == {alone.digest}


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_stops_between_two_cycles_with_the_state_whole():
    program = textwrap.dedent(
        """
        import sidestep
        scenario = {"world": "robots", "cycles": 10**9, "map": {"ascii": "....."},
                    "robots": [{"count": 2}]}
        sim = sidestep.Simulation(scenario)
        try:
            print("running", flush=True)
            sim.run()
        except KeyboardInterrupt:
            again = sidestep.Simulation(scenario)
            again.restore(sim.checkpoint())
            print("stopped", again.digest == sim.digest, sim.step(), flush=True)
        """
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout.readline() == "running\n"
        # The run would go on for days.
        run.send_signal(signal.SIGINT)
        assert run.stdout.readline() == "stopped True 1\n"
    assert run.returncode == 0


def told_of(program):
    """Returns the output of a program; one that waits forever fails the test, and does not hold the others up."""
    program = [sys.executable, "-c", textwrap.dedent(program)]
    return subprocess.run(program, capture_output=True, text=True, check=True, timeout=300).stdout


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_a_handler_of_a_signal_reads_saves_and_stops_the_run_that_it_interrupts():
    told = told_of(
        """
        import signal, sidestep
        scenario = {"world": "robots", "cycles": 10**9, "map": {"ascii": "....."},
                    "robots": [{"count": 2}]}
        sim, seen = sidestep.Simulation(scenario), []

        def look(*_):
            seen.append((sim.cycle, sim.checkpoint(), sim.digest))
            if len(seen) == 3:
                raise KeyboardInterrupt

        signal.signal(signal.SIGALRM, look)
        signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)
        try:
            sim.run()
        except KeyboardInterrupt:
            signal.setitimer(signal.ITIMER_REAL, 0)
        cycles = [cycle for cycle, _, _ in seen]
        again = sidestep.Simulation(scenario)
        again.restore(seen[-1][1])
        print(cycles == sorted(cycles), sim.cycle == cycles[-1] > 0, again.digest == sim.digest)
        """
    )
    assert told == "True True True\n"


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_handlers_of_signals_change_neither_rows_nor_bits_and_add_their_own_steps():
    told = told_of(
        """
        import signal, sidestep
        scenario = {"world": "robots", "cycles": 10**9, "map": {"ascii": "....."},
                    "robots": [{"count": 2}]}
        quiet, asked = (sidestep.Simulation(scenario, record=["trajectories"]) for _ in range(2))
        looks = []
        signal.signal(signal.SIGALRM, lambda *_: looks.append(asked.metrics()))
        signal.setitimer(signal.ITIMER_REAL, 0.001, 0.001)
        done = asked.step(300_000)
        signal.setitimer(signal.ITIMER_REAL, 0)
        quiet.step(300_000)
        ours, theirs = (sim.tables()["trajectories"] for sim in (quiet, asked))
        same = all(list(ours[name]) == list(theirs[name]) for name in ours.columns)
        print(done, len(looks) > 0, same, asked.digest == quiet.digest)

        steps = []
        signal.signal(signal.SIGALRM, lambda *_: steps.append(asked.step(3)))
        signal.setitimer(signal.ITIMER_REAL, 0.001, 0.001)
        done = asked.step(300_000)
        signal.setitimer(signal.ITIMER_REAL, 0)
        print(done, asked.cycle == 600_000 + 3 * len(steps))
        """
    )
    assert told == "300000 True True True\n300000 True\n"


def test_it_is_loaded_quickly_and_says_its_version():
    program = "import sys, sidestep; print(sidestep.__version__, 'matplotlib' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    version, plots = told.stdout.split()
    assert version == sidestep.__version__
    assert plots == "False"


def test_a_schema_knows_the_keys_of_a_world():
    schema = sidestep.schema("robots")
    assert "robots" in schema["properties"]
    assert set(sidestep.worlds()) == {"robots", "chain", "airspace"}
    with pytest.raises(sidestep.InputError, match="it is one of robots"):
        sidestep.schema("robot")
