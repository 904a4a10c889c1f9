import os
import pathlib
import signal

import pytest

# Programs that a shell starts in the background ignore Ctrl-C, which tests send to themselves.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).resolve().parents[2]

EXTERNAL = {
    "world": "robots",
    "seed": 7,
    "cycles": 200,
    "map": {"ascii": "..........\n..........\n....##....\n..........\n.........."},
    "radio": {"range_m": 100},
    "robots": [
        {
            "count": 5,
            "sensors": ["sonar-8"],
            "effector": "nomad",
            "behaviour": {"kind": "external"},
        },
        {"count": 2},
    ],
}


@pytest.fixture
def external():
    return EXTERNAL


@pytest.fixture
def command():
    """The path of the command that was built with the package."""
    name = "sidestep.exe" if os.name == "nt" else "sidestep"
    path = os.environ.get("SIDESTEP_BINARY") or ROOT / "target" / "release" / name
    if not pathlib.Path(path).exists():
        if "package" in os.environ.get("SIDESTEP_REQUIRE", ""):
            pytest.fail(f"no command at {path}")
        pytest.skip(f"no command at {path}: build it with `cargo build --release`")
    return path


@pytest.fixture
def root():
    return ROOT
