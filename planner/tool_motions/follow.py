"""A path of the tool to a path of the joints: one curve, on one branch, within a stated tolerance."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.search import pose_errors
from planner.robots import Robot
from planner.spatial import FloatArray, Pose, rotation_vector
from planner.tolerances import SAME_CONFIGURATION
from planner.tool_motions.inverse_jacobian import (
    NEAR_SINGULARITY,
    RANK,
    handedness,
    inverse_step,
    kept_motions,
    null_space,
)
from planner.tool_motions.pose_paths import PosePath
from planner.trajectories.polynomials import PiecewisePolynomial, horner, quintics_through

PROBE_TOLERANCE_SHARE = 0.25
"""The share of the tolerance that the joint path may use up at the probes; time needs some, too."""

PROBES = np.array([0.25, 0.5, 0.75])
"""Shares of the way between two knots at which the curve is compared with the path; its error is like u^3 (1 - u)^3."""

FIRST_KNOT_STEP = 0.125
"""The first step from knot to knot, as a share of the first piece of the path."""

LONGEST_STEP = 0.25
"""The longest step from knot to knot, as a share of a piece of the path, so that no detour is missed."""

SHORT_TRAVEL = 0.05
"""Largest travel of a joint, rad or m, for which one step may cover a whole piece: the Jacobian hardly changes."""

SHORTEST_TURN = 1e-2
"""Travel of the steepest joint, rad or m, in the step in u below which the path counts as lost."""

GROWTH = 1.6
"""The factor on the step after a knot that the tolerance allowed."""

MOST_CORRECTION = 0.15
"""Largest distance of a joint from the extrapolation of the last knot, rad or m; beyond may be another branch."""

CLOSE_TO_END = 1e-3
"""Distance of a joint from a given end, rad or m, below which the last knot is sought from that end. At a singular
joint position, the pose alone does not determine the idle joints."""

KNOT_ERROR = 1e-11
"""The error, m and rad, at which a knot is solved."""

MOST_ITERATIONS = 12
"""The most Newton steps until a knot is solved."""

DIFFERENCE_STEP = 1e-4
"""The step in u of the difference quotient for the second derivative, and the largest travel of a joint in it, rad or
m."""

FAR_AHEAD = 1e-2
"""The same at a singular joint position: far enough to leave the singularity."""

SINGULAR_TRAVEL = 1e3
"""Travel of a joint, rad or m, for 1 m or 1 rad of the tool above which the path counts as singular. A joint of 3 rad/s
would limit the tool to 3 mm/s."""

SOLVED_NEAR_SINGULARITY = 1e-14
"""The error, m and rad, at which a knot near a singularity is solved: there a joint moves far for a small error."""

ALONG_LOST = 1e-5
"""The share of its speed with which the tool may go in a lost direction: more, and a joint would have to jump."""

LEAST_TURN = 1e-3
"""Smallest rotation of a lost direction, rad per rad of joint motion, that determines the speed of the idle joints."""

CROSSED = 1e-6
"""Distance of the tool, m and rad, from a singular pose below which the motion passes through it. The inverse
kinematics reaches every pose only to this accuracy."""

CROSSING_STEPS = 30
"""Bisections in the search for the point where a path crosses a singularity."""


@dataclass(frozen=True, eq=False)
class Track:
    """A path of the tool that the joints are to follow.

    Attributes:
        robot: The robot, with its tool.
        path: The path of the tool.
        start: (joints,), at the start of the path.
        end: (joints,), where the joint path should end, if that is known.
        tolerance: m and rad.
        steepest: Largest travel of a joint, rad or m, for 1 m or rad of the tool.
    """

    robot: Robot
    path: PosePath
    start: FloatArray
    end: FloatArray | None
    tolerance: tuple[float, float]
    steepest: float = SINGULAR_TRAVEL

    @property
    def rows(self) -> int:
        """Number of the tool's directions: 6, or 3 where any orientation will do."""
        return len(self.path.twist(0.0))

    @property
    def way(self) -> FloatArray:
        """The way (joints,) from the start to the end, rad or m; zero where that is not known."""
        return np.zeros(self.robot.dof) if self.end is None else self.end - self.start


@dataclass(frozen=True, eq=False)
class Lost:
    """The point where the joints could not follow the tool's path further.

    Attributes:
        u: The last parameter of the path that was reached.
        position: (joints,), there.
        curve: The joint path until then, possibly without pieces.
    """

    u: float
    position: FloatArray
    curve: PiecewisePolynomial


