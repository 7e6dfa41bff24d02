"""The warnings of a plan: what its caller should know, though every limit is kept."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import repeat

import numpy as np

from planner.backends.base import BackEnd
from planner.certificate.checks import Certificate
from planner.certificate.clearance import segment_checkers
from planner.certificate.joint_motions import JOINT_DEVIATION, TOOL_DEVIATION
from planner.errors import distinct
from planner.guarantees import QUANTITIES, Guarantee
from planner.kinematics.following_errors import farthest_tool
from planner.limits import JOINT_QUANTITIES
from planner.paths import JointPath
from planner.problems.any_of import requested_indices
from planner.problems.problem import PlanningProblem
from planner.robots import Robot
from planner.shapes.shape import Shape
from planner.spatial import Pose
from planner.trajectories.trajectory import PlanWarning, Trajectory
from planner.waypoints.solve import given_positions

WANDERING = {TOOL_DEVIATION: 0.1, JOINT_DEVIATION: 1.0}
"""Distances from straight joint motions above which a warning says so: of the tool, m, and of a joint, rad or m.

People and equipment near the arm must allow for such a deviation.
"""

FAR_FROM_TOOL = 1.0 / 3.0
"""The distance of an attached object from the tool above which a warning says so, as a fraction of the arm's length.

No gripper is that long.
"""

WITHIN_FOLLOWING_ERRORS = frozenset(
    {*QUANTITIES, "velocity_at_position", "torque_with_tolerances"} - {"tcp_centripetal_acceleration"}
    | {"waypoint_position_error", "waypoint_orientation_error", "passing_velocity_error", "duration_error"}
)
"""The quantities whose limits hold within following errors, and errors of the plan itself."""

OF_GIVEN_TORQUES = ("power", "total_power", "rms_torque", "torque_at_speed")
"""The quantities that count the given payload and friction alone, without their tolerances."""

MOST_NAMED = 10
"""The most waypoints that one warning names."""


def plan_warnings(
    problem: PlanningProblem, backend: BackEnd, path: JointPath, trajectory: Trajectory, certificate: Certificate
) -> Iterator[PlanWarning]:
    """Yield the warnings of a certified plan."""
    yield from _snapped(problem)
    numbers = requested_indices(problem)
    repeated = [segment + 1 for segment in path.still.tolist() if segment not in path.rides]
    if len(repeated):
        named = ", ".join(str(numbers[i]) for i in repeated[:MOST_NAMED])
        more = f" and {len(repeated) - MOST_NAMED} more" if len(repeated) > MOST_NAMED else ""
        message = (
            "same joint position as the waypoint before; the robot passes both at once, or rests for the requested time"
        )
        yield PlanWarning("waypoint_repeated", f"waypoint {named}{more}: {message}")
    for number, waypoint in zip(numbers, path.waypoints, strict=True):
        if waypoint.tool_motion is not None and waypoint.tool_motion.warning is not None:
            warning = waypoint.tool_motion.warning
            yield replace(warning, message=warning.message.replace("{waypoint}", str(number)))
    yield from unchecked_positions(problem.robot)
    yield from _attached_far_away(problem, path)
    yield from _torque_warnings(problem, path)
    yield from following_error_warnings(problem.robot, certificate)
    for quantity in JOINT_QUANTITIES:
        requested = any(getattr(limits, quantity) is not None for limits in problem.all_limits)
        if requested and backend.guarantees[quantity] is not Guarantee.HARD:
            message = (
                f"the request limits {quantity}, but {backend.kind} only reports it and does not enforce the limit"
            )
            yield PlanWarning(f"{quantity}_not_enforced", message)
    yield from trajectory.warnings
    yield from _wandering(problem, trajectory, certificate)
    if certificate.clearance is not None:
        yield from certificate.clearance.warnings()


def _snapped(problem: PlanningProblem) -> Iterator[PlanWarning]:
    """Yield warnings of joint positions outside their limits by at most the tolerance."""
    given, positions = given_positions(problem.robot, problem.waypoints)
    within = np.clip(positions, problem.robot.limit("lower"), problem.robot.limit("upper"))
    for row, joint in np.argwhere(positions != within).tolist():
        requested, limit = distinct(positions[row, joint], within[row, joint])
        name = problem.robot.joint_names[joint]
        number = requested_indices(problem)[given[row]]
        message = f"waypoint {number} has {name} at {requested}, beyond its limit {limit}; the plan uses the limit"
        yield PlanWarning("position_snapped", message)


def _wandering(problem: PlanningProblem, trajectory: Trajectory, certificate: Certificate) -> Iterator[PlanWarning]:
    """Yield warnings of a tool or a joint that deviates far from straight joint motions."""
    for check in certificate.checks:
        if check.peak <= WANDERING.get(check.quantity, np.inf):
            continue
        segment = int(trajectory.segments[trajectory.locate(np.array([check.time]))[0][0]])
        end = requested_indices(problem)[segment + 1]
        way = f"on the way from waypoint {end - 1} to {end}"
        if check.quantity == TOOL_DEVIATION:
            message = f"{way} the tool goes {check.peak:.3g} m off the straight joint motion; max_deviation limits that"
            yield PlanWarning("tool_deviates", message)
        else:
            away = f"{check.peak:.3g} (rad or m) off the straight joint motion; max_joint_deviation limits that"
            yield PlanWarning("joint_deviates", f"{way} {check.joint} goes {away}")


def unchecked_positions(robot: Robot) -> Iterator[PlanWarning]:
    """Yield a warning of joints without position limits that are not continuous."""
    joints = [joint for joint in robot.joints if joint.kind != "continuous"]
    names = [joint.name for joint in joints if not (np.isfinite(joint.lower) and np.isfinite(joint.upper))]
    if names:
        message = f"{robot.id} has no position limits of {', '.join(names)}: no position is refused"
        yield PlanWarning("position_unchecked", message)


def _attached_far_away(problem: PlanningProblem, path: JointPath) -> Iterator[PlanWarning]:
    """Yield warnings of attached objects that are far away from the tool."""
    if problem.scene is None:
        return
    placements = problem.robot.model.jointPlacements.tolist()
    most = FAR_FROM_TOOL * sum(np.linalg.norm(at.translation) for at in placements)
    held = {
        thing.id: thing
        for checker in segment_checkers(problem, path.positions)
        for thing in checker.scene.attached
        if thing.link is None
    }
    for name, thing in held.items():
        distance = min(map(_least_distance, thing.shapes, repeat(thing.pose)), default=0.0)
        if distance > most:
            message = f"{name} moves with the tool, but is at least {distance:.3g} m away from it"
            yield PlanWarning("attached_far_from_tool", f"{message}; its pose must be given in the tool frame")


def _least_distance(shape: Shape, pose: Pose) -> float:
    """Return a distance, m, that a shape at a pose has at least from the origin."""
    capsule = shape.bounding_capsule
    if capsule is None:
        return 0.0
    ends = np.array([capsule.start, capsule.end])
    placed = ends @ (np.eye(3) if pose.rotation is None else pose.rotation).T + pose.position
    along = placed[1] - placed[0]
    share = np.clip(-placed[0] @ along / max(along @ along, np.finfo(float).tiny), 0.0, 1.0)
    return float(np.linalg.norm(placed[0] + share * along)) - capsule.radius


def following_error_warnings(robot: Robot, certificate: Certificate) -> Iterator[PlanWarning]:
    """Yield a warning of limits that hold for planned positions, and not for all within the following errors."""
    if robot.following_errors is None:
        return
    limited = [check.quantity for check in certificate.checks if check.limit is not None]
    names = [name for name in limited if name not in WITHIN_FOLLOWING_ERRORS]
    names += ["speed_zones"] * bool(certificate.speed_zones)
    names += ["contacts"] * (certificate.clearance is not None and certificate.clearance.contacts is not None)
    if names:
        message = (
            f"the limits of {', '.join(names)} hold for planned positions; with the following errors of the joints the "
            f"tool may be up to {farthest_tool(robot):.3g} m away from them"
        )
        yield PlanWarning("following_error_not_covered", message)


def tolerance_warnings(robot: Robot, certificate: Certificate) -> Iterator[PlanWarning]:
    """Yield a warning of limits that hold for the given payload and friction, and not within their tolerances."""
    sets = ["payload"] * bool(robot.uncertain_payloads) + ["friction"] * (robot.friction_tolerance is not None)
    limited = [check.quantity for check in certificate.checks if check.limit is not None]
    names = [name for name in OF_GIVEN_TORQUES if name in limited]
    if sets and names:
        message = f"the limits of {', '.join(names)} hold for the given {' and '.join(sets)}, without the tolerances"
        yield PlanWarning("tolerances_not_covered", message)


def _torque_warnings(problem: PlanningProblem, path: JointPath) -> Iterator[PlanWarning]:
    """Yield warnings of torques that are not checked, or only in part."""
    robot, is_limited = problem.robot, bool(np.isfinite(path.limits.torque.upper).any())
    unchecked = f"{robot.id} has no torque limits: no torque is checked"
    if robot.has_dynamics:
        if not is_limited:
            yield PlanWarning("torque_unchecked", unchecked)
    elif any(problem.payloads):
        message = f"{robot.id} has no link inertias: torques are those of the payload alone"
        yield PlanWarning("payload_only", message if is_limited else f"{message}; {unchecked}")
    elif is_limited:
        yield PlanWarning("torque_unchecked", f"{robot.id} has torque limits but no inertias: they are not checked")
