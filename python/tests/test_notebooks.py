"""Output of notebook cells, and the notebooks that are shipped, run as they stand."""

import ast
import base64
import importlib
import io
import json
import os
import pathlib
import re
from html.parser import HTMLParser

import numpy as np
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


class Executed:
    """A notebook whose cells were executed from its top to its end: its names, and what each cell shows."""

    def __init__(self, path, plt):
        self.path, self.names = path, {}
        #: Pictures of Sidestep by the id of their cell, and figures of Matplotlib.
        self.pictures, self.figures = {}, {}
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            if cell["cell_type"] == "code":
                self.execute(cell, plt)

    def execute(self, cell, plt):
        tree = ast.parse("".join(cell["source"]), f"{self.path.name} {cell['id']}")
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, self.path.name, "exec"), self.names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), self.path.name, "eval"), self.names)
            for png in re.findall(r'src="data:image/png;base64,([^"]+)"', str(shown(value))):
                image = plt.imread(io.BytesIO(base64.b64decode(png)))
                self.pictures[cell["id"]] = Picture(image)
        for number in plt.get_fignums():
            figure = plt.figure(number)
            figure.canvas.draw()
            self.figures[cell["id"]] = Drawn(figure)
        plt.close("all")


class Picture:
    """Pixels, with colors from 0 to 1."""

    def __init__(self, image):
        self.image = np.asarray(image, dtype=float)[:, :, :3]
        self.height, self.width = self.image.shape[:2]

    def around(self, column, row, radius):
        """The pixels of a square, (n, 3); none where it lies outside."""
        column, row = round(float(column)), round(float(row))
        rows, columns = (slice(max(at - radius, 0), max(at + radius + 1, 0)) for at in (row, column))
        return self.image[rows, columns].reshape(-1, 3)

    def has(self, color, column, row, radius=0, tolerance=0.12):
        distances = abs(self.around(column, row, radius) - np.asarray(color)).max(axis=1, initial=0)
        return bool(len(distances)) and bool((distances < tolerance).any())

    def share_drawn(self):
        """The share of the pixels that are not white."""
        return float((self.image < 0.95).any(axis=2).mean())

    def are_colored(self):
        """Which pixels have a color that is no gray."""
        return self.image.max(axis=2) - self.image.min(axis=2) > 0.25


class Drawn(Picture):
    """A figure of Matplotlib, whose pixels are found by places in its axes."""

    def __init__(self, figure):
        super().__init__(np.asarray(figure.canvas.buffer_rgba())[:, :, :3] / 255)
        self.axes = figure.axes

    def shows(self, axes, color, x, y, radius=1, tolerance=0.12):
        """Whether the color is at the place in the axes; rows count from above."""
        column, above_bottom = axes.transData.transform((x, y))
        return self.has(to_rgb(color), column, self.height - 1 - above_bottom, radius, tolerance)


def to_rgb(color):
    return color if isinstance(color, tuple) else importlib.import_module("matplotlib.colors").to_rgb(color)


DARK = "0.3"
#: A line of one point lies over two rows of pixels, of which none may have more than 70 % of its color.
THIN = 0.3
#: The colors of Matplotlib's first lines.
FIRST, SECOND = "#1f77b4", "#ff7f0e"


@pytest.fixture(scope="module")
def executed():
    """Executes a notebook, once for all tests."""
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not installed, so notebooks are not executed")
    matplotlib.use("Agg")
    plt = importlib.import_module("matplotlib.pyplot")
    done = {}

    def execute(name):
        if name not in done:
            folder = pathlib.Path(__file__).resolve().parents[1] / "examples"
            before = pathlib.Path.cwd()
            os.chdir(folder)
            try:
                # Without the settings of whoever runs the tests.
                with plt.style.context("default"):
                    done[name] = Executed(folder / f"{name}.ipynb", plt)
            finally:
                os.chdir(before)
        return done[name]

    return execute


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_kept_without_outputs(name, root):
    notebook = json.loads((root / f"python/examples/{name}.ipynb").read_text(encoding="utf-8"))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    ids = [cell["id"] for cell in notebook["cells"]]
    assert len(set(ids)) == len(ids)
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None, "outputs are not kept"


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_from_its_top_to_its_end(name, executed):
    notebook = executed(name)
    assert notebook.pictures, "a cell shows a picture"
    assert notebook.figures, "a cell shows a figure"
    for cell, picture in notebook.pictures.items():
        assert min(picture.width, picture.height) >= 120 and max(picture.width, picture.height) >= 480, cell
        assert 0.01 < picture.share_drawn() < 0.5, (cell, picture.share_drawn())
        assert picture.are_colored().mean() > 0.002, cell
    for cell, figure in notebook.figures.items():
        assert 0.01 < figure.share_drawn() < 0.5, (cell, figure.share_drawn())
        for axes in figure.axes:
            assert re.search(r", m$|^cycle$", axes.get_xlabel()) and re.search(r", m$", axes.get_ylabel()), cell
            assert all(text.get_fontsize() >= 8 for text in axes.get_xticklabels()), cell


