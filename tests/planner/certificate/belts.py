"""A box on a belt that crosses the way of an arm, and the least distance between both at dense samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

import planner
from planner.spatial import FloatArray, Pose
from tests.planner.capsule_arm import arm_of_capsules
from tests.planner.cells.brute_force import Placed, distance, robot_world, se3

ARM = arm_of_capsules("ur5e")
LEFT, MIDDLE, RIGHT = ([turn, -1.2, 1.4, -1.77, -1.57, 0.0] for turn in (0.8, 0.0, -0.8))
CROSSING = planner.forward_kinematics(ARM, MIDDLE).position
"""Where the tool crosses the belts of these tests, m."""

AHEAD, UP = np.eye(3)[[0, 2]]


def world_of(thing: planner.SceneObject) -> Callable[[float], Placed]:
    """Return the shapes of an object over time, by Pinocchio's screws between given poses."""
    start, motion = se3(thing.pose), thing.motion

    def at(time: float) -> Placed:
        placed = start
        if isinstance(motion, planner.ConstantVelocity):
            moved = np.asarray(motion.velocity) * min(time, np.inf if motion.end is None else motion.end)
            placed = pin.SE3(start.rotation, start.translation + moved)
        elif isinstance(motion, planner.TimedPoses):
            poses, times = [start, *map(se3, motion.poses)], [0.0, *motion.times]
            k = min(int(np.searchsorted(times, time, side="right")) - 1, len(times) - 2)
            share = min((time - times[k]) / (times[k + 1] - times[k]), 1.0)
            turn = pin.log3(poses[k].rotation.T @ poses[k + 1].rotation)
            there = poses[k].translation + share * (poses[k + 1].translation - poses[k].translation)
            placed = pin.SE3(poses[k].rotation @ pin.exp3(share * turn), there)
        return [(shape, placed) for shape in thing.shapes]  # type: ignore[misc]

    return at


def least_distance(plan: planner.Plan, thing: planner.SceneObject, times: FloatArray) -> float:
    """Compute the least distance of the robot of a plan from an object at times, m."""
    robot, other = robot_world(plan.problem.robot, plan.trajectory), world_of(thing)
    return min(distance(robot(t), other(t)) for t in times.tolist())


def on_belt(delay: float, speed: float = 0.4, *, size: float = 0.1, across: float = 0.0) -> planner.SceneObject:
    """Return a box on a belt that passes the crossing after a delay, s, at a height above it, m."""
    velocity = np.array([0.0, speed, 0.0])
    pose = Pose(CROSSING - velocity * delay + across * UP)
    return planner.SceneObject("box", [planner.Box([size] * 3)], pose, motion=planner.ConstantVelocity(velocity))
