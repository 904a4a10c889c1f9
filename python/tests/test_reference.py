"""The pages of the reference: what is public is on them, with signatures and texts, and nothing else."""

import importlib.util
import pathlib
import re
import sys
from html.parser import HTMLParser

import pytest

import sidestep

pytest.importorskip("pdoc", reason="pdoc is not installed, so the pages of the reference are not made")
pytest.importorskip("pettingzoo")
pytest.importorskip("matplotlib")


class Page(HTMLParser):
    """The words of the heads and texts of a page by their places in it, and its links."""

    def __init__(self):
        super().__init__()
        self.heads, self.texts, self.ids, self.links = {}, {}, set(), []
        self.place, self.into, self.depth = "", None, 0

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if "id" in attrs:
            self.ids.add(attrs["id"])
        if tag == "a" and "href" in attrs:
            self.links.append(attrs["href"])
        kinds = (attrs.get("class") or "").split()
        if tag == "section" or "classattr" in kinds:
            self.place = attrs.get("id", "")
        if tag == "div":
            self.depth += 1
            if self.into is None and ("attr" in kinds or "docstring" in kinds):
                self.into = (self.heads if "attr" in kinds else self.texts, self.depth)

    def handle_endtag(self, tag):
        if tag == "div":
            if self.into is not None and self.into[1] == self.depth:
                self.into = None
            self.depth -= 1

    def handle_data(self, data):
        if self.into is not None:
            kept = self.into[0]
            kept[self.place] = kept.get(self.place, "") + data


@pytest.fixture(scope="module")
def build():
    path = pathlib.Path(__file__).resolve().parents[1] / "reference/build.py"
    spec = importlib.util.spec_from_file_location("reference_build", path)
    module = sys.modules["reference_build"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages(build, tmp_path_factory):
    """The pages by the names of their modules, and the folder that they are in."""
    folder = tmp_path_factory.mktemp("pages")
    build.write_pages(folder)
    found = {}
    for path in folder.rglob("*.html"):
        page = found[path] = Page()
        page.feed(path.read_text(encoding="utf-8"))
        page.close()
    return found, folder


def page_of(pages, module):
    found, folder = pages
    return found[folder / f"{module.replace('.', '/')}.html"]


def words(text):
    return re.sub(r"\s+", " ", text).strip()


def test_every_public_module_has_a_page_with_all_of_its_names(build, pages):
    modules = build.public_modules()
    assert {"sidestep", "sidestep.envs", "sidestep.plot", "sidestep.stats"} <= set(modules)
    for module in modules:
        page = page_of(pages, module)
        names = [name for name in getattr(sys.modules[module], "__all__", ()) if f"{module}.{name}" not in modules]
        assert [name for name in names if name not in page.ids] == [], module
        without = [name for name in names if not words(page.texts.get(name, "")) and not name.startswith("__")]
        # Under this name it is the class that another page describes.
        assert set(without) <= {"parallel_env"}, module


def test_nothing_private_is_shown(pages):
    for path, page in pages[0].items():
        names = [name for name in page.heads if any(part.startswith("_") for part in name.split("."))]
        assert [name for name in names if not name.endswith("__init__") and name != "__version__"] == [], path
        assert not any("_native" in head for head in page.heads.values()), path


def test_what_is_written_in_rust_has_signatures_with_types(pages):
    page = page_of(pages, "sidestep")
    heads = {name: words(head) for name, head in page.heads.items()}
    for name in ("Arm", "Batch", "Scenario", "Simulation"):
        assert heads[f"{name}.__init__"].startswith(f"{name}( "), name
        assert page.texts[name]
    assert (
        "seed: int | None = None, workers: int = 1, record: bool | Sequence[str] = False"
        in heads["Simulation.__init__"]
    )
    assert heads["Simulation.observe"] == "def observe(self, team: int | str | None = None) -> dict[str, NDArray[Any]]:"
    assert heads["Simulation.digest"] == "digest: str"
    assert heads["Table.select"] == "def select(self, columns: Sequence[str]) -> Table:"
    assert heads["worlds"] == "def worlds() -> list[str]:"
    for name in vars(sidestep.Simulation):
        if not name.startswith("_"):
            assert heads[f"Simulation.{name}"] and page.texts[f"Simulation.{name}"], name
    # In the order of the stub, which is one; Rust's is another in every build.
    assert [name for name in heads if name.startswith("Space.")][:3] == ["Space.name", "Space.shape", "Space.dtype"]


def test_fields_have_the_texts_of_their_comments_and_types_as_written(pages):
    page = page_of(pages, "sidestep.stats")
    assert words(page.heads["Mean.interval"]) == "interval: Interval | None"
    assert words(page.texts["Mean.sd"]) == "Standard deviation (divisor n - 1); None below two values."
    assert "Interval.low" in page.heads and "Interval.low" not in page.texts
    for path, one in pages[0].items():
        said = " ".join([*one.heads.values(), *one.texts.values()])
        for leftover in ("Alias for field", ":class:", ":func:", "numpy._typing", "numpy.dtype", "Ellipsis", " at 0x"):
            assert leftover not in said, (path, leftover)


def test_links_between_pages_lead_somewhere(pages):
    found, _ = pages
    links = 0
    for path, page in found.items():
        for link in page.links:
            if "://" in link:
                continue
            links += 1
            target, _, place = link.partition("#")
            other = path if not target else (path.parent / target).resolve()
            assert other in found, (path, link)
            # A member that is inherited of somebody else's class is not shown, but its class is.
            assert not place or {place, place.rpartition(".")[0]} & found[other].ids, (path, link)
    assert links > 500


def test_what_cannot_be_documented_ends_the_build(build, tmp_path, monkeypatch):
    monkeypatch.setattr(sidestep.stats, "__all__", [*sidestep.stats.__all__, "nowhere"])
    with pytest.raises((AttributeError, UserWarning), match="nowhere"):
        build.write_pages(tmp_path / "pages")


def test_a_folder_with_other_things_is_left_alone(build, tmp_path):
    (tmp_path / "thesis.tex").write_text("all of it")
    with pytest.raises(SystemExit, match="something else in it"):
        build.write_pages(tmp_path)
    assert (tmp_path / "thesis.tex").exists()
