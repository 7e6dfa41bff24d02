"""The distance of a motion from the straight joint motion at dense samples, by brute force."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from planner.kinematics import FloatArray, forward_kinematics
from planner.robots import Robot
from planner.trajectories.polynomials import PiecewisePolynomial

DENSE = np.linspace(0.0, 1.0, 20_001)
"""Fractions of a motion for the brute force."""


THIRDS = 60
"""Number of steps of ternary search on a straight line: to 3e-11 of it."""


def tool_positions(robot: Robot, joints: FloatArray) -> FloatArray:
    """Return positions (N, 3), m, at joint positions (N, joints)."""
    return np.array([pose.position for pose in forward_kinematics(robot, joints)])


class StraightWay:
    """The positions of the tool on the straight motion between two joint positions (2, joints)."""

    def __init__(self, robot: Robot, ends: FloatArray, shares: FloatArray = DENSE) -> None:
        self.robot, self.shares = robot, shares
        self.way = cKDTree(tool_positions(robot, ends[0] + shares[:, None] * (ends[1] - ends[0])))

    def distances(self, joints: FloatArray) -> FloatArray:
        """Compute the distances (N,) of the tool at joint positions (N, joints) from the path, m."""
        distances: FloatArray = self.way.query(tool_positions(self.robot, joints))[0]
        return distances

    def farthest(self, motion: PiecewisePolynomial) -> float:
        """Return the largest distance of the tool on a motion, m."""
        return float(self.distances(motion.evaluate(self.shares * motion.breakpoints[-1], [0])[0]).max())


class StraightPositions:
    """The joint positions on that motion; the distance, rad or m, is that of the joint that is farthest."""

    def __init__(self, ends: FloatArray, shares: FloatArray = DENSE) -> None:
        self.ends, self.shares = ends, shares

    def distances(self, joints: FloatArray) -> FloatArray:
        """Compute the distance, rad or m, (N,), of joint positions (N, joints) from the line by ternary search.

        The distance is convex along the line.
        """

        def away(shares: FloatArray) -> FloatArray:
            largest: FloatArray = np.abs(joints - self.ends[0] - shares[:, None] * np.diff(self.ends, axis=0)).max(
                axis=1
            )
            return largest

        first, last = np.zeros(len(joints)), np.ones(len(joints))
        for _ in range(THIRDS):
            left, right = (2.0 * first + last) / 3.0, (first + 2.0 * last) / 3.0
            falls = away(left) > away(right)
            first, last = np.where(falls, left, first), np.where(falls, last, right)
        return away((first + last) / 2.0)

    def farthest(self, motion: PiecewisePolynomial) -> float:
        """Return the largest deviation of the joints on a motion, rad or m."""
        return float(self.distances(motion.evaluate(self.shares * motion.breakpoints[-1], [0])[0]).max())
