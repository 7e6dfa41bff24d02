"""The third-order polynomial of the seed documents, rest to rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from planner.backends.base import enforced
from planner.backends.shared.assembly import assemble
from planner.backends.shared.rest_to_rest import PolynomialScaling
from planner.backends.splines.group_timing import time_group
from planner.guarantees import ALL_BUT_JERK, Capabilities, Guarantee
from planner.paths import JointPath
from planner.trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class Cubic:
    """The third-order polynomial of each segment, from rest to rest; through waypoints the C2 spline.

    theta(t) = theta_i + dtheta (3 (t/T)^2 - 2 (t/T)^3): document 000, Eq. 3.11 and 3.12; 002, Eq. 3.1. The acceleration
    jumps at both ends, so that the jerk is reported, not limited. At waypoints with requested velocities the
    acceleration may jump: the spline has the least mean-square acceleration.
    """

    kind: ClassVar[str] = "cubic"
    summary: ClassVar[str] = "Third-order polynomial, rest to rest: the polynomial of the seed documents, C1."
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_BUT_JERK
    capabilities: ClassVar[Capabilities] = Capabilities(passes_with_velocities=True)
    scaling: ClassVar[PolynomialScaling] = PolynomialScaling((0.0, 0.0, 3.0, -2.0), velocity=1.5, acceleration=6.0)

    def parametrize(self, path: JointPath) -> Trajectory:
        """Put the cubic on each segment, at the requested durations or the shortest."""
        kept = enforced(self)
        path = path.keeping(kept)
        groups = [time_group(path, group, 3, kept) for group in path.groups]
        return assemble(path, [*self.scaling.time(path.straight), *groups])
