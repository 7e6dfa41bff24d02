"""Distances of two machines at dense samples: Pinocchio's kinematics and coal, without the planner's bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import coal
import numpy as np
import pinocchio as pin

import planner
from planner.robots import Robot
from planner.shapes import Capsule, Shape, Sphere
from planner.spatial import FloatArray, Pose
from planner.trajectories.trajectory import Trajectory
from tests.planner.scene.random_scenes import in_capsules

Placed = list[tuple[Shape, pin.SE3]]
"""The shapes of a machine in the world at one time."""

World = Callable[[float], Placed]
"""The shapes of a machine in the world at a time, s."""


NO_SKEW = np.zeros(1)
"""The skews of controllers that start together."""


def se3(pose: Pose | None) -> pin.SE3:
    """Return a pose as a transformation."""
    if pose is None:
        return pin.SE3.Identity()
    return pin.SE3(np.eye(3) if pose.rotation is None else pose.rotation, pose.position)


def robot_world(robot: Robot, trajectory: Trajectory, held: list[Shape] | None = None) -> World:
    """Return the shapes of a robot that rests before and after its trajectory; shapes may be held at its tool."""
    data, base = robot.model.createData(), se3(robot.mounting)

    def at(time: float) -> Placed:
        position = trajectory.evaluate(min(max(time, 0.0), trajectory.duration), [0])[0]
        pin.framesForwardKinematics(robot.model, data, position)
        shapes = [
            (body.shape, base * data.oMi[body.joint] * pin.SE3(body.placement.rotation, body.placement.translation))
            for body in robot.collision_shapes
        ]
        return shapes + [(shape, base * data.oMf[robot.tool_frame_id]) for shape in held or ()]

    return at


def sliding_world(shape: Shape, pose: Pose, velocity: FloatArray, start: float, duration: float) -> World:
    """Return a shape that slides from a time on."""

    def at(time: float) -> Placed:
        placed = se3(pose)
        moved = velocity * min(max(time - start, 0.0), duration)
        return [(shape, pin.SE3(placed.rotation, placed.translation + moved))]

    return at


def distance(first: Placed, second: Placed) -> float:
    """Compute the least distance of two lists of shapes, m; negative: they overlap."""
    request, result, least = coal.DistanceRequest(), coal.DistanceResult(), np.inf
    request.enable_signed_distance = True
    for one, here in first:
        for other, there in second:
            result.clear()
            places = [coal.Transform3s(at.rotation, at.translation) for at in (here, there)]
            found = coal.distance(one.geometry, places[0], other.geometry, places[1], request, result)
            least = min(least, float(found))
    return least


def least_distance(first: World, second: World, times: FloatArray, skews: FloatArray = NO_SKEW) -> float:
    """Compute the least distance at times, for skews of the second machine, m."""
    return min(distance(first(t), second(t + e)) for t in times.tolist() for e in skews.tolist())


def facing_arms(robot: Robot, apart: float) -> tuple[Robot, Robot]:
    """Return two robots that face each other."""
    turned = Pose([apart, 0.0, 0.0], [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    return robot, robot.derived(mounting=turned)


def facing_capsule_arms(apart: float) -> tuple[Robot, Robot]:
    """Return two UR5e made of capsules that face each other."""
    robots = facing_arms(replace(planner.load_robot("ur5e")), apart)
    for robot in robots:
        in_capsules(robot)
    return robots


def random_plan(robot: Robot, rng: np.random.Generator, waypoints: int, backend: str = "cubic") -> planner.Plan:
    """Plan random joint motions of a UR arm that reaches forwards."""
    low, high = np.array([[2.0, -1.6, 0.4, -1.5, -1.7, -0.5], [4.2, -0.7, 1.6, -0.5, -1.4, 0.5]])
    return planner.plan(planner.PlanningProblem(robot, [*rng.uniform(low, high, (waypoints, 6))]), backend)


def capsule_ends(robot: Robot, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends (N, capsules, 2, 3) of a robot's capsules in the world, and their radii (capsules,), m."""
    data, base = robot.model.createData(), se3(robot.mounting)
    shapes = [body.shape for body in robot.collision_shapes]
    assert all(isinstance(shape, Capsule | Sphere) for shape in shapes)
    ends = np.empty((len(positions), len(shapes), 2, 3))
    for row, position in enumerate(positions):
        pin.forwardKinematics(robot.model, data, position)
        for k, body in enumerate(robot.collision_shapes):
            placed = base * data.oMi[body.joint] * pin.SE3(body.placement.rotation, body.placement.translation)
            half = np.array([0.0, 0.0, getattr(body.shape, "length", 0.0) / 2.0])
            ends[row, k] = placed.act(-half), placed.act(half)
    return ends, np.array([getattr(shape, "radius", 0.0) for shape in shapes])


def segment_distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Compute the distances of segments (..., 2, 3), m: Ericson, Real-Time Collision Detection, 2005, section 5.1.9."""
    p, q = first[..., 0, :], second[..., 0, :]
    u, v, r = first[..., 1, :] - p, second[..., 1, :] - q, p - q
    a, e, f = (u * u).sum(-1), (v * v).sum(-1), (v * r).sum(-1)
    b, c = (u * v).sum(-1), (u * r).sum(-1)
    tiny = 1e-12
    denominator = a * e - b * b
    s = np.where(denominator > tiny, np.clip((b * f - c * e) / np.maximum(denominator, tiny), 0.0, 1.0), 0.0)
    t = (b * s + f) / np.maximum(e, tiny)
    clipped = np.clip(t, 0.0, 1.0)
    s = np.where(t == clipped, s, np.clip((b * clipped - c) / np.maximum(a, tiny), 0.0, 1.0))
    gap = r + s[..., None] * u - clipped[..., None] * v
    return np.asarray(np.sqrt((gap * gap).sum(-1)))


def distance_table(plans: tuple[planner.Plan, planner.Plan], times: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Compute the distances (N, M) of two robots made of capsules at all pairs of their nominal times, m."""
    (first, radii), (second, others) = (
        capsule_ends(plan.problem.robot, plan.trajectory.evaluate(own, [0])[0])
        for plan, own in zip(plans, times, strict=True)
    )
    table = np.empty((len(first), len(second)))
    for row, ends in enumerate(first):
        apart = segment_distances(ends[None, :, None], second[:, None]) - radii[:, None] - others
        table[row] = apart.min(axis=(1, 2))
    return table


def fewest_steps(free: np.ndarray, rests: tuple[np.ndarray, np.ndarray] | None = None) -> int | None:
    """Return the fewest steps through free nodes (N, M) of a diagram; None: there is no path.

    Args:
        free: The free nodes.
        rests: The rows and the columns at which a robot may wait; None: each may stop anywhere.
    """
    rows, columns = (np.arange(count) for count in free.shape) if rests is None else rests
    steps = np.full(free.shape, np.inf)
    steps[0, 0] = 0.0 if free[0, 0] else np.inf
    for i, j in np.argwhere(free).tolist():
        before = [steps[i, j]]
        if i and j:
            before.append(steps[i - 1, j - 1] + 1.0)
        if i and j in columns:
            before.append(steps[i - 1, j] + 1.0)
        if j and i in rows:
            before.append(steps[i, j - 1] + 1.0)
        steps[i, j] = min(before)
    return None if np.isinf(steps[-1, -1]) else int(steps[-1, -1])
