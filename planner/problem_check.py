"""What is wrong with a problem as it is asked: lengths of arrays, widths of limits, what contradicts itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import InvalidProblem, MissingDynamics
from planner.guarantees import END_OPTIONS, MovesAtItsEnds, end_states
from planner.limits import JOINT_QUANTITIES
from planner.problem import JointMotion, JointWaypoint, RelativeWaypoint, StopTransition

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.kinematics.options import InverseKinematicsOptions
    from planner.limits import Limits
    from planner.problem import AnyWaypoint, PlanningProblem
    from planner.robots import Robot


def check_problem(problem: PlanningProblem, backend: object) -> None:
    """Hold the problem against its robot: lengths of arrays, widths of limits, order of waypoints.

    What depends on the solved waypoints is refused where they are known (`planner.paths`): two of them at the same
    joint position, and a corner that cannot be passed.

    Args:
        problem: What is asked.
        backend: The back end with its options, which may ask for motion at the ends (`MovesAtItsEnds`).

    Raises:
        InvalidProblem: With every fault found.
        MissingDynamics: Torque limits are asked of a robot whose torques nobody knows.
    """
    faults = [*_faults(problem), *_end_faults(problem, backend)]
    if faults:
        raise InvalidProblem(faults)
    if problem.payload is None:
        refuse_unknown_torques(problem.robot, problem.all_limits)


def waypoint_faults(
    robot: Robot, waypoints: Sequence[AnyWaypoint], options: InverseKinematicsOptions
) -> Iterator[tuple[str, str]]:
    """What keeps the list from saying where the robot is to go: JSON pointers and messages."""
    for i, waypoint in enumerate(waypoints):
        if isinstance(waypoint, JointWaypoint) and len(waypoint.position) != robot.dof:
            count = len(waypoint.position)
            yield f"/waypoints/{i}/position", f"{count} values for the {robot.dof} joints of {robot.id}"
    if waypoints and isinstance(waypoints[0], RelativeWaypoint):
        yield "/waypoints/0/kind", "the first waypoint cannot be relative: there is none before it"
    if options.reference is not None and len(options.reference) != robot.dof:
        yield "/ik/reference", f"{len(options.reference)} values for the {robot.dof} joints of {robot.id}"


def limit_faults(robot: Robot, limits: Limits, pointer: str) -> Iterator[tuple[str, str]]:
    """What is wrong with limits asked by a caller: their length, or being wider than the robot's.

    Yields:
        Pairs of a JSON pointer below `pointer` and a message.
    """
    for quantity in JOINT_QUANTITIES:
        asked = getattr(limits, quantity)
        if asked is None:
            continue
        if len(asked) != robot.dof:
            yield f"{pointer}/{quantity}", f"{len(asked)} values for the {robot.dof} joints of {robot.id}"
            continue
        for i, (value, own) in enumerate(zip(asked, robot.limit(quantity), strict=True)):
            if not value > 0.0:
                yield f"{pointer}/{quantity}/{i}", "a limit must be greater than 0"
            elif value > own:
                yield (
                    f"{pointer}/{quantity}/{i}",
                    f"{value:g} is wider than the robot's own {quantity} limit of {robot.joint_names[i]}, {own:.10g}",
                )


def refuse_unknown_torques(robot: Robot, asked: tuple[Limits, ...]) -> None:
    """A torque limit that cannot be checked is refused, not ignored.

    Raises:
        MissingDynamics: One is asked, and the robot has neither inertias nor a payload.
    """
    if not robot.has_dynamics and any(limits.torque is not None for limits in asked):
        raise MissingDynamics(
            f"{robot.id} has no link inertias and carries no payload: its torque limits cannot be checked"
        )


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


def _end_faults(problem: PlanningProblem, backend: object) -> Iterator[tuple[str, str]]:
    robot = problem.robot
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
