"""Scores of policies and scripted methods on the same seeds, and leaderboards."""

from __future__ import annotations

import html
import json
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import stats
from ..._errors import ReplayError, checked_int, input_error
from ..._native import Batch as Worlds
from ..._native import Simulation, __version__
from ._task import TIME_LEFT, Task, acting_team, found_task
from ._worlds import TaskBatch

Policy = Callable[[NDArray[np.float32], "NDArray[np.int8] | None"], NDArray[Any]]
"""From observations (agents, numbers) and masks of choices (agents, choices), None where actions are no choices, to actions, a
row for each. A method ``reset``, if there is one, is called before each batch of episodes."""

#: The first seed of judgments: none that learners use by default.
FIRST_SEED = 1_000_000
#: Worlds that are judged at once.
MAX_WORLDS = 50
#: The file of a leaderboard.
FILE = "leaderboard.json"


@dataclass(frozen=True)
class Judgment:
    """Scores of a policy, or of a scripted method, on some seeds."""

    #: The task, such as ``Superconflict-v0``.
    task: str
    #: Its name.
    name: str
    is_higher_better: bool
    seeds: NDArray[np.int64]
    #: The score of each seed.
    scores: NDArray[np.float64]
    #: Digest of the last state of each seed, in hexadecimal.
    digests: list[str]

    @property
    def mean(self) -> stats.Mean:
        """The mean with its intervals."""
        return stats.mean(self.scores)

    def compare(self, other: Judgment) -> stats.Paired:
        """Returns how much higher the scores are than those of another one, seed by seed."""
        if self.task != other.task or not np.array_equal(self.seeds, other.seeds):
            raise input_error("other", "it is of another task or of other seeds", "judge both on the same ones")
        return stats.paired(self.scores, other.scores)

    def beats(self, other: Judgment) -> bool:
        """Returns whether it is better: whether the 95 % interval of the difference leaves no doubt."""
        interval = self.compare(other).interval
        if interval is None:
            return False
        low, high = interval
        return low > 0.0 if self.is_higher_better else high < 0.0


Orders = list[dict[str, NDArray[Any]]]
"""The orders of a world by cycle: arrays (agents, ...) by name."""


def judge(
    task: Task | str,
    policy: Policy,
    *,
    name: str = "policy",
    runs: int = 100,
    seed: int = FIRST_SEED,
    workers: int = 1,
) -> Judgment:
    """Returns the scores of a policy, of an episode with each of ``runs`` seeds from ``seed`` on.

    The policy is called once for each cycle, with a row for each agent of up to 50 worlds, one world after the other; rows of
    agents that are gone are among them, and nobody obeys their actions.
    """
    return _judge_and_keep(found_task(task), policy, name, Trials(runs, seed, workers))[0]


def _judge_and_keep(task: Task, policy: Policy, name: str, trials: Trials) -> tuple[Judgment, list[Orders]]:
    """Returns the scores, and the orders of the first episodes."""
    runs, seed = checked_int("runs", trials.runs, 1, 1_000_000), trials.seed
    scores, digests = np.zeros(runs), [""] * runs
    orders: list[Orders] = [[] for _ in range(min(trials.kept, runs))]
    for first in range(0, runs, MAX_WORLDS):
        count = min(MAX_WORLDS, runs - first)
        batch = TaskBatch(task, count, workers=trials.workers)
        ended = np.zeros(count, bool)
        for infos in _episodes(batch, policy, name, seed + first):
            for k in range(first, min(first + count, len(orders))):
                if not ended[k - first]:
                    row = {order: values[k - first] for order, values in batch.last_orders.items()}
                    orders[k].append(row)
            fresh = infos.get("_score", ended) & ~ended
            if fresh.any():
                found = batch.worlds.digests
                for world in np.flatnonzero(fresh):
                    scores[first + world] = infos["score"][world]
                    digests[first + world] = found[world]
                ended |= fresh
            if ended.all():
                break
    judgment = Judgment(task.id, name, task.score.is_higher_better, seed + np.arange(runs), scores, digests)
    return judgment, orders


def _episodes(batch: TaskBatch, policy: Policy, name: str, seed: int) -> Any:
    """Lets a policy act, and yields the infos of each cycle; worlds that have ended go on with further episodes."""
    reset = getattr(policy, "reset", None)
    if reset is not None:
        reset()
    observed: Any
    observed, infos = batch.reset(seed=seed)
    shape = observed.shape[:2]
    has_mask = batch.design.actions.mask is not None
    while True:
        rows = observed.reshape(-1, observed.shape[2])
        masks = infos["action_mask"].reshape(len(rows), -1) if has_mask else None
        actions = np.asarray(policy(rows, masks))
        expected = (len(rows), *(batch.single_action_space.shape or ()))
        if actions.shape != expected:
            given = "None" if actions.dtype == object else f"an array of the shape {actions.shape}"
            cause = f"it returned {given} for {len(rows)} observations"
            raise input_error(f"policy `{name}`", cause, f"return an array of the shape {expected}")
        observed, _, _, _, infos = batch.step(actions.reshape(*shape, *actions.shape[1:]))
        yield infos


