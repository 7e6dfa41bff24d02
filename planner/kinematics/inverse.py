"""Inverse kinematics: Levenberg-Marquardt on Pinocchio's Jacobian, within the position limits, from many starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import pinocchio as pin

from planner.kinematics.forward import jacobian, manipulability, tool_pose

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray, Pose
    from planner.problem import InverseKinematicsOptions
    from planner.robots import Robot

Status = Literal["solved", "unreachable_waypoint", "joint_position_limit"]

STARTS, MOST_STARTS = 24, 128
"""Starts of the search for solutions: at least, and at most while there is reason to expect more."""

ITERATIONS = 60
"""Steps of one descent; a start that needs more is a bad one."""

CONVERGED = 1e-12
"""A descent ends when the error (m, rad) is as small as this: rounding is all that is left."""

SAME_SOLUTION = 1e-4
"""Solutions closer than this in every joint (rad, whole turns apart; m) are one."""

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
        solutions: How many isolated solutions were found; None: there is a continuum of them, or none.
        manipulability: At `position`.
        joint: With `joint_position_limit`: the joint that would have to leave its limits.
        value: With `joint_position_limit`: where that joint would have to be, rad or m.
    """

    status: Status
    position: FloatArray
    pose: Pose
    position_error: float
    orientation_error: float | None
    solutions: int | None
    manipulability: float
    joint: str | None = None
    value: float | None = None


