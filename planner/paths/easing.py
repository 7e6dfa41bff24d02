"""Two motions of the tool that meet with a sudden bend: their curves are eased into each other."""

from __future__ import annotations

import numpy as np

from planner.kinematics.forward import tool_poses
from planner.robots import Robot
from planner.spatial import FloatArray, rotation_vectors
from planner.trajectories.polynomials import PiecewisePolynomial, quintic_hermite

MOST_EASED_SHARE = 0.4
"""Share of either curve that is eased at most: as much is for its other end, and some stays."""

EASING_TOLERANCE_SHARE = 0.5
"""Share of the tolerances that easing may use up, besides the quarter that following the path does."""

EASING_DECREASE = 0.7
"""Factor by which the eased parts are made shorter until they keep to the tolerance."""

MOST_SHRINKS = 60
"""The most times that they are: to a billionth, where a curve deviates by less than rounding."""

EASING_POINTS = 9
"""Number of points on either part at which the tool is compared with where it was; a quintic's error has one peak."""


def eased(
    robot: Robot, before: PiecewisePolynomial, after: PiecewisePolynomial, tolerances: FloatArray
) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
    """Join two curves so that they are C2 where they meet.

    At that point both get the mean of their first and of their second derivatives. The last piece of the first curve
    and the first piece of the second become quintics, within the tool's tolerances.

    Args:
        robot: The robot, with its tool.
        before: Joint positions, in quintics.
        after: The same, from where that one ends.
        tolerances: (2,), m and rad.
    """
    ends, starts = before.evaluate(before.breakpoints[-1:]), after.evaluate(np.zeros(1))
    middle = (starts[0], *((end + start) / 2.0 for end, start in zip(ends[1:], starts[1:], strict=True)))
    lengths = before.breakpoints[-1], after.breakpoints[-1]
    reach = MOST_EASED_SHARE * float(min(lengths))
    for _ in range(MOST_SHRINKS):
        away = [lengths[0] - reach, reach]
        first, last = before.evaluate(np.array(away[:1])), after.evaluate(np.array(away[1:]))
        into, out = (
            quintic_hermite(np.array([reach]), tuple(start), tuple(end))
            for start, end in ((first, middle), (middle, last))
        )
        pieces = [PiecewisePolynomial(np.array([reach]), part) for part in (into, out)]
        at = np.linspace(0.0, reach, EASING_POINTS)
        kept = [before.evaluate(away[0] + at, [0])[0], after.evaluate(at, [0])[0]]
        if all(
            _is_close(robot, piece.evaluate(at, [0])[0], own, tolerances)
            for piece, own in zip(pieces, kept, strict=True)
        ):
            break
        reach *= EASING_DECREASE
    return (
        before.between(0.0, away[0]).followed_by(pieces[0]),
        pieces[1].followed_by(after.between(away[1], float(lengths[1]))),
    )


def _is_close(robot: Robot, positions: FloatArray, requested: FloatArray, tolerances: FloatArray) -> bool:
    """Tell whether the tool stays within the tolerances (2,) between two lists of joint positions (N, joints)."""
    (points, turned), (wanted, axes) = tool_poses(robot, positions), tool_poses(robot, requested)
    distances = np.linalg.norm(points - wanted, axis=1)
    angles = np.linalg.norm(rotation_vectors(axes.transpose(0, 2, 1) @ turned), axis=1)
    return bool((np.array([distances.max(), angles.max()]) <= EASING_TOLERANCE_SHARE * tolerances).all())
