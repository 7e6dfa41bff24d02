"""What makes one solution of a pose better than another, besides the way to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from planner.kinematics.configurations import Configuration, configurations
from planner.kinematics.forward import LEAST_MANIPULABILITY, manipulability
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import Search, wide_spread
from planner.kinematics.turns import counted_velocity
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tool_motions.least_cost import least_cost
from planner.tool_motions.position_limits import shares_of_range

Costs = Callable[[FloatArray], FloatArray]

SIDE = 0.01
"""The weight of the sum over all joints beside the worst one: it decides where that leaves the others open."""

CONTINUUM_STARTS = 6
"""Number of the best solutions that are known of a continuum from which a better one is sought."""


def costs_of(robot: Robot, options: InverseKinematicsOptions) -> Costs | None:
    """Return the preference costs (N,) of joint positions (N, joints); None: only the path counts.

    Args:
        robot: The robot, with its tool; joints behind its own, the offsets of a region, do not count.
        options: The preference and the reference.
    """
    match options.prefer:
        case "continuous" | "arm":
            return None
        case "near_reference":
            return partial(_away, robot, np.array(options.reference))
        case "manipulability":
            return partial(_singular, robot)
        case "far_from_limits":
            return partial(_near_limits, robot)


def best_of_continuum(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions,
    known: Sequence[FloatArray],
    costs: Costs,
    wanted: Configuration,
) -> list[FloatArray]:
    """Return solutions (joints,) of least cost near known ones, and others spread widely."""
    search = Search(robot, pose, options)
    allowed = partial(_in_configuration, robot, wanted, costs)
    starts = np.array([*known, *wide_spread(search)])
    found = allowed(starts)
    best = [row for row in found.argsort(kind="stable")[:CONTINUUM_STARTS].tolist() if np.isfinite(found[row])]
    return [least_cost(search, starts[row], allowed) for row in best]


def _in_configuration(robot: Robot, wanted: Configuration, costs: Costs, positions: FloatArray) -> FloatArray:
    """Return costs (N,) that are infinite outside the requested configuration."""
    found = costs(positions)
    if wanted.names:
        found = np.where([wanted.allows(other) for other in configurations(robot, positions)], found, np.inf)
    return found


def _away(robot: Robot, reference: FloatArray, positions: FloatArray) -> FloatArray:
    """Return the times (N,), s, from the reference (joints,) at full speed of the joints."""
    times = np.abs(positions[:, : robot.dof] - reference) / counted_velocity(robot.limit("velocity"))
    costs: FloatArray = times.max(axis=1) + SIDE * times.sum(axis=1)
    return costs


def _singular(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return the negative logarithms (N,) of the manipulability."""
    costs: FloatArray = -np.log(np.maximum(manipulability(robot, positions[:, : robot.dof]), LEAST_MANIPULABILITY))
    return costs


def _near_limits(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return distances of (N,) joints from the middle of their limits, relative to half their ranges."""
    shares = np.abs(shares_of_range(robot, positions[:, : robot.dof]))
    costs: FloatArray = shares.max(axis=1) + SIDE * shares.sum(axis=1)
    return costs
