"""The workspace: the positions of the tool within the position limits, and their extremes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidProblem
from planner.kinematics.forward import forward_kinematics, jacobian, tool_pose
from planner.robots import Robot
from planner.spatial import FloatArray

DRAWS = 1000
"""Random positions to look for starts in, at least: the figures are as good with a small cloud as with a large one."""

ASCENT_STARTS = 8
"""Ascents for each figure; the best of their ends counts."""

ITERATIONS = 100
"""Newton steps of one ascent; ten are the rule."""

MOST_ASCENT_HALVINGS = 40
"""Halvings of a step before the ascent ends."""

LEAST_BOUNDARY_CURVATURE = 1e-9
"""Curvature (relative to the largest) that counts as none: the step there goes as far as it may."""

TIE = 1e-6
"""Weight of (radius / size)^2 beside height / size: it decides between points that are equally high."""


@dataclass(frozen=True, eq=False)
class Extreme:
    """A figure of the workspace, and where it is reached.

    Attributes:
        value: The figure, m.
        position: (joints,), rad or m: a joint position with that value.
    """

    value: float
    position: FloatArray


@dataclass(frozen=True, eq=False)
class Workspace:
    """The places where the tool can be. Collisions are not looked at.

    Attributes:
        points: (N, 3), m: the tool in the base frame, at random joint positions.
        minimum_radius: Smallest distance from the base frame's z axis.
        maximum_radius: Largest distance from the base frame's z axis.
        minimum_height: Smallest z in the base frame.
        maximum_height: Largest z in the base frame.
        radius_at_maximum_height: Distance from the z axis there; the largest, where there are several.
        minimum_reach: Smallest distance from the base frame's origin.
        maximum_reach: Largest distance from the base frame's origin.
    """

    points: FloatArray
    minimum_radius: Extreme
    maximum_radius: Extreme
    minimum_height: Extreme
    maximum_height: Extreme
    radius_at_maximum_height: Extreme
    minimum_reach: Extreme
    maximum_reach: Extreme


@dataclass(frozen=True)
class Objective:
    """A function of the tool's position p, m, that is maximised: linear . p + square . p^2."""

    linear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    square: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def value(self, p: FloatArray) -> FloatArray:
        """Return the value (...) at positions (..., 3)."""
        result: FloatArray = p @ np.array(self.linear) + p**2 @ np.array(self.square)
        return result


def workspace(robot: Robot, samples: int = DRAWS, seed: int = 0) -> Workspace:
    """Sample the workspace, and find its extremes.

    The search for the extremes starts at the best samples. From each, a Newton ascent within the position limits
    reaches an extreme, to rounding error. The answer depends on nothing but the arguments.

    Args:
        robot: The robot, with its tool.
        samples: How many points are wanted.
        seed: Seed of the random positions: uniform within the limits, over one turn where a joint has none.

    Raises:
        InvalidProblem: A joint slides without limits.
    """
    endless = [joint.name for joint in robot.joints if not joint.is_angle and not np.isfinite(joint.upper)]
    if endless:
        raise InvalidProblem([(("robot",), f"{name} slides without limits: no workspace") for name in endless])
    limited = np.isfinite(robot.limit("lower"))
    lower = np.where(limited, robot.limit("lower"), -np.pi)
    upper = np.where(limited, robot.limit("upper"), np.pi)
    positions = np.random.default_rng(seed).uniform(lower, upper, (max(samples, DRAWS), robot.dof))
    points = np.array([pose.position for pose in forward_kinematics(robot, positions)])
    longest = float((upper - lower).max())

    def best(objective: Objective) -> FloatArray:
        starts = positions[np.argsort(-objective.value(points), kind="stable")[:ASCENT_STARTS]]
        ends = [_ascend(robot, objective, start, longest) for start in starts]
        return max(ends, key=lambda q: float(objective.value(tool_pose(robot, q).position)))

    innermost, outermost = best(Objective(square=(-1.0, -1.0, 0.0))), best(Objective(square=(1.0, 1.0, 0.0)))
    nearest, farthest = best(Objective(square=(-1.0, -1.0, -1.0))), best(Objective(square=(1.0, 1.0, 1.0)))
    lowest = best(Objective(linear=(0.0, 0.0, -1.0)))
    tie = TIE / max(float(np.abs(points).max()), TIE)
    highest = best(Objective(linear=(0.0, 0.0, 1.0), square=(tie, tie, 0.0)))
    # The tie-break pulls the tool off the top by about TIE of its size: one more ascent, by height alone.
    highest = _ascend(robot, Objective(linear=(0.0, 0.0, 1.0)), highest, longest)
    return Workspace(
        points[:samples],
        minimum_radius=_radius(robot, innermost),
        maximum_radius=_radius(robot, outermost),
        minimum_height=_height(robot, lowest),
        maximum_height=_height(robot, highest),
        radius_at_maximum_height=_radius(robot, highest),
        minimum_reach=_reach(robot, nearest),
        maximum_reach=_reach(robot, farthest),
    )


