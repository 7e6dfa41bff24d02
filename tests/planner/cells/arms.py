"""Arms of cells: positions, places and the times of their plans."""

from __future__ import annotations

import numpy as np

import planner
from planner.robots import Robot
from planner.spatial import FloatArray, Pose

MARGIN = 0.01
"""The least distance between robots in these tests, m."""

STEPS = 60
"""Steps of the longest trajectory in the diagram by brute force."""

AWAY = [np.pi, -1.9, 2.3, -1.8, -1.6, 0.0]
"""A joint position of the UR5e above its base."""

REACH = [np.pi, -0.6, 0.8, -1.8, -1.6, 0.0]
"""A joint position of the UR5e that reaches forwards."""


def placed(robot: Robot, x: float, y: float, turn: float) -> Robot:
    c, s = np.cos(turn), np.sin(turn)
    return robot.derived(mounting=Pose([x, y, 0.0], [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def times_of(plan: planner.Plan, step: float) -> FloatArray:
    return np.append(np.arange(0.0, plan.trajectory.duration, step), plan.trajectory.duration)
