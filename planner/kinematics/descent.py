"""Levenberg-Marquardt within a box, from one start or from many at once: the work horse of the inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from eigenpy import LDLT

from planner.spatial import rotation_vector, rotation_vectors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planner.kinematics.screws import Screws
    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

CONVERGED = 1e-10
"""A descent ends when the error (m, rad) is as small as this; its last step leaves far less."""

DAMPING = 1e-3
"""Share of the squared error that damps a step at first."""

LEAST_DAMPING = 1e-13
"""Damping that is added to that: it keeps singular systems solvable, and lets directions of a continuum go free."""

MOST_DAMPING = 1e12
"""Share of the squared error at which steps vanish, and a descent is given up."""

LONGEST_STEP = 1.5
"""rad or m, the norm of a step: the Jacobian says nothing of what lies further away."""

MOST_SLIDES = 20
"""Steps along a continuum: about three are needed."""

SLID = 0.03
"""Share of the way to the reference that a continuum may still have in its tangent space: 5e-4 of the distance."""

LEAST_SHARE = 3e-3
"""Share of a step along a continuum that is tried last, each being a third of the one before."""

STEADY_SLIDE = {"patience": 2, "most": 10}
"""The descent that brings the tool back after a step along a continuum."""

SOLVED = 1e-9
"""Error (m, rad) up to which that has succeeded."""

AT_LIMIT = 1e-6
"""rad or m, from a limit: a joint that a step presses against it is held."""


SLOW = 0.5
"""A step is slow when more than this share of the squared error is left."""


class Descent:
    """Descents of one robot to one pose.

    Minimises |p* - p|^2 + |log(R^T R*)|^2 (m and rad alike). The damping follows the squared error (Sugihara 2011),
    so that steps are Newton's near a solution and bounded at a singularity, and grows when a step does not pay.
    A joint that presses against its limit is taken out of the step.
    """

    def __init__(self, robot: Robot, pose: Pose) -> None:
        self._model, self._data, self._frame = robot.model, robot.data, robot.tool_frame_id
        self._rows = 3 if pose.rotation is None else 6
        self._target = pin.SE3(np.eye(3) if pose.rotation is None else pose.rotation, pose.position)

    def __call__(
        self, start: FloatArray, lower: FloatArray, upper: FloatArray, patience: int, most: int
    ) -> tuple[float, FloatArray]:
        """Return the error and the joint position where the descent from `start` ends.

        Args:
            start: (joints,).
            lower: (joints,), of the box.
            upper: (joints,).
            patience: After so many slow steps in a row the start is given up.
            most: Most steps.
        """
        q, error = start, self._error(start)
        J = self._jacobian()
        squared = float(error.dot(error))
        damping, slow = DAMPING, 0
        for _ in range(most):
            if squared < CONVERGED**2:
                break
            gradient, free = J.T.dot(error), J
            if slow:  # clipping is cheaper than looking, and mostly enough
                pressing = ((q <= lower) & (gradient < 0.0)) | ((q >= upper) & (gradient > 0.0))
                free, gradient = np.where(pressing, 0.0, J), np.where(pressing, 0.0, gradient)
            normal = free.T.dot(free)
            normal.flat[:: len(q) + 1] += damping * min(squared, 1.0) + LEAST_DAMPING
            step = LDLT(normal).solve(gradient).reshape(-1)  # one row is given as a matrix
            length = float(step.dot(step)) ** 0.5
            if length > LONGEST_STEP:
                step *= LONGEST_STEP / length
            candidate = np.minimum(np.maximum(q + step, lower), upper)
            error_there = self._error(candidate)
            squared_there = float(error_there.dot(error_there))
            slow = slow + 1 if squared_there > SLOW * squared else 0
            if squared_there < squared:
                q, error, squared = candidate, error_there, squared_there
                J = self._jacobian()
                damping = max(damping / 4.0, DAMPING)
            else:
                damping *= 16.0
            if slow >= patience or damping > MOST_DAMPING:
                break
        return squared**0.5, q

    def miss(self, q: FloatArray) -> float:
        """Return the norm of the error of the pose at `q`, m and rad alike."""
        error = self._error(q)
        return float(np.sqrt(error.dot(error)))

    def slide(
        self, start: FloatArray, reference: FloatArray, velocity: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> FloatArray:
        """Move along a continuum of solutions to where no small motion on it comes nearer to the reference.

        Minimises |(q - reference) / velocity| over the joint positions that leave the tool where it is: each step
        follows what the solutions' tangent space has of the way to the reference, and a descent brings the tool back.
        Where there is no continuum, nothing moves.

        Args:
            start: (joints,), a solution.
            reference: (joints,).
            velocity: (joints,), that distances are divided by.
            lower: (joints,), of the box.
            upper: (joints,).
        """
        q, share, missing = start, 1.0, (reference - start) / velocity
        distance = float(missing.dot(missing)) ** 0.5
        for _ in range(MOST_SLIDES):
            self._error(q)
            step = self._tangent(q, missing, velocity, lower, upper)
            if float(step.dot(step)) ** 0.5 <= SLID * distance:
                break
            step *= velocity
            # Up to the first limit in the way: there the joint is held from then on.
            ahead = np.where(step > 0.0, upper - q, q - lower)
            over = float((np.abs(step) / np.maximum(ahead, AT_LIMIT)).max())
            step /= max(1.0, over, float(np.abs(step).max()) / LONGEST_STEP)
            while share > LEAST_SHARE:
                trial = np.minimum(np.maximum(q + share * step, lower), upper)
                error, trial = self(trial, lower, upper, **STEADY_SLIDE)
                missing_there = (reference - trial) / velocity
                distance_there = float(missing_there.dot(missing_there)) ** 0.5
                if error < SOLVED and distance_there < distance:
                    break
                share /= 3.0
            else:
                break
            q, missing, distance, share = trial, missing_there, distance_there, min(1.0, 2.0 * share)
        return q

    def _tangent(
        self, q: FloatArray, missing: FloatArray, velocity: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> FloatArray:
        """Return what of `missing` (joints,) leaves the tool still, both in time at the velocities."""
        J, held = self._jacobian() * velocity, np.zeros(len(q), dtype=bool)
        while True:
            J, way = np.where(held, 0.0, J), np.where(held, 0.0, missing)
            normal = J.dot(J.T)
            normal.flat[:: len(J) + 1] += LEAST_DAMPING * (1.0 + normal.diagonal().max())
            step: FloatArray = way - J.T.dot(LDLT(normal).solve(J.dot(way)).reshape(-1))
            pressing = ((q <= lower + AT_LIMIT) & (step < 0.0)) | ((q >= upper - AT_LIMIT) & (step > 0.0))
            if not pressing.any():
                return step
            held |= pressing

    def _error(self, q: FloatArray) -> FloatArray:
        """Return the error (3,) or (6,), linear over angular, in the tool's axes; the data have the Jacobians."""
        pin.computeJointJacobians(self._model, self._data, q)
        missing = pin.updateFramePlacement(self._model, self._data, self._frame).actInv(self._target)
        error = np.empty(self._rows)
        error[:3] = missing.translation
        if self._rows == 6:
            error[3:] = rotation_vector(missing.rotation)
        return error

    def _jacobian(self) -> FloatArray:
        """Return the Jacobian (3 or 6, joints) where `_error` was last asked."""
        J: FloatArray = pin.getFrameJacobian(self._model, self._data, self._frame, pin.ReferenceFrame.LOCAL)
        return J.reshape(6, -1)[: self._rows]  # of a robot with one joint Pinocchio gives a vector


