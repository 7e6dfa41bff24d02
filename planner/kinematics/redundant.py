"""Solutions of redundant arms: one end joint is fixed at many positions, a closed form finds the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.closed_form import closed_form

if TYPE_CHECKING:
    from planner.kinematics.closed_form import ClosedForm
    from planner.kinematics.screws import Screws
    from planner.spatial import FloatArray


class EndJointHeld:
    """Seven joints, of which six have a closed form when the first or the last joint is held.

    Attributes:
        screws: The arm, or the arm seen from its tip where it is the last joint that is held.
        form: The closed form of the arm without the joint that is held.
        whole: The arm from its base, where `screws` is the arm seen from its tip; else None.
    """

    def __init__(self, screws: Screws, form: ClosedForm, whole: Screws | None) -> None:
        self.screws, self.form, self.whole = screws, form, whole

    @property
    def held(self) -> int:
        """Index of the joint that is held."""
        return 0 if self.whole is None else -1

    def __call__(self, position: FloatArray, rotation: FloatArray, held: FloatArray) -> FloatArray:
        """Return candidates (N, joints) for one pose of the tip, all of them finite.

        Args:
            position: (3,), m.
            rotation: (3, 3).
            held: (values,), rad or m: where the joint is held.
        """
        if self.whole is None:
            return self._solve(position, rotation, held)
        # T(0) T^-1 is the pose of the arm seen from its tip.
        seen = self.whole.rotation @ rotation.T
        return -self._solve(self.whole.position - seen @ position, seen, -held)[:, ::-1]

    def _solve(self, position: FloatArray, rotation: FloatArray, held: FloatArray) -> FloatArray:
        axis, point, cross = self.screws.axes[0], self.screws.points[0], self.screws.cross[0]
        if self.screws.is_angle[0]:
            sine, cosine = np.sin(held)[:, None, None], np.cos(held)[:, None, None]
            back = np.eye(3) - sine * cross + (1.0 - cosine) * (cross @ cross)
            positions, rotations = point + back @ (position - point), back @ rotation
        else:
            positions = position - held[:, None] * axis
            rotations = np.broadcast_to(rotation, (len(held), 3, 3))
        others = self.form(positions, rotations)
        first = np.broadcast_to(held[:, None, None], (*others.shape[:2], 1))
        candidates = np.concatenate([first, others], axis=2).reshape(-1, others.shape[2] + 1)
        finite: FloatArray = candidates[np.isfinite(candidates).all(axis=1)]
        return finite


def redundant_form(screws: Screws) -> EndJointHeld | None:
    """Return the form of an arm with seven joints, if it has one with an end joint held."""
    if len(screws.axes) != 7:
        return None
    backwards = screws.backwards()
    for seen, whole in ((backwards, screws), (screws, None)):
        if (form := closed_form(seen.without_first(), None)) is not None:
            return EndJointHeld(seen, form, whole)
    return None
