"""Problems with open joint positions, and their durations by closed forms."""

from __future__ import annotations

import numpy as np

import planner
from planner.problems.regions import Region
from planner.problems.transitions import StopTransition, Transition
from planner.spatial import FloatArray

UR5E = planner.load_robot("ur5e")

PANDA = "panda"
"""A redundant arm with constant limits, of the extra `robots`: tests that load it are skipped without the extra."""

REGION = Region(x=(-0.02, 0.02), rotation_z=(-1.0, 1.0))
"""A shift of 20 mm and a turn of 1 rad to either side."""


def through_poses(
    robot: planner.Robot, seed: int, poses: int, transition: Transition = StopTransition(), free: Region | None = None
) -> planner.PlanningProblem:
    """Make a problem from one random joint position through poses to another; the arm reaches all."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    middle = (lower + upper) / 2.0
    positions = [middle + 0.3 * (upper - lower) * (rng.random(robot.dof) - 0.5)]
    for _ in range(poses + 1):
        positions.append(np.clip(positions[-1] + 0.4 * rng.normal(size=robot.dof), lower, upper))
    between = [
        planner.PoseWaypoint(planner.forward_kinematics(robot, q), free=free, transition=transition)
        for q in positions[1:-1]
    ]
    ends = [planner.JointWaypoint(q) for q in (positions[0], positions[-1])]
    return planner.PlanningProblem(robot, [ends[0], *between, ends[1]])


def trapezoidal_duration(robot: planner.Robot, positions: FloatArray) -> float:
    """Return the time, s, of straight motions from rest to rest, each with one trapezoid within all joints' limits."""
    velocity, acceleration = robot.limit("velocity"), robot.limit("acceleration")
    total = 0.0
    for step in np.abs(np.diff(positions, axis=0)):
        speed, rate = 1.0 / (step / velocity).max(), 1.0 / (step / acceleration).max()
        total += 1.0 / speed + speed / rate if speed**2 < rate else 2.0 / rate**0.5
    return total