def test_pictures_of_the_hall_have_each_wall_robot_and_person_at_its_place(executed):
    notebook = executed("robots")
    hall = notebook.names["HALL"].split()
    start = sidestep.Simulation(notebook.names["scenario"])
    runs = {"robots-1": start, "robots-3": notebook.names["sim"], "robots-8": notebook.names["decided"]}
    assert set(runs) == set(notebook.pictures)
    for cell, sim in runs.items():
        picture, frame = notebook.pictures[cell], sim.frame()
        box_px = picture.width / len(hall[0])
        boxes = [
            (round(x_m / 0.25 - 0.5), len(hall) - 1 - round(y_m / 0.25 - 0.5))
            for x_m, y_m in zip(frame["x_m"], frame["y_m"])
        ]
        kinds = dict(zip(boxes, list(frame["kind"])))
        assert len(kinds) == 15, "12 robots and 3 persons"
        for row, line in enumerate(hall):
            for column, letter in enumerate(line):
                # Beside the arrow in the middle of a robot.
                at = ((column + 0.2) * box_px, (row + 0.2) * box_px)
                color = picture.around(*at, 0)[0]
                spread = color.max() - color.min()
                kind = kinds.get((column, row), "wall" if letter == "#" else "floor")
                is_shown = {
                    "wall": spread < 0.05 and color.max() < 0.35,
                    "floor": color.min() > 0.95,
                    "robot": spread > 0.25,
                    "person": spread < 0.05 and 0.4 < color.max() < 0.9,
                }[kind]
                assert is_shown, (cell, column, row, kind, color)


