"""The examples run as they stand."""

import subprocess
import sys

import numpy as np


def test_the_policy_is_trained_and_judged(root, tmp_path):
    example = root / "python/examples/train_wander.py"
    args = ["--steps", "2", "--pairs", "2", "--cycles", "30", "--runs", "4", "--out", tmp_path / "policy.npy"]
    done = subprocess.run([sys.executable, example, *map(str, args)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "step   2 of 2" in done.stdout
    for metric in ("contacts", "distance_m"):
        assert f"{metric}: " in done.stdout
    assert "against wander in 4 pairs" in done.stdout
    assert np.load(tmp_path / "policy.npy").shape == (2, 66)


def test_a_planner_in_python_flies_beside_pibt_and_learns(root):
    example = root / "python/examples/planner.py"
    done = subprocess.run([sys.executable, example, "--rounds", "1", "--runs", "2"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = dict(line.split(": ", 1) for line in done.stdout.splitlines())
    assert set(lines) == {"pibt", "before", "after", "gain by learning"}
    for name in ("pibt", "before", "after"):
        assert float(lines[name].split()[0]) > 0
