"""Where gravity alone exceeds a torque limit, the remedies work, and are about the smallest that do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner.backends import BACKENDS, Quintic
from planner.errors import LimitsUnsatisfiable, Remedy
from planner.limits import Limits
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.problems.transitions import ThroughTransition
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload

KINDS = list(BACKENDS)
START, END = (0.0, -1.2, 1.2, 0.0, 0.5, 0.0), (1.0, -0.4, 0.9, 0.3, 0.4, 0.2)
SHOULDER = 1


@pytest.fixture(scope="module")
def robot() -> Robot:
    return replace(load_robot("kuka_kr16_l6_2"), rated_payload=None)


def largest_gravity(robot: Robot, joint: int) -> float:
    """Return the largest gravity torque on the straight motion from START to END, by Pinocchio's own function."""
    data = robot.model.createData()
    way = np.linspace(START, END, 2001)
    return float(max(abs(pin.computeGeneralizedGravity(robot.model, data, q)[joint]) for q in way))


def refused(problem: PlanningProblem, kind: str) -> tuple[Remedy, ...]:
    with pytest.raises(LimitsUnsatisfiable, match="gravity alone") as refusal:
        plan(problem, BACKENDS[kind]())
    return refusal.value.remedies


def straight(robot: Robot, **changes: object) -> PlanningProblem:
    waypoints = (JointWaypoint(position=START), JointWaypoint(position=END))
    return replace(PlanningProblem(robot, waypoints), **changes)  # type: ignore[arg-type]


def narrowed(robot: Robot, value: float) -> tuple[float, ...]:
    torque = robot.limit("torque").tolist()
    torque[SHOULDER] = value
    return tuple(torque)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", KINDS)
def test_a_limit_that_gravity_exceeds_is_raised_by_one_percent_of_what_it_takes(robot: Robot, kind: str) -> None:
    needed = largest_gravity(robot, SHOULDER)
    problem = straight(robot, limits=Limits(torque=narrowed(robot, 0.7 * needed)))
    (remedy,) = refused(problem, kind)
    assert remedy.field == ("limits", "torque", SHOULDER)
    assert remedy.value == pytest.approx(needed / 0.99, rel=1e-3)
    assert plan(
        replace(problem, limits=Limits(torque=narrowed(robot, remedy.value))), BACKENDS[kind]()
    ).certificate.satisfied


def test_the_limit_of_a_waypoint_is_raised_there(robot: Robot) -> None:
    needed = largest_gravity(robot, SHOULDER)
    waypoints = (
        JointWaypoint(position=START),
        JointWaypoint(position=END, limits=Limits(torque=narrowed(robot, 0.7 * needed))),
        JointWaypoint(position=START),
    )
    problem = PlanningProblem(robot, waypoints)
    (remedy,) = refused(problem, "quintic")
    assert remedy.field == ("waypoints", 1, "limits", "torque", SHOULDER)
    mended = replace(waypoints[1], limits=Limits(torque=narrowed(robot, remedy.value)))
    assert plan(replace(problem, waypoints=(waypoints[0], mended, waypoints[2])), Quintic()).certificate.satisfied


@pytest.mark.parametrize("kind", ["quintic", "min_effort"])
def test_an_asked_duration_gets_the_torque_that_it_takes(robot: Robot, kind: str) -> None:
    needed = largest_gravity(robot, SHOULDER)
    limits = Limits(torque=narrowed(robot, 0.7 * needed))
    waypoints = (JointWaypoint(position=START), JointWaypoint(position=END, duration=1.5))
    problem = straight(robot, limits=limits, waypoints=waypoints)
    (remedy,) = refused(problem, kind)
    assert 1.01 * needed < remedy.value <= 2.0 * needed
    mended = plan(replace(problem, limits=Limits(torque=narrowed(robot, remedy.value))), BACKENDS[kind]())
    assert mended.trajectory.duration == 1.5


