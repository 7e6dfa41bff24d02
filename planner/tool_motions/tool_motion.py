"""A motion of the tool to a waypoint: followed with the joints, or refused with the point where it ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile

import numpy as np

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
from planner.kinematics.turns import turned_to
from planner.problems.problem import AnyWaypoint, CartesianMotion, JointWaypoint, LinearMotion, PoseWaypoint
from planner.problems.regions import Region, region_of
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tolerances import POSITION_TOLERANCE, SAME_CONFIGURATION
from planner.tool_motions.deviations import GENTLE, SHARE_OF_DEVIATION, by_region_joints, through_singular_wrist
from planner.tool_motions.errors import (
    SINGULAR_TRAVEL_SLOWED,
    configuration_error,
    limit_error,
    lost_error,
    singularity_warning,
)
from planner.tool_motions.even_axes import follow_evenly
from planner.tool_motions.follow import SINGULAR_TRAVEL, Lost, Track, follow
from planner.tool_motions.follow_many import follow_any, follow_lines
from planner.tool_motions.pose_paths import Line, NoPath, PosePath, Reversed, stands_still
from planner.tool_motions.position_limits import first_beyond
from planner.tool_motions.redundancy.following import follow_by_choice
from planner.tool_motions.self_motions import follow_by_self_motions
from planner.tool_motions.shapes import SHAPES
from planner.trajectories.polynomials import PiecewisePolynomial, joined
from planner.trajectories.trajectory import PlanWarning

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
        chooses_axes: Whether external axes may go on any way between the ends, as the search of last resort lets them.
    """

    robot: Robot
    options: InverseKinematicsOptions
    index: int
    waypoint: AnyWaypoint
    before: Pose
    after: Pose
    pinned_ends: FloatArray | None = None
    chooses_axes: bool = False

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
            return [turned_to(self.robot, self.waypoint.position, start)]
        if self.pinned_ends is None:
            return []
        pins = self.waypoint.external if isinstance(self.waypoint, PoseWaypoint) else None
        turned = (turned_to(self.robot, q, start, pins or ()) for q in self.pinned_ends)
        return sorted(turned, key=lambda q: float(np.abs(q - start).max()))[:most]

    @property
    def configuration(self) -> Configuration:
        """The configuration in which it is to end; without names any will do."""
        return self.waypoint.configuration if isinstance(self.waypoint, PoseWaypoint) else Configuration()

    @property
    def still(self) -> tuple[str, ...]:
        """The external axes that are to stand still as far as the arm can follow alone."""
        return self.robot.external_axes if self.options.prefer == "arm" else ()

    @property
    def is_to_be_flat(self) -> bool:
        """Whether the axes of a positioner are to hold the workpiece flat all along, instead of going evenly."""
        return self.options.prefer == "weld_flat" and bool(self.robot.positioner) and self.pinned_ends is None

    @property
    def region(self) -> Region:
        """The tolerance region of its poses; without ranges, the poses are as written."""
        return Region() if self.motion.free is None else region_of(self.motion.free)

    @property
    def is_open(self) -> bool:
        """Whether it leaves coordinates open that are chosen where it cannot be followed otherwise."""
        return self.motion.free is not None or self.chooses_axes

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
    for one in requested if idle >= 0 and not (requested[0].still or requested[0].is_to_be_flat) else ():
        is_line = (
            isinstance(one.waypoint.motion, LinearMotion)
            and not one.waypoint.motion.free
            and {one.before.rotation is None, one.after.rotation is None} == {free}
            and one.pinned_ends is None
        )
        line = Line(one.before, one.after)
        if not is_line or stands_still(line) or (idle and isinstance(one.waypoint, JointWaypoint)):
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
        _made(one, line, curve, end)
        for one, line, curve, end in zip(requested, lines, curves[:count], reached, strict=False)
    ]


def follow_path(requested: RequestedMotion, start: FloatArray, path: PosePath) -> ToolMotion | RefusedMotion:
    """Follow the tool's path from a joint position (joints,); use its tolerance region if necessary."""
    has_rotation = path.pose(0.0).rotation is not None
    if requested.is_to_be_flat and has_rotation and (flat := _follow_by_choice(requested, start, path)) is not None:
        return flat
    if (even := _follow_evenly(requested, start, path)) is not None:
        return even
    ends: list[FloatArray | None] = [*requested.given_ends(start)] or [None]
    results = (_follow_as_written(requested, start, path, end) for end in ends)
    result = first = next(results)
    while isinstance(result, RefusedMotion) and (other := next(results, None)) is not None:
        result = other
    result = result if isinstance(result, ToolMotion) else first
    if isinstance(result, ToolMotion) or not (has_rotation and requested.is_open):
        return result
    by_offsets = requested.motion.free is not None and partial(_follow_by_offsets, requested, start, path)
    by_choice = not requested.is_to_be_flat and partial(_follow_by_choice, requested, start, path)
    # Of more than one open coordinate the graph takes longer than offsets near a straight way.
    is_quick = len(requested.region.ranges) + len(requested.robot.external_axes) == 1
    ways = (by_choice, by_offsets) if is_quick else (by_offsets, by_choice)
    return next((motion for way in ways if way and (motion := way()) is not None), result)