def judge_method(
    task: Task | str, method: str, *, runs: int = 100, seed: int = FIRST_SEED, workers: int = 1
) -> Judgment:
    """Returns the scores of a scripted method, on the seeds on which :func:`judge` judges a policy."""
    task = found_task(task)
    runs = checked_int("runs", runs, 1, 1_000_000)
    scores, digests = np.zeros(runs), [""] * runs
    for first in range(0, runs, MAX_WORLDS):
        seeds = seed + first + np.arange(min(MAX_WORLDS, runs - first))
        found = _run_method(task, method, seeds, workers)
        for k, (score, digest) in enumerate(found):
            scores[first + k], digests[first + k] = score, digest
    return Judgment(task.id, method, task.score.is_higher_better, seed + np.arange(runs), scores, digests)


def _run_method(task: Task, method: str, seeds: NDArray[np.int64], workers: int) -> list[tuple[float, str]]:
    """Runs a scripted method until the end of each episode, which is that of a policy's episode."""
    scenario = task.scenario(method)
    worlds = Worlds(scenario, len(seeds), workers=workers, seeds=seeds)
    design = task.design(task.setting())
    if design.tracker is None:
        worlds.step(scenario.cycles)
        return [
            (task.score.measure(metrics, {}), digest)
            for metrics, digest in zip(worlds.metrics(), worlds.digests, strict=True)
        ]
    team = acting_team(worlds.teams)
    agents = len(team)
    tracker = design.tracker(len(seeds) * agents)
    going: NDArray[np.bool_] = np.ones(len(seeds), bool)

    def arrays() -> dict[str, NDArray[Any]]:
        seen = worlds.observe(team.name)
        return {name: array.reshape(-1, *array.shape[2:]) for name, array in seen.items()}

    tracker.restart(np.repeat(going, agents), arrays())
    for _ in range(scenario.cycles):
        worlds.step(mask=going)
        now = arrays()
        tracker.advance(np.repeat(going, agents), now)
        left = np.repeat(1.0 - worlds.cycles / scenario.cycles, agents)
        now |= {**tracker.arrays, TIME_LEFT: left}
        done: NDArray[np.bool_] = np.zeros(len(seeds), bool)
        if design.is_done is not None:
            done = np.asarray(design.is_done(now).reshape(len(seeds), agents).all(axis=1))
        going = np.logical_and(going, ~np.logical_or(done, worlds.is_over))
        if not going.any():
            break
    results = []
    for k, (metrics, digest) in enumerate(zip(worlds.metrics(), worlds.digests, strict=True)):
        tracked = {name: array[k * agents : (k + 1) * agents] for name, array in tracker.arrays.items()}
        results.append((task.score.measure(metrics, tracked), digest))
    return results


class TaskComparison(dict[str, Any]):
    """Scores of policies and scripted methods of a task, as :func:`sidestep.compare` returns them.

    ``methods`` has a dict for each: ``method`` (its name), ``score`` (``mean``, 95 % ``interval`` and ``n``), and for all but
    the first ``first_less_this``: how much higher the score of the first is, seed by seed (``difference``, ``interval``,
    ``p_value``), and ``verdict``: what the first one does to it. ``str`` of it is a table.
    """

    def __str__(self) -> str:
        better = "higher" if self["is_higher_better"] else "lower"
        lines = [f"{self['task']}: {self['meaning']}; {better} is better; {self['runs']} seeds, 95 % intervals"]
        first = self["methods"][0]["method"]
        for one in self["methods"]:
            line = f"{one['method']:<20} {_with_interval(one['score']['mean'], one['score']['interval'])}"
            pairs = one.get("first_less_this")
            if pairs is not None:
                told = _with_interval(pairs["difference"], pairs["interval"], sign="+")
                line += f"   {first} {pairs['verdict']}: {told}"
            lines.append(line)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"


def _with_interval(value: float, interval: Any, sign: str = "") -> str:
    bounds = "" if interval is None else f" [{interval[0]:{sign}.3f}, {interval[1]:{sign}.3f}]"
    return f"{value:{sign}10.3f}{bounds}"


