"""Which waypoints of a list can be reached, each by itself: nothing is planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.errors import InvalidProblem, PlanningError
from planner.kinematics.configurations import Configuration, in_configuration
from planner.kinematics.forward import manipulability, tool_pose
from planner.kinematics.inverse import InverseKinematicsResult, solutions_or_failure
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import Search, is_isolated, wide_spread
from planner.problems.problem import START_TOLERANCE, AnyWaypoint, JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.problems.rides import unplanned_faults
from planner.problems.waypoint_faults import waypoint_faults
from planner.robots import Robot
from planner.robots.tools import with_tools
from planner.scene import CollisionChecker, Handling, PositionCollision, Scene, collisions_at, is_free
from planner.scene.carried import checker_at_waypoints
from planner.scene.scene import handling_faults
from planner.spatial import FloatArray, Pose
from planner.waypoints.candidates import configuration_error, solutions_in
from planner.waypoints.goal_regions import Surroundings, with_chosen_poses
from planner.waypoints.pinned import Pinned, pinned_robots, without_pins
from planner.waypoints.solve import position_limit_error, unreachable_error, within_limits
from planner.waypoints.targets import moved_pose, of_other_tool, wanted_poses


class LimitMargin(NamedTuple):
    """The distance of a joint position from the position limits.

    Attributes:
        joint: Name of the joint that is nearest to one of its limits, rad and m alike.
        value: Distance from that limit, rad or m.
    """

    joint: str
    value: float


@dataclass(frozen=True, eq=False)
class Reachability:
    """The reachability of one waypoint.

    Attributes:
        error: Why it cannot be reached; None: it can.
        solutions: Number of isolated solutions of the pose in the requested configuration; None: a continuum, or a
            joint waypoint.
        best: (joints,), rad or m: the collision-free solution furthest from the limits; any solution if none is
            collision-free; None: no solution. If the requested configuration has no solution, one of another
            configuration.
        limit_margin: How near `best` is to the limits; None: no joint has limits, or there is no solution.
        manipulability: The manipulability at `best`.
        nearest: The nearest that the robot gets to a pose that it cannot reach.
        free: Whether a collision-free solution exists; None: nothing is checked for collisions.
        free_solutions: How many of `solutions` these are; None as `solutions`, or where `free` is.
        hindered_by: Without a collision-free solution, the pairs in collision at the solutions, each once, the least
            deep first.
    """

    error: PlanningError | None
    solutions: int | None
    best: FloatArray | None = None
    limit_margin: LimitMargin | None = None
    manipulability: float | None = None
    nearest: InverseKinematicsResult | None = None
    free: bool | None = None
    free_solutions: int | None = None
    hindered_by: tuple[PositionCollision, ...] = ()


def reachability(
    robot: Robot,
    waypoints: Sequence[AnyWaypoint],
    options: InverseKinematicsOptions,
    *,
    scene: Scene | None = None,
    self_collision: bool | None = None,
) -> list[Reachability]:
    """Check the reachability of every waypoint by itself, without motions, transitions and speed limits.

    A relative waypoint starts from the requested pose before it, reachable or not. If the orientation of that pose is
    free, the axes of the tool come from the best solution there, or else from the nearest pose. A joint position
    outside the limits by at most `START_TOLERANCE` is moved to the limits, as in plans. Objects that the robot takes or
    puts down at some waypoint are not checked, because it may touch them there.

    Args:
        robot: The robot, with its tool.
        waypoints: One or more.
        options: Tolerances, seed, and the joint position that solutions are turned nearest to.
        scene: The obstacles: collision-free solutions come before others. None: no obstacles.
        self_collision: Whether the arm is checked against itself, see `CollisionChecker`; without a scene only if
            `True`.

    Raises:
        InvalidProblem: A joint position or the reference does not have one value per joint. Or the first waypoint is
            relative, or the scene lacks an object to take.
    """
    handling = [Handling(waypoint.attach, waypoint.detach) for waypoint in waypoints]
    faults = [*waypoint_faults(robot, waypoints, options), *unplanned_faults(waypoints)]
    faults += [] if scene is None else handling_faults(robot, scene, handling)
    if faults:
        raise InvalidProblem(faults)
    checker = checker_at_waypoints(robot, scene, self_collision, handling)
    robots = with_tools(robot, [waypoint.tool for waypoint in waypoints])
    surroundings = None if checker is None or checker.is_empty else Surroundings(partial(is_free, checker))
    waypoints = with_chosen_poses(robot, within_limits(robot, waypoints, START_TOLERANCE), options, surroundings)
    wanted, every_pinned = wanted_poses(robots, waypoints), pinned_robots(robots, waypoints)
    answers: list[Reachability] = []
    before: Pose | None = None
    for index, (robot, waypoint, pose) in enumerate(zip(robots, waypoints, wanted, strict=True)):
        if index and before is not None and robot is not robots[index - 1]:
            before = of_other_tool(before, robots[index - 1], robot)
        if isinstance(waypoint, JointWaypoint):
            q = np.array(waypoint.position)
            refusal = position_limit_error(robot, index, q)
            answers.append(_unreached(refusal, None, checker) if refusal else _reached(robot, None, (q,), checker))
            before = pose
            continue
        axes = None if before is None else before.rotation
        if pose is None:
            assert isinstance(waypoint, RelativeWaypoint)  # noqa: S101 - no other is unknown
            nearest = answers[-1].nearest
            position = answers[-1].best if nearest is None else nearest.position
            assert position is not None  # noqa: S101 - a pose has a solution, or a nearest joint position
            there = tool_pose(robot, position)
            axes, before = there.rotation, Pose(there.position) if before is None else before
            pose = moved_pose(before, axes, waypoint)
        pinned = every_pinned[index]
        solutions = solutions_or_failure(pinned.robot, pose, pinned.options(options))
        if isinstance(solutions, tuple):
            requested = waypoint.configuration if isinstance(waypoint, PoseWaypoint) else Configuration()
            answers.append(_pose_waypoint(robot, pinned, index, pose, solutions, requested, options, checker))
        else:
            nearest = pinned.failure(solutions)
            error = unreachable_error(robot, index, waypoint, pose, nearest, before, axes)
            error.remedies = (*error.remedies, *without_pins(robot, index, waypoint, pose, nearest.position))
            answers.append(_unreached(error, 0, checker, nearest=nearest))
        before = pose
    return answers


def _unreached(
    error: PlanningError,
    solutions: int | None,
    checker: CollisionChecker | None,
    best: FloatArray | None = None,
    nearest: InverseKinematicsResult | None = None,
) -> Reachability:
    nothing = (None, None) if checker is None else (False, solutions)
    return Reachability(error, solutions, best, None, None, nearest, *nothing)


def _pose_waypoint(
    robot: Robot,
    pinned: Pinned,
    index: int,
    pose: Pose,
    solutions: tuple[FloatArray, ...],
    wanted: Configuration,
    options: InverseKinematicsOptions,
    checker: CollisionChecker | None,
) -> Reachability:
    own = pinned.options(options)
    allowed = solutions_in(pinned.robot, pose, solutions, wanted, own)
    if not allowed:
        error = configuration_error(pinned.robot, index, pose, solutions, wanted, own)
        return _unreached(error, 0, checker, pinned.whole(solutions[0]))
    if is_isolated(pinned.robot, pose, allowed[0]):
        return _reached(robot, len(allowed), pinned.solutions(allowed), checker)
    found = _reached(robot, None, pinned.solutions(allowed), checker)
    if found.free is not False:
        return found
    more = in_configuration(pinned.robot, wide_spread(Search(pinned.robot, pose, own)), wanted)
    return _reached(robot, None, pinned.solutions((*allowed, *more)), checker)


def _reached(
    robot: Robot, count: int | None, solutions: tuple[FloatArray, ...], checker: CollisionChecker | None
) -> Reachability:
    """Return what there is to say of the solutions (joints of all,) of a waypoint, one or more."""
    collisions = () if checker is None else collisions_at(checker, np.array(solutions))
    free = [q for q, collision in zip(solutions, collisions, strict=True) if collision is None] if checker else []
    best = max(free or solutions, key=lambda q: float(_margins(robot, q).min()))
    margins = _margins(robot, best)
    joint = int(margins.argmin())
    margin = LimitMargin(robot.joint_names[joint], float(margins[joint])) if np.isfinite(margins[joint]) else None
    reached = Reachability(None, count, best, margin, float(manipulability(robot, best[None])[0]))
    if checker is None:
        return reached
    free_solutions = None if count is None else len(free)
    least: dict[tuple[str, str], PositionCollision] = {}  # each pair as deep as it is least
    for collision in sorted((each for each in collisions if each is not None), key=lambda each: each.depth):
        least.setdefault(collision.pair, collision)
    hindered_by = () if free else tuple(least.values())
    return replace(reached, free=bool(free), free_solutions=free_solutions, hindered_by=hindered_by)


def _margins(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the distance (joints,) of each joint to the nearer of its limits, rad or m; infinite: none."""
    return np.minimum(q - robot.limit("lower"), robot.limit("upper") - q)
