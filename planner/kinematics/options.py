"""The options of the inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Preference = Literal["continuous", "near_reference", "manipulability", "far_from_limits", "arm", "weld_flat"]
"""Which of several solutions of a pose is taken."""


@dataclass(frozen=True)
class InverseKinematicsOptions:
    """Options of the inverse kinematics.

    Attributes:
        tolerance_position: Largest distance of the tool from its pose, m.
        tolerance_orientation: Largest angle of the tool from its orientation, rad.
        reference: Joint position that the way through the solutions starts from; None: it may start anywhere.
        seed: Seed of the random starts; the same seed gives the same answer.
        prefer: The preference among several solutions, also of a redundant arm or a tolerance region. `continuous`: the
            solution on the shortest path through the whole list. `near_reference`: the solution nearest to the
            reference, in time at full speed. `manipulability`: the solution furthest from a singularity.
            `far_from_limits`: the one whose worst joint is nearest to the middle of its limits. `arm`: the one for
            which external axes move least from the waypoint before: the arm reaches alone, and follows motions alone,
            wherever it can. `weld_flat`: the one for which a positioner holds the workpiece flat: its surface under the
            tool faces up. So it does along motions of the tool to poses without `external` positions. Motions of the
            tool go on from where they start in any case; only where they cannot, another start is taken.
    """

    tolerance_position: float = 1e-6
    tolerance_orientation: float = 1e-6
    reference: tuple[float, ...] | None = None
    seed: int = 0
    prefer: Preference = "continuous"
