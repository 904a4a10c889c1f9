"""The README, the book's chapter and the docstrings run as they stand."""

import doctest
import importlib.util
import inspect
import re

import pytest

import sidestep
from sidestep import _native


PAGES = ["README.md", "python/README.md", "docs/src/python.md", "docs/src/planners.md", "docs/src/tasks.md"]


@pytest.mark.parametrize("page", PAGES)
def test_the_code_of_a_page_runs_from_its_top_to_its_end(page, root, monkeypatch):
    monkeypatch.chdir(root)
    blocks = re.findall(r"^```python\n(.*?)^```", (root / page).read_text(), re.M | re.S)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


#: Names written in Python that belong to no module of their own.
OF_PYTHON = (
    "Agent",
    "Comparison",
    "Each",
    "FkResult",
    "Fleet",
    "FleetStatus",
    "Finding",
    "IkResult",
    "ImportReport",
    "NodeStatus",
    "Sweep",
    "SweepStatus",
    "Tables",
    "compare",
    "each",
    "fk",
    "ik",
    "inspect",
    "read",
    "sweep",
    "sweep_status",
)


def public():
    """Everything public, by its name."""
    modules = [sidestep.stats, sidestep.collectives, sidestep.learn]
    if importlib.util.find_spec("matplotlib"):
        modules.append(importlib.import_module("sidestep.plot"))
    for module in modules:
        yield module.__name__, module
        for name in module.__all__:
            yield f"{module.__name__}.{name}", getattr(module, name)
    yield from ((name, thing) for name, thing in vars(_native).items() if not name.startswith("_"))
    for name in OF_PYTHON:
        yield name, getattr(sidestep, name)


def documented():
    """Everything public, with its docstring; the examples of a method go on from those of its class."""
    yield "sidestep", sidestep, sidestep.__doc__
    for name, thing in public():
        assert inspect.getdoc(thing), f"{name} says nothing of itself"
        yield name, thing, thing.__doc__
        if inspect.isclass(thing):
            for method, member in vars(thing).items():
                if not method.startswith("_"):
                    assert inspect.getdoc(member), f"{name}.{method} says nothing of itself"
                    yield f"{name}.{method}", member, f"{inspect.getdoc(thing)}\n\n{inspect.getdoc(member)}"


def environments():
    """Names that are documented of environments, where they are installed."""
    if importlib.util.find_spec("pettingzoo"):
        for name in ("envs", "envs.robots_v0", "envs.chain_v0", "envs.airspace_v0"):
            module = importlib.import_module(f"sidestep.{name}")
            yield name, module, module.__doc__


def test_everything_is_documented_and_its_examples_run(root, monkeypatch):
    monkeypatch.chdir(root)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for name, _, text in [*documented(), *environments()]:
        runner.run(parser.get_doctest(text or "", {}, name, None, 0))
    told = runner.summarize(verbose=False)
    assert told.failed == 0
    assert told.attempted > 100


def test_every_function_and_method_has_an_example():
    """Attributes need none, and neither do functions that the package's own modules stand on."""
    own = {
        "rebuild", "unpack_arm", "unpack_batch", "unpack_learned", "unpack_scenario", "unpack_space", "unpack_table", "unpack_team", "rows_by_name", "table_names", "run_sweep", "run_task", "compare_methods",
        "learn_effector", "learn_sensor", "minimize_objective", "minimize_pairs", "Arm.forward", "Arm.inverse",
        "arm_trajectories",
    }  # fmt: skip
    # Those that have their example where they are made.
    elsewhere = {"Learned.profile", "sidestep.learn.Learned.profile", "Each.of_team", "Agent.decide"}
    own |= {name for name in vars(_native) if name.startswith("stats_")} | elsewhere
    own |= {"inspect", "read", "sweep_status", "write_clean"}
    own |= {f"LogColumns.{name}" for name in vars(_native.LogColumns)}
    without = [
        name
        for name, thing, _ in documented()
        if inspect.isroutine(thing) and not inspect.isdatadescriptor(thing) and name not in own
        if ">>>" not in (inspect.getdoc(thing) or "")
    ]
    assert without == []
    for thing in (sidestep.inspect, sidestep.read, sidestep.sweep_status):
        assert ">>>" in (inspect.getdoc(thing) or "")
