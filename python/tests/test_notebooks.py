"""Output of notebook cells, and the notebooks that are shipped, run as they stand."""

import ast
import json
from html.parser import HTMLParser

import pytest

import sidestep
from sidestep import stats

PNG = b"\x89PNG\r\n\x1a\n"
VOID = {"img", "line", "circle"}


class Balanced(HTMLParser):
    """A reader of HTML that notes elements which are not closed."""

    def __init__(self):
        super().__init__()
        self.open, self.seen = [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.seen.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def elements(thing):
    """The elements that a cell shows of a thing, which must be whole HTML without scripts."""
    reader = Balanced()
    reader.feed(thing._repr_html_())
    reader.close()
    assert reader.open == [] and "script" not in reader.seen
    return reader.seen


def test_scenarios_simulations_and_tables_show_themselves(external, tmp_path):
    scenario = sidestep.Scenario({**external, "name": "<b>&"})
    assert {"table", "img"} <= set(elements(scenario))
    assert "&lt;b&gt;&amp;" in scenario._repr_html_()
    sim = sidestep.Simulation(scenario, record=True)
    sim.run(30)
    before = sim.digest
    assert {"table", "img"} <= set(elements(sim))
    assert sim._repr_png_()[:8] == PNG
    assert sim.digest == before, "looking changes nothing"
    tables = sim.tables()
    assert elements(tables["trajectories"]).count("tr") == 1 + 6
    assert "210 rows" in tables["trajectories"]._repr_html_()
    sim.close()
    assert elements(sim) == ["p"] and sim._repr_png_() is None
    with sidestep.Simulation(external, out=tmp_path / "run"):
        pass
    assert "table" in elements(sidestep.read(tmp_path / "run"))


@pytest.mark.parametrize("world", ["robots", "chain", "airspace"])
def test_every_world_shows_a_picture(world, root):
    scenario = sidestep.Scenario(root / f"scenarios/{world}/default.toml")
    assert "img" in elements(scenario)
    assert elements(sidestep.Simulation(scenario)).count("img") == 1


def test_sweeps_and_comparisons_show_themselves(tmp_path):
    floor = {
        "world": "robots",
        "cycles": 100,
        "map": {"ascii": "......\n......"},
        "robots": {"count": 2, "effector": "nomad"},
    }
    swept = sidestep.sweep(floor, vary={"robots.count": [2, 4]}, replicate=5, out=tmp_path / "s")
    assert "count=4" in swept._repr_html_() and "[" in swept._repr_html_()
    assert "table" in elements(swept)
    assert "10 of 10 runs, 0 failed" in sidestep.sweep_status(tmp_path / "s")._repr_html_()
    found = stats.paired(swept.values("contacts", 1), swept.values("contacts", 0))
    assert {"svg", "table"} <= set(elements(found))
    assert elements(stats.paired([1.0], [2.0]))[0] == "table", "no interval, no drawing"
    four = {"world": "airspace", "airspace": {"shield": "off", "generator": {"kind": "superconflict", "n": 4}}}
    compared = sidestep.compare(four, methods=["mvp", "none"], runs=2)
    assert elements(compared).count("tr") == 3


def shown(value):
    """Returns the output that a front end shows of the last value of a cell."""
    for name in ("_repr_html_", "_repr_png_", "__repr__"):
        if hasattr(value, name):
            return getattr(value, name)()
    return None


NOTEBOOKS = ["robots", "chain", "airspace"]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_from_its_top_to_its_end(name, root, monkeypatch):
    path = root / f"python/examples/{name}.ipynb"
    notebook = json.loads(path.read_text())
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    ids = [cell["id"] for cell in notebook["cells"]]
    assert len(set(ids)) == len(ids)
    monkeypatch.chdir(root / "python/examples")
    names, pictures = {}, 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == [] and cell["execution_count"] is None, "outputs are not kept"
        tree = ast.parse("".join(cell["source"]), f"{path.name} {cell['id']}")
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, path.name, "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), path.name, "eval"), names)
            pictures += "<img" in str(shown(value))
    assert pictures, "a cell shows a picture"


def test_there_is_a_notebook_of_each_world_and_no_other(root):
    found = {path.stem for path in (root / "python/examples").glob("*.ipynb")}
    assert found == set(NOTEBOOKS) == set(sidestep.worlds())
