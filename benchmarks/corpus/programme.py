"""A robot programme, written move by move while the arm is traced along with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.corpus.arms import PAYLOADS, Place
from benchmarks.corpus.tracing import circle, holds_still, on_circle, on_line, tool_at, trace
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
    SplineMotion,
)
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots.payload import Payload
from planner.spatial import FloatArray, Pose

STEP = 0.02
"""Tool motion from one traced pose to the next, in lengths of a job."""

STOP, THROUGH = StopTransition(), ThroughTransition()


class Untraceable(Exception):
    """The arm cannot do this programme at this place."""


class Programme:
    """Moves from a first waypoint on.

    Attributes:
        place: Where.
        waypoints: So far.
        positions: (joints,) of each.
        pose: Of the tool, now.
        seconds: Duration of the lines and circles at their speed limits, s.
        seconds_cut: The most of it that blends may save, s.
        heaviest: The heaviest part that is gripped, as a share of the arm's greatest payload.
        options: Options of the inverse kinematics.
    """

    def __init__(self, place: Place, first: Pose | FloatArray | None = None, **options: Any) -> None:
        self.place = place
        self.waypoints: list[AnyWaypoint] = []
        self.positions: list[FloatArray] = []
        self.seconds = self.seconds_cut = self.heaviest = 0.0
        self.options = InverseKinematicsOptions()
        self._q, self.pose = place.position, place.pose
        if isinstance(first, Pose):
            self.to(first, **options)
        else:
            self.joints(place.position if first is None else first, **options)

    def blend(self, radius: float) -> Transition:
        """Return a blend whose radius is given in lengths of a job."""
        return BlendTransition(radius * self.place.size)

    def joints(self, position: FloatArray, **options: Any) -> None:
        """Move to a joint position (joints,)."""
        robot = self.place.robot
        if (position < robot.limit("lower")).any() or (position > robot.limit("upper")).any():
            raise Untraceable
        pose = tool_at(robot, position)
        self._q, self.pose = position, pose if self.place.pose.rotation is not None else Pose(pose.position)
        self._add(JointWaypoint(position=tuple(position.tolist()), **options))

    def to(self, pose: Pose, **options: Any) -> None:
        """Move to a pose by a joint motion."""
        self._trace(on_line(self.pose, pose, STEP * self.place.size))
        self._add(PoseWaypoint(pose=pose, **options))

    def line(self, pose: Pose, speed: float | None = None, **options: Any) -> None:
        """Move to a pose in a straight line, at a speed in m/s."""
        self._time(float(np.linalg.norm(pose.position - self.pose.position)), speed, options.get("transition"))
        self._trace(on_line(self.pose, pose, STEP * self.place.size))
        self._add(PoseWaypoint(pose=pose, motion=LinearMotion(), limits=_speed(speed), **options))

    def arc(self, via: FloatArray, pose: Pose, speed: float | None = None, **options: Any) -> None:
        """Move to a pose on a circle by way of a position (3,)."""
        _, radius, _, angle = circle(self.pose.position, via, pose.position)
        self._time(radius * angle, speed, options.get("transition"))
        self._trace(on_circle(self.pose, via, pose, STEP * self.place.size))
        motion = CircularMotion(Pose(via))
        self._add(PoseWaypoint(pose=pose, motion=motion, limits=_speed(speed), **options))

    def polyline(self, poses: list[Pose], blend: float, speed: float, **options: Any) -> None:
        """Move by poses to the last in one motion, its corners cut within a share of a job's size."""
        motion = PolylineMotion(poses[:-1], blend * self.place.size)
        for pose in poses:
            self._time(float(np.linalg.norm(pose.position - self.pose.position)), speed, BlendTransition(motion.blend))
            self._trace(on_line(self.pose, pose, STEP * self.place.size))
        self._add(PoseWaypoint(pose=poses[-1], motion=motion, limits=_speed(speed), **options))

    def spline(self, poses: list[Pose], speed: float, **options: Any) -> None:
        """Move by poses to the last of them on one smooth curve, which scipy traces."""
        points = np.array([self.pose.position, *(pose.position for pose in poses)])
        knots = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        count = int(np.ceil(knots[-1] / (STEP * self.place.size)))
        dense = CubicSpline(knots, points, bc_type="natural")(np.linspace(0.0, knots[-1], count + 1)[1:])
        self._time(float(knots[-1]), speed, None)
        self._trace([*(Pose(point, poses[-1].rotation) for point in dense[:-1]), poses[-1]])
        motion = SplineMotion(poses[:-1])
        self._add(PoseWaypoint(pose=poses[-1], motion=motion, limits=_speed(speed), **options))

    def known(self, waypoint: PoseWaypoint, position: FloatArray) -> None:
        """Add a waypoint whose joint position (joints,) is known."""
        self._q, self.pose = position, waypoint.pose
        self._add(waypoint)

    def change_last(self, **changes: Any) -> None:
        """Change fields of the last waypoint, at which the arm is where it was traced."""
        self.waypoints[-1] = replace(self.waypoints[-1], **changes)

    def pass_last(self, transition: Transition) -> None:
        """Give the last waypoint a transition."""
        self.change_last(transition=transition)

    def grip(self, share: float) -> None:
        """Take a part at the last waypoint, as heavy as this share of the greatest payload; 0: put it down."""
        self.heaviest = max(self.heaviest, share)
        self.waypoints[-1] = replace(self.waypoints[-1], payload=self._part(share), put_down=not share)

    def problem(self, limits: Limits | None = None, carries: float = 0.0) -> PlanningProblem:
        """Return the programme as a planning problem.

        Args:
            limits: Of the whole.
            carries: Share of the arm's greatest payload that it carries from the start.
        """
        robot, heaviest = self.place.robot, self._part(max(carries, self.heaviest))
        self.pass_last(STOP)
        if not holds_still(robot.with_payload(heaviest) if heaviest else robot, np.array(self.positions)):
            raise Untraceable
        return PlanningProblem(
            robot,
            tuple(self.waypoints),
            limits=limits or Limits(),
            inverse_kinematics=self.options,
            payload=self._part(carries),
        )

    def _part(self, share: float) -> Payload | None:
        """Return a payload as heavy as a share of the arm's greatest one; None: for a share of 0."""
        return Payload(share * PAYLOADS[self.place.robot.id], (0.0, 0.0, 0.05 * self.place.size)) if share else None

    def _add(self, waypoint: AnyWaypoint) -> None:
        self.waypoints.append(waypoint)
        self.positions.append(self._q)

    def _trace(self, poses: list[Pose]) -> None:
        chain = trace(self.place.robot, poses, self._q)
        if chain is None:
            raise Untraceable
        self._q, self.pose = chain[-1], poses[-1]

    def _time(self, length: float, speed: float | None, transition: Transition | None) -> None:
        if speed is None:
            return
        self.seconds += length / speed
        if isinstance(transition, BlendTransition):
            self.seconds_cut += 2.0 * transition.radius / speed


def _speed(speed: float | None) -> Limits | None:
    return None if speed is None else Limits(tcp_linear_velocity=speed)