def compare_on_task(
    task: Task | str,
    methods: Mapping[str, Policy | str] | Sequence[str] | None = None,
    *,
    runs: int = 100,
    seed: int | None = None,
    workers: int = 1,
) -> TaskComparison:
    """Compares policies and scripted methods of a task on the same seeds: what :func:`sidestep.compare` does for tasks.

    ``methods`` are policies, or names of scripted methods, by the names under which they are listed; or names alone. By
    default they are all scripted methods. The others are compared with the first.
    """
    task = found_task(task)
    if methods is None:
        methods = list(task.methods)
    entries = dict(methods) if isinstance(methods, Mapping) else {name: name for name in methods}
    if not entries:
        raise input_error("methods", "there are none", f"give policies by name, or some of {', '.join(task.methods)}")
    seed = FIRST_SEED if seed is None else seed
    trials = Trials(runs, seed, workers)
    judgments = {name: judge_entry(task, name, entry, trials)[0] for name, entry in entries.items()}
    first, *_ = judgments.values()
    told = []
    for name, found in judgments.items():
        mean = found.mean
        one: dict[str, Any] = {"method": name, "score": {"mean": mean.mean, "interval": mean.interval, "n": mean.n}}
        if found is not first:
            pairs = first.compare(found)
            verdict = "beats it" if first.beats(found) else "loses to it" if found.beats(first) else "undecided"
            one["first_less_this"] = {
                "difference": pairs.difference,
                "interval": pairs.interval,
                "p_value": pairs.p_value,
                "verdict": verdict,
            }
        told.append(one)
    return TaskComparison(
        task=task.id,
        score=task.score.name,
        meaning=task.score.meaning,
        is_higher_better=task.score.is_higher_better,
        first_seed=seed,
        runs=runs,
        methods=told,
    )


@dataclass(frozen=True)
class Trials:
    """The episodes on which entries are judged."""

    runs: int
    seed: int
    workers: int
    #: Number of the first episodes whose orders are kept.
    kept: int = 0


def judge_entry(task: Task, name: str, entry: Policy | str, trials: Trials) -> tuple[Judgment, list[Orders]]:
    """Returns the scores of a policy, with the orders of some episodes, or of a scripted method by its name."""
    runs, seed, workers = trials.runs, trials.seed, trials.workers
    if isinstance(entry, str):
        return replace(judge_method(task, entry, runs=runs, seed=seed, workers=workers), name=name), []
    return _judge_and_keep(task, entry, name, trials)


@dataclass(frozen=True)
class Leaderboard:
    """A folder with judgments, policies and recorded runs of a task."""

    folder: Path
    task: str
    version: str
    #: By name.
    judgments: dict[str, Judgment]

    @classmethod
    def read(cls, folder: str | PathLike[str]) -> Leaderboard:
        """Reads a folder that :func:`write_leaderboard` wrote.

        Raises InputError when it is none.
        """
        folder = Path(folder)
        try:
            content = json.loads((folder / FILE).read_text(encoding="utf-8"))
            entries = content["entries"]
            judgments = {
                name: Judgment(
                    content["task"],
                    name,
                    content["is_higher_better"],
                    np.array(entry["seeds"], np.int64),
                    np.array(entry["scores"], float),
                    list(entry["digests"]),
                )
                for name, entry in entries.items()
            }
            return cls(folder, content["task"], content["sidestep"], judgments)
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            remedy = f"give a folder that write_leaderboard wrote: it has a {FILE}"
            raise input_error("folder", f"{folder} is no leaderboard: {error}", remedy) from error

    @property
    def ranking(self) -> list[str]:
        """The names, the best mean score first."""
        sign = -1.0 if next(iter(self.judgments.values())).is_higher_better else 1.0
        return sorted(self.judgments, key=lambda name: sign * float(self.judgments[name].scores.mean()))

    @property
    def runs(self) -> list[Path]:
        """The folders of recorded runs: ``sidestep replay`` repeats each, and compares its digest."""
        return sorted(path.parent for path in self.folder.glob("runs/*/*/run.json"))

    def __str__(self) -> str:
        lines = [f"{self.task}, sidestep {self.version}"]
        for place, name in enumerate(self.ranking, 1):
            mean = self.judgments[name].mean
            interval = "" if mean.interval is None else f" [{mean.interval[0]:.2f}, {mean.interval[1]:.2f}]"
            lines.append(f"{place:2} {name:<24} {mean.mean:10.2f}{interval}, {mean.n} seeds")
        return "\n".join(lines)


