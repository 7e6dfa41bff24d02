"""A motion of the tool to a waypoint: followed with the joints, or refused with the point where it ends."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import (
    ConfigurationChange,
    InvalidProblem,
    JointPositionLimit,
    PathPoint,
    PlanningError,
    SingularPath,
    UnreachableWaypoint,
)
from planner.kinematics.configurations import Configuration, configurations
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.inverse import inverse_kinematics
from planner.kinematics.search import pose_errors
from planner.kinematics.turns import TURN
from planner.polynomials import PiecewisePolynomial, joined
from planner.problem import CartesianMotion, JointWaypoint, LinearMotion, PoseWaypoint
from planner.spatial import Pose
from planner.tolerances import POSITION_TOLERANCE, SAME_CONFIGURATION
from planner.tool_motions.deviations import through_singular_wrist
from planner.tool_motions.follow import GENTLE, STEEP, STEEPEST, Lost, follow
from planner.tool_motions.follow_many import follow_lines
from planner.tool_motions.pose_paths import Line, NoPath, Reversed
from planner.tool_motions.position_limits import first_beyond
from planner.tool_motions.self_motions import follow_by_self_motions
from planner.tool_motions.shapes import SHAPES
from planner.trajectory import PlanWarning

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from planner.kinematics.options import InverseKinematicsOptions
    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.tool_motions.pose_paths import PosePath

LOOK_AHEAD = 2e-3
"""The share of the way behind the point where the arm got stuck, at which the path is tried for reachability."""

WORTH_A_WARNING = 100.0
"""How far a joint goes, rad or m, where the tool goes 1 m or rad, if that is worth a warning: at 3 rad/s of the joint
the tool goes at 30 mm/s."""

SLOWEST = 1e-9
"""The smallest motion of the tool, m and rad, by which that of a joint is divided."""

SHARE_OF_DEVIATION = 0.9
"""The share of the tolerance of the orientation that a path through a singular wrist may use up."""

LOOKS_AHEAD = 8
"""The number of poses on the rest of the way that are tried for it, too."""


@dataclass(frozen=True, eq=False)
class AskedMotion:
    """A motion of the tool along a curve, as a waypoint asks for it.

    Attributes:
        robot: The arm with its tool.
        options: How poses are solved.
        index: Index of the waypoint where the motion ends.
        waypoint: The waypoint itself.
        before: The pose asked at the waypoint before.
        after: The pose asked at the waypoint itself.
    """

    robot: Robot
    options: InverseKinematicsOptions
    index: int
    waypoint: AnyWaypoint
    before: Pose
    after: Pose

    @property
    def name(self) -> str:
        """The motion in words."""
        return f"the {SHAPES[type(self.motion)].name} to waypoint {self.index}"

    @property
    def motion(self) -> CartesianMotion:
        """The motion by itself."""
        assert isinstance(self.waypoint.motion, CartesianMotion)  # noqa: S101 - asked for motions of the tool only
        return self.waypoint.motion

    @property
    def configuration(self) -> Configuration:
        """The configuration in which it is to end; without names any will do."""
        return self.waypoint.configuration if isinstance(self.waypoint, PoseWaypoint) else Configuration()

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
        warning: What is to be said of a singularity near its path; None: nothing.
    """

    path: PosePath
    curve: PiecewisePolynomial
    end: FloatArray
    warning: PlanWarning | None = None


@dataclass(frozen=True, eq=False)
class RefusedMotion:
    """A motion of the tool that the joints cannot follow.

    Attributes:
        asked: The motion.
        start: (joints,), rad or m, from where it was followed.
        path: Poses of the tool over u from 0 to 1.
        point: The point up to which it can be followed.
        error: Why it ends there.
    """

    asked: AskedMotion
    start: FloatArray
    path: PosePath
    point: PathPoint
    error: PlanningError

    @property
    def is_out_of_reach(self) -> bool:
        """Whether the path leads out of the arm's reach, so that it can be followed from no other start either."""
        depends_on_start = self.asked.before.rotation is None and self.asked.after.rotation is not None
        return isinstance(self.error, UnreachableWaypoint) and not depends_on_start


def follow_motion(asked: AskedMotion, start: FloatArray) -> ToolMotion | RefusedMotion:
    """Follow a motion of the tool from a joint position (joints,) at the waypoint before.

    Raises:
        InvalidProblem: There is no path through the poses, such as no one circle.
    """
    return follow_path(asked, start, asked.pose_path(start))


