"""Payloads heavier than the rated payload of the robot are refused. The ratings are the makers' figures."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from planner.errors import PayloadExceeded
from planner.operations import CertifiedTrajectory, retime_trajectory, reverse_trajectory
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload

KUKA = load_robot("kuka_kr16_l6_2")
HOME, ABOVE = (0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.2, -1.2, 1.4, 0.1, 0.5, 0.1)
RATED, HEAVY, HEAVIEST = Payload(6.0), Payload(7.0), Payload(50.0)


def to_and_fro(
    robot: Robot, *carried: Payload | None, payload: Payload | None = None, put_down: bool = False
) -> PlanningProblem:
    """Return a problem whose waypoints bring the payloads; the last may put down its own."""
    waypoints = [JointWaypoint((HOME, ABOVE)[k % 2], payload=body) for k, body in enumerate(carried)]
    waypoints.append(JointWaypoint((HOME, ABOVE)[len(carried) % 2], put_down=put_down))
    return PlanningProblem(robot, waypoints, payload=payload)


def refusal(problem: PlanningProblem) -> PayloadExceeded:
    with pytest.raises(PayloadExceeded) as caught:
        plan(problem)
    return caught.value


def with_remedies(problem: PlanningProblem) -> Plan:
    """Plan a refused problem with all remedies of its refusal."""
    refused = refusal(problem)
    assert refused.remedies
    for remedy in refused.remedies:
        problem = remedy.applied_to(problem)
    found = plan(problem)
    assert {remedy.duration for remedy in refused.remedies} == {found.trajectory.duration}
    return found


def test_the_payload_of_a_whole_plan() -> None:
    problem = to_and_fro(KUKA, None, payload=HEAVIEST)
    refused = refusal(problem)
    assert refused.message.startswith("the payload of 50 kg exceeds the rated 6 kg of kuka_kr16_l6_2 (KUKA")
    assert (refused.value, refused.limit, refused.waypoint) == (50.0, 6.0, None)
    assert with_remedies(problem).problem.payload == RATED


def test_the_heaviest_of_several_payloads_is_named_and_all_become_lighter() -> None:
    problem = to_and_fro(KUKA, None, HEAVY, HEAVIEST, put_down=True)
    refused = refusal(problem)
    assert refused.message.startswith("the payload of 50 kg from waypoint 2 on exceeds the rated 6 kg")
    assert refused.waypoint == 2
    assert [body and body.mass for body in with_remedies(problem).problem.payloads] == [None, 6.0, 6.0, None]


def test_a_payload_that_the_last_waypoint_brings() -> None:
    refused = refusal(PlanningProblem(KUKA, [JointWaypoint(HOME), JointWaypoint(ABOVE, payload=HEAVY)]))
    assert refused.message.startswith("the payload of 7 kg from waypoint 1 on exceeds")


def test_the_rated_payload_itself_is_carried() -> None:
    for problem in (to_and_fro(KUKA, None, payload=RATED), to_and_fro(KUKA, RATED), to_and_fro(KUKA, None)):
        assert plan(problem).certificate.satisfied


def test_an_excess_that_six_digits_do_not_show_is_told() -> None:
    refused = refusal(to_and_fro(KUKA, None, payload=Payload(6.0000001)))
    assert refused.message.startswith("the payload of 6.0000001 kg exceeds the rated 6 kg")


def test_a_payload_that_the_first_waypoint_replaces_is_not_carried() -> None:
    assert plan(to_and_fro(KUKA, RATED, payload=HEAVIEST)).certificate.satisfied


def test_payloads_add_up() -> None:
    """The robot carries 4 kg already; another 3 kg exceed its 6 kg, and 2 kg do not."""
    gripper = KUKA.with_payload(Payload(4.0))
    problem = to_and_fro(gripper, None, payload=Payload(3.0))
    assert refusal(problem).message.startswith("the payload of 7 kg")
    assert with_remedies(problem).problem.payload == Payload(2.0)
    assert plan(to_and_fro(gripper, None, payload=Payload(2.0))).certificate.satisfied


def test_a_robot_whose_own_tool_exceeds_the_rating_has_no_remedy() -> None:
    refused = refusal(to_and_fro(KUKA.with_payload(HEAVY), None))
    assert refused.message.startswith("the payload of 7 kg exceeds")
    assert not refused.remedies
    assert not refused.hints


def test_a_robot_without_a_known_rating_carries_any_payload() -> None:
    robot = load_robot("welding_arm")
    assert robot.rated_payload is None
    assert plan(to_and_fro(robot, None, payload=HEAVIEST)).certificate.satisfied


def test_derived_robots_inherit_the_rating() -> None:
    derived = KUKA.derived(id="mine", limits={KUKA.joint_names[0]: {"velocity": 0.5}})
    assert (derived.rated_payload, derived.rated_payload_source) == (6.0, KUKA.rated_payload_source)
    assert "exceeds the rated 6 kg of mine" in refusal(to_and_fro(derived, None, payload=HEAVIEST)).message


def reversed_by(robot: Robot) -> CertifiedTrajectory:
    trajectory = plan(PlanningProblem(KUKA, [JointWaypoint(HOME), JointWaypoint(ABOVE)])).trajectory
    return reverse_trajectory(robot, trajectory)


def retimed_by(robot: Robot) -> CertifiedTrajectory:
    return retime_trajectory(robot, [HOME, ABOVE])


@pytest.mark.parametrize("operation", [reversed_by, retimed_by])
def test_operations_on_trajectories_refuse_the_payload(operation: Callable[[Robot], CertifiedTrajectory]) -> None:
    with pytest.raises(PayloadExceeded, match="payload of 7 kg exceeds the rated 6 kg of kuka_kr16_l6_2"):
        operation(KUKA.with_payload(HEAVY))
    assert operation(KUKA.with_payload(RATED)).certificate.satisfied
