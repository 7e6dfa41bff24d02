"""Smooth pieces of the tool's path, all followed at once in array operations."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from planner.kinematics.screws import screws_of
from planner.robots import Robot
from planner.spatial import FloatArray, rotation_vectors
from planner.tool_motions.follow import (
    DIFFERENCE_STEP,
    KNOT_ERROR,
    LONGEST_STEP,
    MOST_CORRECTION,
    PROBE_TOLERANCE_SHARE,
    PROBES,
)
from planner.tool_motions.inverse_jacobian import NEAR_SINGULARITY
from planner.trajectories.polynomials import PiecewisePolynomial, horner, quintic_hermite

BATCH_STEP_TRAVEL = 0.05
"""Largest travel of every joint, rad or m, for which one step may span any part of a piece.

The Jacobian hardly changes on it, so no detour is missed.
"""

MOST_STEP_HALVINGS = 8
"""Times that steps are halved until the tolerance is kept: what needs shorter ones is followed from knot to knot."""

MOST_NEWTON_STEPS = 8
"""Newton steps until all knots are solved: from a good guess three are enough."""


class FollowedPieces(NamedTuple):
    """The first pieces of a chain that were followed, perhaps none.

    Attributes:
        curves: Joint positions over u from 0 to 1, for each piece.
        ends: (pieces, joints), rad or m, where each of them ends and the next one starts.
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


