"""Distances of two machines at dense samples: Pinocchio's kinematics and coal, without the planner's bodies."""

from __future__ import annotations

from collections.abc import Callable

import coal
import numpy as np
import pinocchio as pin

import planner
from planner.robots import Robot
from planner.shapes import Shape
from planner.spatial import FloatArray, Pose
from planner.trajectories.trajectory import Trajectory

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


def random_plan(robot: Robot, rng: np.random.Generator, waypoints: int, backend: str = "cubic") -> planner.Plan:
    """Plan random joint motions of a UR arm that reaches forwards."""
    low, high = np.array([[2.0, -1.6, 0.4, -1.5, -1.7, -0.5], [4.2, -0.7, 1.6, -0.5, -1.4, 0.5]])
    return planner.plan(planner.PlanningProblem(robot, [*rng.uniform(low, high, (waypoints, 6))]), backend)
