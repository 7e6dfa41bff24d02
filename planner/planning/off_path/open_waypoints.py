"""Waypoints whose joint position is open: in a tolerance region, of a redundant arm, or without an orientation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.kinematics.configurations import Configuration, in_configuration
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.search import QUICK, Search
from planner.problems.motion_around import as_requested
from planner.problems.problem import JointMotion, JointWaypoint, PlanningProblem, PoseWaypoint
from planner.problems.regions import Region, region_of
from planner.robots import Robot
from planner.robots.tools import with_region_joints
from planner.spatial import FloatArray, Pose
from planner.tool_motions.inverse_jacobian import null_space
from planner.waypoints.pinned import Pinned, pinned_robots
from planner.waypoints.targets import wanted_poses


@dataclass(frozen=True, eq=False)
class OpenWaypoint:
    """A pose waypoint that several joint positions meet.

    Its coordinates (coordinates,) are the joints that are not fixed, and behind them the offsets in its region.

    Attributes:
        index: Index of the waypoint in the requested problem.
        pose: The requested pose.
        region: Its tolerance region; None: none.
        robot: The robot with the tool of the waypoint.
        search: Solves its pose with joints and offsets.
        pinned: The robot without the external axes that the waypoint fixes.
        configuration: The requested configuration.
    """

    index: int
    pose: Pose
    region: Region | None
    robot: Robot
    search: Search
    pinned: Pinned
    configuration: Configuration

    def tangent(self, coordinates: FloatArray) -> FloatArray:
        """Return the directions (directions, coordinates) in which the coordinates may move."""
        return null_space(jacobian(self.search.robot, coordinates)[: self.search.rows])

    def returned(self, coordinates: FloatArray) -> FloatArray | None:
        """Return coordinates near given ones that meet the pose; None: there are none in the configuration."""
        within = np.clip(coordinates, self.search.lower, self.search.upper)
        solved = self.search.solve(within, QUICK)
        if solved is None or not self.configuration.names:
            return solved
        own = solved[: self.pinned.robot.dof]
        return solved if in_configuration(self.pinned.robot, [own], self.configuration) else None

    def coordinates(self, position: FloatArray) -> FloatArray:
        """Return the coordinates of a joint position (joints,), within their ranges."""
        offsets: list[float] = []
        if self.region is not None:
            offsets = [*self.region.offsets(self.pose, tool_pose(self.robot, position)).values()][::-1]
        found = np.concatenate([self.pinned.own(position), offsets])
        return np.asarray(np.clip(found, self.search.lower, self.search.upper), dtype=np.float64)

    def position(self, coordinates: FloatArray) -> FloatArray:
        """Return the joint position (joints,) at coordinates, rad or m."""
        return self.pinned.whole(coordinates[: self.pinned.robot.dof])

    @cached_property
    def joints(self) -> np.ndarray:
        """Indices of the joints that its first coordinates are."""
        return np.flatnonzero(self.pinned.left)


def open_waypoints(problem: PlanningProblem, positions: FloatArray) -> dict[OpenWaypoint, FloatArray]:
    """Return the open waypoints of a problem, with their coordinates.

    Waypoints at the end of a tool motion are not among them: their joint position continues from the waypoint before.
    A preference of the inverse kinematics other than `continuous` decides the joint positions itself.

    Args:
        problem: The problem as requested, without detours.
        positions: The joint positions (waypoints, joints) at them, rad or m.
    """
    if problem.inverse_kinematics.prefer != "continuous":
        return {}
    waypoints = [as_requested(waypoint) for waypoint in problem.waypoints]
    poses = wanted_poses(problem.robots, waypoints)
    pinned_at = pinned_robots(problem.robots, waypoints)
    found: dict[OpenWaypoint, FloatArray] = {}
    for k, (waypoint, pinned) in enumerate(zip(waypoints, pinned_at, strict=True)):
        if isinstance(waypoint, JointWaypoint) or not isinstance(waypoint.motion, JointMotion):
            continue
        robot, pose, region, configuration = pinned.robot, poses[k], None, Configuration()
        if isinstance(waypoint, PoseWaypoint):
            pose, configuration = waypoint.pose_in_base, waypoint.configuration
            if waypoint.free:
                region = region_of(waypoint.free)
                robot = with_region_joints(robot, region.ranges)
        if pose is None:
            continue
        search = Search(robot, pose, pinned.options(problem.inverse_kinematics))
        one = OpenWaypoint(k, pose, region, problem.robots[k], search, pinned, configuration)
        coordinates = one.coordinates(positions[k])
        if len(one.tangent(coordinates)):
            found[one] = coordinates
    return found
