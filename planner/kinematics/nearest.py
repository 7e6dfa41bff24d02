"""The solution nearest to a reference: by a closed form where the arm has one, along the continuum where there is one.

Nearest counts in time: the joints' distances are divided by their velocity limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.kinematics.configurations import keeps_configuration
from planner.kinematics.descent import seed_table
from planner.kinematics.forward import jacobian
from planner.kinematics.search import BEYOND, QUICK, STEADY, Search, search_all, targets
from planner.kinematics.turns import TURN, by_distance, counted_velocity, nearest_turn, travel_times, turns_within
from planner.spatial import FloatArray
from planner.tolerances import SAME_SOLUTION

JUMP = 0.5
"""Largest movement of a joint in a descent from the reference, rad or m, whose result counts as the nearest solution.

It applies to arms without a closed form for all isolated solutions.
"""

CLOSE_TO_POSE = 0.02
"""m and rad: where the reference misses the pose by more, no descent from it can prove that it found the nearest."""

CLOSE_TO_CONFIGURED_POSE = 0.3
"""m and rad: the same for arms whose solutions have named configurations."""

FAR = 1.0
"""m and rad: where the reference misses the pose by more, a descent from it rarely ends without a jump."""

CANDIDATE_ERROR = 0.05
"""rad or m, by which a descent from a candidate of a closed form may move a joint: most where two branches meet."""

NEARLY_SINGULAR = 1e-5
"""Magnitude of the Jacobian's determinant (m and rad alike) below which a candidate may belong to a continuum."""

NEARLY_FREE = 1e-5
"""Singular value of such a candidate's Jacobian below which one is looked for: candidates are as good as that."""

SAMPLES_ALONG = 9
"""Joint positions on the line that touches a continuum at a candidate, over two turns of the joint that moves most."""

FOLLOWED = 5
"""Starts, apart from each other, from which the nearest solution of a continuum is looked for at an isolated pose."""

FAMILIES = 2
"""The same for an arm that has a continuum of solutions for every pose."""

APART = 0.5
"""rad or m, in some joint, by which such starts differ."""

FURTHER = 1.2
"""A start that is as many times as far as the nearest solution so far is not followed."""

CONFIRMED = 1e-5
"""Error, m or rad, up to which a candidate that is not singular counts as a solution without a descent."""

MANY_POSES = 8
"""Number of poses above which finding all candidates together is faster."""


def nearest_solution(search: Search, reference: FloatArray) -> FloatArray | None:
    """Return the solution nearest to the reference (joints,); None if none is found.

    - For an arm with a closed form, all isolated solutions are compared, unless a descent finds one that is provably
      the nearest.
    - Of a continuum, the answer is a local minimum of the distance along the continuum. The search covers its nearest
      parts, which descents from a table find.
    - For any other arm, the answer is the result of a descent from the reference without a jump. If it jumps, the
      answer is the nearest result of descents from a table.
    """
    target = search.target
    form = None if search.robot.dof > search.rows else seed_table(search.robot).form(target)
    near = _near_by(search, reference, proved=form is not None)
    if near is not None:
        return near
    if form is not None:
        return _of_closed_form(search, form(target.tips, target.rotations)[0], reference)
    solutions = by_distance(search.robot, search_all([search], reference)[0], reference)
    return _along_continuum(search, np.array(solutions), reference, FAMILIES) if solutions else None


def _near_by(search: Search, reference: FloatArray, *, proved: bool) -> FloatArray | None:
    """Find the nearest solution by a descent, with proof or without a jump; None: not found."""
    start = np.minimum(np.maximum(reference, search.lower), search.upper)
    velocity = counted_velocity(search.robot.limit("velocity"))
    named = proved and search.rows == 6 and keeps_configuration(search.robot, reference, velocity, 0.0)
    if search.miss(start) > (CLOSE_TO_CONFIGURED_POSE if named else CLOSE_TO_POSE if proved else FAR):
        return None
    solution = search.solve(start, QUICK)
    if solution is None:
        return None
    if proved:
        time = float(travel_times(search.robot, solution, reference))
        # A nearer solution would be of another configuration, or a whole turn away.
        only = named and np.abs(solution - reference).max() < np.pi
        only = only and keeps_configuration(search.robot, reference, velocity, time)
        return solution if only or _is_only_one_near(search, solution, reference) else None
    return _slid(search, solution, reference) if np.abs(solution - reference).max() <= JUMP else None


