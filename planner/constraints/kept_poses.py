"""Constraints on the pose of the tool along motions of a robot: bounds at all times, and projections."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.constraints.pose_constraints import PoseConstraint
from planner.kinematics.forward import tool_poses
from planner.kinematics.screws import screws_of
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.extrema import UnitPolynomials, derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial

GAUGE_ERROR = 1e-12
"""The amount by which the bound on a gauge may exceed a sample, without unit or m."""

SHARE_OF_ROOM = 0.001
"""The share of a sample's distance from the limit by which the bound may exceed the sample."""

PARTS = 4
"""Number of intervals into which an interval is cut whose bound is too wide."""

MOST_INTERVALS = 100_000
"""The largest number of intervals of a motion: they take 50 ms."""

LONGEST_KEPT_STEP = 0.3
"""The longest motion between two projections, rad or m: over it, the angle of an axis leaves a chord by 1 degree."""

STEP_BEND = 4.0
"""The square of a motion relative to the room of a constraint over its lever: the chord leaves half the room."""

PROJECTION_STEPS = 12
"""The largest number of steps of a projection."""

LARGEST_PROJECTION_STEP = 0.5
"""The largest step of a projection, rad or m."""

PROJECTION_DAMPING = 1e-6
"""The damping of a projection, relative to the largest square of a slope, without unit."""


class BoundedValue(NamedTuple):
    """The largest value of a constraint along a motion.

    Attributes:
        bound: No value exceeds it at any time, rad or m.
        reached: The value at `time`, rad or m.
        time: The time of the largest sample, s.
    """

    bound: float
    reached: float
    time: float


class KeptPoses(NamedTuple):
    """Constraints on the tool of a robot.

    Attributes:
        robot: The robot with its tool.
        keep: The constraints.
    """

    robot: Robot
    keep: tuple[PoseConstraint, ...]

    @property
    def longest_step(self) -> float:
        """The longest straight motion between two projections, rad or m, for the narrowest constraint."""
        farthest = np.maximum(np.abs(self.robot.limit("lower")), np.abs(self.robot.limit("upper")))
        lever = float(screws_of(self.robot).levers(-farthest, farthest).max())
        steps = (np.sqrt(STEP_BEND * own.room / (1.0 if own.is_angle else lever)) for own in self.keep)
        return float(min(LONGEST_KEPT_STEP, *steps))

    def hold_along(self, motion: PiecewisePolynomial) -> bool:
        """Tell whether a motion provably keeps all constraints at all times."""
        along = _Along(self.robot, motion)
        return all(along.bound(own, closely=False).bound <= own.value(own.largest_gauge) for own in self.keep)

    def largest_values(self, motion: PiecewisePolynomial) -> list[BoundedValue]:
        """Bound the value of each constraint along a motion at all times, closely near its limit."""
        along = _Along(self.robot, motion)
        return [along.bound(own, closely=True) for own in self.keep]

    def is_within_limits(self, position: FloatArray) -> bool:
        """Tell whether a joint position (joints,) keeps the position limits."""
        return bool(((self.robot.limit("lower") <= position) & (position <= self.robot.limit("upper"))).all())

    def values_at(self, position: FloatArray) -> list[float]:
        """Compute the value of each constraint, rad or m, at a joint position (joints,)."""
        poses = tool_poses(self.robot, position[None])
        return [own.value(float(own.gauges(*poses)[0])) for own in self.keep]

    def broken_at(self, position: FloatArray) -> tuple[PoseConstraint, float] | None:
        """Return the constraint that a joint position (joints,) breaks most, with its value; None: it keeps all."""
        values = zip(self.keep, self.values_at(position), strict=True)
        worst = max(values, key=lambda own: own[0].ratio(own[1]))
        return worst if worst[0].ratio(worst[1]) > 1.0 else None

    def projected(self, position: FloatArray) -> FloatArray | None:
        """Move a joint position (joints,) by least steps until it keeps all constraints; None: it does not arrive.

        Position limits do not count. A joint position that keeps the constraints stays as it is.
        """
        tool = self.robot.tool_in_tip
        for _ in range(PROJECTION_STEPS):
            reached, tips, jacobians = screws_of(self.robot).reach(position[None], tool.translation)
            turned = tips @ tool.rotation
            slopes, excesses = [], []
            for own in self.keep:
                gauge = float(own.gauges(reached, turned)[0])
                if gauge > own.largest_gauge:
                    slopes.append(own.slope(reached[0], turned[0]) @ jacobians[0])
                    excesses.append(own.value(gauge) - own.target)
            if not slopes:
                return position
            rows = np.array(slopes)
            squares = rows @ rows.T
            scale = float(squares.diagonal().max())
            if scale == 0.0:
                return None
            damped = squares + PROJECTION_DAMPING * scale * np.eye(len(rows))
            step = -rows.T @ np.linalg.solve(damped, np.array(excesses))
            position = position + step / max(1.0, float(np.sqrt(step @ step)) / LARGEST_PROJECTION_STEP)
        return None


