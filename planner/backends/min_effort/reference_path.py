"""The path of a first motion, from which another motion may deviate by a limited distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.backends.min_effort.options import MinEffortOptions
from planner.kinematics.forward import jacobian
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tool_motions.path_distances import CHORDS, farthest_from_path, joints_farthest_from_path
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial

JOINTS_SHARE = 1e-3
"""Share of a radian in the measure of lengths, beside the tool's motion; it counts if the tool hardly moves."""


@dataclass(frozen=True, eq=False)
class ReferencePath:
    """The path of a motion, and the largest deviations of another motion from it.

    Attributes:
        robot: The robot, with its tool.
        motion: The motion along the path.
        max_deviation: The largest distance of the tool from the path, m; None: any.
        max_joint_deviation: The largest distance of any joint from its position on the path, rad or m; None: any.
    """

    robot: Robot
    motion: SegmentedPolynomial
    max_deviation: float | None
    max_joint_deviation: float | None

    @classmethod
    def of(cls, robot: Robot, motion: SegmentedPolynomial, options: MinEffortOptions) -> ReferencePath | None:
        """Return the path of a motion with the largest deviations from it; None: no limit."""
        if options.max_deviation is None and options.max_joint_deviation is None:
            return None
        return cls(robot, motion, options.max_deviation, options.max_joint_deviation)

    def limits(self, margin: float) -> FloatArray:
        """Return the limits (rows,) of the rows of `path_stage_of`; limits of deviations are narrowed by a margin."""
        tool = [] if self.max_deviation is None else [(self.max_deviation / margin) ** 2]
        joints = [] if self.max_joint_deviation is None else [self.max_joint_deviation / margin] * self.robot.dof
        return np.array([*tool, *joints, 1.0])

    def constants(self, segments: np.ndarray, of_segment: FloatArray) -> FloatArray:
        """Return the constants (instants, 3 joints + 1) of `path_stage_of` at shares of the time of segments.

        A straight path may be followed at any pace. A joint position is then compared with the nearest point of the
        path, measured by the tool's motion there. A curved path is followed at the pace of its motion.
        """
        positions = np.empty((len(segments), self.robot.dof))
        for segment, own in enumerate(by_segment(self.motion)):
            there = segments == segment
            positions[there] = own.evaluate(of_segment[there] * own.breakpoints[-1], [0])[0]
        shares = np.full((len(positions), 1), 0.5)
        slope, gradient = np.zeros_like(positions), np.zeros_like(positions)
        if not segments.any():
            start, end = self.motion.evaluate(self.motion.breakpoints[[0, -1]], [0])[0]
            slope += end - start
            shares = (positions - start) @ slope[:1].T / (slope[:1] @ slope[:1].T)
            levers = np.array([jacobian(self.robot, position)[:3] for position in positions])
            gradient = np.einsum("nik,nil,nl->nk", levers, levers, slope) + JOINTS_SHARE**2 * slope
            gradient /= (gradient * slope).sum(axis=1)[:, None]
        return np.hstack([positions, shares, slope, gradient])

    def use(self, other: SegmentedPolynomial) -> float:
        """Return the largest used share of the allowed deviations, segment by segment."""
        worst = 0.0
        for known, own in zip(by_segment(self.motion), by_segment(other), strict=True):
            (reference,) = known.evaluate(np.linspace(0.0, known.breakpoints[-1], CHORDS + 1), [0])
            last = float(own.breakpoints[-1])
            if self.max_deviation is not None:
                worst = max(worst, farthest_from_path(self.robot, own, 0.0, last, reference)[0] / self.max_deviation)
            if self.max_joint_deviation is not None:
                worst = max(worst, joints_farthest_from_path(own, 0.0, last, reference)[0] / self.max_joint_deviation)
        return worst


def by_segment(motion: SegmentedPolynomial) -> list[PiecewisePolynomial]:
    """Return the motion on each of its segments, in their order."""
    return [motion.of(motion.segments == segment) for segment in np.unique(motion.segments)]
