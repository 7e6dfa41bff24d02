"""A path of the tool to a path of the joints: one curve, on one branch, within a stated tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.search import pose_errors
from planner.polynomials import PiecewisePolynomial, horner, quintic_hermite
from planner.tolerances import SAME_CONFIGURATION

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.tool_motions.pose_paths import PosePath

SHARE_OF_TOLERANCE = 0.25
"""The share of the tolerance that the joint path may use up at the probes; time needs some, too."""

PROBES = np.array([0.25, 0.5, 0.75])
"""Shares of the way between two knots at which the curve is compared with the path; its error is like u^3 (1 - u)^3."""

FIRST_STEP = 0.125
"""The first step in u from knot to knot."""

LONGEST_STEP = 0.25
"""The longest step in u from knot to knot, so that no detour is missed."""

SHORTEST_STEP = 1e-5
"""The step in u below which the path is given up as lost."""

GROWTH = 1.6
"""The factor on the step after a knot that the tolerance allowed."""

MOST_CORRECTION = 0.15
"""How far a joint may be, rad or m, from where the last knot pointed: further away may be another branch."""

SOLVED = 1e-11
"""The error, m and rad, at which a knot is solved."""

MOST_ITERATIONS = 12
"""The most Newton steps until a knot is solved."""

AHEAD = 1e-4
"""The step in u of the difference quotient for the second derivative."""

SINGULAR = 1e-4
"""The smallest singular value of the Jacobian (m and rad alike) below which a direction of the tool is lost."""


@dataclass(frozen=True, eq=False)
class Lost:
    """The point where a joint path ended before the path of the tool did.

    Attributes:
        u: The last parameter of the path that was reached.
        position: (joints,), there.
        curve: What was followed until then, perhaps no piece at all.
    """

    u: float
    position: FloatArray
    curve: PiecewisePolynomial


class _Knot(NamedTuple):
    """A parameter of the path, and the joint position there with its derivatives by u, (joints,) each."""

    u: float
    q: FloatArray
    first: FloatArray
    second: FloatArray


def follow(
    robot: Robot,
    path: PosePath,
    start: FloatArray,
    end: FloatArray | None,
    tolerance: tuple[float, float],
) -> PiecewisePolynomial | Lost:
    """Follow the path with the tool from the joint position `start`, without a jump and without a detour.

    The joint path q(u) solves forward(q) = X(u). At its knots q is solved by Newton's method, q' from J q' = X', and
    q'' by differences of q'; between them it is the quintic that has these values at both ends, so that it is C2. A
    knot is kept only if that quintic is within the tolerance of X. Position limits are not looked at.

    An arm with more joints than the tool has directions keeps the component of its joint position in the null space
    of the start (or changes it evenly to that of `end`), which makes q(u) a function of u alone.

    Args:
        robot: With its tool.
        path: Of the tool.
        start: (joints,), at the start of the path.
        end: (joints,), where the joint path should end, if that is known.
        tolerance: m and rad.

    Returns:
        The joint path over u from 0 to 1, or where it got lost.
    """
    return _Follower(robot, path, start, end, tolerance).run()


class _Follower:
    def __init__(
        self,
        robot: Robot,
        path: PosePath,
        start: FloatArray,
        end: FloatArray | None,
        tolerance: tuple[float, float],
    ) -> None:
        self.robot, self.path, self.start, self.end = robot, path, start, end
        self.rows = len(path.twist(0.0))
        self.distance, self.angle = (SHARE_OF_TOLERANCE * allowed for allowed in tolerance)
        self.free = _null_space(self._jacobian(start))
        self.drift = self.free @ (np.zeros(robot.dof) if end is None else end - start)

    def run(self) -> PiecewisePolynomial | Lost:
        """The curve, or where it ended."""
        first = self._with_derivatives(0.0, self.start)
        if first is None:
            return Lost(0.0, self.start, PiecewisePolynomial(np.empty(0), np.empty((0, self.robot.dof, 6))))
        knots, step = [first], FIRST_STEP
        handedness = self._handedness(self.start)
        while (last := knots[-1]).u < 1.0:
            ahead = 1.0 if last.u + step > 1.0 - SHORTEST_STEP else last.u + step
            knot = self._next(last, ahead)
            if knot is not None and self._handedness(knot.q) == handedness:
                knots.append(knot)
                step = min(GROWTH * (ahead - last.u), LONGEST_STEP)
                continue
            step = (ahead - last.u) / 2.0
            if step < SHORTEST_STEP:
                return Lost(last.u, last.q, _curve(knots))
        if self.end is not None and np.abs(knots[-1].q - self.end).max() < SAME_CONFIGURATION:
            knots[-1] = knots[-1]._replace(q=self.end)
        return _curve(knots)

    def _next(self, last: _Knot, u: float) -> _Knot | None:
        """The next knot; None: the step is too long, or no joint position leads on."""
        h = u - last.u
        guess = last.q + h * last.first + 0.5 * h * h * last.second
        q = self._solve(u, guess)
        if q is None or np.abs(q - guess).max() > MOST_CORRECTION:
            return None
        knot = self._with_derivatives(u, q)
        return knot if knot is not None and self._is_close(last, knot) else None

    def _is_close(self, start: _Knot, end: _Knot) -> bool:
        """Whether the quintic between two knots keeps to the path."""
        piece = _curve([start, end])
        for probe in PROBES:
            at = probe * (end.u - start.u)
            q = horner(piece.coefficients[0], np.array(at))
            distance, angle = pose_errors(self.path.pose(start.u + at), tool_pose(self.robot, q))
            if distance > self.distance or (angle is not None and angle > self.angle):
                return False
        return True

    def _solve(self, u: float, q: FloatArray) -> FloatArray | None:
        """The joint position at u near `q`, by Newton's method."""
        pose = self.path.pose(u)
        wanted = self.free @ self.start + u * self.drift
        for _ in range(MOST_ITERATIONS):
            here = tool_pose(self.robot, q)
            missing = np.concatenate([np.zeros(self.rows), wanted - self.free @ q])
            missing[:3] = pose.position - here.position
            if pose.rotation is not None and here.rotation is not None:
                missing[3:6] = here.rotation @ pin.log3(here.rotation.T @ pose.rotation)
            if np.abs(missing).max() < SOLVED:
                return q
            step = self._inverse(q, missing)
            if step is None:
                return None
            q = q + step
            if self.rows > self.robot.dof and np.abs(step).max() < SOLVED:
                return q  # nearest to the pose: whether that is near enough is seen between the knots
        return None

    def _with_derivatives(self, u: float, q: FloatArray) -> _Knot | None:
        if np.linalg.svd(self._jacobian(q), compute_uv=False)[-1] < SINGULAR:
            return None
        first = self._rate(u, q)
        if first is None:
            return None
        before, after = self._rate(u - AHEAD, q - AHEAD * first), self._rate(u + AHEAD, q + AHEAD * first)
        if before is None or after is None:
            return None
        return _Knot(u, q, first, (after - before) / (2.0 * AHEAD))

    def _rate(self, u: float, q: FloatArray) -> FloatArray | None:
        return self._inverse(q, np.concatenate([self.path.twist(u), self.drift]))

    def _inverse(self, q: FloatArray, change: FloatArray) -> FloatArray | None:
        """The joint step that makes a small change of the tool (base axes) and in the null space; None: singular."""
        J = self._augmented(q)
        try:
            is_square = J.shape[0] == J.shape[1]
            step = np.linalg.solve(J, change) if is_square else np.linalg.lstsq(J, change, rcond=None)[0]
        except np.linalg.LinAlgError:
            return None
        return np.asarray(step, dtype=np.float64)

    def _handedness(self, q: FloatArray) -> float:
        """The sign of the determinant: it changes where a path crosses into another branch."""
        J = self._augmented(q)
        return float(np.linalg.slogdet(J)[0]) if J.shape[0] == J.shape[1] else 1.0

    def _augmented(self, q: FloatArray) -> FloatArray:
        return np.vstack([self._jacobian(q), self.free])

    def _jacobian(self, q: FloatArray) -> FloatArray:
        return jacobian(self.robot, q)[: self.rows]


def _null_space(J: FloatArray) -> FloatArray:
    """(joints - rows, joints): an orthonormal basis; empty where there are no more joints than rows."""
    rows, joints = J.shape
    basis: FloatArray = np.linalg.svd(J)[2][min(rows, joints) :]
    return basis


def _curve(knots: list[_Knot]) -> PiecewisePolynomial:
    u, *values = (np.array(rows) for rows in zip(*knots, strict=True))
    lengths = np.diff(u)
    starts, ends = tuple(rows[:-1] for rows in values), tuple(rows[1:] for rows in values)
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))
