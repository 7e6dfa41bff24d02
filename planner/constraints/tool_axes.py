"""Constraints on an axis of the tool: its angle to a direction, bounded along motions, and projections to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kinematics.forward import tool_poses
from planner.kinematics.screws import screws_of
from planner.trajectories.extrema import derivatives_on_unit_time

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fields import FieldPath
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial

COSINE_ERROR = 1e-6
"""The amount by which the bound on a cosine between two samples may exceed the samples."""

LEAST_ANGLE = 0.02
"""The least angle of a constraint, rad: straight joint motions hardly keep a smaller one."""

PROJECTION_STEPS = 10
"""The largest number of steps of a projection."""

PROJECTED_SHARE = 0.98
"""The share of the allowed angle to which a projection leads: straight motions between such positions have room."""

LARGEST_PROJECTION_STEP = 0.5
"""The largest step of a projection, rad or m."""


class BoundedAngle(NamedTuple):
    """The largest angle along a motion.

    Attributes:
        bound: No angle exceeds it at any time, rad.
        reached: The angle at `time`, rad.
        time: The time of the largest sample, s.
    """

    bound: float
    reached: float
    time: float


@dataclass(frozen=True)
class ToolAxis:
    """The constraint that an axis of the tool stays within an angle of a direction, such as an upright cup.

    Attributes:
        direction: The direction in the base frame; its length does not count.
        angle: The largest angle between the axis and the direction, rad.
        axis: The axis in the tool frame; its length does not count.

    Examples:
        >>> import planner
        >>> upright = planner.ToolAxis((0.0, 0.0, 1.0), 0.2)
        >>> planner.FreeMotion(keep=(upright,)).keep[0].angle
        0.2
    """

    direction: tuple[float, float, float]
    angle: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def faults(self, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
        """Find invalid values, with their fields."""
        for name in ("direction", "axis"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != (3,) or not np.isfinite(values).all() or not values.any():
                yield (*field, name), f"must be three finite numbers, not all 0; got {getattr(self, name)}"
        if not LEAST_ANGLE <= self.angle < np.pi:
            yield (*field, "angle"), f"must be at least {LEAST_ANGLE:g} and less than pi rad; got {self.angle:g}"

    def cosines(self, robot: Robot, positions: FloatArray) -> FloatArray:
        """Compute the cosines (N,) of the angle at joint positions (N, joints)."""
        axes = tool_poses(robot, positions)[1] @ _unit(self.axis)
        return np.asarray(axes @ _unit(self.direction), dtype=np.float64)

    def angles(self, robot: Robot, positions: FloatArray) -> FloatArray:
        """Compute the angles (N,), rad, at joint positions (N, joints)."""
        return np.arccos(np.clip(self.cosines(robot, positions), -1.0, 1.0))

    def largest_angle(self, robot: Robot, motion: PiecewisePolynomial) -> BoundedAngle:
        """Bound the angle along a motion at all times.

        The second derivative of the axis by time is at most (sum of |q'|)^2 + sum of |q''| over the joints that turn.
        So the cosine between samples h apart is below the lower sample by at most h^2 / 8 of that.
        """
        turning = robot.is_angle
        derivatives = derivatives_on_unit_time(motion, 3)
        magnitudes = np.abs(derivatives.bernstein[1:]).max(axis=-1)
        first, second = magnitudes[..., turning].sum(axis=-1) * motion.lengths ** np.array([[1], [2]])
        steps = np.maximum(1, np.ceil(np.sqrt((first**2 + second) / (8.0 * COSINE_ERROR)))).astype(np.int64)
        pieces = np.repeat(np.arange(len(steps)), steps + 1)
        ends = np.cumsum(steps + 1)
        units = (np.arange(ends[-1]) - (ends - steps - 1)[pieces]) / steps[pieces]
        cosines = self.cosines(robot, derivatives.evaluate(pieces, units)[0])
        lowest = int(np.argmin(cosines))
        bound, reached = np.arccos(np.clip(cosines[lowest] - np.array([COSINE_ERROR, 0.0]), -1.0, 1.0)).tolist()
        piece = pieces[lowest]
        return BoundedAngle(bound, reached, float(motion.breakpoints[piece] + units[lowest] * motion.lengths[piece]))

    def projected(self, robot: Robot, position: FloatArray) -> FloatArray | None:
        """Move a joint position (joints,) by least steps until the axis is within the angle; None: it does not arrive.

        Position limits do not count. A joint position within the angle stays as it is.
        """
        axis, direction = _unit(self.axis), _unit(self.direction)
        for _ in range(PROJECTION_STEPS):
            _, rotations, jacobians = screws_of(robot).reach(position[None], robot.tool_in_tip.translation)
            turned = rotations[0] @ robot.tool_in_tip.rotation @ axis
            angle = float(np.arccos(np.clip(turned @ direction, -1.0, 1.0)))
            if angle <= self.angle:
                return position
            normal = np.cross(turned, direction)
            row = jacobians[0, 3:].T @ normal
            square = float(row @ row)
            if square == 0.0:
                return None
            step = row * (float(np.linalg.norm(normal)) * (angle - PROJECTED_SHARE * self.angle) / square)
            position = position + step * min(1.0, LARGEST_PROJECTION_STEP / float(np.linalg.norm(step)))
        return None


def _unit(vector: tuple[float, float, float]) -> FloatArray:
    """Return the unit vector (3,) of a direction."""
    values = np.array(vector, dtype=np.float64)
    return values / float(np.linalg.norm(values))
