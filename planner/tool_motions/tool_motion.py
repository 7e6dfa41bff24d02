"""A motion of the tool to a waypoint: followed with the joints, or refused with the point where it ends."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import (
    ConfigurationChange,
    InvalidProblem,
    PathPoint,
    PlanningError,
    UnreachableWaypoint,
)
from planner.kinematics.configurations import Configuration, configurations, in_configuration
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import all_solutions
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import pose_errors
from planner.kinematics.turns import TURN
from planner.problems.problem import AnyWaypoint, CartesianMotion, JointWaypoint, LinearMotion, PoseWaypoint
from planner.problems.regions import Region, region_of
from planner.robots import Robot
from planner.robots.tools import with_region_joints
from planner.spatial import FloatArray, Pose
from planner.tolerances import POSITION_TOLERANCE, SAME_CONFIGURATION
from planner.tool_motions.deviations import by_region_joints, through_singular_wrist
from planner.tool_motions.errors import SINGULAR_TRAVEL_SLOWED, configuration_error, limit_error, lost_error
from planner.tool_motions.even_axes import follow_evenly
from planner.tool_motions.follow import SINGULAR_TRAVEL, Lost, Track, follow
from planner.tool_motions.follow_many import follow_any, follow_lines
from planner.tool_motions.pose_paths import Line, NoPath, PosePath, Reversed
from planner.tool_motions.position_limits import first_beyond
from planner.tool_motions.self_motions import follow_by_self_motions
from planner.tool_motions.shapes import SHAPES
from planner.trajectories.polynomials import PiecewisePolynomial, joined
from planner.trajectories.trajectory import PlanWarning

WORTH_A_WARNING = 100.0
"""Travel of a joint, rad or m, for 1 m or 1 rad of the tool above which a warning says so.

With a joint at 3 rad/s, the tool moves at 30 mm/s.
"""

LEAST_TOOL_TRAVEL = 1e-9
"""The smallest motion of the tool, m and rad, by which that of a joint is divided."""

GENTLE = 20.0
"""Travel of a joint, rad or m, for 1 m or rad of the tool above which the tool rather leaves its orientation.

At 3 rad/s the tool goes at 150 mm/s."""

SHARE_OF_DEVIATION = 0.9
"""The share of the tolerance of the orientation that a path through a singular wrist may use up."""

MOST_ENDS = 4
"""The most solutions at the end of a motion, the nearest ones, that its tolerance region is used to reach."""


@dataclass(frozen=True, eq=False)
class RequestedMotion:
    """A requested motion of the tool along a curve.

    Attributes:
        robot: The arm with its tool.
        options: How poses are solved.
        index: Index of the waypoint where the motion ends.
        waypoint: The waypoint itself.
        before: The requested pose at the waypoint before.
        after: The requested pose at the waypoint itself.
        pinned_ends: Joint positions (n, joints), at one of which it is to end, where external axes are pinned there;
            None: it may end anywhere.
    """

    robot: Robot
    options: InverseKinematicsOptions
    index: int
    waypoint: AnyWaypoint
    before: Pose
    after: Pose
    pinned_ends: FloatArray | None = None

    @property
    def name(self) -> str:
        """The motion in words; `{waypoint}` stands for where it leads, as in the text of a refusal."""
        return f"the {SHAPES[type(self.motion)].name} to waypoint {{waypoint}}"

    @property
    def motion(self) -> CartesianMotion:
        """The motion by itself."""
        assert isinstance(self.waypoint.motion, CartesianMotion)  # noqa: S101 - asked for motions of the tool only
        return self.waypoint.motion

    def given_ends(self, start: FloatArray, most: int | None = MOST_ENDS) -> list[FloatArray]:
        """Return the joint positions (joints,) where it is to end, those nearest to its start first; none: anywhere."""
        if isinstance(self.waypoint, JointWaypoint):
            return [_turned_to(self.robot, self.waypoint.position, start)]
        if self.pinned_ends is None:
            return []
        pins = self.waypoint.external if isinstance(self.waypoint, PoseWaypoint) else None
        turned = (_turned_to(self.robot, q, start, pins or ()) for q in self.pinned_ends)
        return sorted(turned, key=lambda q: float(np.abs(q - start).max()))[:most]

    @property
    def configuration(self) -> Configuration:
        """The configuration in which it is to end; without names any will do."""
        return self.waypoint.configuration if isinstance(self.waypoint, PoseWaypoint) else Configuration()

    @property
    def still(self) -> tuple[str, ...]:
        """The names of the external axes that are to stand still as far as the arm can follow alone."""
        return self.robot.external_axes if self.options.prefer == "arm" else ()

    def pose_path(self, start: FloatArray) -> PosePath:
        """Return the path of the tool.

        Args:
            start: (joints,), rad or m, at the waypoint before. An orientation that is left open there is the one
                reached.

        Raises:
            InvalidProblem: There is no path through the poses, such as no one circle.
        """
        before = self.before
        if before.rotation is None and self.after.rotation is not None:
            before = Pose(before.position, tool_pose(self.robot, start).rotation)
        try:
            return SHAPES[type(self.motion)].path(before, self.motion, self.after)
        except NoPath as error:
            raise InvalidProblem([(("waypoints", self.index, "motion", *error.field), str(error))]) from None


@dataclass(frozen=True, eq=False)
class ToolMotion:
    """A motion of the tool that the joints can follow.

    Attributes:
        path: Poses of the tool over u from 0 to 1.
        curve: Joint positions over the same u.
        end: (joints,), rad or m, where the motion ends.
        warning: The warning of a singularity near its path; None: none.
    """

    path: PosePath
    curve: PiecewisePolynomial
    end: FloatArray
    warning: PlanWarning | None = None


@dataclass(frozen=True, eq=False)
class RefusedMotion:
    """A motion of the tool that the joints cannot follow.

    Attributes:
        requested: The motion.
        start: (joints,), rad or m, from where it was followed.
        path: Poses of the tool over u from 0 to 1.
        point: The point up to which it can be followed.
        error: Why it ends there.
    """

    requested: RequestedMotion
    start: FloatArray
    path: PosePath
    point: PathPoint
    error: PlanningError

    @property
    def is_out_of_reach(self) -> bool:
        """Whether the path leads out of the arm's reach, so that it can be followed from no other start either."""
        depends_on_start = self.requested.before.rotation is None and self.requested.after.rotation is not None
        is_free = self.requested.motion.free is not None
        return isinstance(self.error, UnreachableWaypoint) and not (depends_on_start or is_free)