def test_the_figure_of_the_hall_has_walls_track_and_contacts_in_meters(executed):
    notebook = executed("robots")
    figure, names = notebook.figures["robots-12"], notebook.names
    (axes,) = figure.axes
    hall = names["HALL"].split()
    for row, line in enumerate(hall):
        for column, letter in enumerate(line):
            if letter == "#":
                assert figure.shows(axes, DARK, 0.25 * column, 0.25 * (len(hall) - 1 - row)), (column, row)
    track = names["x_m"][:, 8], names["y_m"][:, 8]
    places = names["places"]
    assert (places.x_m[places.agent == 8] == track[0]).all() and (places.y_m[places.agent == 8] == track[1]).all()
    assert all(figure.shows(axes, FIRST, x, y, tolerance=THIN) for x, y in zip(*track))
    for x, y, kind in zip(*at_contacts(names), names["events"]["kind"][names["is_contact"]]):
        boxes = [(round(x / 0.25) + dx, len(hall) - 1 - round(y / 0.25) + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
        inside = [box for box in boxes if 0 <= box[0] < len(hall[0]) and 0 <= box[1] < len(hall)]
        is_beside_wall = len(inside) < 9 or any(hall[row][column] == "#" for column, row in inside)
        assert kind != "wall" or is_beside_wall, (x, y)
    contacts = list(zip(*at_contacts(names)))
    assert len(contacts) == names["is_contact"].sum() > 50
    on_track = set(zip(*track))
    assert all(figure.shows(axes, "black", x, y) for x, y in contacts if (x, y) not in on_track)
    assert any((x, y) not in on_track for x, y in contacts)
    ends = track[0][-1], track[1][-1]
    column, above = axes.transData.transform(ends)
    assert (abs(figure.around(column, figure.height - 1 - above, 1) - to_rgb(FIRST)) < 0.12).all(), "a dot at its end"


def at_contacts(names):
    return names["x_m"][names["at"]], names["y_m"][names["at"]]


def test_figures_of_the_chain_have_connectors_pillar_and_target_in_meters(executed):
    notebook = executed("chain")
    names = notebook.names
    start = sidestep.Simulation(names["scenario"]).observe()["joints_m"][0]
    end = names["sim"].observe()["joints_m"][0]
    chains = {"chain-1": [(FIRST, start)], "chain-10": [(FIRST, names["stopped"]), (SECOND, end)]}
    assert set(chains) == set(notebook.figures)
    for cell, drawn in chains.items():
        figure = notebook.figures[cell]
        (axes,) = figure.axes
        pillar = names["PILLAR"]
        x_m, y_m = pillar["at_m"]
        for angle in np.arange(0, 360, 30) * np.pi / 180:
            for share in (0, 0.5, 0.8):
                radius_m = share * pillar["radius_m"]
                assert figure.shows(axes, DARK, x_m + radius_m * np.cos(angle), y_m + radius_m * np.sin(angle)), cell
        assert cell != "chain-1" or figure.shows(axes, "black", *names["TARGET"])
        for color, joints_m in drawn:
            assert len(joints_m) == 8
            rods_m = (joints_m[1:] + joints_m[:-1]) / 2
            assert all(figure.shows(axes, color, *place) for place in [*joints_m, *rods_m]), (cell, color)
    assert np.linalg.norm(end[0] - names["TARGET"]) < 0.05, "it is beyond the pillar"
    assert (names["stopped"][:, 0] < pillar["at_m"][0]).all()


def test_the_picture_of_the_chain_has_each_connector_beside_the_pillar(executed):
    notebook = executed("chain")
    picture, joints_m = notebook.pictures["chain-11"], notebook.names["sim"].observe()["joints_m"][0]
    blue = (0.0, 0.447, 0.698)
    rows, columns = np.nonzero((abs(picture.image - blue) < 0.1).all(axis=2))
    # Connectors at both ends are circles of one size.
    radius_px = 10.5
    low_m, high_m = joints_m.min(axis=0), joints_m.max(axis=0)
    px_per_m = (columns.max() - columns.min() - 2 * radius_px) / (high_m[0] - low_m[0])

    def pixel(x_m, y_m):
        column = columns.min() + radius_px + (x_m - low_m[0]) * px_per_m
        return column, rows.min() + radius_px + (high_m[1] - y_m) * px_per_m

    assert all(picture.has(blue, *pixel(*place), radius=2) for place in joints_m)
    assert all(picture.has(blue, *pixel(*place), radius=3) for place in (joints_m[1:] + joints_m[:-1]) / 2)
    x_m, y_m = notebook.names["PILLAR"]["at_m"]
    for off_m in (-0.2, 0, 0.2):
        assert picture.has((0.24, 0.24, 0.24), *pixel(x_m + off_m, y_m + 0.05)), off_m
    assert not picture.has((0.24, 0.24, 0.24), *pixel(x_m + 0.6, y_m + 0.05), radius=5)


def test_the_picture_of_the_traffic_has_each_airplane_at_its_place(executed):
    notebook = executed("airspace")
    picture, sim = notebook.pictures["airspace-1"], sidestep.Simulation(notebook.names["scenario"], seed=1)
    sim.step(20)
    frame = sim.frame()
    is_airplane = np.array(list(frame["kind"])) == "airplane"
    places_m = np.stack([frame["x_m"], frame["y_m"]], axis=1)[is_airplane]
    assert len(places_m) == 8
    colored = picture.are_colored()

    def airplanes(turned_rad, px_per_m):
        """The number of airplanes at whose places are a dozen colored pixels; the plan is square, with its words below."""
        sine, cosine = np.sin(turned_rad), np.cos(turned_rad)
        middle = picture.width / 2
        found = 0
        for x_m, y_m in places_m @ np.array([[cosine, sine], [-sine, cosine]]):
            column, row = round(middle + x_m * px_per_m), round(middle - y_m * px_per_m)
            found += colored[max(row - 4, 0) : row + 5, max(column - 4, 0) : column + 5].sum() >= 12
        return found

    scales = np.linspace(0.4, 0.5, 101) * picture.width / abs(places_m).max()
    best = max(scales, key=lambda scale: airplanes(0, scale))
    assert airplanes(0, best) == 8
    assert airplanes(np.pi / 8, best) == 0, "nothing colored is between them"


def test_the_figure_of_the_traffic_has_tracks_and_the_nearest_two(executed):
    notebook = executed("airspace")
    figure, names = notebook.figures["airspace-9"], notebook.names
    tracks, nearest = figure.axes
    places = importlib.import_module("sidestep.plot").places(names["rows"])
    for agent in range(8):
        own = places.agent == agent
        color = tracks.lines[2 * agent].get_color()
        assert figure.shows(tracks, color, places.x_m[own][-1], places.y_m[own][-1]), agent
        # Tracks of airplanes that fly toward each other cover each other in part.
        is_shown = [
            figure.shows(tracks, color, *place, tolerance=THIN) for place in zip(places.x_m[own], places.y_m[own])
        ]
        assert np.mean(is_shown) > (0.3 if agent < 4 else 0.9), agent
    assert len({line.get_color() for line in tracks.lines}) == 8
    pc, none, required = nearest.lines
    assert [text.get_text() for text in nearest.get_legend().get_texts()] == ["pc", "none", "required"]
    assert required.get_ydata()[0] == 500 < pc.get_ydata().min() and none.get_ydata().min() < 100
    in_view = [cycle for cycle in range(152, 194) if pc.get_ydata()[cycle] < 2900]
    for line, color in ((pc, FIRST), (none, SECOND)):
        shown_at = [figure.shows(nearest, color, cycle, line.get_ydata()[cycle], tolerance=THIN) for cycle in in_view]
        # Where they cross, one of them covers the other.
        assert np.mean(shown_at) > 0.8, color
    assert figure.shows(nearest, "0.4", 151, 500, radius=3)


def test_a_picture_with_a_body_elsewhere_is_told(executed):
    """The tests above would notice it: a place without a connector has not its color."""
    figure = executed("chain").figures["chain-1"]
    (axes,) = figure.axes
    assert not figure.shows(axes, FIRST, 0.5, 0.0) and not figure.shows(axes, DARK, 1.6, -0.2)
    assert not figure.has((0, 0, 0), -50, -50, radius=2), "nothing is outside"


def test_there_is_a_notebook_of_each_world_and_no_other(root):
    found = {path.stem for path in (root / "python/examples").glob("*.ipynb")}
    assert found == set(NOTEBOOKS) == set(sidestep.worlds())