@pytest.mark.long_table
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("passing", [False, True])
def test_the_payload_that_is_just_held(robot: Robot, kind: str, passing: bool) -> None:
    payload = Payload(400.0, center_of_mass=(0.0, 0.05, 0.1))
    waypoints = (JointWaypoint(position=START), JointWaypoint(position=END))
    if passing:
        middle = JointWaypoint(position=tuple((0.5 * (np.array(START) + END)).tolist()), transition=ThroughTransition())
        waypoints = (waypoints[0], middle, waypoints[1])
    problem = straight(robot, payload=payload, waypoints=waypoints)
    (remedy,) = refused(problem, kind)
    assert remedy.field == ("payload", "mass")
    lighter = replace(payload, mass=remedy.value)
    assert plan(replace(problem, payload=lighter), BACKENDS[kind]()).certificate.satisfied
    limit = robot.limit("torque")
    use = [largest_gravity(robot.with_payload(lighter), joint) / limit[joint] for joint in range(robot.dof)]
    assert max(use) == pytest.approx(0.99, abs=2e-3)


@pytest.mark.parametrize("kind", ["toppra", "min_effort"])
def test_both_are_offered_where_both_help_also_on_a_line(robot: Robot, kind: str) -> None:
    between = 720.0  # N m: 686 without a payload, 776 with it
    down = RelativeWaypoint(frame="base", move=CartesianMove((0.0, 0.0, -0.1)), motion=LinearMotion())
    problem = straight(
        robot,
        waypoints=(JointWaypoint(position=END), down),
        payload=Payload(6.0),
        limits=Limits(torque=narrowed(robot, between)),
    )
    limit, mass = refused(problem, kind)
    assert (limit.field, mass.field) == (("limits", "torque", SHOULDER), ("payload", "mass"))
    assert plan(
        replace(problem, limits=Limits(torque=narrowed(robot, limit.value))), BACKENDS[kind]()
    ).certificate.satisfied
    assert plan(replace(problem, payload=Payload(mass.value)), BACKENDS[kind]()).certificate.satisfied
    assert 0.0 < mass.value < 6.0


def test_where_nothing_helps_nothing_is_offered(robot: Robot) -> None:
    """Joint 2 cannot hold the arm itself within its own limit."""
    joints = list(robot.joints)
    joints[SHOULDER] = replace(joints[SHOULDER], torque=0.7 * largest_gravity(robot, SHOULDER))
    weak = replace(robot, joints=tuple(joints))
    assert refused(straight(weak), "quintic") == ()
    assert refused(straight(weak, payload=Payload(1.0)), "quintic") == ()


@pytest.mark.parametrize(
    "waypoints",
    [
        [JointWaypoint(position=START)],
        [JointWaypoint(position=START)] * 3,
        [JointWaypoint(position=START, dwell=1.0), JointWaypoint(position=START)],
        [JointWaypoint(position=START), JointWaypoint(position=START, duration=1.0)],
        [JointWaypoint(position=START), RelativeWaypoint(move=CartesianMove((0.0, 0.0, 0.0)), motion=LinearMotion())],
    ],
    ids=["one", "equal", "dwell", "rest", "line of no length"],
)
@pytest.mark.parametrize("kind", KINDS)
def test_an_arm_that_only_rests_is_held_by_the_remedy(
    robot: Robot, kind: str, waypoints: list[JointWaypoint | RelativeWaypoint]
) -> None:
    """The remedies considered moving segments only, and there were none."""
    data = robot.model.createData()
    gravity = np.abs(pin.computeGeneralizedGravity(robot.model, data, np.array(START)))
    problem = straight(robot, waypoints=waypoints, limits=Limits(torque=narrowed(robot, 1.0)))
    with pytest.raises(LimitsUnsatisfiable) as refusal:
        plan(problem, BACKENDS[kind]())
    (remedy,) = refusal.value.remedies
    assert remedy.field == ("limits", "torque", SHOULDER)
    assert gravity[SHOULDER] <= remedy.value < 1.02 * gravity[SHOULDER]
    assert plan(remedy.applied_to(problem), BACKENDS[kind]()).certificate.satisfied
