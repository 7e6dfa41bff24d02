"""Speeds near objects, independent of the tested code: Pinocchio's velocities and closed forms, densely sampled."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.scene import Scene
from planner.shapes import Capsule, Sphere
from planner.spatial import FloatArray
from planner.speed_zones import SpeedZone
from planner.trajectories.trajectory import Trajectory
from tests.planner.scene.brute_force import distances_over_time
from tests.sizes import NAME

DIRECTIONS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
"""Directions of the checked points of a ball."""

HEIGHTS, TURNS = np.linspace(-1.0, 1.0, 101)[:, None] * np.pi / 2.0, np.arange(200) * np.pi / 100.0
RING = np.stack(
    np.broadcast_arrays(np.cos(HEIGHTS) * np.cos(TURNS), np.cos(HEIGHTS) * np.sin(TURNS), np.sin(HEIGHTS)), axis=-1
).reshape(-1, 3)
"""More directions, one of them within 2 degrees of any direction."""

PERIOD = {"quick": 5e-3, "large": 2e-3, "soak": 1e-3}[NAME]
"""Time between two samples, s."""

MOST_SAMPLES = 20_000
"""Number of samples of a long motion."""


def speeds_over_time(
    robot: Robot, times: FloatArray, trajectory: Trajectory, directions: FloatArray = DIRECTIONS
) -> FloatArray:
    """Compute the highest speed (times,) of points on the capsules, in directions (N, 3), and of the tool, m/s."""
    frame = robot.model.frames[robot.tool_frame_id]
    points = [(int(frame.parentJoint), frame.placement.translation[None])]
    for body in robot.collision_shapes:
        assert isinstance(body.shape, Capsule | Sphere)
        half = body.shape.length / 2.0 if isinstance(body.shape, Capsule) else 0.0
        ball = body.shape.radius * directions / np.linalg.norm(directions, axis=1)[:, None]
        end = np.array([0.0, 0.0, half])
        both = np.concatenate([ball + end, ball - end])
        points.append((body.joint, both @ body.placement.rotation.T + body.placement.translation))
    data, found = robot.model.createData(), np.zeros(len(times))
    for row, state in enumerate(zip(*trajectory.evaluate(times, [0, 1]), strict=True)):
        pin.forwardKinematics(robot.model, data, *state)
        for joint, there in points:
            twist = data.v[joint]  # in the joint's frame, of its origin
            speeds = np.linalg.norm(twist.linear + np.cross(twist.angular, there), axis=1)
            found[row] = max(found[row], speeds.max())
    return found


def speeds_in_zone(
    robot: Robot, scene: Scene, trajectory: Trajectory, clearance: float, objects: Sequence[str] | None = None
) -> FloatArray:
    """Return the highest speeds (N,) of a robot at samples nearer to objects than a clearance, m/s."""
    period = max(PERIOD, trajectory.duration / MOST_SAMPLES)
    times = np.append(np.arange(0.0, trajectory.duration, period), trajectory.duration)
    apart = distances_over_time(robot, scene, times, trajectory)
    counts = [objects is None or thing.id in objects for thing in scene.objects]
    near = np.nanmin(apart[:, :, counts], axis=(1, 2)) < clearance
    return speeds_over_time(robot, times[near], trajectory)


def assert_slow_enough(robot: Robot, scene: Scene, trajectory: Trajectory, zones: Sequence[SpeedZone]) -> FloatArray:
    """Fail if a sample is too fast in a zone; return the highest speed (zones,) in each, m/s."""
    seen = np.zeros(len(zones))
    for k, zone in enumerate(zones):
        speeds = speeds_in_zone(robot, scene, trajectory, zone.clearance, zone.objects)
        seen[k] = speeds.max(initial=0.0)
        assert seen[k] <= zone.speed * (1.0 + 1e-9), f"{seen[k]} m/s in a zone of {zone.speed} m/s"
    return seen
