"""The search behind the inverse kinematics: one solution by descents from a table of starts, or all of many poses."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.kinematics.configurations import Configuration, in_configuration
from planner.kinematics.descent import Descent, Target, descend_many
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.seeds import random_configurations, seed_table
from planner.kinematics.turns import TURN, distances, nearest_turn
from planner.spatial import rotation_vector, rotation_vectors
from planner.tolerances import SAME_SOLUTION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics.options import InverseKinematicsOptions
    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

QUICK_STARTS = 16
"""Number of starts from the table for a first solution, one after the other."""

QUICK = {"patience": 2, "most": 30}
"""Options of such descents: one that is slow is given up for the next."""

STEADY = {"patience": 3, "most": 30}
"""Options of descents of which many are made."""

POLISH = {"patience": 300, "most": 300}
"""Options of the descent to the nearest pose where none is reached, and convergence is slow."""

STARTS = 28
"""Number of starts from the table for all solutions."""

MORE_STARTS = 256
"""Number of starts from the table where some solutions may be missed."""

BLIND_STARTS = 16
"""Number of random starts besides those."""

NEAREST_STARTS = 6
"""Number of starts from the table for the nearest pose to one that is out of reach."""

SPREAD = 0.3
"""Least difference in some joint, rad or m, of solutions that are given of a continuum."""

MOST_SPREAD = 16
"""Number of solutions that are given of a continuum at most."""

BEYOND = 1e-3
"""rad or m, by which a candidate may leave the limits: polishing brings it back, or not."""

SINGULAR = 1e-6
"""Singular value of the Jacobian, m and rad alike, below which a solution is no isolated one."""


class Search:
    """The search for one pose, and the best of what it has tried."""

    def __init__(self, robot: Robot, pose: Pose, options: InverseKinematicsOptions) -> None:
        self.robot, self.pose, self.options = robot, pose, options
        self.lower, self.upper = robot.limit("lower"), robot.limit("upper")
        self.best: tuple[float, FloatArray] = (np.inf, robot.middle)

    @cached_property
    def descend(self) -> Descent:
        """Descents to the pose; of many searches at once most need none of their own."""
        return Descent(self.robot, self.pose)

    @property
    def rows(self) -> int:
        """Number of equations that the pose sets: 6, or 3 where any orientation will do."""
        return 3 if self.pose.rotation is None else 6

    @property
    def tip(self) -> pin.SE3:
        """The placement that the tip frame is to have; only of a pose with a rotation."""
        return pin.SE3(self.pose.rotation, self.pose.position) * self.robot.tool_in_tip.inverse()

    def first(self) -> FloatArray | None:
        """Return the first solution found."""
        for start in self.table_starts(QUICK_STARTS):
            if (solution := self.solve(start, **QUICK)) is not None:
                return solution
        solutions = search_all([self], self.robot.middle)[0]
        return solutions[0] if solutions else None

    def solve(self, start: FloatArray, patience: int, most: int) -> FloatArray | None:
        """Return the solution that a descent from `start` ends at."""
        error, q = self.descend(start, self.lower, self.upper, patience, most)
        self.remember(error, q)
        # The error is Pinocchio's, of position and angle together: within both tolerances there is no more to check.
        within = error <= min(self.options.tolerance_position, self.options.tolerance_orientation)
        return q if within or self.is_solution(q) else None

    def remember(self, error: float, q: FloatArray) -> None:
        """Keep what comes nearest to the pose."""
        if error < self.best[0]:
            self.best = error, q

    def is_solution(self, q: FloatArray) -> bool:
        """Whether the tool is at the pose, within the tolerances, by Pinocchio's forward kinematics."""
        distance, angle = pose_errors(self.pose, tool_pose(self.robot, q))
        within = distance <= self.options.tolerance_position
        return within and (angle is None or angle <= self.options.tolerance_orientation)

    def nearest(self) -> FloatArray:
        """Return the joint position of the nearest pose found."""
        if not np.isfinite(self.best[0]):
            for start in self.table_starts(NEAREST_STARTS):
                self.solve(start, **QUICK)
        return self.descend(self.best[1], self.lower, self.upper, **POLISH)[1]

    def beyond_the_limits(self, wanted: Configuration = Configuration()) -> FloatArray | None:
        """Return the solution in a configuration that leaves the limits least, whole turns apart.

        Returns:
            None: not even without limits is there one.
        """
        if not (np.isfinite(self.lower).any() or np.isfinite(self.upper).any()):
            return None
        unlimited = Search(self.robot, self.pose, self.options)
        unlimited.lower, unlimited.upper = np.full((2, self.robot.dof), [[-np.inf], [np.inf]])
        solutions = search_all([unlimited], self.robot.middle, thorough=False)[0]
        solutions = list(in_configuration(self.robot, solutions, wanted))
        if not solutions:
            return None
        q = np.array(solutions)
        inside = np.clip(q, self.lower, self.upper)
        turned = np.where(self.robot.is_angle, q + TURN * np.round((inside - q) / TURN), q)
        excess = np.maximum(self.lower - turned, turned - self.upper).max(axis=1)
        least: FloatArray = turned[excess.argmin()]
        return least

    def table_starts(self, count: int) -> FloatArray:
        """Return starts (count, joints) from the table, the most promising first."""
        table = seed_table(self.robot)
        if self.pose.rotation is None:
            return table.starts_at(self.pose.position, self.robot.tool_in_tip.translation, count)
        return table.starts(self.tip, count)

    def blind_starts(self, count: int) -> FloatArray:
        """Return starts (count, joints) at random, by the seed of the options."""
        return random_configurations(self.robot, count, self.options.seed)


