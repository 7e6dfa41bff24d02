"""Proposed joint positions at open waypoints and radii of blends, each near the best so far or after a jump."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from planner.free_motion.detours import last_of
from planner.guarantees import Guarantee
from planner.planning.attempts import Planned
from planner.planning.off_path.descent import Points, descended
from planner.planning.off_path.leg_times import LegTimes
from planner.planning.off_path.open_waypoints import open_waypoints
from planner.planning.off_path.warm_start import points_on
from planner.problems.blend_radii import blend_radii
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory

WINDOW_SIZE = 12
"""The most open waypoints that move in one iterate, one after the other in the list."""

LARGEST_REACH = 4.0
"""The largest distance of coordinates from the best point in a descent, rad or m: more than half a turn."""

LEAST_REACH = 1e-3
"""The distance below which no further descent starts from the best point, rad or m."""

LESS_REACH = 0.25
"""The factor on the distance to a point that is no better."""

JUMP_SIZES = (0.1, 1.5)
"""Smallest and largest standard deviation of a jump, rad or m; small and large ones are equally likely."""

WORTH_CERTIFYING = 1.02
"""The largest estimate, relative to that of the best point, at which the end of a jump is timed."""

SAME_POINT = 1e-3
"""The largest distance of joint positions, rad or m, at which the end of a jump is the best point again."""

FIRST_STEP = 0.05
"""The first standard deviation of a step without a descent, rad or m."""

STEP_SIZES = (1e-4, 0.5)
"""The smallest and the largest standard deviation of such steps."""

STEP_GROWTH = 1.5
"""The factor on it after a shorter duration. Its fourth root divides it otherwise, so that one in five steps helps."""

SHARE_MOVED = 0.5
"""The share of steps and jumps of some waypoints alone, and the share of waypoints and blends that these change."""

RADII_SIZE = 4.0
"""The standard deviation of the logarithms of radii, as a multiple of that of a step."""

LEAST_RADIUS = 1.0 / 32.0
"""The least radius of a blend that is tried, as a share of its own."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """The changes of one iterate.

    Attributes:
        points: The joint positions.
        radii: The radii of blends, m, by the indices of their waypoints.
        kind: `descent` from the best point, `jump` from there and then a descent, or `step`.
        window: Index of the window of open waypoints that moved.
    """

    points: Points
    radii: Mapping[int, float]
    kind: str
    window: int


class Search:
    """Proposes candidates, and learns from their outcomes.

    Attributes:
        first: The candidate without changes.
        best: The best candidate so far.
    """

    def __init__(self, planned: Planned) -> None:
        """Begin at a plan; its blends have their largest radii."""
        problem, path = planned.attempt.problem, planned.plan.path
        rows = [last_of(planned.plan.problem, k) for k in range(len(problem.waypoints))]
        found = open_waypoints(problem, path.positions[rows])
        every = [(one, rows[one.index]) for one in found]
        points = Points(every, tuple(found.values()), path.positions)
        self.best = self.first = Candidate(points, blend_radii(problem), "descent", 0)
        count = -(-len(every) // WINDOW_SIZE)
        self._windows: list[list[int]] = [own.tolist() for own in np.array_split(np.arange(len(every)), count or 1)]
        self._reach = [LARGEST_REACH if own else 0.0 for own in self._windows]
        self._step = FIRST_STEP
        backend = planned.attempt.backend
        self._times = LegTimes(path, keeps_jerk=backend.guarantees["jerk"] is Guarantee.HARD)
        self._given = [] if problem.warm_start is None else self._from(problem.warm_start)

    @property
    def is_empty(self) -> bool:
        """Whether nothing is open."""
        return not self.first.points.rows and not self.first.radii

    def moved(self, candidate: Candidate) -> dict[int, FloatArray]:
        """Return the joint positions (joints,) at waypoints that differ from the first plan, by their indices."""
        points, first = candidate.points, self.first.points
        pairs = zip(points.rows, points.coordinates, first.coordinates, strict=True)
        return {one.index: points.positions[row] for (one, row), own, other in pairs if (own != other).any()}

    def candidate(self, number: int, rng: np.random.Generator) -> Candidate | None:
        """Return the candidate of a round; None: it would be no better by its estimate."""
        if self._given:
            return Candidate(self._given.pop(0), self.best.radii, "jump", 0)
        window = number % len(self._windows)
        if self._reach[window] >= LEAST_REACH:
            return self._descent(window)
        if (number // len(self._windows)) % 2 and self._windows[window]:
            return self._jump(window, rng)
        return self._stepped(window, rng)

    def learn(self, candidate: Candidate, *, is_better: bool) -> None:
        """Remember a candidate that is better; adapt the sizes of steps."""
        if candidate.kind == "descent" and not is_better:
            away = np.abs(candidate.points.positions - self.best.points.positions).max()
            self._reach[candidate.window] = LESS_REACH * min(float(away), self._reach[candidate.window])
        elif candidate.kind == "jump" and is_better:
            self._reach[candidate.window] = LARGEST_REACH
        elif candidate.kind == "step":
            self._step = float(np.clip(self._step * (STEP_GROWTH if is_better else STEP_GROWTH**-0.25), *STEP_SIZES))
        if is_better:
            self.best = candidate

    def _from(self, trajectory: Trajectory) -> list[Points]:
        """Return the points on another trajectory, and the end of a descent from there."""
        begin = end = points_on(trajectory, self.best.points)
        if begin is None or end is None:
            return []
        for window in range(len(self._windows)):
            end = self._descended(end, window, LARGEST_REACH) or end
        return [begin, end]

    def _descent(self, window: int) -> Candidate | None:
        """Descend from the best point; None: there is no descent."""
        points = self._descended(self.best.points, window, self._reach[window])
        if points is None:
            self._reach[window] = 0.0
            return None
        return Candidate(points, self.best.radii, "descent", window)

    def _jump(self, window: int, rng: np.random.Generator) -> Candidate | None:
        """Move away from the best point and descend; None: the end is not promising, or the best point again."""
        best = self.best.points
        size = JUMP_SIZES[0] * (JUMP_SIZES[1] / JUMP_SIZES[0]) ** rng.random()
        start = self._away(window, size, rng)
        points = None if start is None else self._descended(start, window, LARGEST_REACH) or start
        if points is None or np.abs(points.positions - best.positions).max() < SAME_POINT:
            return None
        if self._estimate(points) > WORTH_CERTIFYING * self._estimate(best):
            return None
        return Candidate(points, self.best.radii, "jump", window)

    def _stepped(self, window: int, rng: np.random.Generator) -> Candidate | None:
        """Change coordinates and radii a little; None: a pose is not met any more."""
        radii = dict(self.best.radii)
        changed = [k for k in radii if rng.random() < SHARE_MOVED]
        for k in changed:
            most = self.first.radii[k]
            radii[k] = float(
                np.clip(radii[k] * np.exp(RADII_SIZE * self._step * rng.normal()), LEAST_RADIUS * most, most)
            )
        points = self._away(window, self._step, rng) if self._windows[window] else self.best.points
        return None if points is None else Candidate(points, radii, "step", window)

    def _away(self, window: int, size: float, rng: np.random.Generator) -> Points | None:
        """Return points at a random distance from the best; of some waypoints of a window, or of all."""
        best = self.best.points
        steps = [np.zeros_like(own) for own in best.coordinates]
        own = self._windows[window]
        some = [k for k in own if rng.random() < SHARE_MOVED] or own
        for k in some if rng.random() < SHARE_MOVED else own:
            tangent = best.rows[k][0].tangent(best.coordinates[k])
            steps[k] = size * rng.normal(size=len(tangent)) @ tangent
        return best.moved(steps)

    def _descended(self, points: Points, window: int, reach: float) -> Points | None:
        """Descend with the open waypoints of a window; None: there is no descent."""
        own = self._windows[window]
        part = replace(
            points, rows=[points.rows[k] for k in own], coordinates=tuple(points.coordinates[k] for k in own)
        )
        found = descended(part, self._times, reach)
        if found is part:
            return None
        coordinates = list(points.coordinates)
        for k, moved in zip(own, found.coordinates, strict=True):
            coordinates[k] = moved
        return replace(points, coordinates=tuple(coordinates), positions=found.positions)

    def _estimate(self, points: Points) -> float:
        return float(self._times(points.positions).total)
