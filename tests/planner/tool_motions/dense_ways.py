"""The distance of a motion's tool from the straight joint motion, by nearest neighbours of dense samples."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from planner.kinematics import FloatArray, forward_kinematics
from planner.polynomials import PiecewisePolynomial
from planner.robots import Robot

DENSE = np.linspace(0.0, 1.0, 20_001)
"""Shares of a motion at which the brute force looks."""


class StraightWay:
    """The places of the tool on the straight motion between two joint positions (2, joints)."""

    def __init__(self, robot: Robot, ends: FloatArray) -> None:
        self.robot = robot
        self.places = cKDTree(self._tool(ends[0] + DENSE[:, None] * (ends[1] - ends[0])))

    def distances(self, joints: FloatArray) -> FloatArray:
        """m, (N,), of the tool at joint positions (N, joints)."""
        distances: FloatArray = self.places.query(self._tool(joints))[0]
        return distances

    def farthest(self, motion: PiecewisePolynomial) -> float:
        """m, of the tool on a motion."""
        return float(self.distances(motion.evaluate(DENSE * motion.breakpoints[-1], [0])[0]).max())

    def _tool(self, joints: FloatArray) -> FloatArray:
        return np.array([pose.position for pose in forward_kinematics(self.robot, joints)])
