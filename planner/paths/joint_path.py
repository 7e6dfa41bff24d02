"""From waypoints to a joint path: every waypoint solved, every motion joined to the next."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import InvalidProblem
from planner.paths.runs import Run, build_run, straight_run
from planner.problem import JointMotion, StopTransition
from planner.tolerances import POSITION_TOLERANCE
from planner.waypoints.solve import SolvedWaypoint, solve_waypoints

if TYPE_CHECKING:
    from planner.limits import SegmentLimits
    from planner.problem import PlanningProblem
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.tool_motions.pose_paths import PosePath


@dataclass(frozen=True, eq=False)
class StraightMotions:
    """Straight joint motions from rest to rest, row by row.

    Attributes:
        robot: With tool and payload.
        segments: (rows,), index of each.
        starts: (rows, joints).
        travels: (rows, joints), from the start of each to its end.
        durations: (rows,), s; NaN: as fast as the limits allow.
        limits: In force on each.
    """

    robot: Robot
    segments: np.ndarray
    starts: FloatArray
    travels: FloatArray
    durations: FloatArray
    limits: SegmentLimits

    def of(self, rows: np.ndarray) -> StraightMotions:
        """Some of them, by index or mask."""
        arrays = (self.segments[rows], self.starts[rows], self.travels[rows], self.durations[rows])
        return StraightMotions(self.robot, *arrays, self.limits.of(rows))


@dataclass(frozen=True, eq=False)
class JointPath:
    """What the joints do, without time. Its existence means: every waypoint is solved, every motion can be followed.

    Attributes:
        robot: The arm, with tool and payload.
        waypoints: The solved waypoints, in order; segment i goes from waypoint i to waypoint i + 1.
        limits: The limits in force on each segment.
        durations: (segments,), s; NaN: as fast as the limits allow.
        dwells: (waypoints,), s.
        runs: What is passed without stopping, and motions of the tool; all other segments are straight joint motions
            from rest to rest.
        tool_motions: (segments,), the line or circle of the tool; None: a joint motion.
    """

    robot: Robot
    waypoints: tuple[SolvedWaypoint, ...]
    limits: SegmentLimits = field(repr=False)
    durations: FloatArray
    dwells: FloatArray
    runs: tuple[Run, ...] = field(repr=False)
    tool_motions: tuple[PosePath | None, ...] = field(repr=False)

    @cached_property
    def positions(self) -> FloatArray:
        """(waypoints, joints), rad or m."""
        return np.array([waypoint.position for waypoint in self.waypoints])

    @cached_property
    def every_run(self) -> tuple[Run, ...]:
        """The runs, and each straight motion as a run of its own, in order."""
        own = self.straight_runs(self.straight.segments)
        return tuple(sorted((*self.runs, *own), key=lambda run: run.first))

    @cached_property
    def straight(self) -> StraightMotions:
        """The segments that belong to no run."""
        in_runs = [run.segments for run in self.runs]
        segments = np.setdiff1d(np.arange(len(self.durations)), np.concatenate(in_runs) if in_runs else [])
        return self.straight_motions(segments)

    def straight_motions(self, segments: np.ndarray) -> StraightMotions:
        """Joint motions straight from waypoint to waypoint, and rest at both."""
        starts = self.positions[segments]
        travels = self.positions[segments + 1] - starts
        return StraightMotions(
            self.robot, segments, starts, travels, self.durations[segments], self.limits.of(segments)
        )

    def straight_runs(self, segments: np.ndarray) -> list[Run]:
        """The same, each as a run of its own."""
        return [
            straight_run(segment, self.positions[segment], self.positions[segment + 1], self.limits.velocity[segment])
            for segment in segments.tolist()
        ]


def solve_path(problem: PlanningProblem) -> JointPath:
    """Solve the waypoints, choose their branches and join their motions.

    Raises:
        InvalidProblem: Two neighbouring waypoints are the same joint position; a corner cannot be passed; no one
            circle goes through three poses.
        UnreachableWaypoint: A pose has no solution, or a motion of the tool leaves what the arm can reach.
        JointPositionLimit: A waypoint or the way to it lies beyond a joint's position limits.
        ConfigurationChange: A motion of the tool ends in another configuration than its waypoint.
        SingularPath: A motion of the tool meets a singularity.
    """
    robot = problem.robot if problem.payload is None else problem.robot.with_payload(problem.payload)
    waypoints, options = problem.waypoints, problem.inverse_kinematics
    solved = solve_waypoints(robot, waypoints, options)
    _refuse_standing_still(solved)
    limits = problem.segment_limits()
    durations = [np.nan if waypoint.duration is None else waypoint.duration for waypoint in waypoints[1:]]
    rests = [k for k, waypoint in enumerate(waypoints) if isinstance(waypoint.transition, StopTransition)]
    runs = tuple(
        build_run(robot, waypoints, solved, limits, first, last)
        for first, last in pairwise(rests)
        if last > first + 1 or not isinstance(waypoints[last].motion, JointMotion)
    )
    return JointPath(
        robot=robot,
        waypoints=solved,
        limits=limits,
        durations=np.array(durations),
        dwells=np.array([waypoint.dwell for waypoint in waypoints]),
        runs=runs,
        tool_motions=tuple(
            None if waypoint.tool_motion is None else waypoint.tool_motion.path for waypoint in solved[1:]
        ),
    )


def _refuse_standing_still(solved: tuple[SolvedWaypoint, ...]) -> None:
    travels = np.diff([waypoint.position for waypoint in solved], axis=0)
    still = np.flatnonzero(np.abs(travels).max(axis=1) < POSITION_TOLERANCE)
    if len(still):
        message = "the same joint position as the waypoint before; to rest there, use that waypoint's dwell"
        raise InvalidProblem([(("waypoints", i + 1), message) for i in still.tolist()])
