"""Poses of which something is left open: of all in their region that of the nearest posture, or the preferred one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.configurations import configurations
from planner.kinematics.inverse import inverse_kinematics, solution_layers
from planner.kinematics.search import QUICK, Search
from planner.problems.problem import JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.problems.regions import region_of
from planner.robots.freedoms import with_freedoms
from planner.robots.tools import with_tools
from planner.tool_motions.least_cost import least_cost
from planner.waypoints.choice import motion_costs
from planner.waypoints.pinned import pinned_robots
from planner.waypoints.preferences import costs_of
from planner.waypoints.targets import wanted_poses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics.options import InverseKinematicsOptions
    from planner.problems.problem import AnyWaypoint
    from planner.problems.regions import Region
    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

SWEEP = 2.0 * np.pi / 72
"""The distance of turns that are tried at first, rad: every five degrees, so that no branch of solutions is missed."""

FEWEST = 9
"""The fewest offsets of one freedom that are tried at first."""

TOGETHER = 128
"""Number of offsets that are tried at first where there are several freedoms."""

REFINED = 3
"""Number of the best of them from which the posture is refined: the best branches, and neighbours on them."""


def with_chosen_poses(
    robot: Robot, waypoints: Sequence[AnyWaypoint], options: InverseKinematicsOptions
) -> tuple[AnyWaypoint, ...]:
    """Choose the poses of waypoints in their regions, one after the other; the others stay as they are.

    The posture at a pose that is asked in full is taken to be the one nearest to the posture before. Where no pose of a
    region can be reached, the one nearest to what is written is what is asked.

    Args:
        robot: The robot, with the tool that it has until a waypoint changes it.
        waypoints: The waypoints as they are asked.
        options: How poses are solved, and what is preferred in place of the nearest posture; the way starts at their
            reference, or else in the middle of the limits.
    """
    chosen = list(waypoints)
    free = [k for k, waypoint in enumerate(chosen) if isinstance(waypoint, PoseWaypoint) and waypoint.free]
    robots = with_tools(robot, [waypoint.tool for waypoint in waypoints])
    every_pinned = pinned_robots(robots, waypoints)
    near = robot.middle if options.reference is None else np.array(options.reference)
    origin = 0
    for k in range(free[-1] + 1 if free else 0):
        waypoint = chosen[k]
        if isinstance(waypoint, PoseWaypoint) and waypoint.free:
            pinned = every_pinned[k]
            region = region_of(waypoint.free)
            pose = _chosen(pinned.robot, waypoint, region, pinned.own(near), pinned.options(options))
            chosen[k] = waypoint = replace(waypoint, pose=pose, free=None)
        if isinstance(waypoint, JointWaypoint):
            near = np.array(waypoint.position)
        elif k < free[-1]:
            origin = origin if isinstance(waypoint, RelativeWaypoint) else k
            there = wanted_poses(robots[origin : k + 1], chosen[origin : k + 1])[-1]
            pinned = every_pinned[k]
            if there is not None:
                solved = inverse_kinematics(pinned.robot, there, pinned.options(options), pinned.own(near))
                near = near if solved.status != "solved" else pinned.whole(solved.position)
        origin = k if isinstance(waypoint, JointWaypoint) else origin
    return tuple(chosen)


def _chosen(
    robot: Robot, waypoint: PoseWaypoint, region: Region, near: FloatArray, options: InverseKinematicsOptions
) -> Pose:
    """Return the pose in the region of a waypoint that has the posture nearest to another (joints,), or the best."""
    asked, wanted, preferred = waypoint.pose_in_base, waypoint.configuration, costs_of(robot, options)

    def costs(positions: FloatArray) -> FloatArray:
        """Return the costs (N,), s, of postures (N, joints and freedoms) in the configuration asked."""
        own = positions[:, : robot.dof]
        found = motion_costs(robot, near, own, options.prefer) if preferred is None else preferred(own)
        if wanted.names:
            found[[not wanted.allows(other) for other in configurations(robot, own)]] = np.inf
        return found

    free = with_freedoms(robot, region.ranges)
    if robot.dof >= 6:
        found = _in_spread(robot, asked, region, near, options)
    else:  # few poses of the region can be reached: those that the freedoms lead to
        found = list(solution_layers(free, [asked], options, np.append(near, np.zeros(len(region.ranges))))[0])
    found = [q for q in found if np.isfinite(costs(q[None])[0])] if wanted.names else found
    if not found:
        return region.pose(waypoint.pose, np.array([np.clip(0.0, *ends) for ends in region.ranges.values()]))
    postures = np.array(found)
    best = postures[costs(postures).argsort(kind="stable")[:REFINED]]
    search = Search(free, asked, options)
    refined = np.array([least_cost(search, q, costs) for q in best])
    taken = refined[int(costs(refined).argmin())]
    return region.pose(waypoint.pose, taken[robot.dof :][::-1])


def _in_spread(
    robot: Robot, asked: Pose, region: Region, near: FloatArray, options: InverseKinematicsOptions
) -> list[FloatArray]:
    """Return postures (joints and freedoms,) at poses all over a region."""
    offsets = _spread(region)
    poses = [region.pose(asked, row) for row in offsets]
    layers = solution_layers(robot, poses, options, near)
    found = [np.concatenate([q, row[::-1]]) for row, layer in zip(offsets, layers, strict=True) for q in layer]
    if robot.dof > 6:  # what is known of a continuum is a spread: these are the solutions nearby
        start = np.clip(near, robot.limit("lower"), robot.limit("upper"))
        nearby = (Search(robot, pose, options).solve(start, **QUICK) for pose in poses)
        solved = zip(offsets, nearby, strict=True)
        found += [np.concatenate([q, row[::-1]]) for row, q in solved if q is not None]
    return found


def _spread(region: Region) -> FloatArray:
    """Return offsets (N, freedoms) all over a region."""
    ends: FloatArray = np.array(list(region.ranges.values()))
    lower, upper = ends[:, 0], ends[:, 1]
    if len(lower) > 1:
        shares: FloatArray = np.random.default_rng(0).random((TOGETHER, len(lower)))
        shares[0] = np.clip(-lower / np.where(upper > lower, upper - lower, 1.0), 0.0, 1.0)  # the pose as it is written
        return lower + shares * (upper - lower)
    count = FEWEST
    if next(iter(region.ranges)).startswith("rotation"):
        count = max(FEWEST, int(np.ceil((upper[0] - lower[0]) / SWEEP)) + 1)
    steps: FloatArray = np.linspace(0.0, 1.0, count)[:, None]
    return lower + steps * (upper - lower)
