"""Poses with a tolerance region: the choice of the pose with the nearest or the preferred joint position.

In a scene, collision-free joint positions come before all others. Among these, those whose following tool motions are
collision-free come first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from planner.kinematics import IsFree
from planner.kinematics.configurations import configurations
from planner.kinematics.costs import PREFERENCE_WEIGHT, motion_costs
from planner.kinematics.inverse import inverse_kinematics, solution_layers
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import QUICK, Search
from planner.problems.problem import AnyWaypoint, JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.problems.regions import Region, region_of
from planner.robots import Robot
from planner.robots.tools import with_region_joints, with_tools
from planner.spatial import FloatArray, Pose
from planner.tool_motions.redundancy.flattest import flattest_solutions
from planner.waypoints.pinned import Pinned, pinned_robots
from planner.waypoints.preferences import costs_of, least_cost
from planner.waypoints.targets import wanted_poses

SWEEP = 2.0 * np.pi / 72
"""The distance of turns that are tried at first, rad: every five degrees, so that no branch of solutions is missed."""

FEWEST = 9
"""The fewest offsets tried first in a region with one coordinate."""

TOGETHER = 128
"""Number of offsets tried first in a region with several coordinates."""

REFINED_POSITIONS = 3
"""Number of the best joint positions that are refined: the best branches, and neighbours on them."""

MOST_TRIED_POSITIONS = 100
"""The most joint positions of a region whose following tool motions are tried, each some 10 ms."""


class Surroundings:
    """Obstacles around the robot, which judge joint positions only.

    Attributes:
        is_free: Tells which joint positions (N, joints) keep clear.
    """

    def __init__(self, is_free: IsFree) -> None:
        """Prepare for what tells which joint positions keep clear."""
        self.is_free = is_free

    def judges_motions(self, index: int) -> bool:
        """Tell whether it judges more than the joint position at a waypoint with a tolerance region."""
        return False

    def may_lead_on(self, index: int, at_poses: Sequence[AnyWaypoint]) -> np.ndarray:
        """Tell from which poses (N,), bool, of a waypoint's goal region the motions of the tool may be free."""
        return np.ones(len(at_poses), dtype=bool)

    def leads_on(self, chosen: Sequence[AnyWaypoint], index: int, before: FloatArray, position: FloatArray) -> bool:
        """Prove that a waypoint and the tool motions to it and after it are collision-free.

        Args:
            chosen: The waypoints up to this one, each with its pose.
            index: Index of this one.
            before: (joints,), rad or m: where the robot comes from.
            position: (joints,): its joint position at the waypoint.
        """
        return True


@dataclass(frozen=True, kw_only=True)
class SettledWaypoint(PoseWaypoint):
    """A pose that was chosen in its region for one joint position, from which motions of the tool are free.

    Attributes:
        position: One value per joint, rad or m.
    """

    position: tuple[float, ...]


