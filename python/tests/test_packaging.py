"""What is written of the package for those who install it: extras, the recipe for conda, workflows, and advice."""

import ast
import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

# Python 3.10 has none of its own; pytest brings this one there.
try:
    import tomllib
except ImportError:
    tomllib = pytest.importorskip("tomli")

#: Distributions whose packages for conda have other names.
CONDA = {"matplotlib": "matplotlib-base", "ray": "ray-core"}
#: Modules that have other names than the distributions that bring them.
BROUGHT_BY = {
    "stable_baselines3": "stable-baselines3",
    "tensordict": "torchrl",
    "torch": "torchrl",
    "typing_extensions": "gymnasium",
}
#: Extras that are for work on the package itself.
OWN = {"all", "docs", "test"}


@pytest.fixture(scope="module")
def root():
    return pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def project(root):
    return tomllib.loads((root / "python/pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def workspace(root):
    return tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]


@pytest.fixture(scope="module")
def sources(root):
    folder = root / "python/sidestep"
    if not folder.exists():
        pytest.skip("the sources of the package are not beside its tests")
    return sorted(folder.rglob("*.py"))


@pytest.fixture(scope="module")
def yaml():
    return pytest.importorskip("yaml", reason="pyyaml is not installed, so recipe and workflows are not read")


@pytest.fixture(scope="module")
def recipe(root, yaml):
    """The recipe, with the values of its `context` in place."""
    text = (root / "python/conda/recipe.yaml").read_text(encoding="utf-8")
    context = yaml.safe_load(text)["context"]
    return yaml.safe_load(re.sub(r"\$\{\{ (\w+) \}\}", lambda found: str(context.get(found[1], found[0])), text))


def requirement(text):
    """Returns name and version of `minari[hdf5]>=0.5`."""
    name, version = re.fullmatch(r"([A-Za-z0-9_-]+)(?:\[[\w,]+\])?(.*)", text).groups()
    return name, version


def requirements(texts):
    return dict(requirement(text) for text in texts)


def conda(texts):
    """Returns the versions of a recipe's requirements by their names."""
    words = (text.split(maxsplit=1) for text in texts if isinstance(text, str))
    return {one[0]: "".join(one[1:]) for one in words}


# Extras


def test_the_extra_all_has_what_all_others_have(project):
    extras = project["optional-dependencies"]
    optional = [text for name, texts in extras.items() if name not in OWN for text in texts]
    assert extras["all"] == optional
    assert set(extras) == OWN | {"dask", "datasets", "learners", "plot", "progress", "ray", "rl"}


def test_what_the_package_imports_is_required_or_in_an_extra(sources, project):
    known = set(requirements([*project["dependencies"], *project["optional-dependencies"]["all"]]))
    standard = {"sidestep", *sys.stdlib_module_names}
    unknown = {}
    for path in sources:
        for name in imported(ast.parse(path.read_text(encoding="utf-8"))):
            if BROUGHT_BY.get(name, name) not in known | standard:
                unknown[name] = path.name
    assert unknown == {}


def imported(tree):
    """Yields the names of modules that a file imports, by statements and by `import_module`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name.partition(".")[0] for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.partition(".")[0]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            constants = [one.value for one in node.args[:1] if isinstance(one, ast.Constant)]
            yield from (name.partition(".")[0] for name in constants)


def test_classifiers_name_the_pythons_that_are_promised_and_no_license(project):
    classifiers = project["classifiers"]
    assert classifiers == sorted(set(classifiers))
    assert project["license"] == "MIT OR Apache-2.0"
    assert not any(one.startswith("License ::") for one in classifiers), "an SPDX expression stands alone"
    pythons = [one.rpartition(" ")[2] for one in classifiers if re.search(r"Python :: 3\.\d+$", one)]
    assert pythons == [f"3.{minor}" for minor in range(10, 15)]
    assert project["requires-python"] == f">={pythons[0]}"
    for system in ("MacOS", "Microsoft :: Windows", "POSIX :: Linux"):
        assert f"Operating System :: {system}" in classifiers
    assert {"Homepage", "Documentation", "Repository", "Issues", "Changelog"} <= set(project["urls"])


def test_classifiers_are_those_that_there_are(project):
    known = pytest.importorskip("trove_classifiers", reason="the list of classifiers is not installed").classifiers
    assert [one for one in project["classifiers"] if one not in known] == []


def test_the_licenses_of_the_package_are_those_of_the_repository(root, project):
    """Copies, because a package may name files of its own folder only, and links are files of text on Windows."""
    assert project["license-files"] == ["LICENSE-APACHE", "LICENSE-MIT"]
    for name in project["license-files"]:
        assert (root / "python" / name).read_bytes() == (root / name).read_bytes(), name


# The recipe for conda


def test_the_recipe_has_name_and_version_of_the_package(recipe, project, workspace):
    assert recipe["schema_version"] == 1
    assert recipe["package"] == {"name": project["name"], "version": workspace["version"]}
    assert recipe["context"]["python_min"] == project["requires-python"].removeprefix(">=")
    assert recipe["about"]["license"] == project["license"] == workspace["license"]
    assert recipe["about"]["summary"] == project["description"]
    assert recipe["about"]["homepage"] == project["urls"]["Homepage"] == workspace["repository"]


def test_the_recipe_is_built_of_the_tree_that_it_is_in(root, recipe):
    assert (root / "python/conda" / recipe["source"]["path"]).resolve() == root
    script = recipe["build"]["script"]
    assert "cd python/native" in script["content"][0]
    assert "pip install .. " in script["content"][-1] and "--no-build-isolation" in script["content"][-1]
    assert script["env"] == {"MATURIN_PEP517_ARGS": "--locked"}
    for name in recipe["about"]["license_file"]:
        assert (root / name).exists() or f"--output ../../{name}" in script["content"][1]


def test_the_recipe_requires_what_the_package_requires(root, recipe, project, workspace):
    needs = recipe["requirements"]
    oldest = recipe["context"]["python_min"]
    required = {"python": f">={oldest}", **requirements(project["dependencies"])}
    assert conda(needs["run"]) == required
    assert conda(needs["host"])["python-abi3"] == f"{oldest}.*"
    assert conda(needs["build"])["rust"] == f">={workspace['rust-version']}"
    build = tomllib.loads((root / "python/pyproject.toml").read_text(encoding="utf-8"))["build-system"]
    assert conda(needs["host"])["maturin"] == requirements(build["requires"])["maturin"]
    optional = requirements(project["optional-dependencies"]["all"])
    assert conda(needs["run_constraints"]) == {CONDA.get(name, name): version for name, version in optional.items()}
    features = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["dependencies"]["pyo3"]
    assert features["features"] == [f"abi3-py{oldest.replace('.', '')}"], "one package for all Pythons"
    assert recipe["build"]["python"]["version_independent"] is True


def test_the_recipe_tests_what_it_has_built(root, recipe, project):
    imports, symbols, tests = recipe["tests"]
    python = imports["python"]
    assert python["python_version"] == [f"{recipe['context']['python_min']}.*", "*"]
    for name in python["imports"]:
        assert importlib.util.find_spec(name), name
    assert symbols["requirements"]["run"] == ["abi3audit"]
    assert tests["script"] == ["python -m pytest python/tests"]
    known = {}
    for texts in project["optional-dependencies"].values():
        known |= {CONDA.get(name, name): version for name, version in requirements(texts).items()}
    for name, version in conda(tests["requirements"]["run"]).items():
        assert known[name] == version, name
    for path in tests["files"]["source"]:
        assert (root / path).exists(), path


# Workflows


def test_workflows_are_whole_and_a_release_has_a_wheel_for_each_system(root, yaml):
    folder = root / ".github/workflows"
    if not folder.exists():
        pytest.skip("there are no workflows beside the tests")
    read = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8")) for path in folder.glob("*.yml")}
    assert {"nightly", "pull-request", "release"} <= set(read)
    jobs = read["release"]["jobs"]
    wheels = [one["target"] for one in jobs["wheels"]["strategy"]["matrix"]["include"]]
    assert sorted(wheels) == [
        "aarch64-apple-darwin",
        "aarch64-unknown-linux-gnu",
        "x86_64-apple-darwin",
        "x86_64-pc-windows-msvc",
        "x86_64-unknown-linux-gnu",
    ]
    pythons = [step["id"] for step in jobs["wheels"]["steps"] if "setup-python" in step.get("uses", "")]
    commands = len(jobs["command"]["strategy"]["matrix"]["include"])
    check = next(step["run"] for step in jobs["release"]["steps"] if step.get("name") == "All or nothing")
    counts = [int(count) for count in re.findall(r"wc -l\)\" = (\d+)", check)]
    assert counts == [commands, len(wheels) * len(pythons)]


# Advice


#: `pip install sidestep`, with options, an extra or a version, in any quotes. The name in the public index is not ours.
#: What is installed from a folder (`./python`) or a file has a `/` or `.whl` in it.
FROM_INDEX = re.compile(
    r"""(?:\b(?:pip3?|pipx|uv|poetry|pdm|conda|mamba|pixi)\s+(?:pip\s+)?(?:install|add)\b
         (?:\s+(?:-{1,2}[\w-]+(?:=\S+)?|['"`]?[\w.-]+(?:\[[\w,-]*\])?(?:[<>=!~]=?[\w.*]+)?['"`]?))*?
         \s+['"`\\]*sidestep(?:\[[\w,\s-]*\])?(?![\w/.-]))
        |(?:['"`\s=]sidestep\[(?:all|dask|datasets|docs|learners|plot|progress|ray|rl|test)[\w,\s-]*\])""",
    re.X,
)


@pytest.mark.parametrize(
    "advice",
    [
        "pip install 'sidestep[rl]'",
        "pip install sidestep",
        "`pip install --upgrade sidestep`",
        "pip3 install -U numpy sidestep==0.1",
        'python -m pip install "sidestep[plot,rl]"',
        "!pip install sidestep",
        "uv add sidestep",
        "uv pip install sidestep[rl]",
        "conda install -c conda-forge sidestep",
        'extras: "sidestep[rl]"',
    ],
)
def test_advice_to_install_from_an_index_is_found(advice):
    assert FROM_INDEX.search(advice)


@pytest.mark.parametrize(
    "advice",
    [
        "pip install ./python",
        "pip install './python[rl]'",
        "pip install 'gymnasium>=1.0' 'pettingzoo>=1.24'",
        "pip install dist/sidestep-0.1.0-cp310-abi3-linux_x86_64.whl",
        "pip install sidestep-0.1.0-cp310-abi3-linux_x86_64.whl",
        "pip install ./python  # then `import sidestep`",
        "cargo install --path crates/cli",
        'alone -m pip install --quiet --only-binary :all: "$wheel[plot,rl,test]"',
        "cd sidestep && pip install ./python",
    ],
)
def test_advice_that_works_in_a_clone_is_not_found(advice):
    assert not FROM_INDEX.search(advice)


def test_nothing_advises_to_install_a_package_that_is_not_ours(root):
    """Files that git knows or would know: whoever pastes such a line gets somebody else's package."""
    if shutil.which("git") is None or not (root / ".git").exists():
        pytest.skip("git is not here, or this is no clone")
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    told = subprocess.run(listed, cwd=root, capture_output=True, check=True)
    names = [name for name in told.stdout.decode().split("\0") if name]
    assert len(names) > 500
    found = []
    for name in names:
        path = root / name
        if path == pathlib.Path(__file__).resolve() or not path.is_file():
            continue
        data = path.read_bytes()
        if b"sidestep" not in data or b"\0" in data[:8000]:
            continue
        text = data.decode("utf-8", "replace")
        found += [f"{name}: {one[0].strip()}" for one in FROM_INDEX.finditer(text)]
    assert found == []


def test_advice_names_the_versions_of_the_extras(sources, project):
    """Error messages and texts name packages, with versions: those that the extras have."""
    versions = requirements(project["optional-dependencies"]["all"])
    advised = {}
    for path in sources:
        for line in path.read_text(encoding="utf-8").splitlines():
            if "pip install" in line:
                named = re.findall(r"'([\w-]+)(?:\[[\w,]+\])?(>=[\d.]+)'", line.partition("pip install")[2])
                assert named, f"{path.name}: {line.strip()}"
                advised |= dict(named)
    assert {"gymnasium", "pettingzoo", "matplotlib", "ray"} <= set(advised)
    for name, version in advised.items():
        assert versions[name] == version, name