class _Along:
    """The tool along a motion, with bounds on its second derivative by the unit time of each piece.

    A revolute joint turns the tool about its axis. So the second derivative of a unit vector of the tool is at most
    (sum of |q'|)^2 + sum of |q''|. The same bounds half of the second derivative of a trace: a product of two cross
    products has a nuclear norm of at most 2. The second derivative of the tool's position is at most the sum of
    l_j |q'_i q'_j| + l_j |q''_j|. There j is the later joint of the two, and l_j its lever. A joint that slides has a
    lever of 1, and turns no later joint.
    """

    def __init__(self, robot: Robot, motion: PiecewisePolynomial) -> None:
        self._robot, self._motion = robot, motion
        self._derivatives: UnitPolynomials = derivatives_on_unit_time(motion, 3)
        magnitudes = np.abs(self._derivatives.bernstein).max(axis=-1)
        by_unit = magnitudes[1:] * motion.lengths[:, None] ** np.array([1, 2])[:, None, None]
        first, second = by_unit
        turning = np.where(robot.is_angle, first, 0.0)
        self._of_angles = turning.sum(axis=1) ** 2 + np.where(robot.is_angle, second, 0.0).sum(axis=1)
        farthest = magnitudes[0].max(axis=0)
        levers = screws_of(robot).levers(-farthest, farthest) + float(np.linalg.norm(robot.tool_in_tip.translation))
        levers = np.where(robot.is_angle, levers, 1.0)
        before = np.cumsum(turning, axis=1) - turning
        self._of_distances = (levers * (first * 2.0 * before + turning**2 + second)).sum(axis=1)

    def bound(self, own: PoseConstraint, *, closely: bool) -> BoundedValue:
        """Bound the value of a constraint by halving intervals whose bound is too wide.

        A gauge is convex, and the tool is at most h^2 / 8 of its second derivative from the chord of an interval h. So
        the gauge exceeds that at the ends by no more.

        Args:
            own: The constraint.
            closely: Whether the bound is close to a sample, relative to the distance from the limit. Otherwise it only
                tells whether the limit is kept.
        """
        bends = (self._of_angles if own.is_angle else self._of_distances) / 8.0
        pieces = np.arange(len(bends))
        starts, widths = np.zeros(len(bends)), np.ones(len(bends))
        ends = self._gauges(own, np.tile(pieces, 2), np.concatenate([starts, starts + widths]))
        left, right = np.split(ends, 2)
        largest, bound, made = -np.inf, -np.inf, 0
        at = (0, 0.0)
        while True:
            for values, units in ((left, starts), (right, starts + widths)):
                k = int(values.argmax())
                if values[k] > largest:
                    largest, at = float(values[k]), (int(pieces[k]), float(units[k]))
            upper = np.maximum(left, right) + bends[pieces] * widths**2
            room = own.largest_gauge - largest
            done = largest + max(GAUGE_ERROR, SHARE_OF_ROOM * abs(room) if closely else room)
            is_open = upper > done
            made += len(pieces)
            if (room < 0.0 and not closely) or made > MOST_INTERVALS:
                is_open[:] = False
            bound = max(bound, float(upper[~is_open].max(initial=-np.inf)))
            if not is_open.any():
                break
            pieces, starts, widths, left, right = self._cut(own, pieces, starts, widths, left, right, is_open)
        piece, unit = at
        time = float(self._motion.breakpoints[piece] + unit * self._motion.lengths[piece])
        return BoundedValue(own.value(bound), own.value(largest), time)

    def _cut(
        self,
        own: PoseConstraint,
        pieces: np.ndarray,
        starts: FloatArray,
        widths: FloatArray,
        left: FloatArray,
        right: FloatArray,
        is_open: np.ndarray,
    ) -> tuple[np.ndarray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Cut the open intervals into equal parts, with the gauges at their ends."""
        pieces, starts, widths = pieces[is_open], starts[is_open], widths[is_open] / PARTS
        inner = starts[:, None] + widths[:, None] * np.arange(1, PARTS)
        values = self._gauges(own, np.repeat(pieces, PARTS - 1), inner.ravel()).reshape(inner.shape)
        lefts = np.column_stack([left[is_open], values])
        rights = np.column_stack([values, right[is_open]])
        begins = np.column_stack([starts, inner])
        return np.repeat(pieces, PARTS), begins.ravel(), np.repeat(widths, PARTS), lefts.ravel(), rights.ravel()

    def _gauges(self, own: PoseConstraint, pieces: np.ndarray, units: FloatArray) -> FloatArray:
        """Compute the gauges (N,) at unit times (N,) of pieces (N,)."""
        return own.gauges(*tool_poses(self._robot, self._derivatives.evaluate(pieces, units)[0]))
