"""Chains of straight lines, polylines and splines of the tool to paths of the joints, all pieces at once."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from planner.kernels.descent import Box
from planner.kinematics.descent import Target
from planner.kinematics.forward import jacobian
from planner.kinematics.search import STEADY
from planner.robots import Robot
from planner.spatial import FloatArray, rotations_from_vectors
from planner.tolerances import SAME_CONFIGURATION
from planner.tool_motions.batch import Batch, FollowedPieces
from planner.tool_motions.follow import LONGEST_STEP, Lost, Track, follow
from planner.tool_motions.inverse_jacobian import kept_motions
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_paths import Line, PiecedPath
from planner.tool_motions.pose_splines import PoseSpline
from planner.tool_motions.redundancy.offset_paths import OffsetPath
from planner.trajectories.polynomials import PiecewisePolynomial

MANY_PIECES = 16
"""Number of pieces of a path up to which each is followed in `BATCH_FOLLOWING_STEPS`."""

BATCH_FOLLOWING_STEPS = 4
"""Number of steps in which the pieces of a path of few are followed."""


def follow_lines(
    robot: Robot,
    lines: Sequence[Line],
    start: FloatArray,
    guesses: FloatArray,
    are_given: np.ndarray,
    tolerances: FloatArray,
    steepest: FloatArray,
) -> FollowedPieces:
    """Follow the first lines of a chain as `follow` does, up to the first line that needs special care.

    Such a line comes near a singularity, needs very short steps, or ends at an unexpected joint position. It and all
    lines after it are left to `follow`. Position limits do not count.

    Args:
        robot: The robot, with its tool, of no fewer joints than the tool has directions.
        lines: All with rotations or all without.
        start: (joints,), at the start of the first line.
        guesses: (lines, joints), where the lines are expected to end. An arm with more joints than the tool has
            directions ends where its null space takes it.
        are_given: (lines,), whether such a joint position is exactly the end.
        tolerances: (lines, 2), m and rad.
        steepest: (lines,), largest travel of a joint, rad or m, for 1 m or rad of the tool.
    """
    batch = _Lines(robot, lines, start, tolerances, steepest)
    return batch.follow(batch.solve_ends(guesses, are_given))


def follow_any(track: Track, still: Collection[str] = ()) -> PiecewisePolynomial | Lost:
    """Follow a path as `follow` does, a polyline or a spline at once where it is ordinary."""
    at_once = follow_at_once(track, still)
    return follow(track, still) if at_once is None else at_once


def follow_at_once(track: Track, still: Collection[str] = ()) -> PiecewisePolynomial | None:
    """Follow all pieces of a path at once, as `follow` does; None: the path or the robot is not ordinary.

    The path is neither a polyline nor a spline, comes near a singularity or needs very short steps. Or the robot has
    fewer joints than the tool has directions.
    """
    path, end = track.path, track.end
    if not isinstance(path, Polyline | PoseSpline | OffsetPath):
        return None
    count = len(path.breakpoints)
    steps = 1 if count > MANY_PIECES else BATCH_FOLLOWING_STEPS
    bounds = np.interp(np.arange(steps * (count - 1) + 1) / steps, np.arange(count), path.breakpoints)
    batch = _Pieces(track, path, bounds, still)
    if batch.idle != len(batch.drift) or batch.solve_ends(end) < len(batch.lengths):
        return None
    followed = batch.follow(len(batch.lengths), LONGEST_STEP * steps)
    if len(followed.curves) < len(batch.lengths):
        return None
    lengths = np.concatenate([curve.lengths for curve in followed.curves])
    coefficients = np.concatenate([curve.coefficients for curve in followed.curves])
    scales = np.repeat(batch.lengths, [len(curve.lengths) for curve in followed.curves])
    powers = scales[:, None, None] ** np.arange(coefficients.shape[2])
    return PiecewisePolynomial(lengths * scales, coefficients / powers)


class _Lines(Batch):
    """Straight lines of the tool, each of which starts where the one before ends."""

    def __init__(
        self,
        robot: Robot,
        lines: Sequence[Line],
        start: FloatArray,
        tolerances: FloatArray,
        steepest: FloatArray,
    ) -> None:
        self.origins = np.array([line.start.position for line in lines])
        self.ways = np.array([line.end.position for line in lines]) - self.origins
        turns = [line.turn for line in lines if line.turn is not None]
        twists = self.ways
        if turns:
            self.rotations = np.array([turn.start for turn in turns])
            self.vectors = np.array([turn.first for turn in turns])
            twists = np.hstack([self.ways, (self.rotations @ self.vectors[..., None])[..., 0]])
        super().__init__(robot, twists.shape[1], np.ones(len(lines)), start, tolerances, steepest)
        self.twists = np.hstack([twists, np.zeros((len(lines), self.idle))])

    def poses(self, lines: np.ndarray, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3) and rotations (N, 3, 3) at shares u (N,) of lines (N,)."""
        positions = self.origins[lines] + u[:, None] * self.ways[lines]
        if not self.turns:
            return positions, None
        return positions, self.rotations[lines] @ rotations_from_vectors(self.vectors[lines] * u[:, None])

    def changes(self, lines: np.ndarray, u: FloatArray) -> FloatArray:
        """Return the changes (N, joints) by u, which are the same all along each of the lines (N,)."""
        return np.asarray(self.twists[lines])

    def solve_ends(self, guesses: FloatArray, are_given: np.ndarray) -> int:
        """Solve the ends, and so the starts, of the lines; return the number of leading lines with a solution."""
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
            self.ends[k : k + 1], solved = self._solve(np.array([k]), np.ones(1), self.starts[k : k + 1])
            if not solved.all():
                return k
        return count