def follow_motion(requested: RequestedMotion, start: FloatArray) -> ToolMotion | RefusedMotion:
    """Follow a motion of the tool from a joint position (joints,) at the waypoint before.

    Raises:
        InvalidProblem: There is no path through the poses, such as no one circle.
    """
    return follow_path(requested, start, requested.pose_path(start))


def follow_chain(requested: Sequence[RequestedMotion], start: FloatArray, guesses: FloatArray) -> list[ToolMotion]:
    """Follow consecutive tool motions, all at once.

    Args:
        requested: The motions.
        start: (joints,), rad or m, at the start of the first one.
        guesses: (motions, joints), solutions of the inverse kinematics where they are expected to end.

    Returns:
        The first of them, up to one that is not an ordinary straight line within the position limits.
    """
    robot, free = requested[0].robot, requested[0].after.rotation is None
    idle = robot.dof - (3 if free else 6)
    lines: list[Line] = []
    for one in requested if idle >= 0 and not requested[0].still else ():
        is_line = (
            isinstance(one.waypoint.motion, LinearMotion)
            and not one.waypoint.motion.free
            and {one.before.rotation is None, one.after.rotation is None} == {free}
            and one.pinned_ends is None
        )
        line = Line(one.before, one.after)
        if not is_line or _stands_still(line) or (idle and isinstance(one.waypoint, JointWaypoint)):
            break
        lines.append(line)
    if not lines:
        return []
    ends = [one.waypoint for one in requested[: len(lines)]]
    are_given = np.array([isinstance(waypoint, JointWaypoint) for waypoint in ends])
    curves, reached = follow_lines(robot, lines, start, guesses[: len(lines)], are_given, *_allowed(ends))
    if curves and (beyond := first_beyond(robot, joined(curves))) is not None:
        curves = curves[: int(beyond[0])]  # each of them is 1 long
    are_allowed = (
        one.configuration.allows(own) for one, own in zip(requested, configurations(robot, reached), strict=False)
    )
    count = sum(takewhile(bool, are_allowed))
    return [
        ToolMotion(line, curve, end, _warning(one, line, curve, 0.0))
        for one, line, curve, end in zip(requested, lines, curves[:count], reached, strict=False)
    ]