def write_leaderboard(
    folder: str | PathLike[str],
    task: Task | str,
    entries: Mapping[str, Policy | str],
    *,
    runs: int = 100,
    seed: int = FIRST_SEED,
    recorded: int = 3,
    files: Sequence[str | PathLike[str]] = (),
    workers: int = 1,
) -> Leaderboard:
    """Judges policies and scripted methods, and writes the scores, with a record of the first ``recorded`` runs of each.

    ``entries`` are policies, or names of scripted methods, by the names under which they are listed; ``files``, such as
    weights and the program that reads them, are copied into the folder. ``sidestep replay FOLDER/runs/NAME/SEED`` repeats a
    recorded run without the policy, and tells whether the digest is the same.

    Raises InputError when the folder exists already, a name cannot be that of a folder, or a file is not there.
    """
    task = found_task(task)
    complete = Path(folder)
    if complete.exists():
        raise input_error("folder", f"{complete} exists already", "give another name, or delete it")
    for name in entries:
        if not re.fullmatch(r"[\w-][\w.-]*", name):
            raise input_error("entries", f"`{name}` is no name of a folder", "use letters, digits, `_`, `-` and `.`")
    for file in files:
        if not Path(file).is_file():
            raise input_error("files", f"{file} is not there", "give files that exist")
    # Under another name until all is written: a folder with a part of it would be taken for a leaderboard.
    complete.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix=f".{complete.name}-", dir=complete.parent))
    try:
        _write_entries(folder, task, entries, files, Trials(runs, seed, workers, recorded))
        folder.rename(complete)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return Leaderboard.read(complete)


def _write_entries(
    folder: Path,
    task: Task,
    entries: Mapping[str, Policy | str],
    files: Sequence[str | PathLike[str]],
    trials: Trials,
) -> None:
    judgments = {}
    for name, entry in entries.items():
        found, orders = judge_entry(task, name, entry, trials)
        judgments[name] = found
        for k in range(min(trials.kept, trials.runs)):
            place = folder / "runs" / name / str(trials.seed + k)
            if isinstance(entry, str):
                _record_method(place, task, entry, trials.seed + k, found.digests[k])
            else:
                _record_orders(place, task, orders[k], trials.seed + k, found.digests[k])
    (folder / "files").mkdir(parents=True)
    for file in files:
        shutil.copy(file, folder / "files")
    content = {
        "task": task.id,
        "sidestep": __version__,
        "score": task.score.name,
        "meaning": task.score.meaning,
        "is_higher_better": task.score.is_higher_better,
        "files": sorted(path.name for path in (folder / "files").iterdir()),
        "entries": {
            name: {"seeds": found.seeds.tolist(), "scores": found.scores.tolist(), "digests": found.digests}
            for name, found in judgments.items()
        },
    }
    (folder / FILE).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


# The plan of a recorded run ends where the episode ends: it is complete then, and can be verified.


def _record_method(folder: Path, task: Task, method: str, seed: int, digest: str) -> None:
    """Records a run of a scripted method, the same as was judged."""
    cycles = _judged_cycles(task, method, seed)
    folder.parent.mkdir(parents=True, exist_ok=True)
    sim = Simulation(task.scenario(method).set(cycles=cycles), seed=seed, out=folder)
    sim.run()
    _close(sim, digest)


def _record_orders(folder: Path, task: Task, given: Orders, seed: int, digest: str) -> None:
    """Records a run with the orders of a policy that was judged."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    sim = Simulation(task.scenario().set(cycles=len(given)), seed=seed, out=folder)
    number = next(k for k, team in enumerate(sim.teams) if team.action_spaces)
    for orders in given:
        for order, values in orders.items():
            sim.order(order, values, team=number)
        sim.step()
    _close(sim, digest)


def _close(sim: Simulation, digest: str) -> None:
    found = sim.digest
    sim.close()
    if found != digest:
        raise ReplayError(
            f"a recorded run ended with the digest {found}, not {digest}: this is a bug; please report it"
        )


def _judged_cycles(task: Task, method: str, seed: int) -> int:
    """Returns after how many cycles the episode of a scripted method ends."""
    design = task.design(task.setting())
    scenario = task.scenario(method)
    if design.tracker is None:
        return scenario.cycles
    sim = Simulation(scenario, seed=seed)
    team = acting_team(sim.teams)
    everyone = np.ones(len(team), bool)
    tracker = design.tracker(len(team))
    tracker.restart(everyone, sim.observe(team.name))
    while sim.cycle < scenario.cycles and not sim.is_over:
        sim.step()
        seen = sim.observe(team.name)
        tracker.advance(everyone, seen)
        now = {**seen, **tracker.arrays, TIME_LEFT: np.zeros(len(team))}
        if design.is_done is not None and design.is_done(now).all():
            break
    return sim.cycle
