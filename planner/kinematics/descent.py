"""Descents to poses, and along continua of solutions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.kernels.descent import Box, descend
from planner.kernels.kinematics import Arm
from planner.kinematics.screws import Screws
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
