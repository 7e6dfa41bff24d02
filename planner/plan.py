"""The one way through: problem, joint path, trajectory, certificate, plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.base import END_OPTIONS, MovesAtItsEnds, end_states
from planner.certificate.limits import certify
from planner.certificate.tool_path import certify_tool_path
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable
from planner.guarantees import Guarantee
from planner.limits import JOINT_QUANTITIES, limit_faults, refuse_unknown_torques
from planner.paths import JointPath, solve_path
from planner.problem import BlendTransition, JointMotion, StopTransition
from planner.remedies import remedies_for
from planner.waypoints.targets import waypoint_faults

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.certificate.checks import Certificate
    from planner.limits import Limits
    from planner.problem import PlanningProblem
    from planner.trajectory import Trajectory


@dataclass(frozen=True)
class PlanWarning:
    """Something the caller should know about a plan that is good all the same."""

    code: str
    message: str


@dataclass(frozen=True, eq=False)
class Plan:
    """A certified trajectory and what it came from. Its existence means: every enforced limit is kept."""

    problem: PlanningProblem
    path: JointPath
    trajectory: Trajectory
    certificate: Certificate
    warnings: tuple[PlanWarning, ...]


def plan(problem: PlanningProblem) -> Plan:
    """Plan a certified trajectory.

    Raises:
        PlanningError: Of the kind that says why there is none, with remedies where there are any.
    """
    check_problem(problem)
    path = solve_path(problem)
    try:
        return _plan_along(problem, path)
    except (InfeasibleDuration, LimitsUnsatisfiable) as refusal:
        refusal.remedies = tuple(remedies_for(refusal, problem, path, lambda it: _plan_along(it, solve_path(it))))
        raise


def _plan_along(problem: PlanningProblem, path: JointPath) -> Plan:
    trajectory = problem.backend.parametrize(path)
    blended = [isinstance(waypoint.transition, BlendTransition) for waypoint in problem.waypoints]
    certificate = certify(
        trajectory,
        path.robot,
        path.limits,
        problem.backend.guarantees,
        np.where(np.array(blended)[:, None], np.nan, path.positions),
        certify_tool_path(trajectory, path.robot, problem.waypoints, path.waypoints),
        end_states(problem.backend, path.robot.dof),
    )
    refuse_unless_satisfied(certificate)
    remarks = (PlanWarning(remark.code, remark.message) for remark in trajectory.remarks)
    return Plan(problem, path, trajectory, certificate, (*_warnings(problem), *remarks))


def check_problem(problem: PlanningProblem) -> None:
    """Hold the problem against its robot: lengths of arrays, widths of limits, order of waypoints.

    Raises:
        InvalidProblem: With every fault found.
        MissingDynamics: Torque limits are asked of a robot whose torques nobody knows.
    """
    faults = list(_faults(problem))
    if faults:
        raise InvalidProblem(faults)
    if problem.payload is None:
        refuse_unknown_torques(problem.robot, _all_limits(problem))


def _all_limits(problem: PlanningProblem) -> tuple[Limits, ...]:
    own = (waypoint.limits for waypoint in problem.waypoints)
    return (problem.limits, *(limits for limits in own if limits is not None))


def _faults(problem: PlanningProblem) -> Iterator[tuple[str, str]]:
    robot, waypoints = problem.robot, problem.waypoints
    if len(waypoints) < 2:
        yield "/waypoints", "a trajectory needs at least two waypoints"
    yield from waypoint_faults(robot, waypoints, problem.inverse_kinematics)
    for i, waypoint in enumerate(waypoints):
        if waypoint.limits is not None:
            yield from limit_faults(robot, waypoint.limits, f"/waypoints/{i}/limits")
        if waypoint.dwell > 0.0 and not isinstance(waypoint.transition, StopTransition):
            yield f"/waypoints/{i}/dwell", "the robot rests only at a waypoint where it stops"
    for i in (0, len(waypoints) - 1):
        if waypoints and not isinstance(waypoints[i].transition, StopTransition):
            yield f"/waypoints/{i}/transition", "the robot starts and ends at rest"
    if waypoints and not isinstance(waypoints[0].motion, JointMotion):
        yield "/waypoints/0/motion", "the first waypoint ends no segment: there is no motion to it"
    if waypoints and waypoints[0].duration is not None:
        yield "/waypoints/0/duration", "the first waypoint ends no segment: it has no duration"
    if waypoints and waypoints[0].limits is not None:
        yield "/waypoints/0/limits", "the first waypoint ends no segment: it has no limits"
    yield from limit_faults(robot, problem.limits, "/limits")
    yield from _end_faults(problem)


def _end_faults(problem: PlanningProblem) -> Iterator[tuple[str, str]]:
    robot, backend = problem.robot, problem.backend
    if not isinstance(backend, MovesAtItsEnds):
        return
    asked = {name: rates for name in END_OPTIONS if (rates := getattr(backend, name)) is not None}
    wrong = [name for name, rates in asked.items() if len(rates) != robot.dof]
    for name in wrong:
        yield f"/backend/{name}", f"{len(asked[name])} values for the {robot.dof} joints of {robot.id}"
    if wrong or not problem.waypoints:
        return
    ends = end_states(backend, robot.dof)
    for moving, i in ((ends.starts_moving, 0), (ends.ends_moving, len(problem.waypoints) - 1)):
        if moving and problem.waypoints[i].dwell > 0.0:
            yield f"/waypoints/{i}/dwell", "the robot cannot rest where it is asked to be in motion"


def refuse_unless_satisfied(certificate: Certificate) -> None:
    """The promise: no trajectory that breaks an enforced limit goes out.

    Raises:
        LimitsUnsatisfiable: Naming the worst check.
    """
    if certificate.satisfied:
        return
    broken = [check for check in certificate.checks if check.enforced and not check.satisfied]
    worst = max(broken, key=lambda check: check.ratio or float("inf"))
    subject = worst.joint or "the tool"
    raise LimitsUnsatisfiable(
        f"the {worst.quantity} of {subject} would reach {worst.peak:.6g}, its limit is {worst.limit:.6g}",
        joint=worst.joint,
        value=worst.peak,
        limit=worst.limit,
        time=worst.time,
    )


def _warnings(problem: PlanningProblem) -> Iterator[PlanWarning]:
    robot, backend = problem.robot, problem.backend
    if problem.payload is not None and not robot.has_dynamics:
        yield PlanWarning("payload_only", f"{robot.id} has no link inertias: torques are those of the payload alone")
    elif not robot.has_dynamics and np.isfinite(robot.limit("torque")).any():
        yield PlanWarning("torque_unchecked", f"{robot.id} has torque limits but no inertias: they are not checked")
    for quantity in JOINT_QUANTITIES:
        asked = any(getattr(limits, quantity) is not None for limits in _all_limits(problem))
        if asked and backend.guarantees[quantity] is not Guarantee.HARD:
            message = f"a {quantity} limit is asked, but {backend.kind} only reports {quantity}"
            yield PlanWarning(f"{quantity}_not_enforced", message)