def inverse_kinematics(
    robot: Robot, pose: Pose, options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> InverseKinematicsResult:
    """Solve for the joint position nearest to `reference` that brings the tool to `pose`.

    Nearest counts in time: the joints' distances are divided by their velocity limits. The answer is verified
    by forward kinematics and depends on nothing but the arguments.

    The search goes on while a solution has been found only once: by Good's estimate (1953) the chance that the
    next start finds a new one is the share of starts that found what no other has.

    Args:
        robot: With its tool.
        pose: In the base frame; without a rotation, the position alone counts.
        options: Tolerances and seed.
        reference: (joints,); None: `options.reference`, or the middle of the limits.
    """
    if reference is None:
        reference = robot.middle if options.reference is None else np.array(options.reference)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    starts = _starts(robot, reference, options.seed)
    solutions: list[FloatArray] = []
    found: list[int] = []
    best = (np.inf, reference)
    for i, start in enumerate(starts):
        if i >= STARTS and solutions and (1 not in found or not _is_isolated(robot, pose, solutions[0])):
            break
        error, q = _descend(robot, pose, start, lower, upper)
        best = min(best, (error, q), key=lambda pair: pair[0])
        if _is_solution(robot, pose, q, options):
            known = next((k for k, other in enumerate(solutions) if _same(robot, q, other)), None)
            if known is None:
                solutions.append(_nearest_turn(robot, q, reference))
                found.append(1)
            else:
                found[known] += 1
    if solutions:
        weights = 1.0 / np.where(np.isfinite(robot.limit("velocity")), robot.limit("velocity"), 1.0)
        nearest = min(solutions, key=lambda q: float(np.linalg.norm((q - reference) * weights)))
        count = len(solutions) if _is_isolated(robot, pose, nearest) else None
        return _result(robot, pose, nearest, "solved", count)
    beyond = _beyond_the_limits(robot, pose, starts, options)
    if beyond is None:
        return _result(robot, pose, best[1], "unreachable_waypoint", None)
    excess = np.maximum(lower - beyond, beyond - upper)
    joint = int(np.argmax(excess))
    return _result(
        robot,
        pose,
        best[1],
        "joint_position_limit",
        None,
        joint=robot.joint_names[joint],
        value=float(beyond[joint]),
    )


def pose_errors(pose: Pose, reached: Pose) -> tuple[float, float | None]:
    """Distance (m) and angle (rad) between the pose asked and the one reached; no angle if none was asked."""
    distance = float(np.linalg.norm(pose.position - reached.position))
    if pose.rotation is None or reached.rotation is None:
        return distance, None
    return distance, float(np.linalg.norm(pin.log3(reached.rotation.T @ pose.rotation)))


def _result(
    robot: Robot,
    pose: Pose,
    q: FloatArray,
    status: Status,
    count: int | None,
    joint: str | None = None,
    value: float | None = None,
) -> InverseKinematicsResult:
    reached = tool_pose(robot, q)
    distance, angle = pose_errors(pose, reached)
    return InverseKinematicsResult(
        status, q, reached, distance, angle, count, float(manipulability(robot, q[None])[0]), joint, value
    )


def _starts(robot: Robot, reference: FloatArray, seed: int) -> FloatArray:
    """(MOST_STARTS, joints): the reference first, then random positions within the limits.

    Angles are drawn from one turn about the reference: more would only repeat the same poses.
    """
    rng = np.random.default_rng(seed)
    reach = np.where(robot.is_angle, np.pi, 1.0)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    centre = np.clip(reference, lower, upper)
    low, high = np.maximum(lower, centre - reach), np.minimum(upper, centre + reach)
    whole = np.isfinite(lower) & np.isfinite(upper) & ~(robot.is_angle & (upper - lower > TURN))
    low, high = np.where(whole, lower, low), np.where(whole, upper, high)
    random = low + (high - low) * rng.random((MOST_STARTS - 1, robot.dof))
    return np.vstack([centre, random])


def _descend(
    robot: Robot, pose: Pose, start: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[float, FloatArray]:
    """The error and joint position where Levenberg-Marquardt within the box ends.

    Minimises |p* - p|^2 + |log(R* R^T)|^2 (m and rad alike), the linear part of whose Jacobian is exact and
    whose gradient is. Damping follows the error (Sugihara 2011), so that steps are Newton's near a solution,
    and survives a singular Jacobian; it grows when a step does not pay. A joint that presses against its
    limit is taken out of the step.
    """
    q = start
    damping = 1.0
    error = _error(robot, pose, q)
    squared = float(error @ error)
    stalled = 0
    for _ in range(ITERATIONS):
        if squared < CONVERGED**2:
            break
        J = jacobian(robot, q)[: len(error)]
        gradient = J.T @ error
        free = ~(((q <= lower) & (gradient < 0.0)) | ((q >= upper) & (gradient > 0.0)))
        J = J[:, free]
        if J.shape[1] == 0:
            break
        normal = J.T @ J
        normal.flat[:: len(normal) + 1] += damping * 1e-2 * min(squared, 1.0) + 1e-14
        step = np.zeros_like(q)
        step[free] = np.linalg.solve(normal, gradient[free])
        largest = float(np.abs(step).max())
        if largest > 1.0:
            step /= largest
        candidate = np.clip(q + step, lower, upper)
        error_there = _error(robot, pose, candidate)
        squared_there = float(error_there @ error_there)
        if squared_there < squared:
            stalled = stalled + 1 if squared_there > 0.99 * squared else 0
            q, error, squared = candidate, error_there, squared_there
            damping = max(damping / 4.0, 1e-6)
            if stalled >= 8:
                break
        else:
            damping *= 8.0
            if largest < 1e-13 or damping > 1e12:
                break
    return float(np.sqrt(squared)), q


def _error(robot: Robot, pose: Pose, q: FloatArray) -> FloatArray:
    """(3,) or (6,): what is missing to the pose, linear over angular, in the base's axes."""
    pin.forwardKinematics(robot.model, robot.data, q)
    placement = pin.updateFramePlacement(robot.model, robot.data, robot.tool_frame_id)
    linear: FloatArray = pose.position - placement.translation
    if pose.rotation is None:
        return linear
    return np.concatenate([linear, pin.log3(pose.rotation @ placement.rotation.T)])


def _is_solution(robot: Robot, pose: Pose, q: FloatArray, options: InverseKinematicsOptions) -> bool:
    distance, angle = pose_errors(pose, tool_pose(robot, q))
    return distance <= options.tolerance_position and (angle is None or angle <= options.tolerance_orientation)


def _nearest_turn(robot: Robot, q: FloatArray, reference: FloatArray) -> FloatArray:
    """The same configuration with every angle turned by whole turns to lie nearest to `reference`, within limits."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    turns = np.round((reference - q) / TURN)
    with np.errstate(invalid="ignore"):
        fewest, most = np.ceil((lower - q) / TURN - 1e-12), np.floor((upper - q) / TURN + 1e-12)
    turned = q + TURN * np.clip(turns, fewest, most)
    return np.where(robot.is_angle, np.clip(turned, lower, upper), q)


def _same(robot: Robot, q: FloatArray, other: FloatArray) -> bool:
    difference = q - other
    wrapped = np.where(robot.is_angle, difference - TURN * np.round(difference / TURN), difference)
    return bool(np.abs(wrapped).max() < SAME_SOLUTION)


def _is_isolated(robot: Robot, pose: Pose, q: FloatArray) -> bool:
    """Whether no motion of the joints leaves the tool where it is asked to be."""
    J = jacobian(robot, q)[: 3 if pose.rotation is None else 6]
    return bool(np.linalg.matrix_rank(J, tol=1e-6) == robot.dof)


def _beyond_the_limits(
    robot: Robot, pose: Pose, starts: FloatArray, options: InverseKinematicsOptions
) -> FloatArray | None:
    """The solution that leaves the limits least, whole turns apart; None: not even without limits is there one."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    if not (np.isfinite(lower).any() or np.isfinite(upper).any()):
        return None
    unlimited = np.full(robot.dof, np.inf)
    found = []
    for start in starts[:STARTS]:
        _, q = _descend(robot, pose, start, -unlimited, unlimited)
        if _is_solution(robot, pose, q, options):
            centre = np.clip(q, lower, upper)
            turned = np.where(robot.is_angle, q + TURN * np.round((centre - q) / TURN), q)
            excess = np.maximum(lower - turned, turned - upper).max()
            found.append((float(excess), turned))
    return min(found, key=lambda pair: pair[0])[1] if found else None