def _follow_evenly(requested: RequestedMotion, start: FloatArray, path: PosePath) -> ToolMotion | None:
    """Follow the path while the axes of a positioner go evenly to a given end; None: the arm cannot."""
    motion = requested.motion
    tolerance = motion.tolerance_position, motion.tolerance_orientation
    curve = follow_evenly(requested.robot, path, start, requested.given_ends(start, None), tolerance)
    if curve is None:
        return None
    end: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
    is_allowed = requested.configuration.allows(configurations(requested.robot, end[None])[0])
    return _made(requested, path, curve, end) if is_allowed else None


def _follow_by_offsets(requested: RequestedMotion, start: FloatArray, path: PosePath) -> ToolMotion | None:
    """Follow the path with offsets that keep the joints near the straight way; None: no tried end works."""
    robot, region, ends = requested.robot, requested.region, requested.given_ends(start)
    if robot.dof + len(region.ranges) <= len(path.twist(0.0)):
        return None  # the joints alone say where in the region the tool is
    if not ends:
        found = all_solutions(robot, path.pose(1.0), requested.options, start)
        ends = list(in_configuration(robot, [turned_to(robot, q, start) for q in found], requested.configuration))
    for end in sorted(ends, key=lambda q: float(np.abs(q - start).max()))[:MOST_ENDS]:
        offset = by_region_joints(robot, path, region, start, end, requested.options)
        if offset is None:
            continue
        curve, deviation = _followed(requested, robot, offset, start, end)
        if isinstance(curve, Lost) or first_beyond(robot, curve) is not None:
            continue
        if np.abs(curve.evaluate(curve.breakpoints[-1:], [0])[0][0] - end).max() <= SAME_CONFIGURATION:
            return _made(requested, path, curve, end, deviation)
    return None


def _follow_by_choice(requested: RequestedMotion, start: FloatArray, path: PosePath) -> ToolMotion | None:
    """Follow the path with the cheapest offsets and external axes; None: they cannot be chosen, or lead to no end."""
    robot, region, ends, deviations = requested.robot, requested.region, requested.given_ends(start), [0.0]

    def follow(arm: Robot, moved: PosePath, first: FloatArray, last: FloatArray | None) -> PiecewisePolynomial | Lost:
        curve, deviation = _followed(requested, arm, moved, first, last)
        deviations.append(deviation)
        return curve

    for curve in follow_by_choice(robot, path, region, start, ends, requested.options.prefer, follow):
        reached: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
        given = [end for end in ends if np.abs(reached - end).max() <= SAME_CONFIGURATION]
        is_end = bool(given or not ends) and requested.configuration.allows(configurations(robot, reached[None])[0])
        if is_end and first_beyond(robot, curve) is None:
            return _made(requested, path, curve, [*given, reached][0], max(deviations))
    return None


def _follow_as_written(
    requested: RequestedMotion, start: FloatArray, path: PosePath, given: FloatArray | None
) -> ToolMotion | RefusedMotion:
    """Follow the given path from a joint position (joints,) at its start to the given one, if any."""
    robot = requested.robot
    if stands_still(path) and (given is None or np.abs(given - start).max() <= POSITION_TOLERANCE):
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
        given = None if given is None else turned_to(robot, given, end)
        u, position = 1.0, end
        if given is not None and np.abs(end - given).max() > SAME_CONFIGURATION:
            error = configuration_error(requested.name, robot, end, given)
        elif not requested.configuration.allows(reached):
            error = ConfigurationChange(f"{requested.name} ends with {reached}, not with {requested.configuration}")
        else:
            return _made(requested, path, curve, end if given is None else given, deviation)
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


def _made(
    requested: RequestedMotion, path: PosePath, curve: PiecewisePolynomial, end: FloatArray, angle: float = 0.0
) -> ToolMotion:
    """Return the motion along a curve to its end (joints,), with the warning of a deviation by an angle, rad."""
    return ToolMotion(path, curve, end, singularity_warning(requested.name, requested.robot, path, curve, angle))


def _allowed(waypoints: Sequence[AnyWaypoint]) -> tuple[FloatArray, FloatArray]:
    """Return the tolerances (lines, 2), m and rad, of lines to waypoints, and how steep (lines,) joints may be."""
    motions = [waypoint.motion for waypoint in waypoints if isinstance(waypoint.motion, CartesianMotion)]
    tolerances = np.array([(motion.tolerance_position, motion.tolerance_orientation) for motion in motions])
    return tolerances, np.array([GENTLE if motion.singularity == "deviate" else SINGULAR_TRAVEL for motion in motions])


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
