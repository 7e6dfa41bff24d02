"""The shortest way through the layers of solutions of a waypoint list."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import PlanningError
from planner.limits import counted_velocity
from planner.tolerances import POSITION_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.waypoints.candidates import Layer

MOTION_PENALTY = 0.01
"""Of the times of all joints, beside that of the slowest: no joint moves for nothing behind a slower one."""

LIMIT_PENALTY = 0.01
"""s, of a joint position at a limit."""

CONDITIONING_PENALTY = 0.01
"""s, of a singular joint position beside another that is not."""

DESCENTS = 4
"""From so many of the best joint positions at one waypoint a continuum at the next is approached."""

SAME_END = 1e-6
"""rad or m: an end of a followed motion this near to a joint position is there."""


@dataclass(frozen=True, eq=False)
class Stop:
    """One waypoint on the way.

    Attributes:
        index: Of the waypoint.
        layer: Its candidates.
        follow: From a joint position (joints,) at the waypoint before, where the Cartesian motion to this one ends;
            raises a PlanningError when it cannot be followed from there. None: a joint motion, from any to any.
    """

    index: int
    layer: Layer
    follow: Callable[[FloatArray], FloatArray] | None = None


@dataclass(frozen=True, eq=False)
class _Stage:
    """The best ways to one stop: where they lead (n, joints), their costs (n,), and their rows one stop before (n,)."""

    positions: FloatArray
    costs: FloatArray
    origins: FloatArray


def shortest_way(robot: Robot, stops: Sequence[Stop], start: FloatArray, weight: float) -> list[FloatArray]:
    """A joint position (joints,) for every stop, so that the sum of these is least.

    - For every motion the time of its slowest joint, max_j t_j, t_j = |dq_j| / v_j (v_j: velocity limit; 1 rad/s or
      1 m/s without one), and `MOTION_PENALTY` sum_j t_j; of a Cartesian motion too; for the first, from `start`, times
      `weight`.
    - For every joint position `LIMIT_PENALTY` max_j |q_j - middle_j| / (half the range of joint j), over the joints
      with limits, and `CONDITIONING_PENALTY` (1 - w / w_best), w its manipulability and w_best the largest of a
      solution of the same waypoint. The penalties are so small that they decide between ways that take about as long.

    Dynamic programming (Bellman 1957) from layer to layer. A Cartesian motion leads from one joint position to one
    other, and costs some milliseconds to follow: its end is taken to be the nearest candidate until the best way goes
    along it, and only then is it followed. The way returned has been followed wherever it is Cartesian.

    Raises:
        PlanningError: No way is left; it is the error of the first motion that could not be followed.
    """
    return _Search(robot, stops, start, weight).run()


def joint_times(robot: Robot, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Time (..., joints), s, of every joint at its velocity limit: |dq_j| / v_j.

    Args:
        robot: A joint without a velocity limit counts 1 rad/s or 1 m/s.
        starts: (..., joints).
        ends: (..., joints).
    """
    velocity = robot.limit("velocity")
    times: FloatArray = np.abs(ends - starts) / counted_velocity(velocity)
    return times


