"""The README, the book's chapter and the docstrings run as they stand."""

import doctest
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


def documented():
    yield sidestep.__doc__
    for name, thing in vars(_native).items():
        if name.startswith("_"):
            continue
        assert inspect.getdoc(thing), f"{name} says nothing of itself"
        yield thing.__doc__
        if inspect.isclass(thing):
            for method, member in vars(thing).items():
                if not method.startswith("_"):
                    assert inspect.getdoc(member), f"{name}.{method} says nothing of itself"
                    yield member.__doc__


def test_everything_is_documented_and_its_examples_run():
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    for k, text in enumerate(documented()):
        runner.run(parser.get_doctest(text or "", {}, f"docstring {k}", None, 0))
    told = runner.summarize(verbose=False)
    assert told.failed == 0
    assert told.attempted > 5