def follow_chain(asked: Sequence[AskedMotion], start: FloatArray, guesses: FloatArray) -> list[ToolMotion]:
    """Follow motions of the tool, each of which starts where the one before ends, all at once.

    Args:
        asked: The motions.
        start: (joints,), rad or m, at the start of the first one.
        guesses: (motions, joints), solutions of the inverse kinematics where they are expected to end.

    Returns:
        The first of them, up to one that is not an ordinary straight line within the position limits.
    """
    robot, free = asked[0].robot, asked[0].after.rotation is None
    idle = robot.dof - (3 if free else 6)
    lines: list[Line] = []
    for one in asked if idle >= 0 else ():
        is_line = isinstance(one.waypoint.motion, LinearMotion) and {
            one.before.rotation is None,
            one.after.rotation is None,
        } == {free}
        line = Line(one.before, one.after)
        if not is_line or _stands_still(line) or (idle and isinstance(one.waypoint, JointWaypoint)):
            break
        lines.append(line)
    if not lines:
        return []
    ends = [one.waypoint for one in asked[: len(lines)]]
    are_given = np.array([isinstance(waypoint, JointWaypoint) for waypoint in ends])
    curves, reached = follow_lines(robot, lines, start, guesses[: len(lines)], are_given, *_allowed(ends))
    if curves and (beyond := first_beyond(robot, joined(curves))) is not None:
        curves = curves[: int(beyond[0])]  # each of them is 1 long
    are_allowed = (
        one.configuration.allows(own) for one, own in zip(asked, configurations(robot, reached), strict=False)
    )
    count = sum(takewhile(bool, are_allowed))
    return [
        ToolMotion(line, curve, end, _warning(one, line, curve, 0.0))
        for one, line, curve, end in zip(asked, lines, curves[:count], reached, strict=False)
    ]


def follow_path(asked: AskedMotion, start: FloatArray, path: PosePath) -> ToolMotion | RefusedMotion:
    """Follow the path of the tool from a joint position (joints,) at its start."""
    robot, waypoint = asked.robot, asked.waypoint
    given = _turned_to(robot, waypoint.position, start) if isinstance(waypoint, JointWaypoint) else None
    if _stands_still(path) and (given is None or np.abs(given - start).max() <= POSITION_TOLERANCE):
        return ToolMotion(path, PiecewisePolynomial(np.ones(1), start[None, :, None]), start)
    result, deviation = _followed(robot, path, start, given, asked.motion)
    curve = result.curve if isinstance(result, Lost) else result
    if (beyond := first_beyond(robot, curve)) is not None:
        u, position, joint = beyond
        error: PlanningError = _limit_error(asked, u, position, joint)
    elif isinstance(result, Lost):
        u, position = result.u, result.position
        error = _lost_error(asked, path, result)
    else:
        end: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
        if given is None and np.abs(end - start).max() <= POSITION_TOLERANCE:
            end = start
        (reached,) = configurations(robot, end[None])
        given = None if given is None else _turned_to(robot, given, end)
        u, position = 1.0, end
        if given is not None and np.abs(end - given).max() > SAME_CONFIGURATION:
            error = _configuration_error(asked, end, given)
        elif not asked.configuration.allows(reached):
            error = ConfigurationChange(f"{asked.name} ends with {reached}, not with {asked.configuration}")
        else:
            warning = _warning(asked, path, curve, deviation)
            return ToolMotion(path, curve, end if given is None else given, warning)
    error.segment, error.waypoint = asked.index - 1, asked.index
    error.path_point = PathPoint(u, tool_pose(robot, position), position)
    return RefusedMotion(asked, start, path, error.path_point, error)


def _followed(
    robot: Robot, path: PosePath, start: FloatArray, given: FloatArray | None, motion: CartesianMotion
) -> tuple[PiecewisePolynomial | Lost, float]:
    """Follow the path from a joint position (joints,), and say how far the tool turns off it on purpose, rad."""
    tolerance = motion.tolerance_position, motion.tolerance_orientation
    if motion.singularity == "deviate":
        near = follow(robot, path, start, given, tolerance, GENTLE)
        if not isinstance(near, Lost):
            return near, 0.0
        deviated = through_singular_wrist(robot, path, near)
        if deviated is not None and deviated.angle < SHARE_OF_DEVIATION * motion.tolerance_orientation:
            rest = motion.tolerance_orientation - deviated.angle
            through = follow(robot, deviated, start, given, (motion.tolerance_position, rest))
            if not isinstance(through, Lost):
                return through, deviated.angle
    steepest = STEEPEST if motion.singularity == "slow" else STEEP
    result = follow(robot, path, start, given, tolerance, steepest)
    is_redundant = robot.dof > len(path.twist(0.0))
    if is_redundant and (isinstance(result, Lost) or first_beyond(robot, result) is not None):
        result = follow_by_self_motions(robot, path, start, given, tolerance, steepest)
    return result, 0.0


