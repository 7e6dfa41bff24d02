"""Paths of the tool that leave the orientation of another one, so that the arm goes right through a singular wrist."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.kinematics.configurations import WRIST, straight_wrist
from planner.kinematics.forward import jacobian, tool_pose
from planner.spatial import Pose, rotation_vector

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.tool_motions.follow import Lost
    from planner.tool_motions.pose_paths import PosePath

POSITION_WEIGHT = 1e4
"""Weight of a position, m, beside an orientation, rad, where the two cannot both be kept: the position is."""

MOST_ITERATIONS = 50
"""The most Gauss-Newton steps to the point where the wrist is nearest to singular."""

FOUND = 1e-12
"""The step, rad or m and share of the path, at which that point is found."""

SMALLEST_SHARE = 1e-3
"""Smallest part of the path, on either side of the singularity, over which the tool leaves the orientation and returns.
"""


@dataclass(frozen=True, eq=False)
class Deviated:
    """A path whose orientation leaves another path's orientation and returns to it.

    It is exp(w(u) t) R(u), w from 0 at the ends to 1 at one point, where its first two derivatives vanish.

    Attributes:
        path: The other path, with a rotation.
        most: The parameter u where it turns off most.
        turn: (3,), rad, the rotation, in the base's axes.
    """

    path: PosePath
    most: float
    turn: FloatArray

    @property
    def breakpoints(self) -> FloatArray:
        """The breakpoints of the other path."""
        return self.path.breakpoints

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        pose = self.path.pose(u)
        assert pose.rotation is not None  # noqa: S101 - none turns off from a path without rotations
        return Pose(pose.position, pin.exp3(self._share(u)[0] * self.turn) @ pose.rotation)

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u, in the base's axes."""
        share, rate = self._share(u)
        twist = self.path.twist(u).copy()
        twist[3:] = rate * self.turn + pin.exp3(share * self.turn) @ twist[3:]
        return twist

    @property
    def angle(self) -> float:
        """The angle of the rotation, rad."""
        return float(np.linalg.norm(self.turn))

    def _share(self, u: float) -> tuple[float, float]:
        """Return the fraction w of the rotation at u and its derivative; w is a quintic from either end."""
        length = self.most if u < self.most else self.most - 1.0
        x = min(max((u if u < self.most else u - 1.0) / length, 0.0), 1.0)
        return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) ** 2 / length


def through_singular_wrist(robot: Robot, path: PosePath, lost: Lost) -> Deviated | None:
    """Return the path through the wrist singularity near the point where another path got lost.

    At the singularity, axes 4 and 6 are parallel and the tool is on the path, turned by the least angle. Gauss-Newton
    finds it in the other joints and u, with the orientation in the sense of least squares.

    Returns:
        None: the arm has no such wrist, the path no orientation, or it is not singular within the path.
    """
    straight = straight_wrist(robot)
    if straight is None or path.pose(lost.u).rotation is None:
        return None
    q, u = lost.position.copy(), lost.u
    q[WRIST] = straight + np.pi * np.round((q[WRIST] - straight) / np.pi)
    moving = np.arange(WRIST)  # beside the last joint, which turns about the same axis as the fourth
    weights = np.repeat([POSITION_WEIGHT, 1.0], 3)
    for _ in range(MOST_ITERATIONS):
        pose, here = path.pose(u), tool_pose(robot, q)
        turn = rotation_vector(pose.rotation @ np.asarray(here.rotation).T)
        missing = np.concatenate([pose.position - here.position, turn])
        columns = np.column_stack([jacobian(robot, q)[:, moving], -path.twist(u)])
        step = np.linalg.lstsq(columns * weights[:, None], missing * weights, rcond=None)[0]
        q[moving] += step[:-1]
        u += float(step[-1])
        if not SMALLEST_SHARE < u < 1.0 - SMALLEST_SHARE:
            return None
        if np.abs(step).max() < FOUND:
            return Deviated(path, u, -turn)
    return None
