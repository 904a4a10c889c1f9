"""Trains a policy for a task of sidestep.envs.tasks by proximal policy optimization, with PyTorch, and judges it.

    python python/examples/train_ppo.py --task WindingCorridor-v0 --minutes 10
    python python/examples/train_ppo.py --task Exploration-v0 --steps 20000          a quick look

All agents of all worlds share one policy, which sees an agent's own observation alone. When it is trained, it is compared with
each scripted method of the task on 100 seeds that it has never met. The folder OUT gets the weights, the learning curve as
a table, and, where Matplotlib is installed, as a picture.
"""

from __future__ import annotations

import argparse
import copy
import csv
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from torch import nn
from torch.distributions import Categorical, Normal

import sidestep
from sidestep.envs import tasks

Tensor = torch.Tensor


def layer(inputs: int, outputs: int, gain: float = 2**0.5) -> nn.Linear:
    """Returns a linear layer with orthogonal weights."""
    linear = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(linear.weight, gain)
    nn.init.zeros_(linear.bias)
    return linear


class Agent(nn.Module):
    """A policy and a critic, for choices or for numbers from -1 to 1."""

    def __init__(self, observation_size: int, action_space: spaces.Space[Any], hidden: int = 128) -> None:
        super().__init__()
        self.counts = choice_counts(action_space)
        outputs = sum(self.counts) if self.counts else int(np.prod(action_space.shape or ()))

        def network(last: int, gain: float) -> nn.Sequential:
            first = [layer(observation_size, hidden), nn.Tanh(), layer(hidden, hidden), nn.Tanh()]
            return nn.Sequential(*first, layer(hidden, last, gain))

        self.actor = network(outputs, 0.01)
        self.critic = network(1, 1.0)
        self.log_std = nn.Parameter(torch.full((outputs,), -0.5))

    def distributions(self, observed: Tensor, masks: Tensor | None) -> list[Categorical] | Normal:
        """Returns the distributions of the actions: one for each choice, or one of all numbers."""
        outputs = self.actor(observed)
        if not self.counts:
            return Normal(torch.tanh(outputs), self.log_std.exp())
        if masks is not None:
            outputs = outputs.masked_fill(masks == 0, -1e9)
        return [Categorical(logits=logits) for logits in outputs.split(self.counts, dim=1)]

    def act(
        self, observed: Tensor, masks: Tensor | None, actions: Tensor | None = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Returns actions, which are drawn if there are none yet, their log-probabilities, and the entropies."""
        parts = self.distributions(observed, masks)
        if isinstance(parts, Normal):
            drawn = parts.sample() if actions is None else actions
            return drawn, parts.log_prob(drawn).sum(1), parts.entropy().sum(1)
        drawn = torch.stack([part.sample() for part in parts], 1) if actions is None else actions
        columns = list(zip(parts, drawn.unbind(1), strict=True))
        log_probs = torch.stack([part.log_prob(column) for part, column in columns]).sum(0)
        return drawn, log_probs, torch.stack([part.entropy() for part in parts]).sum(0)

    def best(self, observed: Tensor, masks: Tensor | None) -> Tensor:
        """Returns the most probable actions."""
        parts = self.distributions(observed, masks)
        if isinstance(parts, Normal):
            return parts.mean
        return torch.stack([part.logits.argmax(1) for part in parts], 1)


def choice_counts(space: spaces.Space[Any]) -> list[int]:
    """Returns the numbers of choices of an action; none for numbers."""
    if isinstance(space, spaces.Discrete):
        return [int(space.n)]
    return space.nvec.tolist() if isinstance(space, spaces.MultiDiscrete) else []


def as_actions(space: spaces.Space[Any], drawn: Tensor) -> NDArray[Any]:
    """Returns actions as the environment takes them."""
    array = drawn.numpy()
    return (
        array[:, 0]
        if isinstance(space, spaces.Discrete)
        else np.clip(array, -1, 1)
        if not choice_counts(space)
        else array
    )


def policy_of(agent: Agent, space: spaces.Space[Any], draws: bool = False) -> Any:
    """Returns the policy for :func:`sidestep.compare`."""
    # The last bits of a sum depend on how many rows are computed at once. In double precision, rounded at the end, actions
    # do not, so that a recorded run is the one that was judged.
    exact = copy.deepcopy(agent).double()

    def policy(observed: NDArray[np.float32], masks: NDArray[np.int8] | None) -> NDArray[Any]:
        with torch.no_grad():
            seen = torch.from_numpy(observed).double()
            allowed = None if masks is None else torch.from_numpy(masks)
            found = exact.act(seen, allowed)[0] if draws else exact.best(seen, allowed)
        return as_actions(space, found.float() if found.is_floating_point() else found)

    return policy


class Trainer:
    """Proximal policy optimization."""

    def __init__(self, task: tasks.Task, args: argparse.Namespace) -> None:
        self.task, self.args = task, args
        team = len(task.setting().team)
        rows = max(args.envs // team, 1) * team
        self.env = tasks.vector_env(task, rows, autoreset_mode=AutoresetMode.SAME_STEP, workers=args.workers)
        self.space = self.env.single_action_space
        self.agent = Agent(self.env.batch.encoder.size, self.space)
        self.optimizer = torch.optim.Adam(self.agent.parameters(), lr=args.learning_rate, eps=1e-5)
        self.curve: list[tuple[int, float, float]] = []

    def train(self) -> None:
        """Trains until the steps, or the minutes, are over."""
        args = self.args
        started = time.monotonic()
        observed, infos = self.env.reset(seed=args.seed)
        steps, scores = 0, []
        while True:
            spent_s = time.monotonic() - started
            progress = max(steps / args.steps, spent_s / (60 * args.minutes))
            if progress >= 1:
                break
            for group in self.optimizer.param_groups:
                group["lr"] = args.learning_rate * (1 - progress)
            batch, observed, infos, ended_scores = self.collect(observed, infos)
            self.update(batch, args.entropy * (1 - progress))
            steps += args.horizon * self.env.num_envs
            scores = (scores + ended_scores)[-50:]
            mean = float(np.mean(scores)) if scores else float("nan")
            self.curve.append((steps, spent_s, mean))
            if len(self.curve) % 10 == 1:
                print(f"{steps:>10} steps {spent_s:6.0f} s   {self.task.score.name} {mean:8.2f}", flush=True)

    def collect(self, observed: NDArray[Any], infos: dict[str, Any]) -> tuple[dict[str, Tensor], Any, Any, list[float]]:
        """Plays some cycles in all worlds."""
        args, rows = self.args, self.env.num_envs
        held: dict[str, list[Tensor]] = {
            name: [] for name in ("seen", "mask", "action", "log", "value", "reward", "end", "live")
        }
        scores: list[float] = []
        for _ in range(args.horizon):
            seen = torch.from_numpy(observed.copy())
            mask = torch.from_numpy(infos["action_mask"]) if "action_mask" in infos else None
            live = torch.from_numpy(infos["active"].copy()) if "active" in infos else torch.ones(rows, dtype=torch.bool)
            with torch.no_grad():
                action, log, _ = self.agent.act(seen, mask)
                value = self.agent.critic(seen)[:, 0]
            observed, rewards, terminated, truncated, infos = self.env.step(as_actions(self.space, action))
            reward = torch.from_numpy(rewards.astype(np.float32))
            ended = terminated | truncated
            if "score" in infos:
                scores += [
                    float(score) for score in infos["score"][:: len(self.env.batch.agents)] if np.isfinite(score)
                ]
                # An episode that was cut goes on in the value of its last observation.
                cut = np.flatnonzero(truncated)
                if len(cut):
                    last = torch.from_numpy(np.stack([infos["final_obs"][k] for k in cut]))
                    with torch.no_grad():
                        reward[torch.from_numpy(cut)] += args.gamma * self.agent.critic(last)[:, 0]
            row = (seen, mask, action, log, value, reward, torch.from_numpy(ended.astype(np.float32)), live)
            for name, one in zip(held, row, strict=True):
                if one is not None:
                    held[name].append(one)
        batch = {name: torch.stack(rows) for name, rows in held.items() if rows}
        with torch.no_grad():
            following = self.agent.critic(torch.from_numpy(observed.copy()))[:, 0]
        batch["advantage"] = self.advantages(batch, following)
        batch["return"] = batch["advantage"] + batch["value"]
        return batch, observed, infos, scores

    def advantages(self, batch: dict[str, Tensor], following: Tensor) -> Tensor:
        """Returns generalized advantage estimates."""
        args = self.args
        advantages, last = torch.zeros_like(batch["reward"]), torch.zeros_like(following)
        for k in reversed(range(args.horizon)):
            goes_on = 1 - batch["end"][k]
            surprise = batch["reward"][k] + args.gamma * following * goes_on - batch["value"][k]
            last = surprise + args.gamma * args.trace * goes_on * last
            advantages[k] = last
            following = batch["value"][k]
        return advantages

    def update(self, batch: dict[str, Tensor], entropy_weight: float) -> None:
        """Improves policy and critic."""
        args = self.args
        # Rows of agents that are gone mean nothing.
        rows = torch.nonzero(batch["live"].reshape(-1))[:, 0]
        flat = {name: one.reshape(-1, *one.shape[2:])[rows] for name, one in batch.items()}
        count = len(rows)
        for _ in range(args.epochs):
            for chosen in torch.randperm(count).split(-(-count // args.minibatches)):
                part = {name: one[chosen] for name, one in flat.items()}
                _, log, entropy = self.agent.act(part["seen"], part.get("mask"), part["action"])
                ratio = (log - part["log"]).exp()
                advantage = part["advantage"]
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                clipped = ratio.clamp(1 - args.clip, 1 + args.clip)
                actor_loss = -torch.min(ratio * advantage, clipped * advantage).mean()
                critic_loss = 0.5 * (self.agent.critic(part["seen"])[:, 0] - part["return"]).square().mean()
                loss = actor_loss + 0.5 * critic_loss - entropy_weight * entropy.mean()
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.agent.parameters(), 0.5)
                self.optimizer.step()


def write_curve(folder: Path, task: tasks.Task, curve: list[tuple[int, float, float]]) -> None:
    """Writes the learning curve as a table and as a picture."""
    with (folder / "curve.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["steps", "wall_s", task.score.name])
        writer.writerows(curve)
    try:
        import matplotlib.pyplot as pyplot
    except ImportError:
        return
    figure, axes = pyplot.subplots(figsize=(6, 3.5), layout="constrained")
    steps, _, scores = zip(*curve, strict=True)
    axes.plot([step / 1e6 for step in steps], scores)
    axes.set(xlabel="steps of agents in millions", ylabel=task.score.meaning, title=task.id)
    figure.savefig(folder / "curve.png", dpi=150)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="Exploration-v0", choices=list(tasks.TASKS), help="the task [Exploration-v0]")
    parser.add_argument("--minutes", type=float, default=12.0, help="minutes of training at most [12]")
    parser.add_argument("--steps", type=float, default=1e9, help="steps of agents at most [no limit]")
    parser.add_argument("--envs", type=int, default=256, help="agents in all worlds, about [256]")
    parser.add_argument("--horizon", type=int, default=32, help="cycles between two updates [32]")
    parser.add_argument("--epochs", type=int, default=4, help="passes over the cycles of an update [4]")
    parser.add_argument("--minibatches", type=int, default=4, help="parts of a pass [4]")
    parser.add_argument("--learning-rate", type=float, default=1e-3, help="at the start; it falls to 0 [0.001]")
    parser.add_argument("--gamma", type=float, default=0.99, help="discount of a cycle [0.99]")
    parser.add_argument("--trace", type=float, default=0.95, help="lambda of advantages [0.95]")
    parser.add_argument("--clip", type=float, default=0.2, help="bound on the change of probabilities [0.2]")
    parser.add_argument(
        "--entropy", type=float, default=0.01, help="weight of entropy at the start; it falls to 0 [0.01]"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of the first world, and of PyTorch [1]")
    parser.add_argument("--workers", type=int, default=2, help="workers of the worlds [2]")
    parser.add_argument("--runs", type=int, default=100, help="fresh seeds to judge with [100]")
    parser.add_argument("--draws", action="store_true", help="judge the policy that draws, not that of best actions")
    parser.add_argument("--out", default="trained", help="folder for weights and curve [trained]")
    parser.add_argument(
        "--weights", default=None, help="weights of an earlier call, which are judged without training [none]"
    )
    parser.add_argument("--leaderboard", default=None, help="folder for a leaderboard with recorded runs [none]")
    args = parser.parse_args()
    torch.manual_seed(args.seed)
    # The networks are small: a second thread would cost more than it brings.
    torch.set_num_threads(1)
    task = tasks.find_task(args.task)
    trainer = Trainer(task, args)
    folder = Path(args.out)
    if args.weights:
        trainer.agent.load_state_dict(torch.load(args.weights, weights_only=True))
    else:
        trainer.train()
        folder.mkdir(parents=True, exist_ok=True)
        torch.save(trainer.agent.state_dict(), folder / "policy.pt")
        write_curve(folder, task, trainer.curve)
    policy = policy_of(trainer.agent, trainer.space, args.draws)
    # On the same seeds, none of which the policy has met: seed by seed against each scripted method.
    entries = {"ppo": policy, **{method: method for method in task.methods}}
    print(f"\n{sidestep.compare(task, methods=entries, runs=args.runs, workers=args.workers)}")
    if args.leaderboard:
        board = tasks.write_leaderboard(
            args.leaderboard,
            task,
            entries,
            runs=args.runs,
            files=[args.weights or folder / "policy.pt", __file__],
            workers=args.workers,
        )
        print(f"\n{board}")


if __name__ == "__main__":
    main()