class Batch:
    """Smooth pieces of the tool's path, each over u from 0 to 1, that are followed at once.

    Args:
        rows: The tool's directions.
        lengths: (count,), of the pieces in parameters of their path.
        start: (joints,), where the first one starts.
        tolerances: (count, 2), m and rad.
        steepest: (count,), rad or m by 1 m or rad.
    """

    ends_are_known = True
    """Whether the pieces end at joint positions that were known before, and not where descents led."""

    def __init__(
        self,
        robot: Robot,
        rows: int,
        lengths: FloatArray,
        start: FloatArray,
        tolerances: FloatArray,
        steepest: FloatArray,
    ) -> None:
        self.robot, self.screws, self.point = robot, screws_of(robot), robot.tool_in_tip.translation
        self.rows, self.turns, self.idle = rows, rows > 3, robot.dof - rows
        count, self.lengths = len(lengths), lengths
        self.free = np.zeros((count, max(0, self.idle), robot.dof))
        self.tolerances, self.steepest = PROBE_TOLERANCE_SHARE * tolerances, steepest
        self.starts = np.repeat(start[None], count, axis=0)
        self.ends = self.starts.copy()

    def poses(self, lines: np.ndarray, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3) and rotations (N, 3, 3) at shares u (N,) of pieces (N,)."""
        raise NotImplementedError

    def changes(self, lines: np.ndarray, u: FloatArray) -> FloatArray:
        """Return the changes (N, joints) by u of tool and null space at shares u (N,) of pieces (N,)."""
        raise NotImplementedError

    def kept(self, lines: np.ndarray, _u: FloatArray) -> FloatArray:
        """Return the joint positions (N, joints) whose null space components pieces (N,) have at shares u (N,)."""
        return np.asarray(self.starts[lines])

    def follow(self, count: int, longest: float = LONGEST_STEP) -> FollowedPieces:
        """Follow the first pieces, of which the ends are solved, in steps up to `longest`, or short ones."""
        lines = np.arange(count)
        good = np.ones(count, dtype=bool)
        before, fine = self._with_derivatives(lines, np.zeros(count), self.starts[:count])
        good &= fine
        after, fine = self._with_derivatives(lines, np.ones(count), self.ends[:count])
        good &= fine & (before.handedness * after.handedness > 0.0)
        if not self.ends_are_known:
            ahead = before.q + before.first + 0.5 * before.second
            good &= np.abs(after.q - ahead).max(axis=1) < MOST_CORRECTION
        begin, end = np.zeros(count), np.ones(count)
        kept = []
        for _ in range(MOST_STEP_HALVINGS):
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
            close &= (h <= longest) | (self._travels(h, coefficients) <= BATCH_STEP_TRAVEL)
            kept.append((lines[close], begin[close], h[close], coefficients[close]))
            rough = ~close
            if not rough.any():
                break
            lines, begin, end, before, after = lines[rough], begin[rough], end[rough], before.of(rough), after.of(rough)
            half = (end - begin) / 2.0
            guesses = horner(coefficients[rough], half[:, None])
            q, solved = self._solve(lines, begin + half, guesses)
            middle, fine = self._with_derivatives(lines, begin + half, q)
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
        return FollowedPieces([PiecewisePolynomial(h[own], coefficients[own]) for own in pieces], self.ends[:count])

    def _solve(self, lines: np.ndarray, u: FloatArray, guesses: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Return the joint positions (N, joints) at shares u (N,) of lines (N,) near guesses, and which are solved."""
        q = guesses.copy()
        for _ in range(MOST_NEWTON_STEPS):
            missing, J = self._missing(lines, u, q)
            solved = np.abs(missing).max(axis=1) < KNOT_ERROR
            step, fine = _inverse(J, missing)
            q = q + step
            if (solved | ~fine).all():
                break
        return q, solved & fine

    def _missing(self, lines: np.ndarray, u: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the changes (N, joints) of tool and null space that q (N, joints) lacks, and the Jacobians of both."""
        reached, turned, J = self.screws.reach(q, self.point)
        positions, rotations = self.poses(lines, u)
        parts = [positions - reached]
        if rotations is not None:
            parts.append(rotation_vectors(rotations @ self._tools(turned).transpose(0, 2, 1)))
        if self.idle:
            parts.append((self.free[lines] @ (self.kept(lines, u) - q)[..., None])[..., 0])
        return np.hstack(parts), self._augmented(lines, J)

    def _augmented(self, lines: np.ndarray, J: FloatArray) -> FloatArray:
        return np.concatenate([J[:, : self.rows], self.free[lines]], axis=1) if self.idle else J[:, : self.rows]

    def _with_derivatives(self, lines: np.ndarray, u: FloatArray, q: FloatArray) -> tuple[_States, np.ndarray]:
        """Return the knots at solved joint positions (N, joints), and which of them (N,) are away from singularities.

        The second derivatives are differences of the rates ahead and behind.
        """
        change = self.changes(lines, u)
        J = self._augmented(lines, self.screws.reach(q, self.point)[2])
        first, fine = _inverse(J, change)
        fine &= np.abs(first).max(axis=1) < self.steepest[lines] * np.abs(change).max(axis=1)
        ahead = DIFFERENCE_STEP / np.maximum(self.lengths[lines], np.abs(first).max(axis=1))
        rates = []
        for at in (-ahead, ahead):
            J_there = self._augmented(lines, self.screws.reach(q + at[:, None] * first, self.point)[2])
            rate, well = _inverse(J_there, self.changes(lines, u + at))
            rates.append(rate)
            fine &= well
        second = (rates[1] - rates[0]) / (2.0 * ahead)[:, None]
        return _States(q, first, second, np.linalg.slogdet(J)[0]), fine

    def _are_close(self, lines: np.ndarray, begin: FloatArray, h: FloatArray, coefficients: FloatArray) -> np.ndarray:
        """Tell which pieces (N,) keep the tool within the tolerances of their lines."""
        at = PROBES[:, None] * h
        q = horner(coefficients, at[..., None]).reshape(-1, self.robot.dof)
        reached, turned = self.screws.poses(q, self.point)
        lines, u = np.tile(lines, len(PROBES)), (begin + at).ravel()
        positions, rotations = self.poses(lines, u)
        close = np.linalg.norm(positions - reached, axis=1) <= self.tolerances[lines, 0]
        if rotations is not None:
            vectors = rotation_vectors(rotations @ self._tools(turned).transpose(0, 2, 1))
            close &= np.linalg.norm(vectors, axis=1) <= self.tolerances[lines, 1]
        every: np.ndarray = close.reshape(len(PROBES), -1).all(axis=0)
        return every

    def _travels(self, h: FloatArray, coefficients: FloatArray) -> FloatArray:
        """Return the most (N,) that a joint can travel on each piece: its polynomial's terms, without their signs."""
        powers = h[:, None, None] ** np.arange(1, coefficients.shape[2])
        travels: FloatArray = (np.abs(coefficients[..., 1:]) * powers).sum(axis=2).max(axis=1)
        return travels

    def _tools(self, turned: FloatArray) -> FloatArray:
        rotations: FloatArray = turned @ self.robot.tool_in_tip.rotation
        return rotations


def _inverse(J: FloatArray, changes: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return the joint steps (N, joints) that make changes (N, joints), and which Jacobians are not near singular.

    Near a singularity the step is zero.
    """
    probe = np.cos(np.arange(J.shape[1]))  # has a share in every direction
    right = np.stack([changes, np.broadcast_to(probe, changes.shape)], axis=2)
    steps: FloatArray = np.full(right.shape, np.inf)
    with suppress(np.linalg.LinAlgError):
        steps[:] = np.linalg.solve(J, right)
    with np.errstate(invalid="ignore"):
        fine: np.ndarray = np.abs(steps[..., 1]).max(axis=1) < 1.0 / NEAR_SINGULARITY
    return np.where(fine[:, None], steps[..., 0], 0.0), fine
