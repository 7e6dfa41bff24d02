"""Torques of the joints within the tolerances of payloads and friction and the following errors of joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.constraints.constraint import Constraint, Rows
from planner.constraints.excess import first_excess
from planner.constraints.quantities import TORQUE
from planner.dynamics import torques_by_pace
from planner.dynamics.torque_tolerances import torque_tolerances
from planner.kinematics.forward import JointStates
from planner.quantities import MEASURES
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

NEWTON_STEPS_OF_PACE = 30
"""Steps of Newton's method to a root of a convex function with up to a few dozen kinks; 3 are common."""

ROWS_OF_JOINT = 8
"""Number of rows of each joint."""

LEAST_SQUARED_PACE = 1e-200
"""The square of a pace that stands for none at all."""


@dataclass(frozen=True)
class TorqueWithTolerances(Constraint):
    """The torques with the largest magnitudes that the robot needs within its tolerances and following errors.

    The magnitude is |t| + sum |t_k|, for the torques t of the given robot and t_k of each generator. The sign is that
    of t.
    """

    name: str = "torque_with_tolerances"
    unit: str = MEASURES["torque_with_tolerances"].unit
    order: int = 2
    of_joints: bool = True
    counts_at_rest: bool = True
    follows_path_speed: bool = False
    has_rows: bool = True

    def is_known(self, robot: Robot) -> bool:
        """Return whether the robot has tolerances or following errors."""
        return torque_tolerances(robot) is not None

    def has_factors(self, robot: Robot) -> bool:
        """Return that it has."""
        return True

    def values(self, states: JointStates) -> FloatArray:
        """Return the torques (N, joints), N m or N."""
        torques, generators = TORQUE.values(states), torque_tolerances(states.robot)
        if generators is not None:
            spread = np.abs(generators.torques(states.q, states.v, states.a)).sum(axis=0)
            torques += np.copysign(spread, torques)
        return torques

    def overestimates(self, states: JointStates) -> FloatArray:
        """Return twice the remainder (N, joints) of following errors: a torque may be as much below the bound."""
        generators = torque_tolerances(states.robot)
        return np.zeros_like(states.q) if generators is None else 2.0 * generators.remainder(states.v, states.a)

    def rows(self, path: JointStates) -> Rows:
        """Return the path dynamics with some values at the ends of the tolerances, eight rows for each joint.

        These values ask the most at rest, at a constant path velocity, or with a path acceleration; `factors` keep the
        limits with all others.
        """
        own, generators = TORQUE.rows(path), torque_tolerances(path.robot)
        if generators is None:
            return Rows(*(np.repeat(part, ROWS_OF_JOINT, axis=1) for part in own))
        by_u, by_x, rest = terms = generators.path_dynamics(path.q, path.v, path.a)
        signs = [np.where(part >= 0.0, 1.0, -1.0) for part in (rest, by_x, rest + by_u, rest - by_u)]
        added = np.array([side * (terms * sign).sum(axis=1) for sign in signs for side in (1.0, -1.0)])
        each = np.array(own) + added  # (rows of a joint, terms, points, joints)
        return Rows(*each.transpose(1, 2, 3, 0).reshape(3, *path.q.shape[:-1], -1))

    def factors(self, states: JointStates, limits: FloatArray, middle: FloatArray) -> FloatArray:
        """Return the factors: at the pace x every torque is g + m x^2, with g from torques at rest.

        With friction, sum |g| + sum |m| x^2 stands for the sum of the magnitudes of the generators.
        """
        generators = torque_tolerances(states.robot)
        if generators is None:
            return np.zeros_like(limits)
        held, linear, moved = torques_by_pace(states.robot, states.q, states.v, states.a)
        resting, resisting, moving = generators.by_pace(states.q, states.v, states.a)
        if states.robot.friction is None:
            terms = np.array([held, *resting]), np.array([moved, *moving])
            return 1.0 / np.sqrt(largest_squared_paces(*terms, limits))
        sums = [np.abs(part).sum(axis=0) for part in (resting, resisting, moving)]
        given, none = (held, linear, moved), np.zeros_like(held)
        each = [
            np.stack([*(own + side * part for own, part in zip(sums, given, strict=True)), none])
            for side in (1.0, -1.0)
        ]
        paces: FloatArray = np.min([first_excess(coefficients, limits) for coefficients in each], axis=0)
        return 1.0 / paces


def largest_squared_paces(held: FloatArray, moved: FloatArray, limits: FloatArray) -> FloatArray:
    """Return the largest x (...) with sum |held + moved x| <= limits, at least a tiny one; infinite: all.

    The sum is convex in x. Newton's method from above never steps below the root, and ends at it.

    Args:
        held: (terms, ...).
        moved: Of the same shape.
        limits: (...), infinite: none.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (limits + np.abs(held).sum(axis=0)) / np.abs(moved).sum(axis=0)
        x = np.where(np.isnan(x), np.inf, x)
        for _ in range(NEWTON_STEPS_OF_PACE):
            terms = held + moved * np.where(np.isfinite(x), x, 0.0)
            excess = np.abs(terms).sum(axis=0) - limits
            beyond = np.isfinite(x) & (excess > ROUNDING * limits)
            if not beyond.any():
                break
            slope = (np.sign(terms) * moved).sum(axis=0)
            x = np.where(beyond, np.where(slope > 0.0, x - excess / slope, 0.0), x)
    return np.maximum(x, LEAST_SQUARED_PACE)


TORQUE_WITH_TOLERANCES = TorqueWithTolerances()
"""The largest magnitudes of the joints' torques within all tolerances and following errors."""
