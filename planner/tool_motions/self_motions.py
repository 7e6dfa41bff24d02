"""A path of the tool followed by an arm with joints to spare: by the smallest steps, and away from its limits."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray
from planner.tool_motions.follow import MOST_CORRECTION, Follower, Lost, Track
from planner.tool_motions.inverse_jacobian import null_space
from planner.tool_motions.position_limits import shares_of_range
from planner.trajectories.polynomials import PiecewisePolynomial

NEAR_LIMIT = 0.8
"""The share of half its range from where on a joint is moved away from its position limit."""

REPULSION = 20.0
"""Speed at which a joint moves away from its limit, as a multiple of the joints' speed.

A self-motion contains the square of the joint's component in it, a seventh on average.
"""

SURELY_OUTSIDE = 1.01
"""The share of half its range at which a joint has left its limits for good, and the path is given up as lost."""

LAST_PART = 0.1
"""The last part of the way, in u, on which the null space's component nears a given end more and more slowly."""


def follow_by_self_motions(track: Track) -> PiecewisePolynomial | Lost:
    """Follow the path as `follow` does, but without keeping the component of the start in the null space.

    That component may lead out of the position limits, or to where it and the tool together leave no way on. The joint
    path is not a function of u alone: it depends on where it comes from.

    Args:
        track: The path, for a robot that has more joints than the tool has directions.

    Returns:
        The joint path over u from 0 to 1, or where it got lost: that may be just outside of the position limits.
    """
    return _BySmallestSteps(track, np.empty((0, track.robot.dof))).run()


class _BySmallestSteps(Follower):
    """Follows a path by the smallest joint steps, and away from the position limits where the tool leaves that open.

    q' = J^+ X' + N^T N (g + (end - q) / (1 - u)), N the null space of J, and g against the joints that are near their
    limits: the gradient projection of Liégeois (1977), "Automatic supervisory control of the configuration and behavior
    of multibody mechanisms". It is as strong as the joints are fast, so that the curve does not depend on how u runs.
    """

    near_end = MOST_CORRECTION

    def _is_outside(self, q: FloatArray) -> bool:
        return bool(np.abs(shares_of_range(self.robot, q)).max() > SURELY_OUTSIDE)

    def _rate(self, u: float, q: FloatArray, J: FloatArray | None = None) -> FloatArray | None:
        J = self._augmented(q) if J is None else J
        rate = super()._rate(u, q, J)
        if rate is None:
            return None
        shares = shares_of_range(self.robot, q)
        too_far = np.maximum(np.abs(shares) - NEAR_LIMIT, 0.0) / (1.0 - NEAR_LIMIT)
        wanted = -REPULSION * float(np.linalg.norm(rate)) * np.sign(shares) * too_far**2
        if self.end is not None:
            wanted += (self.end - q) / max(1.0 - u, LAST_PART)
        idle = null_space(J)
        return np.asarray(rate + idle.T @ (idle @ wanted))
