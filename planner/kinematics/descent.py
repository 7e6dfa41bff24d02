"""Descents to poses and along continua of solutions, and good starts: a table of configurations with their poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from planner.kernels.descent import Box, descend
from planner.kernels.kinematics import Arm
from planner.kinematics.closed_form import ClosedForm, closed_form
from planner.kinematics.screws import Screws, screws_of
from planner.last_used import LastUsed, bytes_of_arrays
from planner.robots import Robot
from planner.spatial import FloatArray, rotation_vectors


class Patience(NamedTuple):
    """When a descent ends.

    Attributes:
        slow: After so many slow steps in a row it is given up.
        most: Most steps.
    """

    slow: int
    most: int


MOST_SLIDES = 20
"""Steps along a continuum: about three are needed."""

SLID = 0.03
"""Share of the way to the reference that a continuum may still have in its tangent space: 5e-4 of the distance."""

LEAST_STEP_SHARE = 3e-3
"""Share of a step along a continuum that is tried last, each being a third of the one before."""

LONGEST_SLIDE = 1.5
"""rad or m, the longest step of a joint along a continuum: its tangent holds nearby only."""

LEAST_DAMPING = 1e-13
"""Damping that keeps singular systems solvable, as a share of the largest diagonal."""

STEADY_SLIDE = Patience(slow=2, most=10)
"""The descent that brings the tool back after a step along a continuum."""

DESCENT_ERROR = 1e-9
"""Error (m, rad) up to which that has succeeded."""

AT_LIMIT = 1e-6
"""rad or m, from a limit: a joint that a step presses against it is held."""


@dataclass(frozen=True, eq=False)
class Target:
    """The poses to which an arm is to be brought.

    Attributes:
        screws: The arm.
        positions: (N, 3), m: where the point is to be.
        rotations: (N, 3, 3) of the tip; None: positions alone count.
        point: (3,) of the tip frame, m.
    """

    screws: Screws
    positions: FloatArray
    rotations: FloatArray | None
    point: FloatArray

    @cached_property
    def arm(self) -> Arm:
        """The arm and the point, as the kernels take them."""
        return Arm(self.screws.frames, self.point)

    @property
    def rows(self) -> int:
        """Number of equations that a pose sets."""
        return 3 if self.rotations is None else 6

    @property
    def tips(self) -> FloatArray:
        """The positions (N, 3), m, of the origin of the tip frame; without rotations, the point's positions."""
        return self.positions if self.rotations is None else self.positions - self.rotations @ self.point

    def of(self, rows: NDArray[np.intp]) -> Target:
        """Return the targets of some rows (M,)."""
        rotations = None if self.rotations is None else self.rotations[rows]
        return Target(self.screws, self.positions[rows], rotations, self.point)

    def missing(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the errors (N, 3 or 6) of configurations (N, joints), and the Jacobians (N, 3 or 6, joints)."""
        positions, rotations, J = self.screws.reach(q, self.point)
        error = self.positions - positions
        if self.rotations is None:
            return error, J[:, :3]
        return np.hstack([error, rotation_vectors(self.rotations @ rotations.transpose(0, 2, 1))]), J

    def descend(
        self, starts: FloatArray, box: Box, patience: Patience, enough: float = -np.inf
    ) -> tuple[FloatArray, FloatArray]:
        """Descend from as many starts (M, joints) to each target: the errors (M,), and where they end (M, joints).

        Behind the first that reaches the error `enough`, none is made.
        """
        return descend(self.arm, self.positions, self.rotations, starts, box, *patience, enough)

    def slide(self, start: FloatArray, reference: FloatArray, velocity: FloatArray, box: Box) -> FloatArray:
        """Move along a continuum of solutions to a local minimum of the distance from the reference.

        The function minimises |(q - reference) / velocity| over the joint positions with the same tool pose. Each step
        leads towards the reference within the tangent space of the solutions. Then a descent brings the tool back.
        Where there is no continuum, nothing moves.

        Args:
            start: (joints,), a solution of the only target.
            reference: (joints,).
            velocity: (joints,), that distances are divided by.
            box: The limits.
        """
        q, share, missing = start, 1.0, (reference - start) / velocity
        distance = float(missing.dot(missing)) ** 0.5
        for _ in range(MOST_SLIDES):
            step = self._tangent(q, missing, velocity, box)
            if float(step.dot(step)) ** 0.5 <= SLID * distance:
                break
            step *= velocity
            # Up to the first limit in the way: there the joint is held from then on.
            ahead = np.where(step > 0.0, box.upper - q, q - box.lower)
            over = float((np.abs(step) / np.maximum(ahead, AT_LIMIT)).max())
            step /= max(1.0, over, float(np.abs(step).max()) / LONGEST_SLIDE)
            while share > LEAST_STEP_SHARE:
                trial = np.minimum(np.maximum(q + share * step, box.lower), box.upper)
                (error,), (trial,) = self.descend(trial[None], box, STEADY_SLIDE)
                missing_there = (reference - trial) / velocity
                distance_there = float(missing_there.dot(missing_there)) ** 0.5
                if error < DESCENT_ERROR and distance_there < distance:
                    break
                share /= 3.0
            else:
                break
            q, missing, distance, share = trial, missing_there, distance_there, min(1.0, 2.0 * share)
        return q

    def _tangent(self, q: FloatArray, missing: FloatArray, velocity: FloatArray, box: Box) -> FloatArray:
        """Return the part (joints,) of `missing` that leaves the tool still, both in time at the velocities."""
        J = self.screws.reach(q[None], self.point)[2][0, : self.rows] * velocity
        held = np.zeros(len(q), dtype=bool)
        while True:
            J, way = np.where(held, 0.0, J), np.where(held, 0.0, missing)
            normal = J.dot(J.T)
            normal.flat[:: len(J) + 1] += LEAST_DAMPING * (1.0 + normal.diagonal().max())
            step: FloatArray = way - J.T.dot(np.linalg.solve(normal, J.dot(way)))
            pressing = ((q <= box.lower + AT_LIMIT) & (step < 0.0)) | ((q >= box.upper - AT_LIMIT) & (step > 0.0))
            if not pressing.any():
                return step
            held |= pressing


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