def follow_path(requested: RequestedMotion, start: FloatArray, path: PosePath) -> ToolMotion | RefusedMotion:
    """Follow the tool's path from a joint position (joints,); use its tolerance region if necessary."""
    if (even := _follow_evenly(requested, start, path)) is not None:
        return even
    ends: list[FloatArray | None] = [*requested.given_ends(start)] or [None]
    results = (_follow_as_written(requested, start, path, end) for end in ends)
    result = first = next(results)
    while isinstance(result, RefusedMotion) and (other := next(results, None)) is not None:
        result = other
    result = result if isinstance(result, ToolMotion) else first
    if isinstance(result, ToolMotion) or requested.motion.free is None or path.pose(0.0).rotation is None:
        return result
    return _follow_by_region_joints(requested, start, path, region_of(requested.motion.free)) or result


def _follow_evenly(requested: RequestedMotion, start: FloatArray, path: PosePath) -> ToolMotion | None:
    """Follow the path while the axes of a positioner go evenly to a given end; None: the arm cannot."""
    motion = requested.motion
    tolerance = motion.tolerance_position, motion.tolerance_orientation
    curve = follow_evenly(requested.robot, path, start, requested.given_ends(start, None), tolerance)
    if curve is None:
        return None
    end: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
    is_allowed = requested.configuration.allows(configurations(requested.robot, end[None])[0])
    return ToolMotion(path, curve, end, _warning(requested, path, curve, 0.0)) if is_allowed else None


def _follow_by_region_joints(
    requested: RequestedMotion, start: FloatArray, path: PosePath, region: Region
) -> ToolMotion | None:
    """Follow the path with the region's coordinates as joints behind the tool; None: no tried end works."""
    robot, ends = requested.robot, requested.given_ends(start)
    if not ends:
        solutions = all_solutions(robot, path.pose(1.0), requested.options, start)
        ends = list(in_configuration(robot, [_turned_to(robot, q, start) for q in solutions], requested.configuration))
    free, at_ends = with_region_joints(robot, region.ranges), np.zeros(len(region.ranges))
    for end in sorted(ends, key=lambda q: float(np.abs(q - start).max()))[:MOST_ENDS]:
        arm, first, last = robot, start, end
        to_follow: PosePath | None = path
        if free.dof > len(path.twist(0.0)):
            to_follow = by_region_joints(robot, path, region, start, end, requested.options)
        else:  # the joints alone say where in the region the tool is
            arm, first, last = free, np.append(start, at_ends), np.append(end, at_ends)
        if to_follow is None:
            continue
        curve, deviation = _followed(requested, arm, to_follow, first, last)
        if isinstance(curve, Lost) or first_beyond(arm, curve) is not None:
            continue
        reached = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
        if np.abs(reached - last).max() <= SAME_CONFIGURATION:
            own = PiecewisePolynomial(curve.lengths, curve.coefficients[:, : robot.dof])
            return ToolMotion(path, own, end, _warning(requested, path, own, deviation))
    return None


def _follow_as_written(
    requested: RequestedMotion, start: FloatArray, path: PosePath, given: FloatArray | None
) -> ToolMotion | RefusedMotion:
    """Follow the given path from a joint position (joints,) at its start to the given one, if any."""
    robot = requested.robot
    if _stands_still(path) and (given is None or np.abs(given - start).max() <= POSITION_TOLERANCE):
        return ToolMotion(path, PiecewisePolynomial(np.ones(1), start[None, :, None]), start)
    result, deviation = _followed(requested, robot, path, start, given)
    curve = result.curve if isinstance(result, Lost) else result
    if (beyond := first_beyond(robot, curve)) is not None:
        u, position, joint = beyond
        error: PlanningError = limit_error(requested.name, robot, u, position, joint)
    elif isinstance(result, Lost):
        u, position = result.u, result.position
        error = lost_error(requested.name, robot, path, result, requested.options, requested.motion.singularity)
    else:
        end: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
        if given is None and np.abs(end - start).max() <= POSITION_TOLERANCE:
            end = start
        (reached,) = configurations(robot, end[None])
        given = None if given is None else _turned_to(robot, given, end)
        u, position = 1.0, end
        if given is not None and np.abs(end - given).max() > SAME_CONFIGURATION:
            error = configuration_error(requested.name, robot, end, given)
        elif not requested.configuration.allows(reached):
            error = ConfigurationChange(f"{requested.name} ends with {reached}, not with {requested.configuration}")
        else:
            warning = _warning(requested, path, curve, deviation)
            return ToolMotion(path, curve, end if given is None else given, warning)
    there = PathPoint(u, tool_pose(robot, position), position)
    error = error.with_fields(segment=requested.index - 1, waypoint=requested.index, path_point=there)
    return RefusedMotion(requested, start, path, there, error)