def _warning(asked: AskedMotion, path: PosePath, curve: PiecewisePolynomial, deviation: float) -> PlanWarning | None:
    """Return what is to be said of a motion that goes through a singularity or near to one."""
    if deviation > 0.0:
        how = "goes right through a singularity of the wrist"
        return PlanWarning("orientation_deviates", f"{asked.name} {how}, for which it turns off by {deviation:.3g} rad")
    rates = np.abs(curve.coefficients[:, :, 1]) / max(float(np.abs(path.twist(0.0)).max()), SLOWEST)
    knot, joint = np.unravel_index(rates.argmax(), rates.shape)
    if rates[knot, joint] < WORTH_A_WARNING:
        return None
    message = (
        f"{asked.name} passes near a singularity after {curve.breakpoints[knot]:.1%} of the way: for 1 m or 1 rad of "
        f"the tool {asked.robot.joint_names[joint]} goes {rates[knot, joint]:.3g}, for which the tool has to go slowly"
    )
    return PlanWarning("near_singularity", message)


def _turned_to(robot: Robot, position: ArrayLike, towards: FloatArray) -> FloatArray:
    """Turn continuous joints of a position (joints,) as near to another (joints,) as whole turns bring them."""
    q = np.asarray(position, dtype=np.float64)
    turns = np.round((towards - q) / TURN)
    return q + TURN * np.where([joint.kind == "continuous" for joint in robot.joints], turns, 0.0)


def _allowed(waypoints: Sequence[AnyWaypoint]) -> tuple[FloatArray, FloatArray]:
    """Return the tolerances (lines, 2), m and rad, of lines to waypoints, and how steep (lines,) joints may be."""
    motions = [waypoint.motion for waypoint in waypoints if isinstance(waypoint.motion, CartesianMotion)]
    tolerances = np.array([(motion.tolerance_position, motion.tolerance_orientation) for motion in motions])
    return tolerances, np.array([GENTLE if motion.singularity == "deviate" else STEEP for motion in motions])


def _stands_still(path: PosePath) -> bool:
    """Whether a line has no length, and the tool does not turn on it."""
    if not isinstance(path, Line):
        return False
    distance, angle = pose_errors(path.pose(0.0), path.pose(1.0))
    return max(distance, angle or 0.0) <= POSITION_TOLERANCE


def start_of_motion(asked: AskedMotion, end: FloatArray) -> FloatArray | None:
    """Return the joint position (joints,) from which a motion leads to `end` (joints,): followed backwards.

    Returns:
        None: the motion cannot be followed within the position limits, or its first orientation is left open.
    """
    robot = asked.robot
    if asked.before.rotation is None and asked.after.rotation is not None:
        return None
    path = Reversed(asked.pose_path(end))
    curve, _ = _followed(robot, path, end, None, asked.motion)
    if isinstance(curve, Lost) or first_beyond(robot, curve) is not None:
        return None
    start: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
    return start


def _limit_error(asked: AskedMotion, u: float, position: FloatArray, joint: int) -> JointPositionLimit:
    robot = asked.robot
    lower, upper = robot.limit("lower")[joint], robot.limit("upper")[joint]
    value, name = float(position[joint]), robot.joint_names[joint]
    limit = float(lower if value < (lower + upper) / 2.0 else upper)
    return JointPositionLimit(
        f"{asked.name} takes {name} beyond its limit {limit:.6g} after {u:.1%} of the way",
        joint=name,
        value=value,
        limit=limit,
    )


def _lost_error(asked: AskedMotion, path: PosePath, lost: Lost) -> PlanningError:
    robot = asked.robot
    where = f"after {lost.u:.1%} of the way" if lost.u > 0.0 else "at its start"
    ahead = min(1.0, lost.u + LOOK_AHEAD)
    for u in (ahead, *np.linspace(ahead, 1.0, LOOKS_AHEAD + 1)[1:].tolist()):
        if inverse_kinematics(robot, path.pose(u), asked.options, lost.position).status == "unreachable_waypoint":
            where = where if u == ahead else f"before {u:.1%} of the way"
            return UnreachableWaypoint(f"{asked.name} leaves what {robot.id} can reach {where}")
    joint = robot.joint_names[_idle_joint(robot, lost.position)]
    steepest = STEEPEST if asked.motion.singularity == "slow" else STEEP
    far = f"would have to jump, or go further than {steepest:g} rad (or m) for 1 m or 1 rad of the tool"
    return SingularPath(f"{asked.name} meets a singularity {where}, where {joint} {far}", joint=joint)


def _configuration_error(asked: AskedMotion, reached: FloatArray, given: FloatArray) -> ConfigurationChange:
    joint = int(np.argmax(np.abs(reached - given)))
    name = asked.robot.joint_names[joint]
    return ConfigurationChange(
        f"{asked.name} ends in another configuration than the one asked: "
        f"{name} at {reached[joint]:.6g} instead of {given[joint]:.6g}",
        joint=name,
        value=float(reached[joint]),
    )


def _idle_joint(robot: Robot, position: FloatArray) -> int:
    """Return the joint with the largest share in the motion that, at a singularity, does not move the tool."""
    directions = np.linalg.svd(jacobian(robot, position))[2]
    return int(np.argmax(np.abs(directions[min(robot.dof, 6) - 1])))
