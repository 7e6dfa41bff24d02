"""Straight lines of the tool, one after the other, to paths of the joints: all of them at once, in array operations."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.screws import screws_of
from planner.spatial import rotation_vector, rotation_vectors, rotations_from_vectors
from planner.tolerances import SAME_CONFIGURATION
from planner.tool_motions.follow import (
    AHEAD,
    LONGEST_STEP,
    MOST_CORRECTION,
    PROBES,
    SHARE_OF_TOLERANCE,
    SOLVED,
)
from planner.tool_motions.inverse_jacobian import NEAR_SINGULARITY, kept_motions
from planner.trajectories.polynomials import PiecewisePolynomial, horner, quintic_hermite

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.tool_motions.pose_paths import Line

SHORT = 0.05
"""Travel of every joint, rad or m, up to which one step leads from knot to knot however much of its line it is: the
Jacobian hardly changes on it, so that no detour is missed."""

MOST_HALVINGS = 8
"""Times that steps are halved until the tolerance is kept: lines that need shorter ones are followed by themselves."""

MOST_ITERATIONS = 8
"""Newton steps until all knots are solved: from a good guess three are enough."""


class FollowedLines(NamedTuple):
    """The first lines of a chain that were followed, perhaps none.

    Attributes:
        curves: Joint positions over u from 0 to 1, for each line.
        ends: (lines, joints), rad or m, where each of them ends and the next one starts.
    """

    curves: list[PiecewisePolynomial]
    ends: FloatArray


class _States(NamedTuple):
    """Knots: joint positions and their derivatives by u, each (N, joints), and the sign (N,) of the determinant."""

    q: FloatArray
    first: FloatArray
    second: FloatArray
    handedness: FloatArray

    def of(self, rows: np.ndarray) -> _States:
        return _States(*(values[rows] for values in self))


def follow_lines(
    robot: Robot,
    lines: Sequence[Line],
    start: FloatArray,
    guesses: FloatArray,
    are_given: np.ndarray,
    tolerances: FloatArray,
    steepest: FloatArray,
) -> FollowedLines:
    """Follow lines, each of which starts where the one before ends, as `follow` does, as far as they are ordinary.

    A line is not if it comes near a singularity, if it needs very short steps, or
    if it does not end where it is expected to: it and all that come after it are left to `follow`. Position limits are
    not looked at.

    Args:
        robot: The robot, with its tool, of no fewer joints than the tool has directions.
        lines: All with rotations or all without.
        start: (joints,), at the start of the first line.
        guesses: (lines, joints), where the lines are expected to end. An arm with more joints than the tool has
            directions ends where its null space takes it.
        are_given: (lines,), whether such a joint position is exactly the end.
        tolerances: (lines, 2), m and rad.
        steepest: (lines,), how far a joint may go, rad or m, where the tool goes 1 m or rad.
    """
    batch = _Lines(robot, lines, start, tolerances, steepest)
    return batch.follow(batch.solve_ends(guesses, are_given))


class _Lines:
    def __init__(
        self,
        robot: Robot,
        lines: Sequence[Line],
        start: FloatArray,
        tolerances: FloatArray,
        steepest: FloatArray,
    ) -> None:
        self.robot, self.screws, self.point = robot, screws_of(robot), robot.tool_in_tip.translation
        self.origins = np.array([line.start.position for line in lines])
        self.ways = np.array([line.end.position for line in lines]) - self.origins
        turns = [line.turn for line in lines if line.turn is not None]
        self.turns = len(turns) > 0
        self.changes = self.ways
        if self.turns:
            self.rotations = np.array([turn.start for turn in turns])
            self.vectors = np.array([turn.first for turn in turns])
            self.changes = np.hstack([self.ways, (self.rotations @ self.vectors[..., None])[..., 0]])
        self.rows = self.changes.shape[1]
        self.idle = robot.dof - self.rows
        self.changes = np.hstack([self.changes, np.zeros((len(lines), self.idle))])
        self.free = np.zeros((len(lines), self.idle, robot.dof))
        self.tolerances, self.steepest = SHARE_OF_TOLERANCE * tolerances, steepest
        self.starts = np.repeat(start[None], len(lines), axis=0)
        self.ends = self.starts.copy()

    def solve_ends(self, guesses: FloatArray, are_given: np.ndarray) -> int:
        """Solve the ends, and so the starts, of the lines; the number of lines, from the first on, that have one."""
        count = len(self.ends)
        if not self.idle:
            every, one = np.arange(count), np.ones(count)
            ends, solved = self._solve(every, one, guesses)
            solved &= np.abs(ends - guesses).max(axis=1) < SAME_CONFIGURATION
            self.ends = np.where(are_given[:, None], guesses, ends)
            self.starts[1:] = self.ends[:-1]
            return count if solved.all() else int(solved.argmin())
        for k in range(count):
            if k:
                self.starts[k] = self.ends[k - 1]
            free = kept_motions(self.robot, jacobian(self.robot, self.starts[k])[: self.rows])
            if len(free) != self.idle:
                return k
            self.free[k] = free
            end = self._end(k)
            if end is None:
                return k
            self.ends[k] = end
        return count

    def _end(self, k: int) -> FloatArray | None:
        """Return the joint position (joints,) at the end of one line, by Newton's method; None: there is none near."""
        start: FloatArray = self.starts[k]
        q = start
        turned = self._rotations(np.array([k]), np.ones(1))[0] if self.turns else None
        for _ in range(MOST_ITERATIONS):
            here, J = tool_pose(self.robot, q), jacobian(self.robot, q)[: self.rows]
            missing = np.concatenate([self.origins[k] + self.ways[k] - here.position, np.zeros(self.robot.dof - 3)])
            if turned is not None and here.rotation is not None:
                missing[3:6] = here.rotation @ rotation_vector(here.rotation.T @ turned)
            missing[self.rows :] = self.free[k] @ (start - q)
            if np.abs(missing).max() < SOLVED:
                return q
            try:
                q = q + np.linalg.solve(np.vstack([J, self.free[k]]), missing)
            except np.linalg.LinAlgError:
                return None
        return None

    def follow(self, count: int) -> FollowedLines:
        """Follow the first lines, of which the ends are solved."""
        lines = np.arange(count)
        good = np.ones(count, dtype=bool)
        before, fine = self._with_derivatives(lines, self.starts[:count])
        good &= fine
        after, fine = self._with_derivatives(lines, self.ends[:count])
        good &= fine & (before.handedness * after.handedness > 0.0)
        begin, end = np.zeros(count), np.ones(count)
        kept = []
        for _ in range(MOST_HALVINGS):
            going = good[lines]
            lines, begin, end, before, after = (
                lines[going],
                begin[going],
                end[going],
                before.of(going),
                after.of(going),
            )
            h = end - begin
            coefficients = quintic_hermite(h, before[:3], after[:3])
            close = self._are_close(lines, begin, h, coefficients)
            close &= (h <= LONGEST_STEP) | (self._travels(h, coefficients) <= SHORT)
            kept.append((lines[close], begin[close], h[close], coefficients[close]))
            rough = ~close
            if not rough.any():
                break
            lines, begin, end, before, after = lines[rough], begin[rough], end[rough], before.of(rough), after.of(rough)
            half = (end - begin) / 2.0
            guesses = horner(coefficients[rough], half[:, None])
            q, solved = self._solve(lines, begin + half, guesses)
            middle, fine = self._with_derivatives(lines, q)
            fine &= solved & (np.abs(q - guesses).max(axis=1) < MOST_CORRECTION)
            good[lines[~fine | (middle.handedness * before.handedness < 0.0)]] = False
            lines = np.tile(lines, 2)
            begin, end = np.concatenate([begin, begin + half]), np.concatenate([begin + half, end])
            before, after = (
                _States(*(np.concatenate(pair) for pair in zip(*sides, strict=True)))
                for sides in ((before, middle), (middle, after))
            )
        else:
            good[lines] = False
        count = count if good.all() else int(good.argmin())
        lines, begin, h, coefficients = (np.concatenate(parts) for parts in zip(*kept, strict=True))
        order = np.lexsort((begin, lines))
        cuts = np.searchsorted(lines[order], np.arange(1, count + 1))
        pieces = np.split(order, cuts)[:count]
        return FollowedLines([PiecewisePolynomial(h[own], coefficients[own]) for own in pieces], self.ends[:count])

    def _solve(self, lines: np.ndarray, u: FloatArray, guesses: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Return the joint positions (N, joints) at shares u (N,) of lines (N,) near guesses, and which were found."""
        q = guesses.copy()
        for _ in range(MOST_ITERATIONS):
            missing, J = self._missing(lines, u, q)
            solved = np.abs(missing).max(axis=1) < SOLVED
            step, fine = _inverse(J, missing)
            q = q + np.where(fine[:, None], step, 0.0)
            if (solved | ~fine).all():
                break
        return q, solved & fine

    def _missing(self, lines: np.ndarray, u: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the changes (N, joints) of tool and null space that q (N, joints) lacks, and the Jacobians of both."""
        reached, turned, J = self.screws.reach(q, self.point)
        parts = [self.origins[lines] + u[:, None] * self.ways[lines] - reached]
        if self.turns:
            parts.append(rotation_vectors(self._rotations(lines, u) @ self._tools(turned).transpose(0, 2, 1)))
        if self.idle:
            parts.append((self.free[lines] @ (self.starts[lines] - q)[..., None])[..., 0])
        return np.hstack(parts), self._augmented(lines, J)

    def _augmented(self, lines: np.ndarray, J: FloatArray) -> FloatArray:
        return np.concatenate([J[:, : self.rows], self.free[lines]], axis=1) if self.idle else J[:, : self.rows]

    def _with_derivatives(self, lines: np.ndarray, q: FloatArray) -> tuple[_States, np.ndarray]:
        """Return the knots at solved joint positions (N, joints), and which of them (N,) are away from singularities.

        The twist of a line is constant: q'' is that of its rates by the change of the Jacobian alone.
        """
        change = self.changes[lines]
        J = self._augmented(lines, self.screws.reach(q, self.point)[2])
        first, fine = _inverse(J, change)
        fine &= np.abs(first).max(axis=1) < self.steepest[lines] * np.abs(change).max(axis=1)
        rates = []
        for ahead in (-AHEAD, AHEAD):
            rate, well = _inverse(self._augmented(lines, self.screws.reach(q + ahead * first, self.point)[2]), change)
            rates.append(rate)
            fine &= well
        return _States(q, first, (rates[1] - rates[0]) / (2.0 * AHEAD), np.linalg.slogdet(J)[0]), fine

    def _are_close(self, lines: np.ndarray, begin: FloatArray, h: FloatArray, coefficients: FloatArray) -> np.ndarray:
        """Which pieces (N,) keep the tool within the tolerances of their lines."""
        at = PROBES[:, None] * h
        q = horner(coefficients, at[..., None]).reshape(-1, self.robot.dof)
        reached, turned = self.screws.poses(q, self.point)
        lines, u = np.tile(lines, len(PROBES)), (begin + at).ravel()
        errors = np.linalg.norm(self.origins[lines] + u[:, None] * self.ways[lines] - reached, axis=1)
        close = errors <= self.tolerances[lines, 0]
        if self.turns:
            vectors = rotation_vectors(self._rotations(lines, u) @ self._tools(turned).transpose(0, 2, 1))
            close &= np.linalg.norm(vectors, axis=1) <= self.tolerances[lines, 1]
        every: np.ndarray = close.reshape(len(PROBES), -1).all(axis=0)
        return every

    def _travels(self, h: FloatArray, coefficients: FloatArray) -> FloatArray:
        """Return the most (N,) that a joint can travel on each piece: its polynomial's terms, without their signs."""
        powers = h[:, None, None] ** np.arange(1, coefficients.shape[2])
        travels: FloatArray = (np.abs(coefficients[..., 1:]) * powers).sum(axis=2).max(axis=1)
        return travels

    def _rotations(self, lines: np.ndarray, u: FloatArray) -> FloatArray:
        rotations: FloatArray = self.rotations[lines] @ rotations_from_vectors(self.vectors[lines] * u[:, None])
        return rotations

    def _tools(self, turned: FloatArray) -> FloatArray:
        rotations: FloatArray = turned @ self.robot.tool_in_tip.rotation
        return rotations


def _inverse(J: FloatArray, changes: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return the joint steps (N, joints) that make changes (N, joints), and which Jacobians are not near singular."""
    probe = np.cos(np.arange(J.shape[1]))  # has a share in every direction
    right = np.stack([changes, np.broadcast_to(probe, changes.shape)], axis=2)
    steps: FloatArray = np.full(right.shape, np.inf)
    with suppress(np.linalg.LinAlgError):
        steps[:] = np.linalg.solve(J, right)
    with np.errstate(invalid="ignore"):
        fine: np.ndarray = np.abs(steps[..., 1]).max(axis=1) < 1.0 / NEAR_SINGULARITY
    return steps[..., 0], fine
