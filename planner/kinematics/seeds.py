"""Good starts for the inverse kinematics: a table of configurations with the poses they reach."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from planner.kinematics.closed_form import ClosedForm, closed_form
from planner.kinematics.descent import Target
from planner.kinematics.screws import screws_of
from planner.last_used import LastUsed, bytes_of_arrays
from planner.robots import Robot
from planner.spatial import FloatArray

TABLE_ROWS = 4096
"""Configurations in a table: about 2 MB and 15 ms for a robot with six joints."""

TURN_IN_REACHES = 0.5
"""Weight of a turn by 1 rad against a distance, in standard deviations of the tip's position."""

LEAST_TIP_TRAVEL = 1e-6
"""m: of a tip that moves by less the position does not matter."""

DAMPING = 1e-4
"""Damping of the Newton step of every row, so that a row at a singularity predicts no wild step."""

OUTSIDE_COST = 2.0
"""Cost of a predicted joint position outside the limits, for each rad or m of the predicted step."""


SEED_CACHE_BYTES = 2**26
"""Memory of the tables that a process keeps, those last used, bytes: some twenty of arms with six joints."""


class SeedTable:
    """Random joint positions of a robot within its limits, each with its Newton step to a given pose.

    The similarity of a row's pose to the requested one is linear in the requested pose. So is Newton's step to it, with
    (R - R^T) / 2 for the logarithm of a rotation. Two small matrix products therefore find and improve the starts.

    The rows hold the pose of the tip, not of the tool, so that one table serves the robot with any tool.
    """

    def __init__(self, robot: Robot) -> None:
        self.lower, self.upper = robot.limit("lower"), robot.limit("upper")
        self.configurations = random_configurations(robot, TABLE_ROWS, seed=0)
        self.screws = screws_of(robot)
        self.positions, self.rotations, jacobians = self.screws.reach(self.configurations, np.zeros(3))
        self._closed_form = closed_form(self.screws, None)
        self.levers = self.screws.levers(self.lower, self.upper)
        reach = float(np.sqrt(self.positions.var(axis=0).sum()))
        reach = reach if reach > LEAST_TIP_TRAVEL else 1.0
        # |p - p*|^2 / reach^2 + (0.5 |R - R*|_F)^2, without the terms that are the same in every row
        likeness = [
            self.positions / reach**2,
            TURN_IN_REACHES**2 * self.rotations.reshape(TABLE_ROWS, 9),
            -0.5 * (self.positions**2).sum(axis=1, keepdims=True) / reach**2,
        ]
        self._likeness = np.hstack(likeness).astype(np.float32)
        transposed = jacobians.transpose(0, 2, 1)
        inverse = transposed @ np.linalg.inv(jacobians @ transposed + DAMPING * np.eye(6))
        prediction = inverse @ _errors_per_pose(self.positions, self.rotations)
        prediction[:, :, 12] += self.configurations
        self._prediction = prediction.astype(np.float32)

    def form(self, target: Target) -> ClosedForm | None:
        """Return the closed form for such targets, if there is one."""
        return self._closed_form if target.rotations is not None else closed_form(self.screws, target.point)

    def starts(self, tip: pin.SE3, count: int) -> FloatArray:
        """Return starts (count, joints) for this pose of the tip, the predicted nearest first."""
        pose = np.empty(13, dtype=np.float32)
        pose[:3], pose[3:12], pose[12] = tip.translation, tip.rotation.ravel(), 1.0
        rows = np.argpartition(self._likeness @ pose, TABLE_ROWS - count)[TABLE_ROWS - count :]
        predicted = (self._prediction.take(rows, axis=0) @ pose).astype(np.float64)
        within = np.minimum(np.maximum(predicted, self.lower), self.upper)
        cost = np.abs(predicted - self.configurations[rows]) + OUTSIDE_COST * np.abs(predicted - within)
        best_first: FloatArray = within[cost.max(axis=1).argsort(kind="stable")]
        return best_first

    def starts_at(self, point: FloatArray, tool: FloatArray, count: int) -> FloatArray:
        """Return configurations (count, joints) that bring the point `tool` of the tip near `point`, nearest first."""
        distance = ((self.positions + self.rotations @ tool - point) ** 2).sum(axis=1)
        rows = np.argpartition(distance, count)[:count]
        nearest_first: FloatArray = self.configurations[rows[distance[rows].argsort(kind="stable")]]
        return nearest_first


def seed_table(robot: Robot) -> SeedTable:
    """Return the robot's table from a cache; robots with equal kinematics share one."""
    return _tables.get(robot.kinematic_content, lambda: SeedTable(robot))


def random_configurations(robot: Robot, count: int, seed: int) -> FloatArray:
    """Return configurations (count, joints), evenly at random within the limits and one turn."""
    return np.random.default_rng(seed).uniform(*searched_box(robot), (count, robot.dof))


def searched_box(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return bounds (joints,) of the search: one turn of an angle at most, about 1 m of open lengths."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    reach = np.where(robot.is_angle, np.pi, np.where(np.isfinite(upper - lower), np.inf, 1.0))
    return np.maximum(lower, robot.middle - reach), np.minimum(upper, robot.middle + reach)


def _errors_per_pose(positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return linear maps (rows, 6, 13) from a pose (p, R, 1) to each row's error, linear over angular."""
    errors = np.zeros((len(positions), 6, 13))
    errors[:, :3, :3] = np.eye(3)
    errors[:, :3, 12] = -positions
    # (R R_row^T)_ij is the product of row i of R and row j of R_row.
    for axis, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        errors[:, 3 + axis, 3 + 3 * i : 6 + 3 * i] = 0.5 * rotations[:, j]
        errors[:, 3 + axis, 3 + 3 * j : 6 + 3 * j] = -0.5 * rotations[:, i]
    return errors


_tables: LastUsed[SeedTable] = LastUsed(SEED_CACHE_BYTES, bytes_of_arrays)
