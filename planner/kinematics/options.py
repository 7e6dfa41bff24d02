"""The options of the inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InverseKinematicsOptions:
    """The options by which poses are solved.

    Attributes:
        tolerance_position: Largest distance of the tool from its pose, m.
        tolerance_orientation: Largest angle of the tool from its orientation, rad.
        reference: Joint position that the way through the solutions starts from; None: it may start anywhere.
        seed: Seed of the random starts; the same seed gives the same answer.
    """

    tolerance_position: float = 1e-6
    tolerance_orientation: float = 1e-6
    reference: tuple[float, ...] | None = None
    seed: int = 0
