"""The distance of a motion from the straight joint motion, by nearest neighbours of dense samples."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from planner.kinematics import FloatArray, forward_kinematics
from planner.polynomials import PiecewisePolynomial
from planner.robots import Robot

DENSE = np.linspace(0.0, 1.0, 20_001)
"""Shares of a motion at which the brute force looks."""


def tool_positions(robot: Robot, joints: FloatArray) -> FloatArray:
    """m, (N, 3), at joint positions (N, joints)."""
    return np.array([pose.position for pose in forward_kinematics(robot, joints)])


class StraightWay:
    """The places of the tool on the straight motion between two joint positions (2, joints)."""

    norm = 2.0

    def __init__(self, robot: Robot, ends: FloatArray, shares: FloatArray = DENSE) -> None:
        self.robot, self.shares = robot, shares
        self.way = cKDTree(self.points(ends[0] + shares[:, None] * (ends[1] - ends[0])))

    def points(self, joints: FloatArray) -> FloatArray:
        """What is compared, (N, dimensions), at joint positions (N, joints)."""
        return tool_positions(self.robot, joints)

    def distances(self, joints: FloatArray) -> FloatArray:
        """m, (N,), of the tool at joint positions (N, joints)."""
        distances: FloatArray = self.way.query(self.points(joints), p=self.norm)[0]
        return distances

    def farthest(self, motion: PiecewisePolynomial) -> float:
        """m, of the tool on a motion."""
        return float(self.distances(motion.evaluate(self.shares * motion.breakpoints[-1], [0])[0]).max())


class StraightPostures(StraightWay):
    """The postures on that motion; the distance, rad or m, is that of the joint that is farthest."""

    norm = np.inf

    def points(self, joints: FloatArray) -> FloatArray:
        """The joint positions themselves."""
        return joints
