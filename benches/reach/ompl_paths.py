"""Whether OMPL finds a path to a target: RRT-Connect in the space of the postures of a chain.

A posture of a chain with one base or none is the place of its base and a vector for each rod, whose direction the rod
has. The chain between two fixed ends is the constrained space of its connectors (`ProjectedStateSpace`), with rods of
their mean length.
"""

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util
from worlds import TOLERANCE_M

#: Time for each problem, seconds.
TIMEOUT_S = 60.0
#: Postures at the target that the planner is given, and random ones from which they are sought, at most.
MOST_GOALS = 10
MOST_TRIES = 400
#: Passes of the search for such a posture (FABRIK), at most.
MOST_PASSES = 60
#: Least length of a vector that gives a rod its direction.
LEAST_VECTOR = 0.05

util.setLogLevel(util.LOG_NONE)


def find_path(world, posture, target):
    """Returns "reached", "no posture there" or "no path" for a chain that begins in a posture."""
    space = TwoEnds(world) if world.base == "two ends" else OpenChain(world)
    goals = space.goals(posture, target)
    if not goals:
        return "no posture there"
    return "reached" if space.connects(posture, goals) else "no path"


class Geometry:
    """The own body of a chain: parts that share no joint keep the sum of their radii."""

    def __init__(self, world):
        self.world = world
        links = len(world.points) - 1
        self.pairs = np.array([(i, j) for i in range(links) for j in range(i + 2, links)], int).reshape(-1, 2)

    def is_free(self, points):
        """Returns whether no two parts touch: rods, and the connectors that end them."""
        world = self.world
        starts, ends = points[:-1], points[1:]
        first, second = self.pairs.T
        gaps_m = segment_distances(starts[first], ends[first], starts[second], ends[second])
        if np.any(gaps_m < 2.0 * world.rod_radius_m):
            return False
        for k, point in enumerate(points):
            others = [i for i in range(len(starts)) if i not in (k - 1, k)]
            along = ends[others] - starts[others]
            part = np.einsum("ij,ij->i", point - starts[others], along) / np.einsum("ij,ij->i", along, along)
            nearest = starts[others] + np.clip(part, 0.0, 1.0)[:, None] * along
            if np.any(np.linalg.norm(nearest - point, axis=1) < world.radius_m + world.rod_radius_m):
                return False
            # Connectors of one rod share it; all others keep the sum of their radii.
            far = [i for i in range(len(points)) if abs(i - k) > 1]
            if np.any(np.linalg.norm(points[far] - point, axis=1) < 2.0 * world.radius_m):
                return False
        return True

    def is_straight_path_free(self, one, other, posture_at):
        """Returns whether postures stay free on the way between two states."""
        count = int(np.ceil(np.abs(one - other).max() / 0.01)) + 1
        return all(self.is_free(posture_at(f)) for f in np.linspace(0.0, 1.0, count))


