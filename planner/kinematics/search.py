"""The search behind the inverse kinematics: one solution by descents from a table of starts, or all of many poses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin

from planner.kernels.descent import Box
from planner.kinematics.configurations import Configuration, in_configuration
from planner.kinematics.descent import Patience, Target, random_configurations, seed_table
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.screws import screws_of
from planner.kinematics.turns import TURN, distances, nearest_turn
from planner.robots import Robot
from planner.spatial import FloatArray, Pose, rotation_vector, rotation_vectors
from planner.tolerances import SAME_SOLUTION

QUICK_STARTS = 16
"""Number of starts from the table for a first solution, one after the other."""

QUICK = Patience(slow=2, most=30)
"""The patience of such descents: one that is slow is given up for the next."""

STEADY = Patience(slow=3, most=30)
"""The patience of descents of which many are made."""

POLISH = Patience(slow=300, most=300)
"""The patience of the descent to the nearest pose where none is reached, and convergence is slow."""

NO_STEP = Patience(slow=1, most=0)
"""The patience of a descent that ends where it starts."""

SEARCH_STARTS = 28
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

SINGULAR_JACOBIAN = 1e-6
"""Singular value of the Jacobian, m and rad alike, below which a solution is no isolated one."""


class Search:
    """The search for one pose, with its best result so far."""

    def __init__(self, robot: Robot, pose: Pose, options: InverseKinematicsOptions) -> None:
        self.robot, self.pose, self.options = robot, pose, options
        self.lower, self.upper = robot.limit("lower"), robot.limit("upper")
        self.best: tuple[float, FloatArray] = (np.inf, robot.middle)

    @cached_property
    def target(self) -> Target:
        """The pose as the target of descents; of many searches at once most need none of their own."""
        return targets([self])

    @property
    def box(self) -> Box:
        """The limits."""
        return Box(self.lower, self.upper)

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
        tolerance = min(self.options.tolerance_position, self.options.tolerance_orientation)
        found = self.solve_all(self.table_starts(QUICK_STARTS), QUICK, tolerance)
        found = found or search_all([self], self.robot.middle)[0]
        return found[0] if found else None

    def solve(self, start: FloatArray, patience: Patience) -> FloatArray | None:
        """Return the solution that a descent from `start` ends at."""
        return next(iter(self.solve_all(start[None], patience)), None)

    def solve_all(self, starts: FloatArray, patience: Patience, enough: float = -np.inf) -> list[FloatArray]:
        """Return the solutions that descents from `starts` (N, joints) end at; `enough`: none behind such an error."""
        errors, ends = self.target.descend(starts, self.box, patience, enough)
        self.remember(errors, ends)
        near = np.flatnonzero(errors <= self.options.tolerance_position + self.options.tolerance_orientation)
        return [ends[k] for k in near.tolist() if self.is_solved(float(errors[k]), ends[k])]

    def miss(self, q: FloatArray) -> float:
        """Return the norm of the error of the pose at `q`, m and rad alike."""
        return float(self.target.descend(q[None], self.box, NO_STEP)[0][0])

    def remember(self, errors: FloatArray, ends: FloatArray) -> None:
        """Keep what of the ends (N, joints) of descents comes nearest to the pose."""
        nearest = int(errors.argmin())
        if errors[nearest] < self.best[0]:
            self.best = float(errors[nearest]), ends[nearest]

    def is_solved(self, error: float, q: FloatArray) -> bool:
        """Return whether the tool is at the pose, within the tolerances, by an error of position and angle together."""
        tolerances = self.options.tolerance_position, self.options.tolerance_orientation
        return error <= min(tolerances) or (error <= sum(tolerances) and self.is_solution(q))

    def is_solution(self, q: FloatArray) -> bool:
        """Return whether the tool is at the pose, within the tolerances, by Pinocchio's forward kinematics."""
        distance, angle = pose_errors(self.pose, tool_pose(self.robot, q))
        within = distance <= self.options.tolerance_position
        return within and (angle is None or angle <= self.options.tolerance_orientation)

    def nearest(self) -> FloatArray:
        """Return the joint position of the nearest pose found."""
        if not np.isfinite(self.best[0]):
            self.solve_all(self.table_starts(NEAREST_STARTS), QUICK)
        _, (nearest,) = self.target.descend(self.best[1][None], self.box, POLISH)
        return np.asarray(nearest)

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

    The searches are of one robot and within the same limits. A closed form, if the arm has one, gives all candidates,
    so its isolated solutions are complete. Otherwise many descents run at once.
    """
    found: dict[Search, list[FloatArray]] = {}
    for free in (False, True):
        if group := [search for search in searches if (search.pose.rotation is None) == free]:
            found |= _by_closed_form(group, reference)
            continua = _in_continua([search for search in group if search in found], found)
            rest = [search for search in group if search not in found or search in continua]
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
    return search.solve_all(np.array(distinct), STEADY) if distinct else []


def is_isolated(robot: Robot, pose: Pose, position: FloatArray) -> bool:
    """Return whether no joint motion keeps the tool at its pose."""
    J = jacobian(robot, position)[: 3 if pose.rotation is None else 6]
    return bool(np.linalg.matrix_rank(J, tol=SINGULAR_JACOBIAN) == robot.dof)


def pose_errors(pose: Pose, reached: Pose) -> tuple[float, float | None]:
    """Return distance (m) and angle (rad) between the requested and reached pose; no angle without orientation."""
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
    requested, found = (np.array([pose.rotation for pose in group]) for group in (poses, reached))
    turns = rotation_vectors(found.transpose(0, 2, 1) @ requested)
    return list(zip(distances, np.sqrt((turns * turns).sum(axis=1)).tolist(), strict=True))


def _by_closed_form(group: list[Search], reference: FloatArray) -> dict[Search, list[FloatArray]]:
    """Find the solutions of each search by a closed form; no search has an entry if the arm has none."""
    robot, box, target = group[0].robot, group[0].box, targets(group)
    form = seed_table(robot).form(target)
    if form is None:
        return {}
    candidates = form(target.tips, target.rotations)
    there = np.isfinite(candidates).all(axis=2)
    rows, turned = np.nonzero(there)[0], nearest_turn(robot, candidates[there], reference)
    inside = np.minimum(np.maximum(turned, box.lower), box.upper)
    kept = np.asarray((np.abs(turned - inside) < BEYOND).all(axis=1))
    errors, ends = target.of(rows[kept]).descend(inside[kept], box, STEADY)
    of_search = np.searchsorted(rows[kept], np.arange(len(group) + 1)).tolist()
    found = {}
    for k, search in enumerate(group):
        own = slice(of_search[k], of_search[k + 1])
        pairs = zip(errors[own].tolist(), ends[own], strict=True)
        solutions = [q for error, q in pairs if search.is_solved(error, q)]
        if len(ends[own]):
            search.remember(errors[own], ends[own])
        # Without a solution that is the answer, unless a candidate is a singular one: others go with it.
        if solutions or not (len(ends[own]) or _are_singular(target, turned[rows == k]).any()):
            found[search] = _distinct(robot, solutions, SAME_SOLUTION)
    return found


def _by_descents(group: list[Search], reference: FloatArray, thorough: bool) -> dict[Search, list[FloatArray]]:
    """Find solutions by many descents, from the reference and from the table; where in doubt, again from more."""
    robot, first = group[0].robot, np.clip(reference, group[0].lower, group[0].upper)
    ends = _descend(group, [np.vstack([first, search.table_starts(SEARCH_STARTS)]) for search in group])
    if thorough and (doubtful := [search for search in group if _misses_some(search, ends[search])]):
        starts = [np.vstack([first, s.table_starts(MORE_STARTS), s.blind_starts(BLIND_STARTS)]) for s in doubtful]
        ends |= _descend(doubtful, starts)
    found = {}
    for search, reached in ends.items():
        distinct = _distinct(robot, list(nearest_turn(robot, reached, reference)), SAME_SOLUTION)
        if _in_continuum(search, distinct):
            distinct = _distinct(robot, distinct, SPREAD)[:MOST_SPREAD]
        found[search] = search.solve_all(np.array(distinct), STEADY) if distinct else []
    return found


def _misses_some(search: Search, reached: FloatArray) -> bool:
    """Tell whether solutions are probably missing: none, or one found by a single descent (Good 1953)."""
    if len(reached) == 0:
        return True
    near = distances(search.robot, reached[:, None], reached) < SAME_SOLUTION
    return bool((near.sum(axis=1) == 1).any()) and not _in_continuum(search, reached)


def _in_continuum(search: Search, solutions: Sequence[FloatArray] | FloatArray) -> bool:
    """Return whether at some solution the joints can move and the tool stay."""
    return len(solutions) > 0 and bool(_are_singular(search.target, np.array(solutions)).any())


def _in_continua(group: Sequence[Search], found: dict[Search, list[FloatArray]]) -> set[Search]:
    """Return the searches at some of whose solutions the joints can move and the tool stay."""
    solved = [search for search in group for _ in found[search]]
    if not solved:
        return set()
    singular = _are_singular(solved[0].target, np.array([q for search in group for q in found[search]]))
    return {solved[k] for k in np.flatnonzero(singular).tolist()}


def _are_singular(target: Target, positions: FloatArray) -> np.ndarray:
    """Return at which joint positions (N, joints) the joints can move and the tool, placed as the target's, stay."""
    singular: np.ndarray = np.full(len(positions), positions.shape[1] > target.rows)
    if singular.any() or not len(positions):
        return singular
    J = target.screws.reach(positions, target.point)[2][:, : target.rows]
    if J.shape[1] == J.shape[2]:  # the least singular value is no less than the determinant by a power of the norm
        norms = np.sqrt((J * J).sum(axis=(1, 2)))
        singular = np.abs(np.linalg.det(J)) < SINGULAR_JACOBIAN * norms ** (len(J[0]) - 1)
    else:
        singular[:] = True
    singular[singular] = np.linalg.svd(J[singular], compute_uv=False).min(axis=1) < SINGULAR_JACOBIAN
    return singular