def _of_closed_form(search: Search, candidates: FloatArray, reference: FloatArray) -> FloatArray | None:
    """Return the nearest of all isolated solutions, and of a continuum where there seems to be one."""
    starts = _within_limits(search, candidates[np.isfinite(candidates).all(axis=1)], reference)
    if not len(starts):
        return None
    best, least = None, np.inf
    slack = float(np.linalg.norm(CANDIDATE_ERROR / counted_velocity(search.robot.limit("velocity"))))
    times = travel_times(search.robot, starts, reference).tolist()
    for start, expected in zip(starts, times, strict=True):
        if expected > least + slack:
            break
        solution = search.solve(start, STEADY)
        if solution is None:
            continue
        if np.abs(solution - start).max() > SAME_SOLUTION:
            solution = nearest_turn(search.robot, solution, reference)
        time = float(travel_times(search.robot, solution, reference))
        if time < least:
            best, least = solution, time
    J = np.array([jacobian(search.robot, q)[: search.rows] for q in starts])
    singular = np.asarray(np.abs(np.linalg.det(J)) <= NEARLY_SINGULAR)
    if singular.any():
        singular[singular] = np.linalg.svd(J[singular], compute_uv=False)[:, -1] <= NEARLY_FREE
    if not singular.any():
        return best
    around = _touching(search, starts[singular], J[singular], reference)
    if best is not None:
        around = np.vstack([best, around])
    found = _along_continuum(search, around, reference, FOLLOWED)
    return best if found is None else found


def _touching(search: Search, starts: FloatArray, J: FloatArray, reference: FloatArray) -> FloatArray:
    """Return joint positions (N, joints) on tangents of continua at singular ones, nearest to the reference first."""
    free = np.linalg.svd(J)[2][:, -1]
    free = free / np.abs(free).max(axis=1, keepdims=True)
    line = np.linspace(-np.pi, np.pi, SAMPLES_ALONG)[:, None] * free[:, None]
    along = (starts[:, None] + line).reshape(-1, search.robot.dof)
    turned = np.clip(nearest_turn(search.robot, along, reference), search.lower, search.upper)
    return np.array(by_distance(search.robot, turned, reference))


def _within_limits(search: Search, candidates: FloatArray, reference: FloatArray) -> FloatArray:
    """Return candidates (N, joints) that keep the limits, turned to lie nearest to the reference, the nearest first."""
    turned = nearest_turn(search.robot, candidates, reference)
    inside = np.minimum(np.maximum(turned, search.lower), search.upper)
    inside = inside[(np.abs(turned - inside) < BEYOND).all(axis=1)]
    return inside[np.argsort(travel_times(search.robot, inside, reference), kind="stable")]


def _along_continuum(search: Search, starts: FloatArray, reference: FloatArray, most: int) -> FloatArray | None:
    """Give the nearest solution that is found along the continuum from some of the starts, which come nearest first."""
    best, least = None, np.inf
    followed: list[FloatArray] = []
    for start in starts:
        if len(followed) == most or float(travel_times(search.robot, start, reference)) > FURTHER * least:
            break
        if any(np.abs(start - other).max() < APART for other in followed):
            continue
        followed.append(start)
        solution = search.solve(start, STEADY)
        if solution is None:
            continue
        solution = _slid(search, nearest_turn(search.robot, solution, reference), reference)
        time = float(travel_times(search.robot, solution, reference))
        if time < least:
            best, least = solution, time
    return best


def _slid(search: Search, solution: FloatArray, reference: FloatArray) -> FloatArray:
    velocity = counted_velocity(search.robot.limit("velocity"))
    return search.target.slide(solution, reference, velocity, search.box)


def _is_only_one_near(search: Search, solution: FloatArray, reference: FloatArray) -> bool:
    """Prove that no other solution is as near to the reference.

    Let d be a motion from a solution. Column i of the position's Jacobian changes by at most sum_j H_ij |d_j|. Here
    H_ij is the largest lever of the later of two revolute joints, or 1 if the later one is prismatic. Axis i changes by
    the sum of |d_j| over the joints before it. So another solution needs J d = r. There |r| <= |d|^T H |d| / 2 for the
    position and |r| <= 3/4 (sum |d_i|)^2 for the rotation. In units of the time T = |d / v| that is 1 <= T (a h + b w).
    It uses the velocities v that define times and V = diag(v). Here h is the largest eigenvalue of V H V / 2, w = 3/4
    |v|^2, and a and b are the norms of V^-1 J^-1 for position and rotation. A nearer solution is no further than twice
    the time from the reference.
    """
    robot = search.robot
    v = counted_velocity(robot.limit("velocity"))
    J = jacobian(robot, solution)[: search.rows]
    levers = seed_table(robot).levers + float(np.linalg.norm(robot.tool_in_tip.translation))
    if abs(np.linalg.det(J)) <= NEARLY_SINGULAR or not np.isfinite(levers).all():
        return False
    inverse = np.linalg.inv(J) / v[:, None]
    H = np.where(robot.is_angle, levers, 1.0)[np.maximum.outer(range(robot.dof), range(robot.dof))]
    h = float(np.linalg.eigvalsh(v[:, None] * H * v)[-1]) / 2.0
    w = 0.75 * float(v[robot.is_angle] @ v[robot.is_angle])
    bend = float(np.linalg.norm(inverse[:, :3])) * h + float(np.linalg.norm(inverse[:, 3:])) * w
    return bool(2.0 * float(travel_times(robot, solution, reference)) * bend < 1.0)