def segment_distances(a, b, c, d):
    """Returns the distances of pairs of segments from `a` to `b` and from `c` to `d`, row by row."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (np.einsum("ij,ij->i", x, y) for x, y in ((u, u), (u, v), (v, v)))
    uw, vw = (np.einsum("ij,ij->i", x, w) for x in (u, v))
    bottom = np.maximum(uu * vv - uv * uv, 1e-15)
    s = np.clip((uv * vw - vv * uw) / bottom, 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1)


class OpenChain:
    """The postures of a chain with one base, or none."""

    def __init__(self, world):
        self.world = world
        self.geometry = Geometry(world)
        self.dimensions = world.dimensions
        self.rods = len(world.points) - 1
        self.rod_m = 0.5 * sum(world.rod_m)
        size = self.dimensions * (self.rods + 1)
        self.space = ob.RealVectorStateSpace(size)
        bounds = ob.RealVectorBounds(size)
        for i in range(size):
            most = 2.0 * self.rods * self.rod_m if i < self.dimensions else 1.0
            bounds.setLow(i, -most)
            bounds.setHigh(i, most)
        self.space.setBounds(bounds)
        self.size = size

    def points(self, state):
        """Returns the places of the connectors; none where a rod has no direction."""
        base = self.world.project_base(state[: self.dimensions])
        vectors = state[self.dimensions :].reshape(self.rods, self.dimensions)
        lengths = np.linalg.norm(vectors, axis=1)
        if lengths.min() < LEAST_VECTOR:
            return None
        steps = self.rod_m * vectors / lengths[:, None]
        # From the base, the last connector, to the tip.
        return np.vstack([base, base + np.cumsum(steps, axis=0)])[::-1]

    def state_of(self, points):
        outward = points[::-1]
        vectors = np.diff(outward, axis=0)
        vectors /= np.linalg.norm(vectors, axis=1)[:, None]
        return np.concatenate([outward[0], vectors.ravel()])

    def goals(self, posture, target):
        draws = np.random.default_rng(1)
        found = []
        for number in range(MOST_TRIES):
            outward = self.tried_posture(draws, number, posture)
            points = self.reach(outward, target)
            if points is not None and self.geometry.is_free(points):
                found.append(self.state_of(points))
                if len(found) == MOST_GOALS:
                    break
        return found

    def tried_posture(self, draws, number, posture):
        """Returns a posture from which one at the target is sought: smooth ones often, as they are seldom caught."""
        base = self.world.project_base(posture[-1] + draws.normal(size=self.dimensions) * (number % 4))
        direction = draws.normal(size=self.dimensions)
        wildness = (0.1, 0.3, 1.0)[number % 3]
        points = [base]
        for _ in range(self.rods):
            direction = direction / np.linalg.norm(direction) + wildness * draws.normal(size=self.dimensions)
            points.append(points[-1] + self.rod_m * direction / np.linalg.norm(direction))
        return np.array(points)

    def reach(self, outward, target):
        """Returns a posture whose tip is at the target, from a posture given from base to tip."""
        for _ in range(MOST_PASSES):
            outward[-1] = target
            for i in range(self.rods - 1, -1, -1):
                outward[i] = self.at_rod(outward[i + 1], outward[i])
            outward[0] = self.world.project_base(outward[0])
            for i in range(1, self.rods + 1):
                outward[i] = self.at_rod(outward[i - 1], outward[i])
            if np.linalg.norm(outward[-1] - target) < 0.5 * TOLERANCE_M:
                return outward[::-1].copy()
        return None

    def at_rod(self, fixed, moved):
        along = moved - fixed
        return fixed + self.rod_m * along / max(np.linalg.norm(along), 1e-12)

    def connects(self, posture, goals):
        setup = og.SimpleSetup(self.space)

        def is_valid(state):
            points = self.points(np.array([state[i] for i in range(self.size)]))
            return points is not None and self.geometry.is_free(points)

        return solve(setup, self.space, is_valid, self.state_of(posture), goals, self.size)


class TwoEnds(OpenChain):
    """The postures of a chain between two fixed ends, as a constrained space."""

    def __init__(self, world):
        super().__init__(world)
        self.inner = self.rods - 1
        self.size = self.inner * self.dimensions
        ambient = ob.RealVectorStateSpace(self.size)
        bounds = ob.RealVectorBounds(self.size)
        bounds.setLow(-self.rods * self.rod_m)
        bounds.setHigh(self.rods * self.rod_m)
        ambient.setBounds(bounds)
        self.constraint = Lengths(self)
        self.space = ob.ProjectedStateSpace(ambient, self.constraint)

    def points(self, state):
        inner = np.asarray(state).reshape(self.inner, self.dimensions)
        return np.vstack([self.world.points[0], inner, self.world.points[-1]])

    def state_of(self, points):
        return points[1:-1].ravel().copy()

    def reach(self, outward, target):
        """Returns a posture whose leader is at the target, and whose ends are where they are fixed."""
        points = outward[::-1].copy()
        leader = self.world.leader
        for _ in range(MOST_PASSES):
            points[leader] = target
            for end, ahead in ((0, 1), (self.rods, -1)):
                for i in range(leader - ahead, end - ahead, -ahead):
                    points[i] = self.at_rod(points[i + ahead], points[i])
                points[end] = self.world.points[end]
                for i in range(end + ahead, leader + ahead, ahead):
                    points[i] = self.at_rod(points[i - ahead], points[i])
                if end == 0:
                    missed_m = np.linalg.norm(points[leader] - target)
                    points[leader] = target
            missed_m = max(missed_m, np.linalg.norm(points[leader] - target))
            if missed_m < 0.5 * TOLERANCE_M:
                points[leader] = target
                return points
        return None

    def connects(self, posture, goals):
        setup = og.SimpleSetup(ob.ConstrainedSpaceInformation(self.space))

        def is_valid(state):
            return self.geometry.is_free(self.points([state[i] for i in range(self.size)]))

        starts = [self.constraint.settled(state) for state in (self.state_of(posture), *goals)]
        return solve(setup, self.space, is_valid, starts[0], starts[1:], self.size)


class Lengths(ob.Constraint):
    """Rods between two fixed ends have their mean length."""

    def __init__(self, chain):
        self.chain = chain
        super().__init__(chain.size, chain.rods, 1e-4)

    def function(self, x, out):
        out[:] = np.linalg.norm(np.diff(self.chain.points(x), axis=0), axis=1) - self.chain.rod_m

    def jacobian(self, x, out):
        points = self.chain.points(x)
        along = np.diff(points, axis=0)
        along /= np.linalg.norm(along, axis=1)[:, None]
        out[:, :] = 0.0
        dimensions = self.chain.dimensions
        for i in range(self.chain.rods):
            if i > 0:
                out[i, (i - 1) * dimensions : i * dimensions] = -along[i]
            if i < self.chain.rods - 1:
                out[i, i * dimensions : (i + 1) * dimensions] = along[i]

    def settled(self, state):
        """Returns the state after Newton steps onto the constraint."""
        state = np.array(state, float)
        for _ in range(50):
            errors = np.zeros(self.chain.rods)
            slopes = np.zeros((self.chain.rods, self.chain.size))
            self.function(state, errors)
            if np.linalg.norm(errors) < 1e-5:
                break
            self.jacobian(state, slopes)
            state -= np.linalg.pinv(slopes) @ errors
        return state


def solve(setup, space, is_valid, start, goals, size):
    """Returns whether RRT-Connect finds a path from the start to one of the goals in time."""
    setup.setStateValidityChecker(is_valid)
    information = setup.getSpaceInformation()
    # Steps in which a path is checked: finer than the radius of a rod.
    information.setStateValidityCheckingResolution(0.002)

    def state_of(values):
        state = space.allocState()
        if isinstance(space, ob.ConstrainedStateSpace):
            state.copy([float(x) for x in values])
        else:
            for i in range(size):
                state[i] = float(values[i])
        return state

    setup.setStartState(state_of(start))
    states = ob.GoalStates(information)
    for goal in goals:
        states.addState(state_of(goal))
    setup.setGoal(states)
    setup.setPlanner(og.RRTConnect(information))
    setup.setup()
    return bool(setup.solve(TIMEOUT_S)) and setup.haveExactSolutionPath()
