"""Inverse kinematics: Levenberg-Marquardt within the position limits, from starts that a table of poses suggests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import pinocchio as pin

from planner.kinematics.descent import Descent
from planner.kinematics.forward import jacobian, manipulability, tool_pose
from planner.kinematics.seeds import random_configurations, seed_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics.poses import FloatArray, Pose
    from planner.problem import InverseKinematicsOptions
    from planner.robots import Robot

Status = Literal["solved", "unreachable_waypoint", "joint_position_limit"]

QUICK = {"patience": 2, "iterations": 30}
"""How a descent for a first solution goes; one that is slow is given up for the next start."""

STEADY = {"patience": 3, "iterations": 30}
"""How a descent for all solutions goes."""

THOROUGH = {"patience": 8, "iterations": 60}
"""How a descent goes where quick ones have found nothing."""

POLISH = {"patience": 300, "iterations": 300}
"""How the nearest pose is approached where none is reached, and convergence is slow."""

QUICK_STARTS, THOROUGH_STARTS, BLIND_STARTS = 16, 64, 16
"""Starts from the table for a first solution; for another attempt; and random ones."""

POOL, QUIET = 512, 40
"""Starts among which all solutions are sought, and after how many without a new one the search ends."""

NEAR = 0.4
"""rad or m in every joint: starts as close as this to a solution, or to one another, would find the same."""

TWINS, AHEAD = 2, 1e-4
"""Singular values behind whose singularity another branch is sought; and the step of the difference quotient, rad."""

SAME_SOLUTION = 1e-4
"""Isolated solutions closer than this in every joint (rad, whole turns apart; m) are one."""

SPREAD, MOST_SPREAD = 0.3, 16
"""Of a continuum: how far solutions are apart at least in one joint, rad or m, and how many are given."""

JUMP = 0.5
"""rad or m: a descent from the reference that moves no joint by more has found the solution that goes with it."""

TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class InverseKinematicsResult:
    """What was found for one pose.

    Attributes:
        status: `solved`, or why not.
        position: (joints,): the solution, or the joint position of the nearest pose found.
        pose: Of the tool at `position`, by forward kinematics.
        position_error: Distance of `pose` from the pose asked, m.
        orientation_error: Angle between them, rad; None: no orientation was asked.
        manipulability: At `position`.
        joint: With `joint_position_limit`: the joint that would have to leave its limits.
        value: With `joint_position_limit`: where that joint would have to be, rad or m.
    """

    status: Status
    position: FloatArray
    pose: Pose
    position_error: float
    orientation_error: float | None
    manipulability: float
    joint: str | None = None
    value: float | None = None


def inverse_kinematics(
    robot: Robot, pose: Pose, options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> InverseKinematicsResult:
    """Solve for a joint position that brings the tool to `pose`; with a reference, for the one nearest to it.

    Nearest counts in time: the joints' distances are divided by their velocity limits. What a descent from the
    reference reaches without a jump is taken as the nearest, else all solutions are compared. The answer is verified
    by forward kinematics and depends on nothing but the arguments.

    Args:
        robot: With its tool.
        pose: In the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,); None: `options.reference`. Without either the first solution found is returned.
    """
    search = _Search(robot, pose, options)
    if reference is None and options.reference is not None:
        reference = np.array(options.reference)
    solution = search.first() if reference is None else search.nearest(reference)
    return search.failure() if solution is None else _result(robot, pose, solution, "solved")


def all_solutions(
    robot: Robot, pose: Pose, options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> tuple[FloatArray, ...]:
    """All isolated solutions within the limits, nearest to the reference first; of a continuum, a spread of some.

    Configurations that differ by whole turns of joints count once, turned to lie nearest to the reference.

    Args:
        robot: With its tool.
        pose: In the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,); None: `options.reference`, or the middle of the limits.
    """
    if reference is None:
        reference = robot.middle if options.reference is None else np.array(options.reference)
    return tuple(_by_distance(robot, _Search(robot, pose, options).all(reference), reference))


def solutions_or_failure(
    robot: Robot, pose: Pose, options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> tuple[FloatArray, ...] | InverseKinematicsResult:
    """`all_solutions`, or why there is none and the nearest pose found; one search for both."""
    if reference is None:
        reference = robot.middle if options.reference is None else np.array(options.reference)
    search = _Search(robot, pose, options)
    solutions = search.all(reference)
    return tuple(_by_distance(robot, solutions, reference)) if solutions else search.failure()


def solution_layers(
    robot: Robot, poses: Sequence[Pose], options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> list[tuple[FloatArray, ...]]:
    """`all_solutions` of many poses at once; of an unreachable one an empty tuple."""
    return [all_solutions(robot, pose, options, reference) for pose in poses]


def with_whole_turns(
    robot: Robot, solutions: tuple[FloatArray, ...], reference: FloatArray, most: int
) -> tuple[FloatArray, ...]:
    """The solutions and what whole turns of their joints make of them within finite limits.

    Nearest to the reference first; of more than `most`, the nearest.
    """
    lower, upper = robot.limit("lower"), robot.limit("upper")
    turned = []
    for solution in solutions:
        variants = _nearest_turn(robot, solution, reference)[None]
        for joint in np.flatnonzero(robot.is_angle & np.isfinite(upper - lower)):
            turns = np.arange(-most, most + 1)
            values = variants[0, joint] + TURN * turns
            values = values[(values >= lower[joint] - 1e-12) & (values <= upper[joint] + 1e-12)]
            variants = np.repeat(variants, len(values), axis=0)
            variants[:, joint] = np.tile(values, len(variants) // len(values))
            # The distance is a sum over the joints: what is far already does not come near again.
            variants = np.array(_by_distance(robot, variants, reference)[:most])
        turned += list(np.clip(variants, lower, upper))
    return tuple(_by_distance(robot, turned, reference)[:most])


def is_isolated(robot: Robot, pose: Pose, position: FloatArray) -> bool:
    """Whether no motion of the joints leaves the tool where it is asked to be."""
    J = jacobian(robot, position)[: 3 if pose.rotation is None else 6]
    return bool(np.linalg.matrix_rank(J, tol=1e-6) == robot.dof)


class _Search:
    """The search for one pose: what is tried, and the best of it."""

    def __init__(self, robot: Robot, pose: Pose, options: InverseKinematicsOptions) -> None:
        self.robot, self.pose, self.options = robot, pose, options
        self.lower, self.upper = robot.limit("lower"), robot.limit("upper")
        self.descend = Descent(robot, pose)
        self.best: tuple[float, FloatArray] = (np.inf, robot.middle)

    def first(self) -> FloatArray | None:
        """The first solution found."""
        for start in self._table_starts(QUICK_STARTS):
            if (solution := self._solve(start, **QUICK)) is not None:
                return solution
        for start in np.vstack([self._table_starts(THOROUGH_STARTS), self._blind_starts()]):
            if (solution := self._solve(start, **THOROUGH)) is not None:
                return solution
        return None

    def nearest(self, reference: FloatArray) -> FloatArray | None:
        """The solution nearest to the reference."""
        solution = self._solve(np.clip(reference, self.lower, self.upper), **QUICK)
        if solution is not None and np.abs(solution - reference).max() <= JUMP:
            return solution
        solutions = self.all(reference)
        return _by_distance(self.robot, solutions, reference)[0] if solutions else None

    def all(self, reference: FloatArray) -> list[FloatArray]:
        """Isolated solutions, or a spread of a continuum, turned to lie nearest to the reference.

        Starts near what is known are left out: they would find it again. The search ends when many starts in
        different places have found nothing new.
        """
        first = self._solve(np.clip(reference, self.lower, self.upper), **QUICK)
        if first is None and (first := self.first()) is None:
            return []
        isolated = is_isolated(self.robot, self.pose, first)
        apart = SAME_SOLUTION if isolated else SPREAD
        solutions = [first]
        pool = self._away_from(first, self._table_starts(POOL))
        twins = self._twins(first) if isolated else []
        quiet = 0
        while quiet < QUIET and len(twins) + len(pool) and (isolated or len(solutions) < MOST_SPREAD):
            if twins:
                start = twins.pop()
            else:
                start = pool[0]
                pool = self._away_from(start, pool)
            solution = self._solve(start, **STEADY)
            quiet += 1
            if solution is None or any(_distance(self.robot, solution, known) < apart for known in solutions):
                continue
            quiet = 0
            solutions.append(solution)
            twins += self._twins(solution) if isolated else []
            pool = self._away_from(solution, pool)
        return [_nearest_turn(self.robot, solution, reference) for solution in solutions]

    def failure(self) -> InverseKinematicsResult:
        """Why there is no solution, and the nearest pose found."""
        beyond = self._beyond_the_limits()
        _, nearest = self.descend(self.best[1], self.lower, self.upper, **POLISH)
        if beyond is None:
            return _result(self.robot, self.pose, nearest, "unreachable_waypoint")
        joint = int(np.argmax(np.maximum(self.lower - beyond, beyond - self.upper)))
        name, value = self.robot.joint_names[joint], float(beyond[joint])
        return _result(self.robot, self.pose, nearest, "joint_position_limit", name, value)

    def _solve(self, start: FloatArray, patience: int, iterations: int) -> FloatArray | None:
        error, q = self.descend(start, self.lower, self.upper, patience, iterations)
        if error < self.best[0]:
            self.best = error, q
        return q if self._is_solution(q) else None

    def _is_solution(self, q: FloatArray) -> bool:
        distance, angle = pose_errors(self.pose, tool_pose(self.robot, q))
        within = distance <= self.options.tolerance_position
        return within and (angle is None or angle <= self.options.tolerance_orientation)

    def _table_starts(self, count: int) -> FloatArray:
        table, tool = seed_table(self.robot), self.robot.tool_in_tip
        if self.pose.rotation is None:
            return table.starts_at(self.pose.position, tool.translation, count)
        return table.starts(pin.SE3(self.pose.rotation, self.pose.position) * tool.inverse(), count)

    def _blind_starts(self) -> FloatArray:
        return random_configurations(self.robot, BLIND_STARTS, self.options.seed)

    def _away_from(self, solution: FloatArray, starts: FloatArray) -> FloatArray:
        away: FloatArray = starts[np.abs(_difference(self.robot, starts, solution)).max(axis=1) > NEAR]
        return away

    def _twins(self, solution: FloatArray) -> list[FloatArray]:
        """Where other solutions may be; starts, no more.

        Two branches meet at a singularity. From a solution q, along the direction v of a small singular value s of
        the Jacobian, the error grows like s t + h t^2 / 2 (h: how that value changes along v), so that the
        other branch lies near t = -2 s / h. And a spherical wrist in the last three joints can be flipped.
        """
        rows = 3 if self.pose.rotation is None else 6
        u, values, vt = np.linalg.svd(jacobian(self.robot, solution)[:rows], full_matrices=False)
        starts = []
        for s, left, v in zip(values[::-1][:TWINS], u.T[::-1], vt[::-1], strict=False):
            ahead = jacobian(self.robot, solution + AHEAD * v)[:rows]
            h = float(left @ (ahead @ v) - s) / AHEAD
            if abs(h) * np.pi > 2.0 * s:
                starts.append(solution - (2.0 * s / h) * v)
        if self.robot.dof == 6 and self.robot.is_angle[3:].all() and self.pose.rotation is not None:
            starts.append(solution + np.array([0.0, 0.0, 0.0, np.pi, -2.0 * solution[4], np.pi]))
        turned = [_nearest_turn(self.robot, start, self.robot.middle) for start in starts]
        return [np.clip(start, self.lower, self.upper) for start in turned]

    def _beyond_the_limits(self) -> FloatArray | None:
        """The solution that leaves the limits least, whole turns apart; None: not even without limits is there one."""
        if not (np.isfinite(self.lower).any() or np.isfinite(self.upper).any()):
            return None
        unlimited = np.full(self.robot.dof, np.inf)
        found = []
        for start in np.vstack([self._table_starts(QUICK_STARTS), self._blind_starts()]):
            _, q = self.descend(start, -unlimited, unlimited, **THOROUGH)
            if self._is_solution(q):
                centre = np.clip(q, self.lower, self.upper)
                turned = np.where(self.robot.is_angle, q + TURN * np.round((centre - q) / TURN), q)
                excess = np.maximum(self.lower - turned, turned - self.upper).max()
                found.append((float(excess), turned))
        return min(found, key=lambda pair: pair[0])[1] if found else None


def pose_errors(pose: Pose, reached: Pose) -> tuple[float, float | None]:
    """Distance (m) and angle (rad) between the pose asked and the one reached; no angle if none was asked."""
    distance = float(np.linalg.norm(pose.position - reached.position))
    if pose.rotation is None or reached.rotation is None:
        return distance, None
    return distance, float(np.linalg.norm(pin.log3(reached.rotation.T @ pose.rotation)))


def _result(
    robot: Robot, pose: Pose, q: FloatArray, status: Status, joint: str | None = None, value: float | None = None
) -> InverseKinematicsResult:
    reached = tool_pose(robot, q)
    distance, angle = pose_errors(pose, reached)
    measure = float(manipulability(robot, q[None])[0])
    return InverseKinematicsResult(status, q, reached, distance, angle, measure, joint, value)


def _by_distance(robot: Robot, solutions: Sequence[FloatArray] | FloatArray, reference: FloatArray) -> list[FloatArray]:
    """Nearest to the reference first, in time at the velocity limits."""
    if len(solutions) == 0:
        return []
    velocity = robot.limit("velocity")
    weights = 1.0 / np.where(np.isfinite(velocity), velocity, 1.0)
    times = np.linalg.norm((np.array(solutions) - reference) * weights, axis=1)
    return [solutions[i] for i in np.argsort(times, kind="stable")]


def _nearest_turn(robot: Robot, q: FloatArray, reference: FloatArray) -> FloatArray:
    """The same configuration with every angle turned by whole turns to lie nearest to `reference`, within limits."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    turns = np.round((reference - q) / TURN)
    with np.errstate(invalid="ignore"):
        fewest, most = np.ceil((lower - q) / TURN - 1e-12), np.floor((upper - q) / TURN + 1e-12)
    turned = q + TURN * np.clip(turns, fewest, most)
    return np.where(robot.is_angle, np.clip(turned, lower, upper), q)


def _difference(robot: Robot, positions: FloatArray, other: FloatArray) -> FloatArray:
    """(..., joints), of angles less than half a turn."""
    difference: FloatArray = positions - other
    difference -= np.where(robot.is_angle, TURN * np.round(difference / TURN), 0.0)
    return difference


def _distance(robot: Robot, q: FloatArray, other: FloatArray) -> float:
    return float(np.abs(_difference(robot, q, other)).max())