def _descend(group: list[Search], starts: list[FloatArray]) -> dict[Search, FloatArray]:
    """Return joint positions at which descents from each search's starts reach its pose, in the order of the starts."""
    count, joints = starts[0].shape
    errors, ends = targets(group).descend(np.vstack(starts), group[0].box, STEADY)
    reached = {}
    for search, error, end in zip(group, errors.reshape(-1, count), ends.reshape(-1, count, joints), strict=True):
        search.remember(error, end)
        reached[search] = end[error <= max(search.options.tolerance_position, search.options.tolerance_orientation)]
    return reached


def targets(group: Sequence[Search]) -> Target:
    """Return where the searches, of one robot, are to bring the point of the tool, and with rotations the tip."""
    robot = group[0].robot
    positions, tool = np.array([search.pose.position for search in group]), robot.tool_in_tip
    turned = None
    if group[0].pose.rotation is not None:
        turned = np.array([search.pose.rotation for search in group]) @ tool.rotation.T
    return Target(screws_of(robot), positions, turned, tool.translation)


def _distinct(robot: Robot, positions: list[FloatArray], apart: float) -> list[FloatArray]:
    """Return joint positions without those closer in every joint to an earlier one, whole turns aside."""
    if not positions:
        return []
    near = distances(robot, np.array(positions)[:, None], np.array(positions)) < apart
    kept: list[int] = []
    for i in range(len(positions)):
        if not near[i, kept].any():
            kept.append(i)
    return [positions[i] for i in kept]