class _Knot(NamedTuple):
    """A parameter of the path, and the joint position there with its derivatives by u, (joints,) each.

    Handedness is the sign of the Jacobian's determinant: it changes where a path crosses into another branch. It is 0
    where the Jacobian is singular or not square.
    """

    u: float
    q: FloatArray
    first: FloatArray
    second: FloatArray
    handedness: float


def follow(track: Track, still: Collection[str] = ()) -> PiecewisePolynomial | Lost:
    """Follow the path with the tool from the joint position at its start, without a jump and without a detour.

    The joint path q(u) solves forward(q) = X(u). At its knots, Newton's method gives q, J q' = X' gives q', and
    differences of q' give q''. Between the knots it is the quintic with these values at both ends, so it is C2. A knot
    is kept only if that quintic is within the tolerance of X. Position limits do not count.

    At a singular joint position a path with bounded joint derivatives exists if the tool does not move in a lost
    direction. The second derivative then determines the motion of the idle joints: W^T (X'' - J' q') = 0, W the lost
    directions. If it does not, as in a wrist that stays stretched, they take the shortest motion.

    A redundant arm keeps its component in the null space of the start, or changes it linearly to the component of
    `end`. This makes q(u) a function of u alone. An arm that is singular along the whole path does the same, if it
    would not reach `end` otherwise.

    Args:
        track: The path and where it starts.
        still: Names of the joints to spare that are to stand still, or to go evenly to where they are in `end`.

    Returns:
        The joint path over u from 0 to 1, or where it got lost.
    """
    robot, end, rows = track.robot, track.end, track.rows
    kept = kept_motions(robot, jacobian(robot, track.start)[:rows], still) if still else None
    result = Follower(track, kept).run()
    if end is None or isinstance(result, Lost):
        return result
    if np.abs(result.evaluate(result.breakpoints[-1:], [0])[0][0] - end).max() <= SAME_CONFIGURATION:
        return result
    idle = null_space(jacobian(robot, end)[:rows])
    if len(idle) == max(0, robot.dof - rows):
        return result
    guided = Follower(track, idle).run()
    return result if isinstance(guided, Lost) else guided