def _followed(
    requested: RequestedMotion, robot: Robot, path: PosePath, start: FloatArray, end: FloatArray | None
) -> tuple[PiecewisePolynomial | Lost, float]:
    """Follow the path from a joint position (joints,); return its deliberate rotation from the path, rad, too."""
    motion = requested.motion
    steepest = SINGULAR_TRAVEL_SLOWED if motion.singularity == "slow" else SINGULAR_TRAVEL
    track = Track(robot, path, start, end, (motion.tolerance_position, motion.tolerance_orientation), steepest)
    if motion.singularity == "deviate":
        near = follow_any(replace(track, steepest=GENTLE))
        if not isinstance(near, Lost):
            return near, 0.0
        deviated, angle = through_singular_wrist(robot, path, near) or (path, np.inf)
        if angle < SHARE_OF_DEVIATION * motion.tolerance_orientation:
            rest = motion.tolerance_orientation - angle
            through = follow(replace(track, path=deviated, tolerance=(motion.tolerance_position, rest)))
            if not isinstance(through, Lost):
                return through, angle
    is_redundant = robot.dof > track.rows
    if requested.still and is_redundant:
        alone = follow(track, requested.still)
        if not isinstance(alone, Lost) and first_beyond(robot, alone) is None:
            return alone, 0.0
    result = follow_any(track)
    if is_redundant and (isinstance(result, Lost) or first_beyond(robot, result) is not None):
        return follow_by_self_motions(track), 0.0
    return result, 0.0


def _warning(
    requested: RequestedMotion, path: PosePath, curve: PiecewisePolynomial, angle: float
) -> PlanWarning | None:
    """Return the warning of a motion through a singularity or near one."""
    if angle > 0.0:
        how = "goes right through a singularity of the wrist"
        return PlanWarning("orientation_deviates", f"{requested.name} {how}, for which it turns off by {angle:.3g} rad")
    rates = np.abs(curve.coefficients[:, :, 1]) / max(float(np.abs(path.twist(0.0)).max()), LEAST_TOOL_TRAVEL)
    knot, joint = np.unravel_index(rates.argmax(), rates.shape)
    if rates[knot, joint] < WORTH_A_WARNING:
        return None
    message = (
        f"{requested.name} passes near a singularity after {curve.breakpoints[knot]:.1%} of the way: for 1 m or 1 rad "
        f"of the tool {requested.robot.joint_names[joint]} goes {rates[knot, joint]:.3g}, so the tool has to go slowly"
    )
    return PlanWarning("near_singularity", message)


def _turned_to(robot: Robot, position: ArrayLike, towards: FloatArray, still: Collection[str] = ()) -> FloatArray:
    """Turn continuous joints of a position (joints,), except some, to the turn nearest to another (joints,)."""
    q = np.asarray(position, dtype=np.float64)
    turns = np.round((towards - q) / TURN)
    return q + TURN * np.where([one.kind == "continuous" and one.name not in still for one in robot.joints], turns, 0.0)


def _allowed(waypoints: Sequence[AnyWaypoint]) -> tuple[FloatArray, FloatArray]:
    """Return the tolerances (lines, 2), m and rad, of lines to waypoints, and how steep (lines,) joints may be."""
    motions = [waypoint.motion for waypoint in waypoints if isinstance(waypoint.motion, CartesianMotion)]
    tolerances = np.array([(motion.tolerance_position, motion.tolerance_orientation) for motion in motions])
    return tolerances, np.array([GENTLE if motion.singularity == "deviate" else SINGULAR_TRAVEL for motion in motions])


def _stands_still(path: PosePath) -> bool:
    """Tell whether a line has no length, and the tool does not turn on it."""
    if not isinstance(path, Line):
        return False
    distance, angle = pose_errors(path.pose(0.0), path.pose(1.0))
    return max(distance, angle or 0.0) <= POSITION_TOLERANCE


def start_of_motion(requested: RequestedMotion, end: FloatArray) -> FloatArray | None:
    """Return the joint position (joints,) from which a motion leads to `end` (joints,): followed backwards.

    Returns:
        None: the motion cannot be followed within the position limits, or its first orientation is left open.
    """
    if requested.before.rotation is None and requested.after.rotation is not None:
        return None
    path = Reversed(requested.pose_path(end))
    curve, _ = _followed(requested, requested.robot, path, end, None)
    if isinstance(curve, Lost) or first_beyond(requested.robot, curve) is not None:
        return None
    return np.asarray(curve.evaluate(curve.breakpoints[-1:], [0])[0][0])