def with_chosen_poses(
    robot: Robot,
    waypoints: Sequence[AnyWaypoint],
    options: InverseKinematicsOptions,
    surroundings: Surroundings | None = None,
) -> tuple[AnyWaypoint, ...]:
    """Choose the poses of waypoints in their regions, one after the other; the others stay as they are.

    For a pose without a region, the function assumes the solution nearest to the joint position before. If no pose of a
    region is reachable, the pose nearest to the given one remains.

    Args:
        robot: The robot, with the tool that it has until a waypoint changes it.
        waypoints: The requested waypoints.
        options: Options of the inverse kinematics, with the preference. The path starts at their reference, or else in
            the middle of the limits.
        surroundings: The obstacles; None: none.
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
            selection = _Selection(chosen[: k + 1], pinned, region_of(waypoint.free), near, surroundings)
            chosen[k] = waypoint = _chosen(selection, waypoint, pinned.options(options))
        if isinstance(waypoint, JointWaypoint | SettledWaypoint):
            near = np.array(waypoint.position)
        elif k < free[-1]:
            origin = origin if isinstance(waypoint, RelativeWaypoint) else k
            there = wanted_poses(robots[origin : k + 1], chosen[origin : k + 1])[-1]
            pinned = every_pinned[k]
            if there is not None:
                own_options, own_near = pinned.options(options), pinned.own(near)
                solved = inverse_kinematics(pinned.robot, there, own_options, own_near, _is_free(surroundings, pinned))
                near = near if solved.status != "solved" else pinned.whole(solved.position)
        origin = k if isinstance(waypoint, JointWaypoint) else origin
    return tuple(chosen)


def _is_free(surroundings: Surroundings | None, pinned: Pinned) -> IsFree | None:
    """Return what tells which positions (N, joints) of the joints that are not pinned keep clear; None: all do."""
    return None if surroundings is None else lambda positions: surroundings.is_free(pinned.whole(positions))


def settled_at(waypoint: PoseWaypoint, position: FloatArray) -> SettledWaypoint:
    """Return a pose with the joint position (joints,) that was chosen for it."""
    kept = {field.name: getattr(waypoint, field.name) for field in fields(PoseWaypoint)}
    return SettledWaypoint(**kept, position=tuple(position.tolist()))


def positions_in_region(
    pinned: Pinned, waypoint: PoseWaypoint, near: FloatArray, options: InverseKinematicsOptions
) -> FloatArray:
    """Return joint positions (N, joints) all over the goal region of a waypoint, in its configuration.

    The robot comes from the joint position `near` (joints,).
    """
    found = _solutions(pinned.robot, waypoint, pinned.own(near), pinned.options(options))
    own = np.array([position[: pinned.robot.dof] for position in found])
    wanted = waypoint.configuration
    if wanted.names and found:
        own = own[[wanted.allows(other) for other in configurations(pinned.robot, own)]]
    return pinned.whole(own) if len(own) else np.zeros((0, len(near)))


@dataclass(frozen=True, eq=False)
class _Selection:
    """A waypoint with a tolerance region, and its obstacles.

    Attributes:
        chosen: The waypoints up to it, those before it with their poses.
        pinned: The robot that reaches it.
        region: Its tolerance region.
        before: (joints,), rad or m: the joint position before.
        surroundings: The obstacles; None: none.
    """

    chosen: Sequence[AnyWaypoint]
    pinned: Pinned
    region: Region
    before: FloatArray
    surroundings: Surroundings | None

    @property
    def judges_motions(self) -> bool:
        """Whether the choice depends on more than the joint position."""
        return self.surroundings is not None and self.surroundings.judges_motions(len(self.chosen) - 1)

    def is_free(self, solutions: FloatArray) -> np.ndarray:
        """Tell which joint positions (N, joints and offsets) are collision-free."""
        if self.surroundings is None:
            return np.ones(len(solutions), dtype=bool)
        return self.surroundings.is_free(self.pinned.whole(solutions[:, : self.pinned.robot.dof]))

    def with_pose(self, waypoint: PoseWaypoint, solution: FloatArray) -> PoseWaypoint:
        """Return the waypoint with the pose of a joint position with offsets (joints and offsets,)."""
        pose = self.region.pose(waypoint.pose, solution[self.pinned.robot.dof :][::-1])
        return replace(waypoint, pose=pose, free=None)

    def pose_by_pose(self, waypoint: PoseWaypoint, solutions: FloatArray) -> FloatArray:
        """Select joint positions whose tool motions may be free, the first of each pose before any second."""
        joints = self.pinned.robot.dof
        _, first, pose_of = np.unique(solutions[:, joints:].round(6), axis=0, return_index=True, return_inverse=True)
        at_poses = [self.with_pose(waypoint, solution) for solution in solutions[first]]
        assert self.surroundings is not None  # noqa: S101 - else no motions are judged
        may_lead_on = self.surroundings.may_lead_on(len(self.chosen) - 1, at_poses)
        seen: Counter[int] = Counter()
        ranked = []
        for row, pose in enumerate(pose_of.tolist()):
            if may_lead_on[pose]:
                ranked.append((seen[pose], row))
                seen[pose] += 1
        return solutions[[row for _, row in sorted(ranked)]]

    def leads_on(self, waypoint: PoseWaypoint, solution: FloatArray) -> SettledWaypoint | None:
        """Fix the waypoint at a joint position (joints and offsets,), if its tool motions are collision-free."""
        at_pose = self.with_pose(waypoint, solution)
        position = self.pinned.whole(solution[: self.pinned.robot.dof])
        chosen = (*self.chosen[:-1], at_pose)
        if self.surroundings is None or not self.surroundings.leads_on(chosen, len(chosen) - 1, self.before, position):
            return None
        return settled_at(at_pose, position)


def _solutions(
    robot: Robot, waypoint: PoseWaypoint, near: FloatArray, options: InverseKinematicsOptions
) -> list[FloatArray]:
    """Return joint positions (joints and offsets,) at poses across the region of a waypoint."""
    assert waypoint.free is not None  # noqa: S101 - has a region
    region, requested = region_of(waypoint.free), waypoint.pose_in_base
    if options.prefer == "weld_flat":
        flattest = flattest_solutions(robot, requested, region, options, near)
        if flattest:
            return [np.concatenate([q, offsets[::-1]]) for q, offsets in flattest]
    if robot.dof >= 6:
        return _in_spread(robot, requested, region, near, options)
    # Few poses of the region can be reached: those that the region's joints lead to.
    free = with_region_joints(robot, region.ranges)
    return list(solution_layers(free, [requested], options, np.append(near, np.zeros(len(region.ranges))))[0])


def _chosen(selection: _Selection, waypoint: PoseWaypoint, options: InverseKinematicsOptions) -> PoseWaypoint:
    """Return a waypoint with the pose in its region that has the nearest or preferred joint position."""
    robot, region, near = selection.pinned.robot, selection.region, selection.pinned.own(selection.before)
    requested, wanted, preferred = waypoint.pose_in_base, waypoint.configuration, costs_of(robot, options)

    def costs(positions: FloatArray) -> FloatArray:
        """Return the costs (N,), s, of joint positions (N, joints and offsets) in the requested configuration."""
        own = positions[:, : robot.dof]
        found = motion_costs(robot, near, own, options.prefer) if preferred is None else preferred(own)
        if options.prefer == "weld_flat":  # which leaves turns about the tool open
            found = motion_costs(robot, near, own, options.prefer) + PREFERENCE_WEIGHT * found
        if wanted.names:
            found[[not wanted.allows(other) for other in configurations(robot, own)]] = np.inf
        return found

    free = with_region_joints(robot, region.ranges)
    found = _solutions(robot, waypoint, near, options)
    found = [q for q in found if np.isfinite(costs(q[None])[0])] if wanted.names else found
    if not found:
        as_written = np.array([np.clip(0.0, *ends) for ends in region.ranges.values()])
        return replace(waypoint, pose=region.pose(waypoint.pose, as_written), free=None)
    solutions = np.array(found)
    solutions = solutions[costs(solutions).argsort(kind="stable")]
    is_free = selection.is_free(solutions)
    solutions = solutions[is_free] if is_free.any() else solutions
    search = Search(free, requested, options)

    def refined(start: FloatArray) -> FloatArray:
        return least_cost(search, start, costs, selection.is_free if is_free.any() else None)

    if is_free.any() and selection.judges_motions:
        for solution in selection.pose_by_pose(waypoint, solutions)[:MOST_TRIED_POSITIONS]:
            if (settled := selection.leads_on(waypoint, solution)) is not None:
                return selection.leads_on(waypoint, refined(solution)) or settled
    best = np.array([refined(solution) for solution in solutions[:REFINED_POSITIONS]])
    return selection.with_pose(waypoint, best[int(costs(best).argmin())])


def _in_spread(
    robot: Robot, requested: Pose, region: Region, near: FloatArray, options: InverseKinematicsOptions
) -> list[FloatArray]:
    """Return joint positions (joints and offsets,) at poses across a region."""
    offsets = _spread(region)
    poses = [region.pose(requested, row) for row in offsets]
    layers = solution_layers(robot, poses, options, near)
    found = [np.concatenate([q, row[::-1]]) for row, layer in zip(offsets, layers, strict=True) for q in layer]
    if robot.dof > 6:  # what is known of a continuum is a spread: these are the solutions nearby
        start = np.clip(near, robot.limit("lower"), robot.limit("upper"))
        nearby = (Search(robot, pose, options).solve(start, QUICK) for pose in poses)
        solved = zip(offsets, nearby, strict=True)
        found += [np.concatenate([q, row[::-1]]) for row, q in solved if q is not None]
    return found


def _spread(region: Region) -> FloatArray:
    """Return offsets (N, ranges) across a region."""
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
