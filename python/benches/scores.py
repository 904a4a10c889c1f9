"""Scores of all tasks of sidestep.envs.tasks: random actions, scripted methods, and policies that were trained.

    python python/benches/scores.py                          the scripted methods, and random actions
    python python/benches/scores.py --trained trained        and trained/TASK/policy.pt of python/examples/train_ppo.py

Prints the table of the book's chapter on tasks: means over fresh seeds with 95 % intervals, and what the trained policy does
to the best of the scripted methods, seed by seed.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from sidestep.envs import tasks


#: Names are read where a curve passes behind them.
BEHIND = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}


class RandomPolicy:
    """Draws among the choices that the masks allow; the same draws for the same seeds."""

    def __init__(self, space: spaces.Space[Any]) -> None:
        self._space = space
        self._rng = np.random.default_rng(1)

    def reset(self) -> None:
        self._rng = np.random.default_rng(1)

    def __call__(self, observed: NDArray[np.float32], masks: NDArray[np.int8] | None) -> NDArray[Any]:
        rows = len(observed)
        if isinstance(self._space, spaces.Box):
            return self._rng.uniform(-1.0, 1.0, (rows, *self._space.shape))
        if isinstance(self._space, spaces.MultiDiscrete):
            return self._rng.integers(self._space.nvec, size=(rows, len(self._space.nvec)))
        assert masks is not None
        return (self._rng.random(masks.shape) * masks).argmax(axis=1)


def trained_policy(task: tasks.Task, folder: Path, draws: bool) -> Any:
    """Returns the policy of `train_ppo.py` with these weights; None where there are none."""
    weights = folder / task.id / "policy.pt"
    if not weights.exists():
        return None
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "examples"))
    import torch
    import train_ppo

    torch.set_num_threads(1)
    env = tasks.batch_env(task, 1)
    agent = train_ppo.Agent(env.encoder.size, env.single_action_space)
    agent.load_state_dict(torch.load(weights, weights_only=True))
    return train_ppo.policy_of(agent, env.single_action_space, draws)


def draw_curves(folder: Path, names: list[str], scripted: dict[str, list[tasks.Judgment]], out: Path) -> None:
    """Draws the learning curves of the trained policies, with the scores of scripted methods as lines across."""
    import matplotlib.pyplot as pyplot

    shown = [name for name in names if (folder / name / "curve.csv").exists()]
    columns = 3
    size = (10, 2.4 * -(-len(shown) // columns))
    figure, grid = pyplot.subplots(
        -(-len(shown) // columns), columns, figsize=size, layout="constrained", squeeze=False
    )
    for axes in grid.flat[len(shown) :]:
        axes.set_axis_off()
    for axes, name in zip(grid.flat, shown, strict=False):
        task = tasks.find_task(name)
        with (folder / name / "curve.csv").open(encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if row[task.score.name] != "nan"]
        minutes = [float(row["wall_s"]) / 60 for row in rows]
        scores = [float(row[task.score.name]) for row in rows]
        axes.plot(minutes, scores, color="black", linewidth=1.2)
        last = minutes[-1]
        # The best methods alone: lines that nobody reaches would press the curve flat.
        sign = 1 if task.score.is_higher_better else -1
        best = sorted(scripted[name], key=lambda one: -sign * one.scores.mean())[:2]
        # The name of the upper line is above it, that of the lower one below.
        for k, one in enumerate(sorted(best, key=lambda one: -one.scores.mean())):
            mean = float(one.scores.mean())
            axes.axhline(mean, color=f"C{k}", linewidth=1, linestyle="--")
            place = {"xytext": (2, 2 if k == 0 else -9), "textcoords": "offset points"}
            axes.annotate(one.name, (last, mean), color=f"C{k}", fontsize=8, ha="right", bbox=BEHIND, **place)
        levels = [one.scores.mean() for one in best]
        settled = scores[len(scores) // 10 :]
        low, high = min(*settled, *levels), max(*settled, *levels)
        margin = 0.08 * (high - low)
        axes.set_ylim(low - margin, high + margin)
        better = "higher" if task.score.is_higher_better else "lower"
        axes.set_title(name, fontsize=9)
        axes.set_ylabel(f"{task.score.name} ({better} is better)", fontsize=7)
        axes.set_xlabel("minutes of training", fontsize=8)
        axes.tick_params(labelsize=8)
    figure.savefig(out, dpi=110)


def cell(judgment: tasks.Judgment) -> str:
    mean = judgment.mean
    low, high = mean.interval or (mean.mean, mean.mean)
    return f"{mean.mean:.3g} [{low:.3g}, {high:.3g}]"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trained", type=Path, default=Path("trained"), help="folder of trained policies [trained]")
    parser.add_argument("--runs", type=int, default=100, help="fresh seeds [100]")
    parser.add_argument("--only", nargs="*", default=list(tasks.TASKS), help="tasks [all]")
    parser.add_argument("--curves", type=Path, default=None, help="picture of the learning curves [none]")
    parser.add_argument("--draws", nargs="*", default=[], help="tasks whose policies draw their actions [none]")
    args = parser.parse_args()
    print("| task | score | random | scripted methods | trained | against the best scripted one |")
    print("| --- | --- | --- | --- | --- | --- |")
    all_scripted = {}
    for name in args.only:
        task = tasks.find_task(name)
        space = tasks.batch_env(task, 1).single_action_space
        chance = tasks.judge(task, RandomPolicy(space), name="random", runs=args.runs)
        scripted = [tasks.judge_method(task, method, runs=args.runs) for method in task.methods if method != "random"]
        all_scripted[name] = scripted
        best = max(scripted, key=lambda one: one.scores.mean() * (1 if one.is_higher_better else -1))
        told = ", ".join(f"`{one.name}` {cell(one)}" for one in scripted)
        policy = trained_policy(task, args.trained, task.id in args.draws)
        learned, verdict = "", ""
        if policy is not None:
            found = tasks.judge(task, policy, name="trained", runs=args.runs)
            pairs = found.compare(best)
            low, high = pairs.interval or (pairs.difference, pairs.difference)
            word = "better than" if found.beats(best) else "worse than" if best.beats(found) else "undecided beside"
            learned, verdict = cell(found), f"{word} `{best.name}`: {pairs.difference:+.3g} [{low:+.3g}, {high:+.3g}]"
        arrow = "higher" if task.score.is_higher_better else "lower"
        print(
            f"| `{task.id}` | {task.score.name}, {arrow} is better | {cell(chance)} | {told} | {learned} | {verdict} |",
            flush=True,
        )
    if args.curves is not None:
        draw_curves(args.trained, args.only, all_scripted, args.curves)


if __name__ == "__main__":
    main()
