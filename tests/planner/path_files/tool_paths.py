"""Dense points of waypoints, of plans and of known curves, and the distance between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from scipy.spatial import cKDTree

from planner import (
    CircularMotion,
    Limits,
    PathFile,
    Plan,
    PlanningProblem,
    Pose,
    PoseWaypoint,
    Toppra,
    load_robot,
    plan,
    rotation_from_rpy,
)
from planner.spatial import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

SPACING = 5e-5
"""Distance of dense points, m."""

TABLE = Pose([0.95, -0.05, 0.6], rotation_from_rpy(0.0, 0.1, 0.4))
"""A frame within reach of the robot."""

ROBOT = load_robot("kuka_kr16_2")


def line(start: Sequence[float], end: Sequence[float]) -> FloatArray:
    first, last = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    count = int(np.ceil(np.linalg.norm(last - first) / SPACING)) + 1
    return first + np.linspace(0.0, 1.0, count)[:, None] * (last - first)


def arc(centre: Sequence[float], radius: float, first: float, turn: float) -> FloatArray:
    """Return an arc in a plane parallel to XY; a negative turn is clockwise."""
    at = first + np.linspace(0.0, turn, int(np.ceil(abs(turn) * radius / SPACING)) + 2)
    return np.asarray(centre) + radius * np.column_stack([np.cos(at), np.sin(at), np.zeros_like(at)])


def through(start: FloatArray, via: FloatArray, end: FloatArray) -> FloatArray:
    """Return the arc through three points: its centre by the circumcentre's barycentric weights."""
    a, b, c = (float(np.sum((p - q) ** 2)) for p, q in ((via, end), (end, start), (start, via)))
    weights = np.array([a * (b + c - a), b * (c + a - b), c * (a + b - c)])
    centre = weights @ np.array([start, via, end]) / weights.sum()
    radius = float(np.linalg.norm(start - centre))
    x = (start - centre) / radius
    normal = np.cross(via - start, end - via)
    y = np.cross(normal / np.linalg.norm(normal), x)
    turn = np.arctan2((end - centre) @ y, (end - centre) @ x) % (2.0 * np.pi)
    at = np.linspace(0.0, turn, int(np.ceil(turn * radius / SPACING)) + 2)
    return centre + radius * (np.outer(np.cos(at), x) + np.outer(np.sin(at), y))


def curve_of(read: PathFile) -> FloatArray:
    """Return dense points on lines and arcs, in the file's frame."""
    points: list[FloatArray] = []
    before = None
    for waypoint in read.waypoints:
        assert isinstance(waypoint, PoseWaypoint)
        end = waypoint.pose.position
        if before is not None and isinstance(waypoint.motion, CircularMotion):
            points.append(through(before, waypoint.motion.via.position, end))
        elif before is not None:
            points.append(line(before, end))
        before = end
    return np.concatenate(points)


def planned(read: PathFile) -> Plan:
    return plan(PlanningProblem(ROBOT, read.waypoints, limits=Limits(tcp_linear_velocity=0.2)), Toppra())


def tool_points(made: Plan) -> tuple[FloatArray, FloatArray]:
    """Return times and positions of the tool in the frame of the table, by Pinocchio."""
    data = ROBOT.model.createData()
    times = np.linspace(0.0, made.trajectory.duration, 4000)
    points = []
    for q in made.trajectory(times):
        pin.framesForwardKinematics(ROBOT.model, data, q)
        points.append(data.oMf[ROBOT.tool_frame_id].translation.copy())
    assert TABLE.rotation is not None
    return times, (np.array(points) - TABLE.position) @ TABLE.rotation


def apart(one: FloatArray, other: FloatArray) -> float:
    """Return the largest distance of a point of one curve from the other."""
    return float(cKDTree(other).query(one)[0].max())


def assert_same_curve(one: FloatArray, other: FloatArray, tolerance: float) -> None:
    assert apart(one, other) < tolerance
    assert apart(other, one) < tolerance