class Follower:
    """The follower of one path, from knot to knot; for the method see `follow`.

    Args:
        track: The path and where it starts.
        free: (n, joints), joint motions kept besides the tool's motion; None: the null space of the start.
    """

    near_end = CLOSE_TO_END
    """How near to its end, rad or m, the last knot is sought from there."""

    def __init__(self, track: Track, free: FloatArray | None = None) -> None:
        self.robot, self.path, self.start, self.end = track.robot, track.path, track.start, track.end
        self.rows, self.steepest, self.shortest_step = track.rows, track.steepest, SHORTEST_TURN / track.steepest
        self.rank = min(RANK, 1.0 / track.steepest)
        self.distance, self.angle = (PROBE_TOLERANCE_SHARE * allowed for allowed in track.tolerance)
        if free is None:
            free = kept_motions(self.robot, self._jacobian(self.start))[: max(0, self.robot.dof - self.rows)]
        self.free, self.drift = free, free @ track.way

    def run(self) -> PiecewisePolynomial | Lost:
        """Return the curve, or where it ended."""
        first = self._with_derivatives(0.0, self.start)
        if first is None:
            return Lost(0.0, self.start, PiecewisePolynomial(np.empty(0), np.empty((0, self.robot.dof, 6))))
        breakpoints = self.path.breakpoints
        knots, step = [first], FIRST_KNOT_STEP * float(breakpoints[1])
        while (last := knots[-1]).u < 1.0:
            end = int(np.searchsorted(breakpoints, last.u, side="right"))
            piece_end, piece = float(breakpoints[end]), float(breakpoints[end] - breakpoints[end - 1])
            longest = max(LONGEST_STEP * piece, SHORT_TRAVEL / max(float(np.abs(last.first).max()), SHORT_TRAVEL))
            ahead = last.u + min(step, longest)
            if ahead > piece_end - self.shortest_step * piece:
                ahead = piece_end
            knot = self._next(last, ahead)
            if knot is not None:
                knots.append(knot)
                if self._is_outside(knot.q):
                    return Lost(knot.u, knot.q, _curve(knots))
                step = max(step, GROWTH * (ahead - last.u))
                continue
            step = (ahead - last.u) / 2.0
            if step < self.shortest_step * piece:
                return Lost(last.u, last.q, _curve(knots))
        if self.end is not None and np.abs(knots[-1].q - self.end).max() < SAME_CONFIGURATION:
            knots[-1] = knots[-1]._replace(q=self.end)
        return _curve(knots)

    def _is_outside(self, _q: FloatArray) -> bool:
        """Tell whether the joint position (joints,) has left its limits, if limits count."""
        return False

    def _next(self, last: _Knot, u: float) -> _Knot | None:
        """Return the next knot; None: the step is too long, or no joint position leads on."""
        h = u - last.u
        guess = last.q + h * last.first + 0.5 * h * h * last.second
        is_at_end = u == 1.0 and self.end is not None and np.abs(guess - self.end).max() < self.near_end
        q = self._solve(u, self.end if is_at_end and self.end is not None else guess)
        if q is None or np.abs(q - guess).max() > MOST_CORRECTION:
            return None
        knot = self._with_derivatives(u, q)
        if knot is None or not self._is_close(last, knot):
            return None
        return knot if last.handedness * knot.handedness >= 0.0 or self._crosses(last, knot) else None

    def _crosses(self, start: _Knot, end: _Knot) -> bool:
        """Tell whether the path crosses a singularity between two knots, instead of passing it to another branch."""
        coefficients, before, after = _curve([start, end]).coefficients[0], start.u, end.u
        for _ in range(CROSSING_STEPS):
            u = 0.5 * (before + after)
            q = horner(coefficients, np.array(u - start.u))
            is_before = handedness(self._augmented(q)) == start.handedness
            before, after = (u, after) if is_before else (before, u)
        pose = self.path.pose(u)
        for _ in range(MOST_ITERATIONS):
            missing = self._missing(u, pose, q)
            step = np.linalg.lstsq(self._augmented(q), missing, rcond=NEAR_SINGULARITY)[0]
            if np.abs(step).max() < KNOT_ERROR:
                return bool(np.abs(missing).max() < CROSSED)
            q = q + step
        return False

    def _is_close(self, start: _Knot, end: _Knot) -> bool:
        """Tell whether the quintic between two knots keeps to the path."""
        piece = _curve([start, end])
        for probe in PROBES:
            at = probe * (end.u - start.u)
            q = horner(piece.coefficients[0], np.array(at))
            distance, angle = pose_errors(self.path.pose(start.u + at), tool_pose(self.robot, q))
            if distance > self.distance or (angle is not None and angle > self.angle):
                return False
        return True

    def _solve(self, u: float, q: FloatArray) -> FloatArray | None:
        """Return the joint position at u near `q`, by Newton's method."""
        pose = self.path.pose(u)
        for _ in range(MOST_ITERATIONS):
            missing, J = self._missing(u, pose, q), self._augmented(q)
            error = np.abs(missing).max()
            if error < SOLVED_NEAR_SINGULARITY:
                return q
            step, is_near_singularity = inverse_step(J, missing, self.rank)
            if error < KNOT_ERROR and not is_near_singularity:
                return q
            q = q + step
            if np.abs(step).max() < KNOT_ERROR and (self.rows > self.robot.dof or error < KNOT_ERROR):
                return q  # nearest to the pose: whether that is near enough is seen between the knots
        return None

    def _missing(self, u: float, pose: Pose, q: FloatArray) -> FloatArray:
        """Return the error of q (joints,) at u: the change of the tool, and the change in the null space."""
        here = tool_pose(self.robot, q)
        missing = np.zeros(self.rows + len(self.free))
        if len(self.free):
            missing[self.rows :] = self.free @ (self.start - q) + u * self.drift
        missing[:3] = pose.position - here.position
        if pose.rotation is not None and here.rotation is not None:
            missing[3:6] = here.rotation @ rotation_vector(here.rotation.T @ pose.rotation)
        return missing

    def _with_derivatives(self, u: float, q: FloatArray) -> _Knot | None:
        """Return the knot at a solved joint position; None: a joint would have to jump."""
        J = self._augmented(q)
        first = self._rate(u, q, J)
        if first is None:
            return None
        steepness = float(np.abs(first).max())
        if steepness > self.steepest * np.abs(self._change(u)).max():
            return None
        values = np.linalg.svd(J, compute_uv=False)
        if values[-1] < self.rank * values[0]:
            second = self._second_at_singularity(u, q, first)
            return None if second is None else _Knot(u, q, first, second, 0.0)
        ahead = DIFFERENCE_STEP / max(1.0, steepness)
        before, after = self._rate(u - ahead, q - ahead * first), self._rate(u + ahead, q + ahead * first)
        if before is None or after is None:
            return None
        return _Knot(u, q, first, (after - before) / (2.0 * ahead), handedness(J))

    def _second_at_singularity(self, u: float, q: FloatArray, first: FloatArray) -> FloatArray | None:
        """Return the second derivative (joints,) by u from joint positions solved where the arm is singular no more."""
        found = []
        for ahead in (-FAR_AHEAD, FAR_AHEAD):
            near = self._solve(u + ahead, q + ahead * first)
            rate = None if near is None else self._rate(u + ahead, near)
            if rate is not None and np.abs(rate - first).max() < MOST_CORRECTION:
                found.append((rate - first) / ahead)
        return np.mean(found, axis=0) if found else None

    def _rate(self, u: float, q: FloatArray, J: FloatArray | None = None) -> FloatArray | None:
        """Return the joints' derivative by u (joints,) at q; None: the tool goes where no joint can take it."""
        J = self._augmented(q) if J is None else J
        change = self._change(u)
        rate, is_near_singularity = inverse_step(J, change, self.rank)
        if not is_near_singularity:
            return rate
        directions, values, joint_directions = np.linalg.svd(J)
        lost = np.flatnonzero(values < self.rank * values[0])
        if not len(lost):
            return rate
        if np.abs(directions[:, lost].T @ change).max() > ALONG_LOST * np.abs(change).max():
            return None
        return self._with_idle_joints(u, q, rate, directions[:, lost].T, joint_directions[lost])

    def _with_idle_joints(
        self, u: float, q: FloatArray, rate: FloatArray, lost: FloatArray, idle: FloatArray
    ) -> FloatArray | None:
        """Return the rate (joints,) at a singular joint position, with idle joints; None: no rate keeps to the path.

        Args:
            u: Parameter of the path.
            q: (joints,), there.
            rate: (joints,), the smallest that moves the tool as the path does.
            lost: (n, rows), the directions in which no joint moves the tool.
            idle: (n, joints), the joint motions that do not move the tool.
        """
        acceleration = (self._change(u + DIFFERENCE_STEP) - self._change(u - DIFFERENCE_STEP)) / (2.0 * DIFFERENCE_STEP)
        for _ in range(MOST_ITERATIONS):
            turning = self._jacobian_rate(q, rate)
            missing = lost @ (acceleration - turning @ rate)
            size = np.abs(turning).max() * np.abs(rate).max() + np.abs(acceleration).max()
            if np.abs(missing).max() <= ALONG_LOST * size:
                return rate
            slopes = np.column_stack([lost @ (self._jacobian_rate(q, way) @ rate + turning @ way) for way in idle])
            if np.linalg.svd(slopes, compute_uv=False)[-1] < LEAST_TURN * np.abs(rate).max():
                return None
            rate = rate + np.linalg.solve(slopes, missing) @ idle
        return None

    def _jacobian_rate(self, q: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the change (rows, joints) of the Jacobian by u as the joints go at a rate (joints,)."""
        ahead = DIFFERENCE_STEP / max(float(np.abs(rate).max()), DIFFERENCE_STEP)
        return (self._augmented(q + ahead * rate) - self._augmented(q - ahead * rate)) / (2.0 * ahead)

    def _change(self, u: float) -> FloatArray:
        twist = self.path.twist(u)
        return np.concatenate([twist, self.drift]) if len(self.drift) else twist

    def _augmented(self, q: FloatArray) -> FloatArray:
        J = self._jacobian(q)
        return np.vstack([J, self.free]) if len(self.free) else J

    def _jacobian(self, q: FloatArray) -> FloatArray:
        return jacobian(self.robot, q)[: self.rows]


def _curve(knots: list[_Knot]) -> PiecewisePolynomial:
    u, *values = (np.array([knot[i] for knot in knots]) for i in range(4))
    return quintics_through(np.diff(u), *values)
