"""The examples run as they stand."""

import subprocess
import sys

import numpy as np
import pytest


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


def test_a_policy_is_trained_on_a_task_judged_and_recorded(root, tmp_path, command):
    pytest.importorskip("torch", reason="PyTorch is not installed, so its example is not run")
    pytest.importorskip("gymnasium")
    example = root / "python/examples/train_ppo.py"
    args = ["--task", "Exploration-v0", "--steps", "3000", "--envs", "16", "--runs", "3"]
    args += ["--out", str(tmp_path / "out"), "--leaderboard", str(tmp_path / "board")]
    done = subprocess.run([sys.executable, example, *args], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Exploration-v0: share of the floor that was covered, in percent; higher is better; 3 seeds" in done.stdout
    assert "\nwander " in done.stdout and "ppo" in done.stdout
    assert (tmp_path / "out/curve.csv").read_text().startswith("steps,wall_s,coverage\n")
    runs = sorted((tmp_path / "board/runs/ppo").iterdir())
    assert len(runs) == 3
    replayed = subprocess.run([command, "replay", runs[0]], capture_output=True, text=True)
    assert replayed.returncode == 0, replayed.stderr
