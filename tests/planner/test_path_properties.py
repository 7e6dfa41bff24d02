"""Properties of every plan along lines, circles, blends and passed waypoints, on random requests."""

from __future__ import annotations

from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from benchmarks.corpus.promises import (
    is_continuous,
    keeps_joint_limits,
    keeps_least_durations,
    keeps_sampled_limits,
    robots_on_segments,
)
from planner.backends import BACKENDS, BackEnd, Guarantee, Toppra
from planner.errors import ConfigurationChange, InvalidProblem, JointPositionLimit, SingularPath, UnreachableWaypoint
from planner.kinematics import FloatArray, Pose, forward_kinematics
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import (
    CircularMotion,
    JointMotion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
    SplineMotion,
)
from planner.problems.regions import Region
from planner.problems.transitions import BlendTransition
from tests.planner.problems_of_tests import PARTS, REQUESTS, backend_of, path_problems, try_on_random

REFUSALS = (ConfigurationChange, InvalidProblem, JointPositionLimit, SingularPath, UnreachableWaypoint)


ALONG_PATHS: list[BackEnd] = [backend_of(kind) for kind in sorted(BACKENDS)]
ALONG_PATHS.append(Toppra(jerk_limited=True))


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("backend", ALONG_PATHS, ids=repr)
def test_every_plan_along_a_path_keeps_its_promises(backend: BackEnd, part: int) -> None:
    examples = max(1, REQUESTS // 10 // len(PARTS))
    try_on_random(examples, part, path_problems(backend.kind), partial(keeps_its_promises_along_a_path, backend))


def keeps_its_promises_along_a_path(backend: BackEnd, problem: PlanningProblem) -> None:
    try:
        result = plan(problem, backend)
    except REFUSALS:
        assume(False)
    assert result.certificate.satisfied
    keeps_joint_limits(result, 17)
    keeps_least_durations(result)
    keeps_sampled_limits(result, 20)
    is_continuous(result, 2 if backend.guarantees["jerk"] is Guarantee.HARD else 1)
    _goes_where_it_should(result)


def _goes_where_it_should(result: Plan) -> None:
    """Assert that waypoints are met, lines and circles kept up to blends, with one branch along each."""
    robots, trajectory, solved = robots_on_segments(result), result.trajectory, result.path.waypoints
    robots = [result.problem.robot, *robots]  # that each waypoint is reached with
    data = [robot.model.createData() for robot in robots]
    waypoints = result.problem.waypoints
    corners = {
        k: (solved[k].pose.position, waypoint.transition.radius)
        for k, waypoint in enumerate(waypoints)
        if isinstance(waypoint.transition, BlendTransition)
    }
    for waypoint, reached in zip(waypoints, solved, strict=True):
        if isinstance(waypoint, PoseWaypoint) and isinstance(waypoint.free, Region):
            _is_in(waypoint.free, waypoint.pose_in_base, reached.pose)
            continue
        if isinstance(waypoint, PoseWaypoint) and waypoint.pose.rotation is not None:
            away = waypoint.pose_in_base.rotation.T @ reached.pose.rotation  # type: ignore[union-attr]
            assert np.abs(away - np.eye(3))[2 if waypoint.free else slice(None)].max() < 2e-6
        if isinstance(waypoint, PoseWaypoint):
            assert np.linalg.norm(reached.pose.position - waypoint.pose_in_base.position) < 2e-6
    for k, time in enumerate(trajectory.arrivals):
        q = trajectory.evaluate(np.array([time]), [0])[0][0]
        pin.framesForwardKinematics(robots[k].model, data[k], q)
        distance = float(np.linalg.norm(data[k].oMf[robots[k].tool_frame_id].translation - solved[k].pose.position))
        assert distance <= (corners[k][1] if k in corners else 1e-6)
    for k, waypoint in enumerate(waypoints[1:], 1):
        if isinstance(waypoint.motion, JointMotion):
            continue
        times = np.linspace(trajectory.arrivals[k - 1], trajectory.arrivals[k], 150)
        handedness, robot = set(), robots[k]
        start, end = forward_kinematics(robot, solved[k - 1].position[None])[0], solved[k].pose
        for q in trajectory.evaluate(times, [0])[0]:
            pin.computeJointJacobians(robot.model, data[k], q)
            pin.framesForwardKinematics(robot.model, data[k], q)
            tool = data[k].oMf[robot.tool_frame_id]
            near = [corners[end] for end in (k - 1, k) if end in corners]
            if any(np.linalg.norm(tool.translation - corner) <= radius for corner, radius in near):
                continue
            axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            J = pin.getFrameJacobian(robot.model, data[k], robot.tool_frame_id, axes)[: 3 if robot.dof == 3 else 6]
            handedness.add(float(np.sign(np.linalg.det(J))))
            if isinstance(waypoint.motion, PolylineMotion | SplineMotion):
                poses = [start, *waypoint.motion.poses, end]
                assert _from_curve(tool.translation, poses, waypoint.motion) <= 1.01e-4
            elif isinstance(waypoint.motion, CircularMotion):
                assert _from_circle(tool.translation, start, waypoint.motion.via, end) <= 1.001e-4
            else:
                is_fixed = robot.dof > 3 and not waypoint.motion.free  # type: ignore[union-attr]
                assert _from_line(tool, start, end, turns=is_fixed)
        assert len(handedness) <= 1


def _is_in(region: Region, requested: Pose, reached: Pose) -> None:
    """Assert that a pose is in the region, with angles by scipy."""
    turn = Rotation.from_matrix(requested.rotation.T @ reached.rotation).as_euler("XYZ")  # type: ignore[union-attr]
    shift = requested.rotation.T @ (reached.position - requested.position)  # type: ignore[union-attr]
    names = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")
    for name, offset in zip(names, np.concatenate([shift, turn]), strict=True):
        lower, upper = region.ranges.get(name, (0.0, 0.0))
        assert lower - 2e-6 <= offset <= upper + 2e-6


def _from_curve(point: FloatArray, poses: list[Pose], motion: PolylineMotion | SplineMotion) -> float:
    """Return the distance from scipy's natural spline, or from the nearest line of a polyline away from its corners."""
    points = np.array([pose.position for pose in poses])
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if isinstance(motion, SplineMotion):
        curve = CubicSpline(np.concatenate([[0.0], np.cumsum(chords)]), points, bc_type="natural")
        points = curve(np.linspace(0.0, chords.sum(), 2001))
    elif np.linalg.norm(points[1:-1] - point, axis=1).min() <= motion.blend:
        return 0.0
    ways, offsets = np.diff(points, axis=0), point - points[:-1]
    shares = np.clip((offsets * ways).sum(axis=1) / (ways**2).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(offsets - shares[:, None] * ways, axis=1).min())


def _from_line(tool: pin.SE3, start: Pose, end: Pose, *, turns: bool) -> bool:
    way, offset = end.position - start.position, tool.translation - start.position
    share = offset @ way / (way @ way)
    if np.linalg.norm(offset - share * way) > 1.001e-4 or not turns:
        return bool(np.linalg.norm(offset - share * way) <= 1.001e-4)
    assert start.rotation is not None
    due = start.rotation @ pin.exp3(share * pin.log3(start.rotation.T @ end.rotation))
    # A tenth of a millimetre along a short line is a large share of its turn.
    rate = np.linalg.norm(pin.log3(start.rotation.T @ end.rotation)) / np.linalg.norm(way)
    return bool(np.linalg.norm(pin.log3(due.T @ tool.rotation)) <= 1.001e-3 + 1e-4 * rate)


def _from_circle(point: FloatArray, start: Pose, via: Pose, end: Pose) -> float:
    a, b, c = start.position, via.position, end.position
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    x = (b - a) / np.linalg.norm(b - a)
    y = np.cross(normal, x)
    # In the plane: |p|^2 + D x + E y = 0 through the three points, a at the origin.
    (bx, _), (cx, cy) = ((b - a) @ x, (b - a) @ y), ((c - a) @ x, (c - a) @ y)
    D = -bx
    E = -(cx**2 + cy**2 + D * cx) / cy
    center, radius = np.array([-D / 2.0, -E / 2.0]), np.hypot(D, E) / 2.0
    px, py, height = (point - a) @ x, (point - a) @ y, (point - a) @ normal
    return float(np.hypot(np.hypot(px - center[0], py - center[1]) - radius, height))
