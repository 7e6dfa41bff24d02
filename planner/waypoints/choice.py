"""The shortest path through the layers of solutions of a waypoint list."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from planner.kinematics.costs import PREFERENCE_WEIGHT, motion_costs
from planner.kinematics.options import Preference
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import POSITION_TOLERANCE
from planner.tool_motions.position_limits import shares_of_range
from planner.tool_motions.tool_motion import (
    RefusedMotion,
    RequestedMotion,
    ToolMotion,
    follow_chain,
    follow_motion,
    start_of_motion,
)
from planner.waypoints.candidates import Layer
from planner.waypoints.preferences import Costs

LIMIT_PENALTY = 0.01
"""Cost of a joint position at a limit, s."""

CONDITIONING_PENALTY = 0.01
"""Cost of a singular joint position beside another that is not, s."""

FOLLOWED_BACKWARDS = 16
"""The most candidates of a waypoint from which a motion is followed backwards to a singular joint position."""

DESCENTS = 4
"""The number of the best joint positions at one waypoint from which a continuum at the next is approached."""

FEWEST_TOGETHER = 8
"""The fewest motions of the tool, one after the other, that are followed all at once: so many take 3 ms."""

MOST_TOGETHER = 128
"""The most motions followed at once; those after one that needs its own search are followed again."""

MOST_REFUSED = 20
"""The most joint positions from which a motion with a tolerance region is followed in vain: each takes 0.3 s."""

SAME_END = 1e-6
"""The largest distance of a joint, rad or m, at which a followed motion ends at a joint position."""


@dataclass(frozen=True, eq=False)
class Stop:
    """One waypoint of the list.

    Attributes:
        index: Index of the waypoint.
        layer: Its candidates.
        requested: The motion of the tool to this waypoint; None: a joint motion, from any position to any.
        costs: The preference costs (N,) of joint positions (N, joints); None: only the path counts.
    """

    index: int
    layer: Layer
    requested: RequestedMotion | None = None
    costs: Costs | None = None


class Passage(NamedTuple):
    """The choice at one waypoint.

    Attributes:
        position: (joints,), rad or m.
        motion: The motion of the tool to here; None: a joint motion.
    """

    position: FloatArray
    motion: ToolMotion | None


@dataclass(frozen=True, eq=False)
class _Stage:
    """The best paths to one stop: their ends (n, joints), costs (n,) and rows one stop before (n,)."""

    positions: FloatArray
    costs: FloatArray
    origins: FloatArray


def shortest_path(
    robot: Robot,
    stops: Sequence[Stop],
    start: FloatArray,
    weight: float,
    prefer: Preference,
) -> list[Passage] | RefusedMotion:
    """Choose a joint position for every stop, and the tool motions to them, with the least total cost.

    - Of every motion, also a Cartesian one: the time of its slowest joint, max_j t_j, plus `MOTION_PENALTY` sum_j t_j.
      Here t_j = |dq_j| / v_j with the velocity limit v_j, or 1 rad/s or 1 m/s. The first motion, from `start`, counts
      `weight` times. With `prefer` = `arm`, `EXTERNAL_PENALTY` sum_j t_j over the external axes is added.
    - Of every joint position: `LIMIT_PENALTY` max_j |q_j - middle_j| / (half the range of joint j), over the joints
      with limits, and `CONDITIONING_PENALTY` (1 - w / w_best). Here w is its manipulability, and w_best the largest of
      the solutions of the waypoint. These penalties only decide between paths of about the same time.
    - `PREFERENCE_WEIGHT` times the preference costs of a stop, which outweigh everything else.

    The search is dynamic programming (Bellman 1957) from layer to layer. A Cartesian motion leads from one joint
    position to one other, and takes some milliseconds to follow. The search therefore assumes that it ends at the
    nearest candidate, and follows it only if the best path contains it. All Cartesian motions of the returned path have
    been followed.

    Args:
        robot: The robot, with its tool.
        stops: The waypoints with their candidates.
        start: (joints,), rad or m, start of the path.
        weight: Weight of the time to the first stop.
        prefer: The preference: `arm`, which moves external axes little, or any other.

    Returns:
        The choice at every stop; or, without any path, the first motion that the joints cannot follow.

    Raises:
        InvalidProblem: A motion of the tool contradicts itself.
    """
    return _Search(robot, stops, start, weight, prefer).run()


def with_starts_of_motions(robot: Robot, stops: Sequence[Stop]) -> list[Stop]:
    """Add to singular stops the joint positions from which the next motion can be followed.

    A singular pose has a continuum of solutions, and a tool motion can start from only few of them. The function finds
    these backwards from the solutions of the next stop.
    """
    found = list(stops)
    for k in range(len(stops) - 2, -1, -1):
        layer, after = stops[k].layer, found[k + 1]
        if layer.descend is None or after.requested is None:
            continue
        if robot.dof > (3 if after.requested.after.rotation is None else 6):
            continue  # of an arm with more joints than the tool has directions motions lead on from every solution
        ends = after.layer.positions[:FOLLOWED_BACKWARDS]
        starts = [start for end in ends if (start := start_of_motion(after.requested, end)) is not None]
        found[k] = replace(stops[k], layer=layer.with_solutions(robot, starts))
    return found


def with_chosen_axes(stops: Sequence[Stop]) -> list[Stop]:
    """Return the stops with motions of the tool on which external axes may go on any way."""
    return [
        stop if stop.requested is None else replace(stop, requested=replace(stop.requested, chooses_axes=True))
        for stop in stops
    ]


class _Search:
    def __init__(
        self, robot: Robot, stops: Sequence[Stop], start: FloatArray, weight: float, prefer: Preference
    ) -> None:
        self.robot, self.stops, self.weight, self.prefer = robot, stops, weight, prefer
        self.stages = [_Stage(start[None], np.zeros(1), np.zeros(1, dtype=np.intp))]
        self.followed: dict[tuple[int, tuple[float, ...]], ToolMotion | RefusedMotion] = {}
        self.refused: RefusedMotion | None = None
        self.refused_with_freedom = 0
        self.together = MOST_TOGETHER

    def run(self) -> list[Passage] | RefusedMotion:
        """Return the way, or the first motion that could not be followed, from anywhere if that is known."""
        while self.refused is None or not self.refused.is_out_of_reach:
            while len(self.stages) <= len(self.stops):
                self.stages.append(self._next(self.stages[-1], self.stops[len(self.stages) - 1]))
            if np.isinf(self.stages[-1].costs).all():
                assert self.refused is not None  # noqa: S101 - only what cannot be followed costs infinitely much
                return self.refused
            if self.refused is not None and self.refused_with_freedom >= MOST_REFUSED:
                return self.refused
            way = self._followed_way(self._best_rows())
            if way is not None:
                return way
        return self.refused

    def _next(self, stage: _Stage, stop: Stop) -> _Stage:
        best = stage.costs.argsort(kind="stable")[:DESCENTS]
        followed = [self.followed.get((stop.index, tuple(origin))) for origin in stage.positions.tolist()]
        layer = stop.layer.with_descents(stage.positions[[row for row in best.tolist() if followed[row] is None]])
        reached = layer.reached_from(stage.positions)
        origin = stage.positions[:, None]
        if stop.index > 0:  # what is one joint position but for rounding becomes the same
            same = (np.abs(reached - origin) <= POSITION_TOLERANCE).all(axis=-1, keepdims=True)
            reached = np.where(same, origin, reached)
        if stop.requested is None and reached.shape[:2] == (1, 1):  # no choice: what all ways cost does not matter
            return _Stage(reached[0], stage.costs, np.zeros(1, dtype=np.intp))
        costs = self._motion_costs(origin, reached)
        if stop.requested is None:
            weight = self.weight if len(self.stages) == 1 else 1.0
            costs = stage.costs[:, None] + weight * costs
            origins, candidates = costs.argmin(axis=0), np.arange(len(layer.positions))
            positions, costs = reached[origins, candidates], costs[origins, candidates]
        else:
            if stop.requested.is_to_be_flat and stop.costs is not None:
                preferred = stop.costs(reached.reshape(-1, reached.shape[2])).reshape(reached.shape[:2])
                costs = costs + PREFERENCE_WEIGHT * preferred
            origins, candidates = np.arange(len(stage.costs)), costs.argmin(axis=1)
            positions = reached[origins, candidates]
            lost = np.zeros(len(origins), dtype=bool)
            for row, motion in enumerate(followed):
                lost[row] = isinstance(motion, RefusedMotion)
                positions[row] = motion.end if isinstance(motion, ToolMotion) else positions[row]
            costs = np.where(lost, np.inf, stage.costs + self._motion_costs(stage.positions, positions))
        nearness = np.abs(shares_of_range(self.robot, positions)).max(axis=1)
        penalties = LIMIT_PENALTY * nearness + CONDITIONING_PENALTY * (1.0 - layer.conditioning[candidates])
        if stop.costs is not None:
            penalties = penalties + PREFERENCE_WEIGHT * stop.costs(positions)
        return _Stage(positions, costs + penalties, origins)

    def _motion_costs(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        return motion_costs(self.robot, starts, ends, self.prefer)

    def _best_rows(self) -> list[int]:
        """Return the row of every stage on the best way."""
        rows = [int(self.stages[-1].costs.argmin())]
        for stage in self.stages[:0:-1]:
            rows.append(int(stage.origins[rows[-1]]))
        return rows[::-1]

    def _followed_way(self, rows: list[int]) -> list[Passage] | None:
        """Return the best way, its motions of the tool followed; None: one does not end where it was taken to.

        The stages from there on are then to be made again.
        """
        way = []
        for i, stop in enumerate(self.stops, start=1):
            stage, row, motion = self.stages[i], rows[i], None
            if stop.requested is not None:
                start = self.stages[i - 1].positions[rows[i - 1]]
                self._follow_together(i, start)
                result = self._follow(stop.index, stop.requested, start)
                if isinstance(result, RefusedMotion) or np.abs(result.end - stage.positions[row]).max() > SAME_END:
                    self._follow_on(i, result)
                    del self.stages[i:]
                    return None
                stage.positions[row], motion = result.end, result
            way.append(Passage(stage.positions[row], motion))
        return way

    def _follow_together(self, i: int, start: FloatArray) -> None:
        """Follow many consecutive tool motions from stop i - 1 at once, as far as that works."""
        if (self.stops[i - 1].index, tuple(start.tolist())) in self.followed:
            return
        stops = list(takewhile(lambda stop: stop.requested is not None, self.stops[i - 1 : i - 1 + self.together]))
        if len(stops) < FEWEST_TOGETHER:
            return
        motions = follow_chain(
            [stop.requested for stop in stops if stop.requested is not None], start, self._nearest(stops, start)
        )
        for stop, motion in zip(stops, motions, strict=False):
            self.followed[stop.index, tuple(start.tolist())] = motion
            start = motion.end
        # Where many have to be followed by themselves, fewer are tried.
        self.together = min(2 * self.together, MOST_TOGETHER) if motions else max(self.together // 2, FEWEST_TOGETHER)

    def _nearest(self, stops: Sequence[Stop], start: FloatArray) -> FloatArray:
        """Return the candidates (stops, joints), each the nearest to the one before, the first to `start` (joints,)."""
        found = []
        for stop in stops:
            (reached,) = stop.layer.reached_from(start[None])
            start = reached[self._motion_costs(start, reached).argmin()]
            found.append(start)
        return np.array(found)

    def _follow_on(self, i: int, motion: ToolMotion | RefusedMotion) -> None:
        """Follow the motions of the tool that come next, too: from here they lead nowhere else."""
        for k, stop in enumerate(self.stops[i:], start=i + 1):
            if isinstance(motion, RefusedMotion) or stop.requested is None:
                return
            self._follow_together(k, motion.end)
            motion = self._follow(stop.index, stop.requested, motion.end)

    def _follow(self, index: int, requested: RequestedMotion, start: FloatArray) -> ToolMotion | RefusedMotion:
        """Return the followed motion from a joint position (joints,), from the cache if possible."""
        key = index, tuple(start.tolist())
        if key not in self.followed:
            self.followed[key] = result = follow_motion(requested, start)
            if isinstance(result, RefusedMotion):
                self.refused = result if self.refused is None or result.is_out_of_reach else self.refused
                self.refused_with_freedom += requested.is_open or requested.is_to_be_flat
        return self.followed[key]
