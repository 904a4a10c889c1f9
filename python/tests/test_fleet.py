"""Fleets: agents as processes, started, watched and ended from Python."""

import os
import pathlib
import signal
import subprocess
import sys
import textwrap
import time

import pytest

import sidestep

#: Longer than anything here takes, on a machine that has much else to do.
TIMEOUT_S = 120.0

ROBOTS = {
    "world": "robots",
    "seed": 3,
    "cycles": 40,
    "map": {"ascii": "........\n........\n...##...\n........"},
    "robots": [{"count": 3, "sensors": ["sonar-8"], "effector": "nomad"}],
}
RING = {
    "world": "airspace",
    "cycles": 12,
    "airspace": {"deployment": "team", "generator": {"kind": "superconflict", "n": 3, "radius_m": 1500.0}},
}


@pytest.fixture(autouse=True)
def link(command, monkeypatch):
    """The program of the network, of the build of the package."""
    path = pathlib.Path(command).with_name("sidestep-link")
    if not path.exists():
        if "link" in os.environ.get("SIDESTEP_REQUIRE", "").split(","):
            pytest.fail(f"no program at {path}")
        pytest.skip(f"no program at {path}: build it with `cargo build --release -p sidestep-link`")
    monkeypatch.setenv("SIDESTEP_LINK", str(path))
    return path


def is_alive(process):
    """Whether a process runs; one that has ended and is not waited for does not."""
    stat = pathlib.Path(f"/proc/{process}/stat")
    try:
        return stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def until(holds):
    """Waits until something holds."""
    deadline = time.monotonic() + TIMEOUT_S
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize("scenario", [ROBOTS, RING])
def test_a_fleet_in_lockstep_has_the_digest_of_one_process(scenario):
    sim = sidestep.Simulation(scenario)
    sim.run(scenario["cycles"])
    with sidestep.Fleet(scenario) as fleet:
        seen = list(fleet)
        summary = fleet.wait()
    assert summary["digest"] == sim.digest
    assert [node.flown for node in seen[-1].nodes] == [scenario["cycles"]] * 3
    assert (seen[-1].cycle, seen[-1].late, seen[-1].has_begun) == (scenario["cycles"], 0, True)
    assert fleet.is_over and fleet.listens[0].startswith("tcp/127.0.0.1:")
    assert "over" in repr(fleet) and "<table>" in fleet._repr_html_()


def test_a_file_and_changes_of_it_are_flown_and_recorded(tmp_path):
    file = tmp_path / "s.toml"
    file.write_text(sidestep.Scenario(ROBOTS).text)
    plain = sidestep.Fleet(file, topology="star").wait()
    changed = sidestep.Fleet(file, set={"cycles": 20}, out=tmp_path / "run", topology="mesh").wait()
    sim = sidestep.Simulation(sidestep.Scenario(file).set({"cycles": 20}))
    sim.run(20)
    assert (plain["cycles"], changed["cycles"], changed["digest"]) == (40, 20, sim.digest)
    controls = sidestep.read(tmp_path / "run")["controls"]
    assert set(controls["cycle"]) == set(range(20))


def test_a_fleet_in_real_time_keeps_its_clock():
    with sidestep.Fleet(ROBOTS, clock="realtime", speed=40.0) as fleet:
        fleet.wait()
    assert fleet.status.flown_s == pytest.approx(1.0, abs=0.8)
    assert all(node.flown + node.late == 40 for node in fleet.status.nodes)


def test_a_block_that_is_left_ends_the_fleet_and_all_of_its_processes():
    with sidestep.Fleet(ROBOTS, set={"cycles": 1_000_000}) as fleet:
        for status in fleet:
            if status.cycle > 0:
                break
    assert fleet.is_over and 0 < fleet.summary["cycles"] < 1_000_000
    processes = [node.process for node in status.nodes]
    until(lambda: not any(map(is_alive, processes)))
    fleet.end()


def test_a_fleet_that_cannot_be_flown_says_why_and_what_would_be_right(monkeypatch):
    with pytest.raises(sidestep.InputError, match="one process decides for all") as direct:
        sidestep.Fleet(RING, set={"airspace.deployment": "direct"}).wait()
    assert "airspace.deployment=compact-team" in direct.value.remedy
    for wrong, said in [
        ({"clock": "sundial"}, 'give "lockstep" or "realtime"'),
        ({"topology": "tree"}, 'give "mesh", "star" or "multicast"'),
        ({"listen": "tcp/127.0.0.1:0"}, "give a list"),
        ({"packets": True}, "give out, too"),
        ({"speed": float("nan"), "clock": "realtime"}, "give a number from 0.01 to 1000"),
        ({"lease_s": 0.0}, "give a number from 0.1 to 86400"),
        ({"nodes": -1}, "give a number from 0 to"),
    ]:
        with pytest.raises(sidestep.InputError, match=said):
            sidestep.Fleet(ROBOTS, **wrong)
    monkeypatch.setenv("SIDESTEP_LINK", "/nowhere/sidestep-link")
    with pytest.raises(sidestep.InputError, match="cargo install --path crates/link"):
        sidestep.Fleet(ROBOTS)


def test_a_server_that_is_killed_is_an_error():
    with sidestep.Fleet(ROBOTS, set={"cycles": 1_000_000}) as fleet:
        next(iter(fleet))
        os.kill(fleet._process.pid, signal.SIGKILL)
        with pytest.raises(sidestep.FleetError, match="ended with code -9"):
            fleet.wait()


@pytest.mark.skipif(sys.platform == "win32", reason="processes are looked for in /proc")
@pytest.mark.parametrize(
    "ending", ["os.kill(os.getpid(), signal.SIGKILL)", "del fleet, status", "os.fork() or time.sleep(600)"]
)
def test_no_process_is_left_when_its_driver_is_gone_or_has_dropped_it(ending):
    program = f"""
        import os, signal, sidestep, sys, time
        fleet = sidestep.Fleet({ROBOTS!r}, set={{"cycles": 1_000_000}})
        for status in fleet:
            if status.has_begun:
                break
        print(*[node.process for node in status.nodes], flush=True)
        {ending}
        sys.stdin.read()
    """
    driver = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        nodes = [int(word) for word in driver.stdout.readline().split()]
        assert len(nodes) == 3
        if "fork" in ending:
            # The child that it has forked lives on, and must not keep the fleet.
            driver.kill()
        until(lambda: not any(map(is_alive, nodes)))
    finally:
        os.killpg(driver.pid, signal.SIGKILL)
        driver.communicate()
