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
