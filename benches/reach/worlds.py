"""Worlds of one chain that goes to targets in empty space, by the kind of its base."""

from dataclasses import dataclass

import numpy as np

ROD_M = 0.3
RADIUS_M = 0.02
ROD_RADIUS_M = 0.01
#: Half the length of a rail, and the half sides of a box, meters.
RAIL_M = 3.0
BOX_M = (1.0, 0.25, 0.5)
#: Distance of each of two fixed ends from the middle, as a fraction of half the length of the chain.
END_FRACTION = 0.55
#: Part of its reach within which a chain has its targets.
REACH_FRACTION = 0.95
TOLERANCE_M = 0.005
SPEED_M_S = 0.5
DT_S = 0.02
#: Cycles after which a run ends: as many as a chain would need that crossed its reach forty times for each target.
MOST_CYCLES = 200_000


@dataclass
class World:
    """A chain from its tip, connector 0, to its base, its last connector, with the targets of one connector."""

    base: str
    dimensions: int
    points: np.ndarray
    rod_m: tuple
    radius_m: float
    rod_radius_m: float
    leader: int
    targets: np.ndarray

    @property
    def name(self):
        return f"{self.base} {len(self.points) - 1} in {self.dimensions}-D"

    def text(self, cycles=MOST_CYCLES):
        """Returns the scenario."""

        def row(point):
            return "[" + ", ".join(repr(float(x)) for x in point) + "]"

        def rows(points):
            return "[" + ", ".join(row(point) for point in points) + "]"

        least_m, most_m = self.rod_m
        limits = "".join(
            f"[[chains.limits]]\nconnector = {k}\nmobility = {mobility}\n" for k, mobility in self.mobilities()
        )
        return (
            f'format = 1\nworld = "chain"\nseed = 1\ncycles = {cycles}\n'
            f"[chain]\ndimensions = {self.dimensions}\ndt_s = {DT_S}\n"
            f"[[chains]]\npoints_m = {rows(self.points)}\nrod_m = [{least_m}, {most_m}]\n"
            f"radius_m = {self.radius_m}\nrod_radius_m = {self.rod_radius_m}\n{limits}"
            f'[[chains.tasks]]\nkind = "targets"\nconnector = {self.leader}\ntargets_m = {rows(self.targets)}\n'
            f"tolerance_m = {TOLERANCE_M}\nspeed_m_s = {SPEED_M_S}\n"
        )

    def mobilities(self):
        """Returns the connectors that are held, each with its mobility as a scenario writes it."""
        last = len(self.points) - 1
        zeros = [0.0] * (self.dimensions - 1)
        if self.base == "fixed":
            return [(last, '"fixed"')]
        if self.base == "rail":
            return [(last, f"{{ on_segment = [{[-RAIL_M, *zeros]}, {[RAIL_M, *zeros]}] }}")]
        if self.base == "plane":
            up = [*zeros, 1.0]
            return [(last, f"{{ on_plane = {{ normal = {up}, offset_m = 0.0 }} }}")]
        if self.base == "box":
            low = [-x for x in BOX_M[: self.dimensions]]
            return [(last, f"{{ in_box = [{low}, {list(BOX_M[: self.dimensions])}] }}")]
        if self.base == "two ends":
            return [(0, '"fixed"'), (last, '"fixed"')]
        return []

    def project_base(self, point):
        """Returns the place nearest to a point where the base may be."""
        point = np.array(point, float)
        if self.base == "rail":
            point[1:] = 0.0
            point[0] = np.clip(point[0], -RAIL_M, RAIL_M)
        elif self.base == "plane":
            point[-1] = 0.0
        elif self.base == "box":
            most = np.array(BOX_M[: self.dimensions])
            point = np.clip(point, -most, most)
        elif self.base in ("fixed", "two ends"):
            point = self.points[-1].copy()
        return point


def ball(draws, dimensions, radius_m):
    """Returns a point drawn evenly from a ball."""
    while True:
        point = draws.uniform(-radius_m, radius_m, dimensions)
        if np.linalg.norm(point) <= radius_m:
            return point


def straight_world(base, links, dimensions, seed, targets=24, rod_m=ROD_M, radius_m=RADIUS_M):
    """A chain that stands straight on its base, with targets that its reach and the base allow."""
    draws = np.random.default_rng([seed, links, dimensions, len(base)])
    up = np.zeros(dimensions)
    up[-1] = 1.0
    points = np.array([(links - i) * rod_m * up for i in range(links + 1)])
    rod_radius_m = radius_m * ROD_RADIUS_M / RADIUS_M
    none = np.zeros((0, dimensions))
    world = World(base, dimensions, points, (rod_m, rod_m), radius_m, rod_radius_m, 0, none)
    reach_m = REACH_FRACTION * links * rod_m
    drawn = []
    while len(drawn) < targets:
        anywhere = draws.uniform(-RAIL_M, RAIL_M, dimensions)
        drawn.append(world.project_base(anywhere) + ball(draws, dimensions, reach_m))
    world.targets = np.round(drawn, 4)
    return world


def two_ended_world(links, dimensions, seed, targets=24):
    """A chain in an arc between two fixed ends, whose middle connector has targets within reach of both."""
    draws = np.random.default_rng([seed, links, dimensions, 2])
    rod_m = (0.299, 0.301)
    half_m = END_FRACTION * 0.5 * links * ROD_M
    # The bend of an arc of equal rods between the two ends, by bisection.
    low, high = 1e-6, 2.0 * np.pi / links
    for _ in range(100):
        bend = 0.5 * (low + high)
        chord_m = ROD_M * np.sin(0.5 * links * bend) / np.sin(0.5 * bend)
        low, high = (bend, high) if chord_m > 2.0 * half_m else (low, bend)
    angles = (np.arange(links) - 0.5 * (links - 1)) * -bend
    points = np.zeros((links + 1, dimensions))
    points[0, 0] = -half_m
    for i, angle in enumerate(angles):
        points[i + 1] = points[i]
        points[i + 1, :2] += ROD_M * np.array([np.cos(angle), np.sin(angle)])
    points[-1] = 0.0
    points[-1, 0] = half_m
    leader = links // 2
    reaches_m = [REACH_FRACTION * rod_m[0] * count for count in (leader, links - leader)]
    drawn = []
    while len(drawn) < targets:
        point = ball(draws, dimensions, 0.5 * links * ROD_M)
        if all(np.linalg.norm(point - points[end]) <= reach_m for end, reach_m in zip((0, -1), reaches_m)):
            drawn.append(point)
    return World("two ends", dimensions, points, rod_m, RADIUS_M, ROD_RADIUS_M, leader, np.round(drawn, 4))


def snakes(seed):
    """Twenty free chains of many proportions, each with sixteen targets."""
    draws = np.random.default_rng([seed, 320])
    for run in range(20):
        links = int(draws.integers(3, 21))
        radius_m = float(np.round(ROD_M * draws.uniform(0.02, 0.15), 4))
        yield straight_world("free", links, 2 + run % 2, seed + run, targets=16, radius_m=radius_m)
