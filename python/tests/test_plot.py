"""Figures of runs of all three worlds."""

import numpy as np
import pytest

import sidestep

matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not installed, so figures are not tested")
matplotlib.use("Agg")

from sidestep import plot  # noqa: E402

SCENARIOS = {
    "robots": "scenarios/robots/default.toml",
    "airspace": "scenarios/airspace/superconflict.toml",
    "chain": "scenarios/chain/default.toml",
}


@pytest.fixture(params=SCENARIOS)
def run(request, root):
    sim = sidestep.Simulation(root / SCENARIOS[request.param], record=True)
    sim.run(40)
    return sim


def test_tracks_end_where_the_snapshot_has_the_bodies(run):
    last = run.snapshot()["at_m"][:, :2]
    run.step()
    rows = run.tables()
    ax = plot.tracks(rows)
    ends = [line.get_xydata()[-1] for line in ax.lines if line.get_marker() == "o"]
    assert ends
    # Of a body on a grid the rows have a corner, half a body away from its middle.
    slack_m = 1.0 if "col_boxes" in rows["trajectories"] else 1e-9
    for end in ends:
        assert np.hypot(*(last - end).T).min() <= slack_m


def test_separation_is_that_of_the_places(root):
    sim = sidestep.Simulation(root / SCENARIOS["airspace"], record=True)
    sim.run(10)
    rows = sim.tables()
    line = plot.separation(rows, limit_m=5.0).lines[0]
    where = plot.places(rows)
    first = where.cycle == 0
    points = np.stack([where.x_m[first], where.y_m[first]], axis=1)
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    assert len(line.get_xdata()) == 10
    assert line.get_ydata()[0] == pytest.approx(apart[~np.eye(len(points), dtype=bool)].min())


def test_groups_are_counted(root, tmp_path):
    robots = sidestep.Simulation(root / SCENARIOS["robots"])
    robots.run(40)
    counts = [bar.get_height() for bar in plot.groups(robots).patches]
    assert counts == robots.metrics()["group_sizes"]
    with sidestep.Simulation(root / SCENARIOS["airspace"], out=tmp_path / "run") as airplanes:
        airplanes.run(40)
    total = sum(bar.get_height() for bar in plot.groups(tmp_path / "run").patches)
    assert total == len(sidestep.read(tmp_path / "run")["optimizations"])
    with pytest.raises(sidestep.InputError, match="give the run's folder or tables"):
        plot.groups({"optimizations": 3})
    with pytest.raises(sidestep.InputError, match="no table `optimizations`"):
        plot.groups({})


def test_one_agent_has_no_separation(root):
    sim = sidestep.Simulation(root / "scenarios/robots/one-robot.toml", record=True)
    sim.step(3)
    with pytest.raises(sidestep.InputError, match="fewer than two agents"):
        plot.separation(sim.tables())
