"""A motion of least effort that meets a ball, unlike the straight motion, and the effort of a motion."""

from __future__ import annotations

import numpy as np

import planner
from planner.robots import Robot
from planner.scene import SceneObject
from planner.shapes import Sphere
from planner.spatial import Pose
from tests.planner.capsule_arm import CAPSULE_ARM

KUKA = CAPSULE_ARM
REST = planner.JointWaypoint((0.0, -1.57, 1.57, 0.0, 0.5, 0.0))
GOAL = planner.JointWaypoint((1.2, -1.2, 1.9, 0.2, 0.9, 0.3))
BALL = SceneObject("ball", [Sphere(0.02)], Pose([0.6286, -0.4701, 0.8621]))
"""A ball in the way of the third link on the motion of least effort, but not on the straight one from REST to GOAL."""


def effort(robot: Robot, trajectory: planner.Trajectory) -> float:
    """Return the integral of the squared torques by their limits, s, by dense samples."""
    times = np.linspace(0.0, trajectory.duration, 2001)
    torques = planner.inverse_dynamics(robot, *trajectory.evaluate(times, [0, 1, 2])) / robot.limit("torque")
    return float(np.trapezoid((torques**2).sum(axis=1), times))
