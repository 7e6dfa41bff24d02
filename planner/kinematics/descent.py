"""Levenberg-Marquardt from one start, within a box: the work horse of the inverse kinematics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from eigenpy import LDLT

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray, Pose
    from planner.robots import Robot

CONVERGED = 1e-10
"""A descent ends when the error (m, rad) is as small as this; its last step leaves far less."""

DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-13, 1e12
"""Share of the squared error that damps a step at first; what is added to it; and the share at which steps vanish."""

LONGEST_STEP = 1.5
"""rad or m, the norm of a step: the Jacobian says nothing of what lies further away."""

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
        self, start: FloatArray, lower: FloatArray, upper: FloatArray, patience: int, iterations: int
    ) -> tuple[float, FloatArray]:
        """The error and the joint position where the descent from `start` ends.

        Args:
            start: (joints,).
            lower: (joints,), of the box.
            upper: (joints,).
            patience: After so many slow steps in a row the start is given up.
            iterations: Most steps.
        """
        q, error = start, self._error(start)
        J = self._jacobian()
        squared = float(error.dot(error))
        damping, slow = DAMPING, 0
        for _ in range(iterations):
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

    def _error(self, q: FloatArray) -> FloatArray:
        """(3,) or (6,), linear over angular, in the tool's axes; leaves the Jacobians at `q` in Pinocchio's data."""
        pin.computeJointJacobians(self._model, self._data, q)
        missing = pin.updateFramePlacement(self._model, self._data, self._frame).actInv(self._target)
        error = np.empty(self._rows)
        error[:3] = missing.translation
        if self._rows == 6:
            error[3:] = pin.log3(missing.rotation)
        return error

    def _jacobian(self) -> FloatArray:
        """(3 or 6, joints) where `_error` was last asked."""
        J: FloatArray = pin.getFrameJacobian(self._model, self._data, self._frame, pin.ReferenceFrame.LOCAL)
        return J.reshape(6, -1)[: self._rows]  # of a robot with one joint Pinocchio gives a vector