def _radius(robot: Robot, q: FloatArray) -> Extreme:
    return Extreme(float(np.linalg.norm(tool_pose(robot, q).position[:2])), q)


def _height(robot: Robot, q: FloatArray) -> Extreme:
    return Extreme(float(tool_pose(robot, q).position[2]), q)


def _reach(robot: Robot, q: FloatArray) -> Extreme:
    return Extreme(float(np.linalg.norm(tool_pose(robot, q).position)), q)


def _ascend(robot: Robot, objective: Objective, q: FloatArray, longest: float) -> FloatArray:
    """Return the final joint position of Newton's method within the box.

    Steps divide by the magnitude of the curvatures, so that they lead up from a saddle too (Dauphin et al. 2014). Along
    an axis without curvature they have the length `longest`, rad or m. A joint that presses against its limit takes no
    part in the step; the others are projected on the box (Bertsekas 1982).
    """
    lower, upper = robot.limit("lower"), robot.limit("upper")
    value = objective.value(tool_pose(robot, q).position)
    for _ in range(ITERATIONS):
        gradient, hessian = _derivatives(robot, objective, q)
        free = ~(((q <= lower) & (gradient < 0.0)) | ((q >= upper) & (gradient > 0.0)))
        if not free.any():
            break
        curvatures, axes = np.linalg.eigh(hessian[np.ix_(free, free)])
        curvatures = np.abs(curvatures)
        floor = LEAST_BOUNDARY_CURVATURE * max(float(curvatures.max()), 1.0)
        step = np.zeros_like(q)
        step[free] = axes @ np.clip(axes.T @ gradient[free] / np.maximum(curvatures, floor), -longest, longest)
        for halving in range(MOST_ASCENT_HALVINGS):
            candidate = np.clip(q + step * 0.5**halving, lower, upper)
            there = objective.value(tool_pose(robot, candidate).position)
            if there > value:
                q, value = candidate, there
                break
        else:
            break
    return q


def _derivatives(robot: Robot, objective: Objective, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the gradient (joints,) and the Hessian (joints, joints) of the objective in the joint positions.

    The position's second derivative by joints i <= j is w_i x v_j, with the columns w of the angular and v of the
    linear Jacobian. Joint i turns everything behind joint j.
    """
    p, J = tool_pose(robot, q).position, jacobian(robot, q)
    v, w = J[:3], J[3:]
    slope = np.array(objective.linear) + 2.0 * np.array(objective.square) * p
    bend = np.triu(np.einsum("k,kij->ij", slope, np.cross(w[:, :, None], v[:, None, :], axis=0)))
    hessian = bend + np.triu(bend, 1).T + 2.0 * v.T @ (np.array(objective.square)[:, None] * v)
    return v.T @ slope, hessian
