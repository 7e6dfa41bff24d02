"""Distances independent of the tested code: Pinocchio's kinematics, dense samples and closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.scene import PointCloud, Scene, SceneObject
from planner.shapes import Box, Capsule, Cylinder, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose
from planner.trajectories.trajectory import Trajectory

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Remaining share of an interval after each step of the search."""

STEPS = 30
"""Steps of the search: the remaining interval is a millionth of a link."""


def distances_over_time(robot: Robot, scene: Scene, times: FloatArray, trajectory: Trajectory) -> FloatArray:
    """Compute distances (times, bodies, objects) of a robot made of capsules from scene objects; nan: not moved."""
    positions = trajectory.evaluate(times, [0])[0]
    bodies = [(shape, shape.shape) for shape in robot.collision_shapes if isinstance(shape.shape, Capsule | Sphere)]
    assert len(bodies) == len(robot.collision_shapes)
    ends = np.empty((len(times), len(bodies), 2, 3))
    data = robot.model.createData()
    for row, position in enumerate(positions):
        pin.forwardKinematics(robot.model, data, position)
        for column, (body, shape) in enumerate(bodies):
            placed = data.oMi[body.joint] * body.placement
            half = np.array([0.0, 0.0, shape.length / 2.0 if isinstance(shape, Capsule) else 0.0])
            ends[row, column] = placed.act(-half), placed.act(half)
    found = np.full((len(times), len(bodies), len(scene.objects)), np.nan)
    for column, (body, shape) in enumerate(bodies):
        if body.joint == 0:
            continue
        for k, thing in enumerate(scene.objects):
            if isinstance(thing.shapes[0], PointCloud):
                apart = _nearest_of_points(ends[:, column], thing, robot.mounting)
            else:
                apart = _nearest_on_segments(ends[:, column], point_distance(thing, robot.mounting))
            found[:, column, k] = apart - shape.radius
    return found


def _nearest_on_segments(ends: FloatArray, distance: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return the least value (N,) of a convex function on segments (N, 2, 3), by golden sections."""
    start, way = ends[:, 0], ends[:, 1] - ends[:, 0]

    def at(share: FloatArray) -> FloatArray:
        return distance(start + share[:, None] * way)

    low, high = np.zeros(len(ends)), np.ones(len(ends))
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a, at_b = at(a), at(b)
    for _ in range(STEPS):
        left = at_a < at_b
        low, high = np.where(left, low, a), np.where(left, b, high)
        a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        at_a, at_b = at(a), at(b)
    return np.minimum.reduce([at_a, at_b, at(np.zeros(len(ends))), at(np.ones(len(ends)))])


def _nearest_of_points(ends: FloatArray, thing: SceneObject, base: Pose | None) -> FloatArray:
    """Compute the distance (N,) of segments (N, 2, 3) in a base's frame from a cloud's balls, one by one."""
    (cloud,) = thing.shapes
    assert isinstance(cloud, PointCloud)
    rotation = np.eye(3) if thing.pose.rotation is None else thing.pose.rotation
    in_world = cloud.points @ rotation.T + thing.pose.position
    points = (
        in_world
        if base is None
        else (in_world - base.position) @ (np.eye(3) if base.rotation is None else base.rotation)
    )
    start, way = ends[:, 0], ends[:, 1] - ends[:, 0]
    square = np.maximum((way**2).sum(axis=1), np.finfo(np.float64).tiny)
    nearest = np.full(len(ends), np.inf)
    for point in points:
        share = np.clip(((point - start) * way).sum(axis=1) / square, 0.0, 1.0)
        np.minimum(nearest, np.linalg.norm(start + share[:, None] * way - point, axis=1), out=nearest)
    return nearest - cloud.radius


def point_distance(thing: SceneObject, base: Pose | None = None) -> Callable[[FloatArray], FloatArray]:
    """Return the signed distance of points (N, 3) in a base's frame from an object of one simple shape."""
    (shape,) = thing.shapes
    assert isinstance(shape, Shape)
    in_world = np.eye(4)
    if base is not None and base.rotation is not None:
        in_world[:3, :3], in_world[:3, 3] = base.rotation, base.position
    rotation = np.eye(3) if thing.pose.rotation is None else thing.pose.rotation

    def distance(points: FloatArray) -> FloatArray:
        there = points @ in_world[:3, :3].T + in_world[:3, 3]
        local = (there - thing.pose.position) @ rotation
        match shape:
            case Sphere():
                return np.linalg.norm(local, axis=1) - shape.radius
            case HalfSpace():
                return local @ shape.normal - shape.offset
            case Capsule():
                off = local.copy()
                off[:, 2] -= np.clip(off[:, 2], -shape.length / 2.0, shape.length / 2.0)
                return np.linalg.norm(off, axis=1) - shape.radius
            case Box():
                beyond = np.abs(local) - shape.size / 2.0
            case Cylinder():
                around = np.hypot(local[:, 0], local[:, 1]) - shape.radius
                beyond = np.stack([around, np.abs(local[:, 2]) - shape.length / 2.0], axis=1)
            case _:
                raise TypeError(f"{shape} has no closed form here")
        return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)

    return distance


def least_distance(
    robot: Robot, scene: Scene, trajectory: Trajectory, *, coarse: float = 0.004, fine: float = 0.0002
) -> float:
    """Find the least distance of an arm of capsules from the objects, m, by samples that are dense near them."""
    times = np.append(np.arange(0.0, trajectory.duration, coarse), trajectory.duration)
    apart = np.nanmin(distances_over_time(robot, scene, times, trajectory), axis=(1, 2))
    near = times[np.argsort(apart)[:6]]
    dense = (near[:, None] + np.arange(-coarse, coarse, fine)).ravel().clip(0.0, trajectory.duration)
    return float(min(apart.min(), np.nanmin(distances_over_time(robot, scene, np.unique(dense), trajectory))))