def search_all(searches: Sequence[Search], reference: FloatArray, *, thorough: bool = True) -> list[list[FloatArray]]:
    """Find for every search all isolated solutions, or a spread of a continuum, turned to lie nearest to the reference.

    The searches are of one robot and within the same limits. A closed form, where the arm has one, gives all
    candidates; what is found that way and is isolated is all there is. Else many descents are run at once.
    """
    found: dict[Search, list[FloatArray]] = {}
    for free in (False, True):
        if group := [search for search in searches if (search.pose.rotation is None) == free]:
            found |= _by_closed_form(group, reference)
            rest = [search for search in group if search not in found or _in_continuum(search, found[search])]
            for search, spread in _by_descents(rest, reference, thorough).items() if rest else ():
                known = found.get(search, [])
                far = [q for q in spread if all(distances(search.robot, q, other) >= SPREAD for other in known)]
                found[search] = known + far
    return [found[search] for search in searches]


def wide_spread(search: Search) -> list[FloatArray]:
    """Return a wider spread of a continuum than `search_all` gives, from many descents: 20 ms of computing."""
    starts = np.vstack([search.table_starts(MORE_STARTS), search.blind_starts(MORE_STARTS)])
    reached = _descend([search], [starts])[search]
    distinct = _distinct(search.robot, list(nearest_turn(search.robot, reached, search.robot.middle)), SPREAD)
    return [q for end in distinct if (q := search.solve(end, **STEADY)) is not None]


def is_isolated(robot: Robot, pose: Pose, position: FloatArray) -> bool:
    """Whether no motion of the joints leaves the tool where it is asked to be."""
    J = jacobian(robot, position)[: 3 if pose.rotation is None else 6]
    return bool(np.linalg.matrix_rank(J, tol=SINGULAR) == robot.dof)


def pose_errors(pose: Pose, reached: Pose) -> tuple[float, float | None]:
    """Distance (m) and angle (rad) between the pose asked and the one reached; no angle if none was asked."""
    distance = float(np.linalg.norm(pose.position - reached.position))
    if pose.rotation is None or reached.rotation is None:
        return distance, None
    return distance, float(np.linalg.norm(rotation_vector(reached.rotation.T @ pose.rotation)))


def errors_of_many(poses: Sequence[Pose], reached: Sequence[Pose]) -> list[tuple[float, float | None]]:
    """Return the `pose_errors` of many poses, all with a rotation or all without one, in a few array operations."""
    away = np.array([pose.position for pose in poses]) - np.array([pose.position for pose in reached])
    distances: list[float] = np.sqrt((away * away).sum(axis=1)).tolist()
    if poses[0].rotation is None:
        return [(distance, None) for distance in distances]
    asked, found = (np.array([pose.rotation for pose in group]) for group in (poses, reached))
    turns = rotation_vectors(found.transpose(0, 2, 1) @ asked)
    return list(zip(distances, np.sqrt((turns * turns).sum(axis=1)).tolist(), strict=True))


