"""The fifth-order polynomial, rest to rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

from planner.backends.base import enforced
from planner.backends.shared.assembly import assemble
from planner.backends.shared.rest_to_rest import PolynomialScaling
from planner.backends.splines.group_timing import time_group
from planner.guarantees import ALL_HARD, Capabilities, Guarantee
from planner.paths import JointPath
from planner.trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class Quintic:
    """The fifth-order polynomial of each segment, from rest to rest; through waypoints the C4 spline.

    theta(t) = theta_i + dtheta (10 (t/T)^3 - 15 (t/T)^4 + 6 (t/T)^5), the minimum-jerk time scaling (Flash and Hogan
    1985). Velocity and acceleration are zero at both ends, where its jerk is largest, 60 dtheta / T^3. At waypoints
    with requested velocities the acceleration is zero, and the spline C2, so a requested velocity may be the limit.
    """

    kind: ClassVar[str] = "quintic"
    summary: ClassVar[str] = "Fifth-order polynomial, rest to rest: smooth acceleration, limited jerk, C2."
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_HARD
    capabilities: ClassVar[Capabilities] = Capabilities(passes_with_velocities=True)
    scaling: ClassVar[PolynomialScaling] = PolynomialScaling(
        (0.0, 0.0, 0.0, 10.0, -15.0, 6.0), velocity=15.0 / 8.0, acceleration=10.0 / sqrt(3.0), jerk=60.0
    )

    def parametrize(self, path: JointPath) -> Trajectory:
        """Put the quintic on each segment, at the requested durations or the shortest."""
        groups = [time_group(path, group, 5, enforced(self)) for group in path.groups]
        return assemble(path, [*self.scaling.time(path.straight), *groups])
