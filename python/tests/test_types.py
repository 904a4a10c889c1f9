"""Type checkers refuse what is misspelled, and take what NumPy's users give."""

import subprocess
import sys

import pytest

pytest.importorskip("mypy", reason="mypy is not installed, so types are not checked")
pytest.importorskip("gymnasium")

#: Each comment is needed: an error that is not there any more would be reported as unused.
CODE = """
import numpy as np
import sidestep
from sidestep.envs import Batch, parallel_env, tasks

sim = sidestep.Simulation("a.toml", seed=int(np.int64(3)), workers=2)
sim.run(progress=True)
sim.run(progres=True)  # type: ignore[call-arg]
tasks.make("Exploration-v0", rewards={"time": -1.0}, render_mode="ansi", keys={"seed": 2})
tasks.make("Exploration-v0", max_cycle=3)  # type: ignore[call-arg]
tasks.make("Exploration-v0", render_mode="video")  # type: ignore[arg-type]
tasks.vector_env("Exploration-v0", 8, autoreset_mode="SameStep", workers=2)
tasks.vector_env("Exploration-v0", 8, autoreset_mode="Never")  # type: ignore[arg-type]
parallel_env("a.toml", orders=["action"])
parallel_env("a.toml", order=["action"])  # type: ignore[call-arg]
Batch("a.toml", 3, autoreset_mode="Disabled")
sidestep.sweep("a.toml", progress=lambda done, total: print(done, total))
"""


def test_misspelled_options_are_errors_of_types(tmp_path, root):
    (tmp_path / "code.py").write_text(CODE)
    # The settings and the cache of the check of the whole package: NumPy and Gymnasium alone take a minute.
    settings = ["--config-file", str(root / "python/pyproject.toml"), "--cache-dir", str(root / ".mypy_cache")]
    command = [sys.executable, "-m", "mypy", *settings, "code.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
