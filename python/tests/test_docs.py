"""The README, the book's chapter and the docstrings run as they stand."""

import doctest
import importlib.util
import inspect
import re

import pytest

import sidestep
from sidestep import _native


@pytest.mark.parametrize("page", ["README.md", "python/README.md", "docs/src/python.md"])
def test_the_code_of_a_page_runs_from_its_top_to_its_end(page, root, monkeypatch):
    monkeypatch.chdir(root)
    blocks = re.findall(r"^```python\n(.*?)^```", (root / page).read_text(), re.M | re.S)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


#: What is written in Python, and no part of a module of its own.
OF_PYTHON = (
    "Agent",
    "Compared",
    "Each",
    "Placed",
    "Reached",
    "Sweep",
    "SweepStatus",
    "Tables",
    "compare",
    "each",
    "fk",
    "ik",
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
    yield sidestep.__doc__
    for name, thing in public():
        assert inspect.getdoc(thing), f"{name} says nothing of itself"
        yield thing.__doc__
        if inspect.isclass(thing):
            for method, member in vars(thing).items():
                if not method.startswith("_"):
                    assert inspect.getdoc(member), f"{name}.{method} says nothing of itself"
                    yield member.__doc__


def test_everything_is_documented_and_its_examples_run(root, monkeypatch):
    monkeypatch.chdir(root)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for k, text in enumerate(documented()):
        runner.run(parser.get_doctest(text or "", {}, f"docstring {k}", None, 0))
    told = runner.summarize(verbose=False)
    assert told.failed == 0
    assert told.attempted > 5
