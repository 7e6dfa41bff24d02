"""Which joint positions of a goal region keep clear, the motions of the tool from there on included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from itertools import takewhile

import numpy as np

from planner.errors import PlanningError
from planner.kinematics.configurations import in_configuration
from planner.kinematics.inverse import all_solutions, solution_layers
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    JointMotion,
    JointWaypoint,
    PlanningProblem,
    PoseWaypoint,
    Waypoint,
)
from planner.problems.rides import handling_of
from planner.robots.tools import with_tools
from planner.scene import CollisionChecker, clearances, edge, is_free
from planner.scene.carried import checker_at_waypoints, checkers_of_segments
from planner.spatial import FloatArray, Pose
from planner.waypoints.goal_regions import SettledWaypoint, Surroundings, settled_at
from planner.waypoints.pinned import pinned_robots
from planner.waypoints.solve import SolvedWaypoint, solve_waypoints
from planner.waypoints.targets import wanted_poses

MOST_MOTIONS = 8
"""The most motions of the tool after a goal region that are proved for each of its joint positions that is tried."""

MOST_LOOKED_AHEAD = 3
"""The most of these motions at whose ends the joint positions of all poses of the region are looked at first."""

MOST_BRANCHES = 16
"""The most solutions of a pose from which the motions of the tool that follow are tried."""

FULL = 6
"""Number of joints of arms whose solutions are isolated and all known."""


class ClearMotions(Surroundings):
    """Collision checks of joint positions and tool motions against the scene and the robot itself.

    Joint positions are not checked against objects that the robot takes or puts down; motions are.
    """

    def __init__(self, problem: PlanningProblem, waypoints: Sequence[AnyWaypoint], checker: CollisionChecker) -> None:
        """Prepare for a problem whose waypoints are within the limits."""
        super().__init__(partial(is_free, checker))
        self._problem, self._waypoints, self._checker = problem, waypoints, checker
        self._robots = with_tools(problem.robot, [waypoint.tool for waypoint in waypoints])
        self._before: dict[int, FloatArray] = {}

    @classmethod
    def of(cls, problem: PlanningProblem, waypoints: Sequence[AnyWaypoint]) -> ClearMotions | None:
        """Prepare for a problem whose waypoints are within the limits; None: nothing may collide."""
        checker = checker_at_waypoints(problem.robot, problem.scene, problem.self_collision, handling_of(problem))
        return None if checker is None or checker.is_empty else cls(problem, waypoints, checker)

    def judges_motions(self, index: int) -> bool:
        """Tell whether a tool motion begins or ends at a waypoint, or the robot has handled objects by then."""
        is_joint_motion = index == 0 or isinstance(self._waypoints[index].motion, JointMotion)
        handles = any(not done.is_none for done in handling_of(self._problem)[: index + 1])
        return bool(self._after(index)) or not is_joint_motion or handles

    def _after(self, index: int) -> list[AnyWaypoint]:
        """Return the waypoints after one with a tolerance region that tool motions join, before the next region."""

        def is_followed(waypoint: AnyWaypoint) -> bool:
            has_region = isinstance(waypoint, PoseWaypoint) and waypoint.free is not None
            return isinstance(waypoint.motion, CartesianMotion) and not has_region

        return list(takewhile(is_followed, self._waypoints[index + 1 : index + 1 + MOST_MOTIONS]))

    def may_lead_on(self, index: int, at_poses: Sequence[AnyWaypoint]) -> np.ndarray:
        """Tell for which poses (N,), bool, tool motions may end collision-free, by closed-form inverse kinematics."""
        after, is_open = self._after(index)[:MOST_LOOKED_AHEAD], np.ones(len(at_poses), dtype=bool)
        robots = self._robots[index : index + len(after) + 1]
        wanted = [wanted_poses(robots, (waypoint, *after)) for waypoint in at_poses]
        for k, waypoint in enumerate(after, start=1):
            has_pins = isinstance(waypoint, PoseWaypoint) and waypoint.external
            known = {row: pose for row in np.flatnonzero(is_open).tolist() if (pose := wanted[row][k]) is not None}
            if isinstance(waypoint, JointWaypoint) or has_pins or robots[k].dof != FULL or not known:
                continue
            layers = solution_layers(robots[k], list(known.values()), self._problem.inverse_kinematics)
            rows = np.repeat(list(known), [len(layer) for layer in layers])
            positions = np.array([q for layer in layers for q in layer]).reshape(-1, robots[k].dof)
            is_open[list(known)] = False
            is_open[rows[self.is_free(positions)]] = True
        return is_open

    def leads_on(self, chosen: Sequence[AnyWaypoint], index: int, before: FloatArray, position: FloatArray) -> bool:
        """Prove that a waypoint and the tool motions to it and after it are collision-free."""
        first, start = index, position
        if index > 0 and not isinstance(chosen[index].motion, JointMotion):
            first, start = index - 1, before
        part = (_at(chosen[first], start), *chosen[first + 1 : index + 1], *self._after(index))
        solved = self._solved(first, part)
        if solved is None:
            return False
        positions = np.array([waypoint.position for waypoint in solved])
        if not self.is_free(positions).all():
            return False
        checkers = self._checkers(first, np.vstack([self._positions_before(chosen, first), positions]))
        at_rest = edge(positions[index - first], positions[index - first])
        if not clearances(checkers[0], at_rest).is_proved:
            return False
        motions = zip(checkers[1:], (waypoint.tool_motion for waypoint in solved[1:]), strict=False)
        return all(motion is None or clearances(checker, motion.curve).is_proved for checker, motion in motions)

    def with_clear_branches(
        self, chosen: Sequence[AnyWaypoint], solved: Sequence[SolvedWaypoint]
    ) -> tuple[AnyWaypoint, ...]:
        """Settle poses at solutions from which the motions of the tool that follow keep clear, where others do not.

        Args:
            chosen: The waypoints, with the poses that were chosen in their regions.
            solved: The same with the solutions on the shortest path.

        Returns:
            The waypoints, the very same where nothing is to be changed.
        """
        waypoints = list(chosen)
        if self._problem.scene is None:
            return tuple(waypoints)
        positions = np.array([waypoint.position for waypoint in solved])
        for k, waypoint in enumerate(waypoints):
            is_pose = isinstance(waypoint, PoseWaypoint) and not isinstance(waypoint, SettledWaypoint)
            after, is_joint_motion = self._after(k), k == 0 or isinstance(waypoint.motion, JointMotion)
            if not (isinstance(waypoint, PoseWaypoint) and is_pose and is_joint_motion and after):
                continue
            motions = [other.tool_motion for other in solved[k + 1 : k + 1 + len(after)]]
            checkers = self._checkers(k, positions[: k + 1 + len(after)])[1:]
            pairs = zip(checkers, motions, strict=False)
            if all(motion is None or clearances(checker, motion.curve).is_proved for checker, motion in pairs):
                continue
            before = positions[max(k - 1, 0)]
            for position in self.branches(waypoint, k, solved[k].wanted, before):
                if self.leads_on(waypoints, k, before, position):
                    waypoints[k] = settled_at(waypoint, position)
                    break
        return tuple(waypoints)

    def branches(self, waypoint: PoseWaypoint, index: int, pose: Pose, before: FloatArray) -> FloatArray:
        """Return the solutions (N, joints) of a pose in its configuration, the nearest to a joint position first."""
        (pinned,) = pinned_robots([self._robots[index]], [waypoint])
        options, near = pinned.options(self._problem.inverse_kinematics), pinned.own(before)
        found = in_configuration(pinned.robot, all_solutions(pinned.robot, pose, options, near), waypoint.configuration)
        positions = np.array(pinned.solutions(found)).reshape(-1, len(before))
        order = np.argsort(np.abs(positions - before).max(axis=1), kind="stable")
        return np.asarray(positions[order][:MOST_BRANCHES])

    def _solved(self, first: int, waypoints: Sequence[AnyWaypoint]) -> tuple[SolvedWaypoint, ...] | None:
        """Return the solved waypoints of a part of the list that begins at an index; None: there is no solution."""
        options = self._problem.inverse_kinematics
        try:
            return solve_waypoints(self._robots[first], waypoints, options, is_free=self.is_free)
        except PlanningError:
            return None

    def _positions_before(self, chosen: Sequence[AnyWaypoint], count: int) -> FloatArray:
        """Return joint positions (count, joints) of the first waypoints, if the robot handles objects there."""
        if count not in self._before:
            handles = any(not done.is_none for done in handling_of(self._problem)[:count])
            solved = self._solved(0, chosen[:count]) if handles else None
            rows = [waypoint.position for waypoint in solved or ()] or np.zeros((count, self._problem.robot.dof))
            self._before[count] = np.array(rows)
        return self._before[count]

    def _checkers(self, first: int, positions: FloatArray) -> Sequence[CollisionChecker]:
        """Return the robot and its surroundings on the segment to a waypoint, and on each segment after it.

        `positions` (waypoints, joints) belong to all waypoints up to the last segment's end.
        """
        scene, handling = self._problem.scene, handling_of(self._problem)[: len(positions)]
        if scene is None or all(done.is_none for done in handling):
            return (self._checker,) * (len(positions) + 1)
        itself = self._problem.self_collision
        checkers = checkers_of_segments(self._problem.robot, scene, itself, handling, positions)
        return (checkers[max(first - 1, 0)], *checkers[first:])


def _at(waypoint: AnyWaypoint, position: FloatArray) -> JointWaypoint:
    """Return a joint position (joints,) in the place of a waypoint where a part of the list begins."""
    kept = {field.name: getattr(waypoint, field.name) for field in fields(Waypoint)}
    return JointWaypoint(position=position.tolist(), **kept | {"motion": JointMotion(), "tool": None})