def _by_closed_form(group: list[Search], reference: FloatArray) -> dict[Search, list[FloatArray]]:
    """Find the solutions of each search by a closed form; no search has an entry if the arm has none."""
    robot, target = group[0].robot, targets(group)
    form = seed_table(robot).form(target)
    if form is None:
        return {}
    found = {}
    for search, candidates in zip(group, form(target.positions, target.rotations), strict=True):
        turned = nearest_turn(robot, candidates[np.isfinite(candidates).all(axis=1)], reference)
        inside = np.minimum(np.maximum(turned, search.lower), search.upper)
        starts = inside[(np.abs(turned - inside) < BEYOND).all(axis=1)]
        solutions = [q for start in starts if (q := search.solve(start, **STEADY)) is not None]
        # Without a solution that is the answer, unless a candidate is a singular one: others go with it.
        if solutions or not (len(starts) or _in_continuum(search, turned)):
            found[search] = _distinct(robot, solutions, SAME_SOLUTION)
    return found


def _by_descents(group: list[Search], reference: FloatArray, thorough: bool) -> dict[Search, list[FloatArray]]:
    """Find solutions by many descents, from the reference and from the table; where in doubt, again from more."""
    robot, first = group[0].robot, np.clip(reference, group[0].lower, group[0].upper)
    ends = _descend(group, [np.vstack([first, search.table_starts(STARTS)]) for search in group])
    if thorough and (doubtful := [search for search in group if _misses_some(search, ends[search])]):
        starts = [np.vstack([first, s.table_starts(MORE_STARTS), s.blind_starts(BLIND_STARTS)]) for s in doubtful]
        ends |= _descend(doubtful, starts)
    found = {}
    for search, reached in ends.items():
        distinct = _distinct(robot, list(nearest_turn(robot, reached, reference)), SAME_SOLUTION)
        if _in_continuum(search, distinct):
            distinct = _distinct(robot, distinct, SPREAD)[:MOST_SPREAD]
        found[search] = [q for end in distinct if (q := search.solve(end, **STEADY)) is not None]
    return found


def _misses_some(search: Search, reached: FloatArray) -> bool:
    """Whether nothing was reached, or a solution by one descent only: then others are likely unseen (Good 1953)."""
    if len(reached) == 0:
        return True
    near = distances(search.robot, reached[:, None], reached) < SAME_SOLUTION
    return bool((near.sum(axis=1) == 1).any()) and not _in_continuum(search, reached)


def _in_continuum(search: Search, solutions: Sequence[FloatArray] | FloatArray) -> bool:
    """Whether at some solution the joints can move and the tool stay."""
    rows = search.rows
    if len(solutions) == 0 or search.robot.dof > rows:
        return len(solutions) > 0
    J = np.array([jacobian(search.robot, q)[:rows] for q in solutions])
    return bool(np.linalg.svd(J, compute_uv=False).min() < SINGULAR)


def _descend(group: list[Search], starts: list[FloatArray]) -> dict[Search, FloatArray]:
    """Return joint positions at which descents from each search's starts reach its pose, in the order of the starts."""
    (count, joints), lower, upper = starts[0].shape, group[0].lower, group[0].upper
    target, screws = targets(group).repeated(count), seed_table(group[0].robot).screws
    errors, ends = descend_many(screws, target, np.vstack(starts), lower, upper, **STEADY)
    reached = {}
    for search, error, end in zip(group, errors.reshape(-1, count), ends.reshape(-1, count, joints), strict=True):
        search.remember(error.min(), end[error.argmin()])
        reached[search] = end[error <= max(search.options.tolerance_position, search.options.tolerance_orientation)]
    return reached


def targets(group: Sequence[Search]) -> Target:
    """Return where the searches are to bring the tip; without rotations, the tool's point."""
    tool = group[0].robot.tool_in_tip
    if group[0].pose.rotation is None:
        return Target(np.array([search.pose.position for search in group]), None, tool.translation)
    turned = np.array([search.pose.rotation for search in group]) @ tool.rotation.T
    return Target(np.array([search.pose.position for search in group]) - turned @ tool.translation, turned, np.zeros(3))


def _distinct(robot: Robot, positions: list[FloatArray], apart: float) -> list[FloatArray]:
    """Without those that are closer in every joint to one before, whole turns aside."""
    if not positions:
        return []
    near = distances(robot, np.array(positions)[:, None], np.array(positions)) < apart
    kept: list[int] = []
    for i in range(len(positions)):
        if not near[i, kept].any():
            kept.append(i)
    return [positions[i] for i in kept]