def nearest_in_turn(searches: Sequence[Search], reference: FloatArray | None) -> list[FloatArray | None]:
    """Find for each search the solution nearest to the solution before; None: not found.

    The results equal `nearest_solution`, one after the other; if one fails, its reference serves the next. Of
    an arm with a closed form the candidates of all poses are found and checked together, and the chosen ones polished.

    Args:
        searches: They are of one robot, and all with a rotation or all without one.
        reference: (joints,), of the first; None: the first solution found is its answer.
    """
    solutions: list[FloatArray | None] = []
    together = _Together(searches) if len(searches) >= MANY_POSES else None
    chosen: list[int] = []
    for k, search in enumerate(searches):
        if reference is None:
            solution = search.first()
        elif together is not None and (candidate := together.nearest(k, reference)) is not None:
            chosen.append(k)
            solution = candidate
        else:
            solution = nearest_solution(search, reference)
        solutions.append(solution)
        reference = reference if solution is None else solution
    if together is not None and chosen:
        candidates = np.array([solutions[k] for k in chosen])
        for k, solution in zip(chosen, together.polished(np.array(chosen), candidates), strict=True):
            solutions[k] = solution
    return solutions


class _Together:
    """The candidates of many poses at once, by the closed form of their arm.

    Attributes:
        plain: (N,), bool: whether every candidate of a pose solves it, and none is nearly singular.
        candidates: (N, most, joints).
        outside: (N, most): infinite for entries that are no candidates within the limits, else 0.
    """

    def __init__(self, searches: Sequence[Search]) -> None:
        self.searches, self.target, self.robot = searches, targets(searches), searches[0].robot
        self.lower, self.upper = searches[0].lower, searches[0].upper
        self.table = seed_table(self.robot)
        self.plain: np.ndarray = np.zeros(len(searches), dtype=bool)
        form = None if self.robot.dof > searches[0].rows else self.table.form(self.target)
        if form is None:
            return
        candidates = form(self.target.tips, self.target.rotations)
        there = np.asarray(np.isfinite(candidates).all(axis=2))
        poses = np.nonzero(there)[0]
        missing, J = self.target.of(poses).missing(candidates[there])
        wrong = np.asarray(np.abs(missing).max(axis=1) > CONFIRMED)
        singular = np.asarray(np.abs(np.linalg.det(J)) <= NEARLY_SINGULAR)
        irregular = poses[np.flatnonzero(wrong | singular)]
        self.candidates = np.where(there[..., None], candidates, 0.0)
        self.fewest, self.most = turns_within(self.robot, self.candidates)
        turned = self.candidates + TURN * self.fewest
        within = (self.fewest <= self.most) & (turned >= self.lower) & (turned <= self.upper)
        self.outside = np.where(there & within.all(axis=2), 0.0, np.inf)
        self.plain = np.asarray(np.isfinite(self.outside).any(axis=1))
        self.plain[irregular] = False
        self.rates = 1.0 / counted_velocity(self.robot.limit("velocity"))
        self.ones = np.ones(self.robot.dof)

    def nearest(self, k: int, reference: FloatArray) -> FloatArray | None:
        """Give the candidate (joints,) of pose k that is nearest to the reference; None where a search has to tell."""
        if not self.plain[k]:
            return None
        away = self.candidates[k] - reference
        away += TURN * np.minimum(np.maximum(np.rint(away / -TURN), self.fewest[k]), self.most[k])
        times = away * self.rates
        times *= times
        nearest: FloatArray = reference + away[(times @ self.ones + self.outside[k]).argmin()]
        return nearest

    def polished(self, rows: np.ndarray, candidates: FloatArray) -> Iterator[FloatArray | None]:
        """Return the solutions (joints,) that belong to candidates (N, joints) of the poses `rows`."""
        errors, ends = self.target.of(rows).descend(candidates, self.searches[0].box, STEADY)
        confirmed = np.maximum(errors, np.abs(ends - candidates).max(axis=1)) <= CONFIRMED
        for k, candidate, end, is_near in zip(rows.tolist(), candidates, ends, confirmed.tolist(), strict=True):
            yield end if is_near else nearest_solution(self.searches[k], candidate)