class _Pieces(Batch):
    """Pieces of one path of the tool, behind each other."""

    ends_are_known = False

    def __init__(self, track: Track, path: PiecedPath, bounds: FloatArray, still: Collection[str] = ()) -> None:
        self.path, self.begins = path, bounds[:-1]
        count, robot, start, rows = len(bounds) - 1, track.robot, track.start, track.rows
        tolerances, steepest = np.tile(track.tolerance, (count, 1)), np.full(count, track.steepest)
        super().__init__(robot, rows, np.diff(bounds), start, tolerances, steepest)
        free = kept_motions(robot, jacobian(robot, start)[:rows], still)[: max(0, self.idle)]
        self.is_still = np.array([name in still for name in robot.joint_names])
        self.start, self.way, self.drift = start, track.way, free @ track.way
        if self.idle == len(free):
            self.free[:] = free

    def poses(self, lines: np.ndarray, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3) and rotations (N, 3, 3) at shares u (N,) of pieces (N,)."""
        return self.path.poses(self.begins[lines] + u * self.lengths[lines])

    def changes(self, lines: np.ndarray, u: FloatArray) -> FloatArray:
        """Return the changes (N, joints) by u at shares u (N,) of pieces (N,)."""
        lengths = self.lengths[lines]
        twists = self.path.twists(self.begins[lines] + u * lengths)
        return np.asarray(lengths[:, None] * np.hstack([twists, np.tile(self.drift, (len(lines), 1))]))

    def kept(self, lines: np.ndarray, u: FloatArray) -> FloatArray:
        """Return the start, moved evenly to the end where that is given."""
        return np.asarray(self.start + (self.begins[lines] + u * self.lengths[lines])[:, None] * self.way)

    def solve_ends(self, end: FloatArray | None) -> int:
        """Solve the ends, each from the one before; the number of pieces, from the first on, that have one."""
        count = len(self.lengths)
        every, one = np.arange(count), np.ones(count)
        positions, rotations = self.poses(every, one)
        turned = None if rotations is None else rotations @ self.robot.tool_in_tip.rotation.T
        target = Target(self.screws, positions, turned, self.point)
        box, q = Box(*np.full((2, self.robot.dof), [[-np.inf], [np.inf]])), self.starts[0]
        travel, even = np.zeros_like(q), self.kept(every, one)
        for k in range(count):
            if self.is_still.any():
                box = Box(*(np.where(self.is_still, even[k], bound) for bound in (-np.inf, np.inf)))
                travel = np.where(self.is_still, even[k] - q, travel)
            _, (there,) = target.of(every[k : k + 1]).descend((q + travel)[None], box, STEADY)
            self.ends[k], travel, q = there, there - q, there
        self.ends, solved = self._solve(every, one, self.ends)
        if end is not None and np.abs(self.ends[-1] - end).max() < SAME_CONFIGURATION:
            self.ends[-1] = end
        self.starts[1:] = self.ends[:-1]
        return count if solved.all() else int(solved.argmin())
