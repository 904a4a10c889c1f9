"""Sweeps: the same plan, journal, folder and table as the command makes, for every engine."""

import concurrent.futures
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import sidestep
from sidestep import _engines
from sidestep._native import run_task

FLOOR = """format = 1
world = "robots"
cycles = 200
map.ascii = '''
..........
..........
....##....
..........
'''
[robots]
count = 4
sensors = ["sonar-8"]
effector = "nomad"
behaviour = { kind = "wander" }
"""
VARY = {"robots.count": [2, 5], "robots.effector": ["nomad", "perfect"]}
SPAWN = get_context("spawn")


@pytest.fixture
def floor(tmp_path):
    path = tmp_path / "floor.toml"
    path.write_text(FLOOR)
    return path


def files(folder):
    """The files of a sweep that follow from its plan and runs alone."""
    names = ["results.parquet", "cells.parquet", "sweep.json"]
    names += [p.relative_to(folder) for p in (folder / "variants").rglob("*") if p.is_file()]
    return {str(name): (folder / name).read_bytes() for name in names}


def begun(folder):
    """The number of runs that the journal has, after its first line."""
    journals = (folder / "shares").glob("*.journal")
    return sum(max(journal.read_bytes().count(b"\n") - 1, 0) for journal in journals)


def told(command, *args):
    done = subprocess.run([command, *map(str, args), "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def by_command(command, floor, out, *args):
    return told(
        command, "sweep", floor, "--vary", "robots.count=2,5",
        "--vary", "robots.effector=nomad,perfect", *args, "--out", out,
    )  # fmt: skip


def test_a_sweep_is_that_of_the_command_byte_for_byte(floor, command, tmp_path):
    words = by_command(command, floor, tmp_path / "a", "--replicate", 3, "--seed", 7)
    swept = sidestep.sweep(floor, vary=VARY, replicate=3, seed=7, out=tmp_path / "b", workers=2)
    assert files(tmp_path / "a") == files(tmp_path / "b")
    assert words["summary"] == swept.summary
    assert words.keys() == swept.output.keys()
    assert (len(swept), swept.failed, len(swept.timings)) == (12, 0, 12)
    again = sidestep.sweep(floor, vary=VARY, replicate=3, seed=7, out=tmp_path / "a")
    assert again.results["digest"].tolist() == swept.results["digest"].tolist()
    assert again.output["took"] is None, "nothing was run again"


def test_a_precision_ends_a_sweep_as_it_ends_that_of_the_command(floor, command, tmp_path):
    args = ["--until", "ci=0.2", "--max", 40, "--metrics", "contacts"]
    words = by_command(command, floor, tmp_path / "a", *args)
    options = {"until": "ci=0.2", "max_runs": 40, "metrics": ["contacts"]}
    local = sidestep.sweep(floor, vary=VARY, **options, out=tmp_path / "b")
    with ThreadPoolExecutor(3) as pool:
        others = sidestep.sweep(floor, vary=VARY, **options, out=tmp_path / "c", engine=pool)
    assert files(tmp_path / "a") == files(tmp_path / "b") == files(tmp_path / "c")
    assert words["stopped"] == local.output["stopped"] == others.output["stopped"]


def test_a_sweep_file_a_dict_of_one_and_a_scenario_are_swept_alike(floor, tmp_path):
    file = tmp_path / "sweep.toml"
    file.write_text('format = 1\nscenario = "floor.toml"\nreplicates = 2\nvary.robots.count = [2, 5]\n')
    of_dict = {"scenario": str(floor), "replicates": 2, "vary": {"robots.count": [2, 5]}}
    options = {"vary": {"robots.count": [2, 5]}, "replicate": 2}
    swept = [
        sidestep.sweep(file),
        sidestep.sweep(of_dict),
        sidestep.sweep(floor, **options),
        sidestep.sweep(sidestep.Scenario(floor), **options),
        sidestep.sweep(sidestep.Scenario(text=FLOOR), **options),
    ]
    digests = [one.results["digest"].tolist() for one in swept]
    assert len(digests[0]) == 4
    assert digests == [digests[0]] * 5


def test_tables_are_arrow_streams_and_are_read_back_from_the_folder(floor, tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    swept = sidestep.sweep(floor, vary=VARY, replicate=2, out=tmp_path / "s")
    table = pyarrow.table(swept.results)
    assert table.equals(pyarrow.table(sidestep.read(tmp_path / "s")["results"]))
    assert table.column("robots.effector").to_pylist()[:3] == ["nomad"] * 2 + ["perfect"]
    assert swept.results.meanings["digest"] == "Digest of the last state."
    np.testing.assert_array_equal(swept.values("contacts", 1), swept.results["contacts"][2:4])
    assert list(sidestep.read(tmp_path / "s", ["timings"])) == ["timings"]


def test_metrics_over_time_have_means_over_seeds_at_equal_cycles(floor, tmp_path):
    swept = sidestep.sweep(floor, vary=VARY, replicate=3, out=tmp_path / "s")
    series, bands = swept.series, swept.bands
    assert sorted(set(series["cycle"]))[:2] == sorted(set(bands["cycle"]))[:2]
    last = series["cycle"].max()
    at_end = (series["cycle"] == last) & (series["variant"] == 1)
    of_contacts = (bands["metric"] == "contacts") & (bands["cycle"] == last) & (bands["variant"] == 1)
    assert bands["mean"][of_contacts].tolist() == [series["contacts"][at_end].mean()]
    assert bands["mean_low"][of_contacts] <= bands["mean"][of_contacts]
    assert bands["runs"][of_contacts].tolist() == [3]
    np.testing.assert_array_equal(series["contacts"][at_end], swept.values("contacts", 1))
    read = sidestep.read(tmp_path / "s")["series"]
    np.testing.assert_array_equal(read["contacts"], series["contacts"])


def test_methods_are_compared_as_the_command_compares_them(command, root):
    scenario = root / "scenarios/airspace/superconflict.toml"
    words = told(command, "compare", scenario, "--runs", 2, "--methods", "mvp,none")
    compared = sidestep.compare(scenario, methods=["mvp", "none"], runs=2)
    for result in words["methods"] + compared["methods"]:
        del result["optimize_cpu_s"]
    assert compared == words


WRONG = [
    ({"vary": {"robots.count": 3}}, "vary: `robots.count` has no list of values"),
    ({"vary": {"robots.cuont": [3]}}, "`cuont`"),
    ({"replicate": 0}, "replicate: is 0"),
    ({"replicate": 3, "until": "ci=0.1"}, "give one of them"),
    ({"until": "ci=x"}, "is no precision"),
    ({"max_runs": 5}, "it bounds the runs"),
    ({"seed": -1}, "seed: is -1"),
    ({"metrics": "contacts"}, "give a list"),
    ({"metrics": ["kontacts"]}, "`kontacts` is no metric"),
    ({"baseline": "nobody"}, "nobody"),
    ({"baseline": "robots.count=2"}, "is not a name"),
    ({"vary": [3]}, "vary: [3] is not a dict"),
    ({"until": 0.05}, "until: 0.05 is not a text"),
    ({"set": {"seed": 3}}, "`seed` is set"),
    ({"engine": 7}, "7 is not an engine"),
    ({"engine": int}, "the function returned int"),
    ({"engine": "ray", "record": True}, "recorded on this machine only"),
    ({"record": True}, "no folder"),
    ({"workers": 0}, "workers: is 0"),
]


@pytest.mark.parametrize(("options", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_cannot_be_swept_is_an_error_before_any_run(options, words, floor):
    with pytest.raises(sidestep.InputError) as caught:
        sidestep.sweep(floor, **options)
    assert words in str(caught.value)


#: Windows has no signal that kills; there SIGTERM to another process ends it at once.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
signals = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@signals
def test_ctrl_c_stops_a_sweep_with_what_is_finished_in_the_journal(floor, tmp_path):
    out = tmp_path / "s"

    def interrupt():
        while begun(out) < 2:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        # The runs of the second variant would go on for days.
        sidestep.sweep(floor, vary={"cycles": [100, 10**9]}, replicate=2, out=out, workers=2)
    assert len(sidestep.read(out)["results"]) == 2


class Striking(ThreadPoolExecutor):
    """A pool of which the fifth task strikes its own process with a signal."""

    sign, left = signal.SIGINT, 5

    def submit(self, fn, /, *args, **kwargs):
        self.left -= 1
        if self.left == 0:
            signal.raise_signal(self.sign)
        return super().submit(fn, *args, **kwargs)


MANY = {"vary": VARY, "replicate": 6, "seed": 3}


def goes_on(floor, out):
    """The same call makes the missing runs, and has the result of one without a stop."""
    finished = len(sidestep.read(out)["results"])
    assert 0 < finished < 24
    swept = sidestep.sweep(floor, **MANY, out=out, workers=2)
    assert swept.output["took"]["runs"] == 24 - finished
    sidestep.sweep(floor, **MANY, out=out.parent / "whole", workers=2)
    assert files(out) == files(out.parent / "whole")


def test_the_same_call_goes_on_after_ctrl_c(floor, tmp_path):
    out = tmp_path / "s"
    with Striking(2) as pool, pytest.raises(KeyboardInterrupt):
        sidestep.sweep(floor, **MANY, out=out, engine=pool)
    goes_on(floor, out)


DRIVER = """
import signal, sys
import sidestep, test_sweep
floor, out = sys.argv[1:]
with test_sweep.Striking(2) as pool:
    pool.sign = signal.SIGKILL
    sidestep.sweep(floor, **test_sweep.MANY, out=out, engine=pool)
"""


@signals
def test_a_killed_driver_loses_nothing_that_is_in_the_journal(floor, tmp_path):
    out = tmp_path / "s"
    here = pathlib.Path(__file__).parent
    driver = subprocess.run([sys.executable, "-c", DRIVER, floor, out], cwd=here)
    assert driver.returncode == -signal.SIGKILL
    goes_on(floor, out)


FORK = get_context("fork") if hasattr(os, "fork") else None
forks = pytest.mark.skipif(FORK is None, reason="this system does not fork")

FORKING_DRIVER = """
import sys
from concurrent.futures import ProcessPoolExecutor
import sidestep, test_sweep
floor, out = sys.argv[1:]
sidestep.sweep(floor, **test_sweep.ENDLESS, out=out, engine=lambda: ProcessPoolExecutor(3, mp_context=test_sweep.FORK))
"""
#: The runs of the second variant would go on for days, so that a sweep is always stopped in the middle of a task.
ENDLESS = {"vary": {"cycles": [100, 10**9]}, "replicate": 2, "seed": 3}
#: Seconds longer than anything here takes, on a machine that has much else to do.
TIMEOUT_S = 120


def wait_for(what, is_true):
    """Waits for something that happens soon."""
    until = time.monotonic() + TIMEOUT_S
    while not is_true():
        assert time.monotonic() < until, f"waited too long for {what}"
        time.sleep(0.02)


def exists(process):
    """Whether a process runs; not one that has ended and that nobody has asked about yet."""
    try:
        stat = pathlib.Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return False
    return stat.rsplit(")", 1)[1].split()[0] not in "ZX"


def children(process):
    """The processes that a process has started."""
    tasks = pathlib.Path(f"/proc/{process}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


def stopped_sweep(floor, out):
    """A driver whose workers have done the two short runs, and are in long ones."""
    here = pathlib.Path(__file__).parent
    driver = subprocess.Popen([sys.executable, "-c", FORKING_DRIVER, floor, out], cwd=here)
    wait_for("two runs", lambda: begun(out) == 2)
    workers = children(driver.pid)
    assert len(workers) == 3
    return driver, workers


@forks
@pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")
def test_workers_end_with_a_driver_that_is_killed_and_hold_no_lock(floor, tmp_path):
    out = tmp_path / "s"
    driver, workers = stopped_sweep(floor, out)
    # One of them does not even notice that its driver is gone.
    os.kill(workers[0], signal.SIGSTOP)
    driver.kill()
    driver.wait()
    try:
        assert not sidestep.sweep_status(out).is_active, "the lock went with the driver"
        wait_for("idle and busy workers to end", lambda: not any(exists(worker) for worker in workers[1:]))
    finally:
        os.kill(workers[0], signal.SIGKILL)


@forks
@pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")
def test_a_share_that_is_being_run_is_refused_with_the_process_that_runs_it(floor, tmp_path):
    out = tmp_path / "s"
    driver, _ = stopped_sweep(floor, out)
    try:
        with pytest.raises(sidestep.InputError, match=rf"another process \({driver.pid}\) is running this share"):
            sidestep.sweep(floor, **ENDLESS, out=out, workers=1)
        assert sidestep.sweep_status(out).is_active
    finally:
        driver.kill()
        driver.wait()


class StrikingFork(ProcessPoolExecutor):
    """A pool of forked workers of which the fifth task strikes its own driver with Ctrl-C."""

    left = 5

    def submit(self, fn, /, *args, **kwargs):
        self.left -= 1
        if self.left == 0:
            signal.raise_signal(signal.SIGINT)
        return super().submit(fn, *args, **kwargs)


@forks
def test_the_same_call_goes_on_after_ctrl_c_with_a_pool_of_the_users_own(floor, tmp_path):
    out = tmp_path / "s"
    with StrikingFork(2, mp_context=FORK) as pool:
        with pytest.raises(KeyboardInterrupt):
            sidestep.sweep(floor, **MANY, out=out, engine=pool)
        finished = len(sidestep.read(out)["results"]) if begun(out) else 0
        swept = sidestep.sweep(floor, **MANY, out=out, engine=pool)
        assert swept.output["took"]["runs"] == 24 - finished
        assert pool.submit(int).result() == 0, "the pool is usable"
    sidestep.sweep(floor, **MANY, out=tmp_path / "whole", workers=2)
    assert files(out) == files(tmp_path / "whole")


@forks
def test_a_worker_of_something_else_is_left_alone():
    """Only workers of sweeps end with their driver: others may outlive it on purpose."""
    with ProcessPoolExecutor(1, mp_context=FORK) as pool:
        names = pool.submit(_thread_names).result()
    assert "sidestep-driver" not in names


def _thread_names():
    return [thread.name for thread in threading.enumerate()]


def test_any_executor_gives_the_table_of_threads(floor, tmp_path):
    options = {"vary": VARY, "replicate": 4, "seed": 3}
    sidestep.sweep(floor, **options, out=tmp_path / "local")
    with ProcessPoolExecutor(2, mp_context=SPAWN) as pool:
        sidestep.sweep(floor, **options, out=tmp_path / "pool", engine=pool)
        alone = sidestep.sweep(floor, **options, engine=pool)
    assert files(tmp_path / "local") == files(tmp_path / "pool")
    local = sidestep.read(tmp_path / "local")["results"]
    assert alone.results["digest"].tolist() == local["digest"].tolist()


def test_scenarios_travel_with_their_files(tmp_path):
    (tmp_path / "map.txt").write_text("......\n......\n")
    text = FLOOR.replace(FLOOR[FLOOR.index("map.ascii") : FLOOR.index("[robots]")], 'map.file = "map.txt"\n')
    scenario = sidestep.Scenario(text=text, base=tmp_path)
    local = sidestep.sweep(scenario, replicate=3)
    with ProcessPoolExecutor(1, mp_context=SPAWN) as pool:
        others = sidestep.sweep(scenario, replicate=3, engine=pool)
    assert others.results["digest"].tolist() == local.results["digest"].tolist()


class Killing(ProcessPoolExecutor):
    """A pool of which the n-th task kills one worker, once."""

    left = 5

    def submit(self, fn, /, *args, **kwargs):
        type(self).left -= 1
        if type(self).left == 0:
            os.kill(next(iter(self._processes)), KILL)
        return super().submit(fn, *args, **kwargs)


def test_a_killed_worker_loses_nothing(floor, tmp_path):
    options = {"vary": VARY, "replicate": 6, "seed": 3}
    sidestep.sweep(floor, **options, out=tmp_path / "local")
    Killing.left, out = 5, tmp_path / "killed"
    pool = Killing(2, mp_context=SPAWN)
    with pytest.raises(sidestep.EngineError, match="lambda: ProcessPoolExecutor"):
        sidestep.sweep(floor, **options, out=out, engine=pool)
    finished = len(sidestep.read(out)["results"])
    assert 0 < finished < 24
    with ProcessPoolExecutor(2, mp_context=SPAWN) as pool:
        swept = sidestep.sweep(floor, **options, out=out, engine=pool)
    assert swept.output["took"]["runs"] == 24 - finished
    assert files(out) == files(tmp_path / "local")

    Killing.left, out = 5, tmp_path / "replaced"
    sidestep.sweep(floor, **options, out=out, engine=lambda: Killing(2, mp_context=SPAWN))
    assert files(out) == files(tmp_path / "local")


class Broken(concurrent.futures.Executor):
    """An executor of which no task comes to an end."""

    def __init__(self, error):
        self.error = error

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_exception(self.error)
        return future


def test_an_executor_that_never_works_is_given_up(floor):
    with pytest.raises(sidestep.EngineError, match="failed 3 times: no disk"):
        sidestep.sweep(floor, engine=Broken(OSError("no disk")))


class Slow(ThreadPoolExecutor):
    """A pool whose first task waits until another task of the same cells is done."""

    def __init__(self):
        super().__init__(2)
        self.sent, self.is_done = [], threading.Event()

    def submit(self, fn, /, *args, **kwargs):
        cells = args[2]
        is_first, is_second = not self.sent, self.sent[:1] == [cells]
        self.sent.append(cells)

        def run():
            if is_first:
                assert self.is_done.wait(120), "nobody was sent a second time"
            outcomes = fn(*args, **kwargs)
            if is_second:
                self.is_done.set()
            return outcomes

        return super().submit(run)


def test_a_slow_task_is_sent_again_and_whichever_comes_first_counts(floor, tmp_path, monkeypatch):
    monkeypatch.setattr(_engines, "MIN_SLOW_S", 0.0)
    options = {"vary": VARY, "replicate": 2}
    sidestep.sweep(floor, **options, out=tmp_path / "local")
    pool = Slow()
    sidestep.sweep(floor, **options, out=tmp_path / "slow", engine=pool)
    assert pool.is_done.is_set() and pool.sent.count(pool.sent[0]) == 2
    assert files(tmp_path / "slow") == files(tmp_path / "local")


def test_the_metrics_that_are_kept_over_time_are_chosen_with_every_engine(floor):
    with ThreadPoolExecutor(2) as pool:
        for engine in ("local", pool):
            swept = sidestep.sweep(floor, replicate=2, series=["actions"], engine=engine)
            assert set(swept.bands["metric"]) == {"actions"}
            assert "actions" in swept.series.columns


def sent_tasks(floor):
    """The arguments of the tasks of a small sweep."""
    sent = []

    class Noting(ThreadPoolExecutor):
        def submit(self, fn, /, *args, **kwargs):
            sent.append(args)
            return super().submit(fn, *args, **kwargs)

    with Noting(1) as pool:
        sidestep.sweep(floor, replicate=2, engine=pool)
    return sent


class Wrapped(sidestep.InputError):
    """The error that Ray makes of one: of its type, with a traceback as its text."""

    def __init__(self, error):
        super().__init__("Traceback ...")
        self.cause = error


@pytest.mark.parametrize("wrap", [lambda error: error, Wrapped])
def test_what_a_task_refuses_ends_the_sweep_with_its_own_words(wrap, floor):
    refused = sidestep.InputError("s.toml: no start\n  help: make room")
    with pytest.raises(sidestep.InputError, match="no start") as caught:
        sidestep.sweep(floor, engine=Broken(wrap(refused)))
    assert caught.value is refused


def test_a_task_that_is_run_twice_gives_the_same_outcomes_to_the_bit(floor):
    def outcomes(task):
        return [{**json.loads(text), "costs": None} for text in run_task(*task)]

    for task in sent_tasks(floor):
        assert outcomes(task) == outcomes(task)


def test_tasks_refuse_the_sweep_of_another_build(floor):
    build, scenarios, cells, _ = sent_tasks(floor)[0]
    with pytest.raises(sidestep.InputError, match="install the same build"):
        run_task(build + "x", scenarios, cells)
    with ProcessPoolExecutor(1, mp_context=SPAWN) as pool:
        refused = pool.submit(run_task, build + "x", scenarios, cells).exception()
    assert isinstance(refused, sidestep.InputError) and refused.place == "a task of a sweep"


def test_a_task_is_as_long_as_the_first_ones_took(floor):
    pool = _engines.TaskPool(ThreadPoolExecutor(2), None)
    waiting = _engines.deque((k, 0, k, k) for k in range(100))
    assert len(pool._next_task(waiting).trials) == 1
    pool._update_estimate(['{"costs": {"compile_wall_s": 0.02, "run_wall_s": 0.08}}'])
    assert len(pool._next_task(waiting).trials) == 10
    pool._update_estimate(['{"costs": {"compile_wall_s": 0.0, "run_wall_s": 9.0}}'])
    assert len(pool._next_task(waiting).trials) == 1


def needs(name):
    return pytest.importorskip(name, reason=f"{name} is not installed, so sweeps on it are not tested")


def test_a_dask_cluster_that_loses_a_worker_gives_the_same_table(floor, tmp_path):
    distributed = needs("distributed")
    options = {"vary": VARY, "replicate": 6, "set": {"cycles": 2000}}
    sidestep.sweep(floor, **options, out=tmp_path / "local")
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1")
    with cluster, distributed.Client(cluster) as client:
        worker = next(iter(cluster.workers.values()))
        done, at_kill = threading.Event(), []

        def kill():
            while not done.is_set() and not begun(tmp_path / "dask"):
                time.sleep(0.01)
            at_kill.append(begun(tmp_path / "dask"))
            os.kill(worker.pid, KILL)

        thread = threading.Thread(target=kill, daemon=True)
        thread.start()
        try:
            sidestep.sweep(floor, **options, out=tmp_path / "dask", engine=client.get_executor())
        finally:
            done.set()
            thread.join()
    assert 0 < at_kill[0] < 24, "the worker was there to the end"
    assert files(tmp_path / "dask") == files(tmp_path / "local")


def test_a_ray_cluster_that_loses_a_node_gives_the_same_table(floor, tmp_path, monkeypatch):
    ray = needs("ray")
    from ray.cluster_utils import Cluster

    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    options = {"vary": VARY, "replicate": 12, "set": {"cycles": 40_000}}
    sidestep.sweep(floor, **options, out=tmp_path / "local")
    node = {"num_cpus": 1, "object_store_memory": 120_000_000}
    cluster = Cluster(
        initialize_head=True,
        head_node_args={**node, "node_ip_address": "127.0.0.2", "include_dashboard": False},
    )
    others = [cluster.add_node(**node, node_ip_address=f"127.0.0.{k}") for k in (3, 4)]
    ray.init(address=cluster.address, log_to_driver=False)
    try:
        done, at_kill = threading.Event(), []

        def kill():
            while not done.is_set() and not begun(tmp_path / "ray"):
                time.sleep(0.01)
            at_kill.append(begun(tmp_path / "ray"))
            cluster.remove_node(others[0], allow_graceful=False)

        thread = threading.Thread(target=kill, daemon=True)
        thread.start()
        try:
            swept = sidestep.sweep(floor, **options, out=tmp_path / "ray", engine="ray")
        finally:
            done.set()
            thread.join()
        assert 0 < at_kill[0] < 48, "the node was there to the end"
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert swept.output["took"]["at_once"] == 3
    assert files(tmp_path / "ray") == files(tmp_path / "local")


def test_the_status_of_a_sweep_is_that_of_the_command(floor, command, tmp_path):
    """A share that is done, one that was stopped in the middle, and one that was never begun."""
    out = tmp_path / "s"
    with pytest.raises(sidestep.InputError, match="this is no sweep"):
        sidestep.sweep_status(out)
    told(command, "sweep", "plan", floor, "--vary", "robots.count=2,5", "--replicate", 9, "--out", out)
    planned = sidestep.sweep_status(out)
    assert (planned.runs, planned.of, planned.shares, planned.runs_per_s) == (0, 18, [], None)
    for share in (0, 1):
        told(command, "sweep", "run", out, "--shard", f"{share}/3")
    # The journal of a share that was killed: its first four runs, the last one with half a line.
    done = sidestep.sweep_status(out)
    assert [share["is_done"] for share in done.shares] == [True, True]
    full = tmp_path / "full"
    told(command, "sweep", "plan", floor, "--vary", "robots.count=2,5", "--replicate", 9, "--out", full)
    sidestep.sweep(floor, vary={"robots.count": [2, 5]}, replicate=9, out=full)
    lines = (full / "shares/0-of-1.journal").read_bytes().splitlines(keepends=True)
    own = [line for line in lines[1:] if (lambda cell: (cell // 9 + cell % 9) % 3 == 2)(json.loads(line[9:])["cell"])]
    killed = b"".join([lines[0], *own[:3], own[3][:-20]])
    (out / "shares/2-of-3.journal").write_bytes(killed)
    status = sidestep.sweep_status(out)
    assert (status.runs, status.total, status.failed, status.is_complete) == (15, 18, 0, False)
    assert [(share["share"], share["runs"], share["of"], share["is_done"]) for share in status.shares] == [
        ("0/3", 6, 6, True), ("1/3", 6, 6, True), ("2/3", 3, 6, False),
    ]  # fmt: skip
    assert 0 < status.idle_s < 600 and status.runs_per_s > 0
    # The clock goes on between both looks.
    by_command = told(command, "sweep", "status", out)
    names = (
        "runs",
        "total",
        "of",
        "failed",
        "failures",
        "is_complete",
        "is_active",
        "is_worked_on",
        "until_precise",
        "runs_per_s",
    )
    for name in names:
        assert by_command[name] == getattr(status, name), name
    assert (out / "shares/2-of-3.journal").read_bytes() == killed, "looking changes nothing"
    sidestep.sweep(floor, vary={"robots.count": [2, 5]}, replicate=9, out=out)
    status = sidestep.sweep_status(out)
    assert (status.runs, status.total, status.is_complete) == (18, 18, True)
