"""The package with a world that its code does not know: frogs on lily pads, a crate of tests."""

import importlib.util
import subprocess
import sys
import textwrap

import pytest

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("sidestep_pond") is None,
    reason="the world of ponds is not installed: pip install ./python/tests/pond",
)

#: A process of its own takes the module with ponds for the native one, before the package is imported.
HEAD = """
import sys
import sidestep_pond
sys.modules["sidestep._native"] = sidestep_pond
import numpy as np
import sidestep
POND = {"world": "pond", "seed": 3, "cycles": 60, "pond": {"frogs": 5, "width": 6, "height": 4}}
OBEYING = {**POND, "pond": {**POND["pond"], "external": True}}
"""


def run(code, folder):
    """Runs code with ponds in a folder; it says what it has found by assertions."""
    text = HEAD + textwrap.dedent(code)
    done = subprocess.run([sys.executable, "-c", text], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_pond_runs_records_and_is_read_back(tmp_path):
    run(
        """
        assert "pond" in sidestep.worlds()
        serial = sidestep.Simulation(POND)
        with sidestep.Simulation(POND, workers=2, out="run") as recorded:
            assert recorded.run() == serial.run() == 60
            assert recorded.digest == serial.digest
            assert recorded.metrics() == serial.metrics() and recorded.metrics()["hops"] > 0
        rows = sidestep.read("run")
        assert len(rows["trajectories"]) == 5 * 60
        assert set(np.unique(rows["trajectories"]["frog"])) == set(range(5))
        assert serial.copy().digest == serial.digest
        assert serial.render(64).shape[1:] == (64, 3)
        """,
        tmp_path,
    )


def test_frogs_take_orders(tmp_path):
    run(
        """
        sim = sidestep.Simulation(OBEYING)
        east = sim.teams[0].action_spaces[0].choices.index("east")
        before = sim.observe()["pad"]
        sim.order("hop", east, agents=[4])
        sim.step()
        assert (sim.observe()["pad"] - before).tolist() == [0, 0, 0, 0, 1]
        """,
        tmp_path,
    )


def test_a_sweep_varies_ponds(tmp_path):
    run(
        """
        swept = sidestep.sweep(POND, vary={"pond.frogs": [3, 5]}, replicate=2)
        assert len(swept.results) == 4
        """,
        tmp_path,
    )


def test_frogs_learn_by_the_order_and_the_rewards_of_their_world(tmp_path):
    pytest.importorskip("pettingzoo")
    pytest.importorskip("gymnasium")
    run(
        """
        from sidestep import envs
        from sidestep.envs import Pond, pond_v0
        env = envs.parallel_env(OBEYING)
        assert type(env) is Pond is pond_v0.parallel_env and env.metadata["name"] == "pond_v0"
        assert envs.DEFAULTS["pond"] == {"hopped": 1.0}
        assert envs.TERMS["hopped"].meaning == "1 where a frog has left its pad"
        env.reset(seed=1)
        assert env.agents == [f"frog_{k}" for k in range(5)]
        actions = dict.fromkeys(env.agents, 0)
        actions["frog_4"] = 1
        _, rewards, *_ = env.step(actions)
        assert list(rewards.values()) == [0.0, 0.0, 0.0, 0.0, 1.0]
        batch = envs.Batch(OBEYING, 3)
        batch.reset(seed=1)
        _, rewards, *_ = batch.step(np.tile([0, 0, 0, 0, 1], (3, 1)))
        assert rewards.tolist() == [[0.0, 0.0, 0.0, 0.0, 1.0]] * 3
        """,
        tmp_path,
    )


def test_frogs_have_tracks(tmp_path):
    pytest.importorskip("matplotlib")
    run(
        """
        import matplotlib
        matplotlib.use("Agg")
        from sidestep import plot
        sim = sidestep.Simulation(POND, record=True)
        sim.run(20)
        tables = sim.tables()
        positions = plot.places(tables)
        assert set(positions.agent) == set(range(5))
        assert len(plot.tracks(tables).lines) == 10
        """,
        tmp_path,
    )
