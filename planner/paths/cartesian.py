"""The linear and circular motions of a waypoint list: followed with the joints, or refused with place and remedies."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.errors import (
    ConfigurationChange,
    InvalidProblem,
    JointPositionLimit,
    PathPoint,
    PlanningError,
    Remedy,
    SingularPath,
    UnreachableWaypoint,
)
from planner.extrema import derivatives_on_unit_time, largest_magnitudes
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.inverse import all_solutions, inverse_kinematics
from planner.paths.follow import Lost, follow
from planner.paths.pose_paths import Arc, Line
from planner.problem import CircularMotion, JointMotion, JointWaypoint
from planner.spatial import Pose
from planner.waypoints.targets import pose_remedy

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.kinematics.options import InverseKinematicsOptions
    from planner.paths.pose_paths import PosePath
    from planner.polynomials import PiecewisePolynomial
    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.spatial import FloatArray

SAME_CONFIGURATION = 1e-7
"""rad or m: a motion that ends this near to a joint position ends there."""

BEYOND = 1e-9
"""Relative excess over a position limit that is rounding."""

LOOK_AHEAD = 2e-3
"""Of the way: how far behind a place where the arm got stuck the path is tried for reachability."""

SHORTENED = 0.98
"""Of the way to where a line fails, what the remedy of a moved pose keeps."""


class ToolMotion(NamedTuple):
    """A motion of the tool that the joints can follow.

    Attributes:
        path: Of the tool.
        curve: Of the joints, over the same u from 0 to 1.
    """

    path: PosePath
    curve: PiecewisePolynomial


class CartesianMotions:
    """The motions of the tool in one waypoint list.

    What has been followed is remembered: the choice of branches follows a motion first, the path takes it over.
    """

    def __init__(self, robot: Robot, waypoints: Sequence[AnyWaypoint], options: InverseKinematicsOptions) -> None:
        """Nothing is followed yet.

        Args:
            robot: With its tool.
            waypoints: As asked.
            options: Of the inverse kinematics, for remedies.
        """
        self.robot, self.waypoints, self.options = robot, waypoints, options
        self._followed: dict[tuple[int, bytes], ToolMotion] = {}
        self._refused: list[tuple[PlanningError, int, FloatArray, PosePath]] = []

    def follow(self, index: int, start: FloatArray, before: Pose, after: Pose) -> FloatArray:
        """Follow the motion to waypoint `index` and tell where it ends up, (joints,).

        Args:
            index: Of the waypoint.
            start: (joints,), at the waypoint before.
            before: The pose asked there.
            after: The pose asked at the waypoint itself.

        Raises:
            ConfigurationChange, SingularPath, JointPositionLimit, UnreachableWaypoint: It cannot be followed.
            InvalidProblem: No one circle goes through the poses.
        """
        key = index, start.tobytes()
        if key not in self._followed:
            path = self._pose_path(index, start, before, after)
            self._followed[key] = ToolMotion(path, self._follow(index, start, path))
        waypoint, curve = self.waypoints[index], self._followed[key].curve
        return np.array(waypoint.position) if isinstance(waypoint, JointWaypoint) else _end(curve)

    def add_remedies(self, error: PlanningError) -> None:
        """Find out what would help against a refusal of `follow`; costs some milliseconds. Others are left alone."""
        for refusal, index, start, path in self._refused:
            if refusal is error:
                error.remedies = tuple(self._remedies(index, start, path, error))

    def followed(self, index: int, start: FloatArray) -> ToolMotion:
        """The motion to waypoint `index` from where it has been followed."""
        return self._followed[index, start.tobytes()]

    def _pose_path(self, index: int, start: FloatArray, before: Pose, after: Pose) -> PosePath:
        motion = self.waypoints[index].motion
        if before.rotation is None and after.rotation is not None:  # it was left open: it is the one reached
            before = Pose(before.position, tool_pose(self.robot, start).rotation)
        if not isinstance(motion, CircularMotion):
            return Line(before, after)
        try:
            return Arc.through(before, motion.via, after)
        except ValueError as error:
            raise InvalidProblem([(("waypoints", index, "motion", "via"), str(error))]) from None

    def _follow(self, index: int, start: FloatArray, path: PosePath) -> PiecewisePolynomial:
        waypoint = self.waypoints[index]
        assert not isinstance(waypoint.motion, JointMotion)  # noqa: S101 - asked for motions of the tool only
        end = np.array(waypoint.position) if isinstance(waypoint, JointWaypoint) else None
        tolerance = waypoint.motion.tolerance_position, waypoint.motion.tolerance_orientation
        result = follow(self.robot, path, start, end, tolerance)
        curve = result.curve if isinstance(result, Lost) else result
        if (beyond := first_beyond(self.robot, curve)) is not None:
            error: PlanningError = self._limit(index, *beyond)
            u, position = beyond[0], beyond[1]
        elif isinstance(result, Lost):
            u, position = result.u, result.position
            error = self._lost(index, path, result)
        elif end is not None and np.abs(_end(curve) - end).max() > SAME_CONFIGURATION:
            u, position = 1.0, _end(curve)
            error = self._other_configuration(index, position, end)
        else:
            return curve
        error.segment, error.waypoint = index - 1, index
        error.path_point = PathPoint(u, tool_pose(self.robot, position), position)
        self._refused.append((error, index, start, path))
        raise error

    def _name(self, index: int) -> str:
        return "circle" if isinstance(self.waypoints[index].motion, CircularMotion) else "straight line"

    def _limit(self, index: int, u: float, position: FloatArray, joint: int) -> JointPositionLimit:
        lower, upper = self.robot.limit("lower")[joint], self.robot.limit("upper")[joint]
        value, name = float(position[joint]), self.robot.joint_names[joint]
        limit = float(lower if value < (lower + upper) / 2.0 else upper)
        return JointPositionLimit(
            f"the {self._name(index)} to waypoint {index} takes {name} beyond its limit {limit:.6g} "
            f"after {u:.1%} of the way",
            joint=name,
            value=value,
            limit=limit,
        )

    def _lost(self, index: int, path: PosePath, lost: Lost) -> PlanningError:
        way = f"the {self._name(index)} to waypoint {index}"
        where = f"after {lost.u:.1%} of the way" if lost.u > 0.0 else "at its start"
        ahead = path.pose(min(1.0, lost.u + LOOK_AHEAD))
        if inverse_kinematics(self.robot, ahead, self.options).status == "unreachable_waypoint":
            return UnreachableWaypoint(f"{way} leaves what {self.robot.id} can reach {where}")
        joint = self.robot.joint_names[_idle_joint(self.robot, lost.position)]
        return SingularPath(f"{way} meets a singularity {where}, where {joint} would have to jump", joint=joint)

    def _other_configuration(self, index: int, reached: FloatArray, asked: FloatArray) -> ConfigurationChange:
        joint = int(np.argmax(np.abs(reached - asked)))
        name = self.robot.joint_names[joint]
        return ConfigurationChange(
            f"the {self._name(index)} to waypoint {index} ends in another configuration than the one asked: "
            f"{name} at {reached[joint]:.6g} instead of {asked[joint]:.6g}",
            joint=name,
            value=float(reached[joint]),
        )

    def _remedies(self, index: int, start: FloatArray, path: PosePath, error: PlanningError) -> Iterator[Remedy]:
        """Changes after which this motion can be done."""
        waypoint, before, stuck = self.waypoints[index], self.waypoints[index - 1], error.path_point
        assert stuck is not None  # noqa: S101 - every refusal of a motion says where it ends
        if isinstance(error, ConfigurationChange):
            explanation = "the joint position in which the motion ends"
            yield Remedy(("waypoints", index, "position"), tuple(stuck.position.tolist()), explanation)
        elif isinstance(before, JointWaypoint) and (index == 1 or isinstance(before.motion, JointMotion)):
            other = self._other_start(index, start, path)
            if other is not None:
                explanation = "the same pose in another configuration, from which the motion can be done"
                yield Remedy(("waypoints", index - 1, "position"), tuple(other.tolist()), explanation)
        yield Remedy(("waypoints", index, "motion"), JointMotion(), "a joint motion to the same waypoint")
        kept = SHORTENED * stuck.fraction
        if not isinstance(path, Line) or kept < 1.0 - SHORTENED or isinstance(error, ConfigurationChange):
            return
        explanation = f"the first {kept:.1%} of the line"
        before_pose = path.pose(0.0)
        yield from pose_remedy(index, waypoint, path.pose(kept), before_pose, before_pose.rotation, explanation)

    def _other_start(self, index: int, start: FloatArray, path: PosePath) -> FloatArray | None:
        """Another joint position at the pose before from which the motion can be done."""
        pose = tool_pose(self.robot, start)
        for other in all_solutions(self.robot, pose, self.options, start):
            if np.abs(other - start).max() > SAME_CONFIGURATION:
                try:
                    self._follow(index, other, path)
                except PlanningError:
                    continue
                return other
        return None


def _idle_joint(robot: Robot, position: FloatArray) -> int:
    """The joint with the largest share in the motion that, at a singularity, does not move the tool."""
    directions = np.linalg.svd(jacobian(robot, position))[2]
    return int(np.argmax(np.abs(directions[min(robot.dof, 6) - 1])))


def _end(curve: PiecewisePolynomial) -> FloatArray:
    end: FloatArray = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
    return end


def first_beyond(robot: Robot, curve: PiecewisePolynomial) -> tuple[float, FloatArray, int] | None:
    """The first place, joint position and joint where a curve leaves the position limits; None: nowhere."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    limited = np.isfinite(lower) & np.isfinite(upper)
    if not len(curve.lengths) or not limited.any():
        return None
    middle, half = np.where(limited, (lower + upper) / 2.0, 0.0), np.where(limited, (upper - lower) / 2.0, np.inf)
    polynomials = derivatives_on_unit_time(curve, 1)[0].minus(middle)
    if (np.abs(polynomials.bernstein).max(axis=2) <= half).all():  # these bound the curve: mostly they settle it
        return None
    count = len(curve.lengths)
    found = largest_magnitudes(polynomials, np.broadcast_to(half, (count, len(half))), np.arange(count))
    beyond = np.flatnonzero(np.abs(found.values) > half[found.joints] * (1.0 + BEYOND))
    if not len(beyond):
        return None
    piece, joint = int(beyond[0]), int(found.joints[beyond[0]])
    start = float(curve.breakpoints[piece])
    end = start + float(found.units[piece] * curve.lengths[piece])
    for _ in range(50):  # the crossing, by bisection
        u = (start + end) / 2.0
        position = curve.evaluate(np.array([u]), [0])[0][0]
        start, end = (start, u) if (np.abs(position - middle) > half).any() else (u, end)
    position = curve.evaluate(np.array([end]), [0])[0][0]
    return end, position, joint