class _Search:
    def __init__(self, robot: Robot, stops: Sequence[Stop], start: FloatArray, weight: float) -> None:
        lower, upper = robot.limit("lower"), robot.limit("upper")
        self.robot = robot
        # A joint without limits is never near one, and neither is a joint that has no room to move in.
        limited = np.isfinite(upper - lower) & (upper - lower > POSITION_TOLERANCE)
        self.half_range = np.where(limited, (upper - lower) / 2.0, np.inf)
        self.stops, self.weight = stops, weight
        self.stages = [_Stage(start[None], np.zeros(1), np.zeros(1, dtype=np.intp))]
        self.ends: dict[tuple[int, bytes], FloatArray | None] = {}
        self.error: PlanningError | None = None

    def run(self) -> list[FloatArray]:
        """The joint positions of the way."""
        while True:
            while len(self.stages) <= len(self.stops):
                self.stages.append(self._next(self.stages[-1], self.stops[len(self.stages) - 1]))
            if np.isinf(self.stages[-1].costs).all():
                assert self.error is not None  # noqa: S101 - only what cannot be followed costs infinitely much
                raise self.error
            rows = self._best_rows()
            changed = self._follow(rows)
            if changed is None:
                return [stage.positions[row] for stage, row in zip(self.stages[1:], rows[1:], strict=True)]
            del self.stages[changed:]

    def _next(self, stage: _Stage, stop: Stop) -> _Stage:
        best = stage.costs.argsort(kind="stable")[:DESCENTS]
        layer = stop.layer.with_descents(stage.positions[best])
        reached = layer.reached_from(stage.positions)
        costs = self._motion_costs(stage.positions[:, None], reached)
        if stop.follow is None:
            weight = self.weight if len(self.stages) == 1 else 1.0
            costs = stage.costs[:, None] + weight * costs
            origins, candidates = costs.argmin(axis=0), np.arange(len(layer.positions))
            positions, costs = reached[origins, candidates], costs[origins, candidates]
        else:
            origins, candidates = np.arange(len(stage.costs)), costs.argmin(axis=1)
            positions = reached[origins, candidates]
            lost = np.zeros(len(origins), dtype=bool)
            for row, origin in enumerate(stage.positions):
                end = self.ends.get((stop.index, origin.tobytes()), positions[row])
                lost[row] = end is None
                positions[row] = positions[row] if end is None else end
            costs = np.where(lost, np.inf, stage.costs + self._motion_costs(stage.positions, positions))
        return _Stage(positions, costs + self._penalties(positions, layer.conditioning[candidates]), origins)

    def _motion_costs(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        times = joint_times(self.robot, starts, ends)
        costs: FloatArray = times.max(axis=-1) + MOTION_PENALTY * times.sum(axis=-1)
        return costs

    def _penalties(self, positions: FloatArray, conditioning: FloatArray) -> FloatArray:
        nearness = (np.abs(positions - self.robot.middle) / self.half_range).max(axis=1)
        penalties: FloatArray = LIMIT_PENALTY * nearness + CONDITIONING_PENALTY * (1.0 - conditioning)
        return penalties

    def _best_rows(self) -> list[int]:
        """The row of every stage on the best way."""
        rows = [int(self.stages[-1].costs.argmin())]
        for stage in self.stages[:0:-1]:
            rows.append(int(stage.origins[rows[-1]]))
        return rows[::-1]

    def _follow(self, rows: list[int]) -> int | None:
        """Follow the Cartesian motions on the best way; the first stage that now proves wrong, None: none does."""
        for i, stop in enumerate(self.stops, start=1):
            if stop.follow is None:
                continue
            start, stage, row = self.stages[i - 1].positions[rows[i - 1]], self.stages[i], rows[i]
            end = self._end(stop, start)
            if end is None or np.abs(end - stage.positions[row]).max() > SAME_END:
                self._follow_on(i, end)
                return i
            stage.positions[row] = end
        return None

    def _follow_on(self, i: int, position: FloatArray | None) -> None:
        """Follow the Cartesian motions that come next, too: from here they lead nowhere else."""
        for stop in self.stops[i:]:
            if position is None or stop.follow is None:
                return
            position = self._end(stop, position)

    def _end(self, stop: Stop, start: FloatArray) -> FloatArray | None:
        """Where the Cartesian motion to `stop` ends; None: it cannot be followed."""
        assert stop.follow is not None  # noqa: S101 - asked only where there is one
        key = stop.index, start.tobytes()
        if key not in self.ends:
            try:
                self.ends[key] = stop.follow(start)
            except PlanningError as error:
                self.ends[key] = None
                self.error = self.error or error
        return self.ends[key]