@dataclass(frozen=True, eq=False)
class Target:
    """The positions and rotations to which many descents are to bring the tip, or a point of it.

    Attributes:
        positions: (N, 3), m.
        rotations: (N, 3, 3) of the tip; None: positions alone count.
        point: (3,) of the tip frame, m, that is to be there.
    """

    positions: FloatArray
    rotations: FloatArray | None
    point: FloatArray

    def repeated(self, times: int) -> Target:
        """Every target so many times in a row."""
        rotations = None if self.rotations is None else np.repeat(self.rotations, times, axis=0)
        return Target(np.repeat(self.positions, times, axis=0), rotations, self.point)

    def missing(self, screws: Screws, q: FloatArray, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return the errors (M, 3 or 6) of configurations (M, joints) from the targets `rows`, and the Jacobians."""
        positions, rotations, J = screws.reach(q, self.point)
        error = self.positions[rows] - positions
        if self.rotations is None:
            return error, J[:, :3]
        return np.hstack([error, rotation_vectors(self.rotations[rows] @ rotations.transpose(0, 2, 1))]), J


def descend_many(
    screws: Screws, target: Target, starts: FloatArray, lower: FloatArray, upper: FloatArray, patience: int, most: int
) -> tuple[FloatArray, FloatArray]:
    """Descend like `Descent` from many starts at once, in array operations: errors (N,) and positions (N, joints).

    Args:
        screws: The arm.
        target: One for every start.
        starts: (N, joints).
        lower: (joints,), of the box.
        upper: (joints,).
        patience: After so many slow steps in a row a start is given up.
        most: Most steps.
    """
    errors, ends = np.empty(len(starts)), starts.copy()
    rows, q = np.arange(len(starts)), starts
    damping, slow = np.full(len(starts), DAMPING), np.zeros(len(starts), dtype=int)
    error, J = target.missing(screws, q, rows)
    squared = (error**2).sum(axis=1)
    errors[:] = squared
    for _ in range(most):
        going = (squared >= CONVERGED**2) & (slow < patience) & (damping <= MOST_DAMPING)
        if not going.all():
            rows, q, error, J, squared, damping, slow = (
                values[going] for values in (rows, q, error, J, squared, damping, slow)
            )
        if len(rows) == 0:
            break
        gradient = (error[:, None] @ J)[:, 0]
        pressing = ((q <= lower) & (gradient < 0.0)) | ((q >= upper) & (gradient > 0.0))
        free, gradient = np.where(pressing[:, None], 0.0, J), np.where(pressing, 0.0, gradient)
        normal = free.transpose(0, 2, 1) @ free
        diagonal = np.einsum("nii->ni", normal)
        diagonal += (damping * np.minimum(squared, 1.0) + LEAST_DAMPING * (1.0 + diagonal.max(axis=1)))[:, None]
        step = np.linalg.solve(normal, gradient[..., None])[..., 0]
        step *= np.minimum(1.0, LONGEST_STEP / np.maximum(np.linalg.norm(step, axis=1), LONGEST_STEP))[:, None]
        candidate = np.minimum(np.maximum(q + step, lower), upper)
        error_there, J_there = target.missing(screws, candidate, rows)
        squared_there = (error_there**2).sum(axis=1)
        slow = np.where(squared_there > SLOW * squared, slow + 1, 0)
        better = squared_there < squared
        damping = np.where(better, np.maximum(damping / 4.0, DAMPING), damping * 16.0)
        q, squared = np.where(better[:, None], candidate, q), np.where(better, squared_there, squared)
        error = np.where(better[:, None], error_there, error)
        J = np.where(better[:, None, None], J_there, J)
        errors[rows], ends[rows] = squared, q
    return np.sqrt(errors), ends
