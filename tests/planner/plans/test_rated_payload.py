"""Payloads heavier than the rated payload of the robot: the plan says so. The ratings are the makers' figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest

from planner.operations import CertifiedTrajectory, retime_trajectory, reverse_trajectory
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from planner.trajectories.trajectory import PlanWarning

KUKA = load_robot("kuka_kr16_l6_2")
HOME, ABOVE = (0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.2, -1.2, 1.4, 0.1, 0.5, 0.1)
RATED, HEAVY, HEAVIEST = Payload(6.0), Payload(7.0), Payload(50.0)


def said(warnings: Iterable[PlanWarning]) -> list[str]:
    return [warning.message for warning in warnings if warning.code == "payload_above_rating"]


def warned(robot: Robot, *carried: Payload | None, payload: Payload | None = None, put_down: bool = False) -> list[str]:
    """Return the warnings of a plan to and fro whose waypoints bring the payloads; the last may put down its own."""
    waypoints = [JointWaypoint((HOME, ABOVE)[k % 2], payload=body) for k, body in enumerate(carried)]
    waypoints.append(JointWaypoint((HOME, ABOVE)[len(carried) % 2], put_down=put_down))
    return said(plan(PlanningProblem(robot, waypoints, payload=payload)).warnings)


def test_the_payload_of_a_whole_plan_above_the_rating_is_warned_of() -> None:
    (message,) = warned(KUKA, None, payload=HEAVIEST)
    assert message.startswith("the payload of 50 kg exceeds the rated 6 kg of kuka_kr16_l6_2")
    assert "KUKA" in message


def test_the_heaviest_payload_that_a_waypoint_brings_is_warned_of_with_its_waypoint() -> None:
    (message,) = warned(KUKA, None, HEAVY, HEAVIEST, put_down=True)
    assert message.startswith("the payload of 50 kg from waypoint 2 on exceeds the rated 6 kg of kuka_kr16_l6_2")


def test_a_payload_that_the_last_waypoint_brings_is_warned_of() -> None:
    waypoints = [JointWaypoint(HOME), JointWaypoint(ABOVE, payload=HEAVY)]
    (message,) = said(plan(PlanningProblem(KUKA, waypoints)).warnings)
    assert message.startswith("the payload of 7 kg from waypoint 1 on exceeds")


def test_the_rated_payload_itself_is_not_warned_of() -> None:
    assert not warned(KUKA, None, payload=RATED)
    assert not warned(KUKA, RATED)
    assert not warned(KUKA, None)


def test_an_excess_that_six_digits_do_not_show_is_told() -> None:
    (message,) = warned(KUKA, None, payload=Payload(6.0000001))
    assert message.startswith("the payload of 6.0000001 kg exceeds the rated 6 kg")


def test_a_payload_that_the_first_waypoint_replaces_is_not_carried() -> None:
    assert not warned(KUKA, RATED, payload=HEAVIEST)


def test_payloads_add_up() -> None:
    """The robot carries 4 kg already; another 3 kg are above its 6 kg."""
    assert warned(KUKA.with_payload(Payload(4.0)), None, payload=Payload(3.0))[0].startswith("the payload of 7 kg")
    assert not warned(KUKA.with_payload(Payload(4.0)), None, payload=Payload(2.0))


def test_a_robot_without_a_known_rating_is_not_warned_of() -> None:
    robot = load_robot("welding_arm")
    assert robot.rated_payload is None
    assert not warned(robot, None, payload=HEAVIEST)


def test_derived_robots_inherit_the_rating() -> None:
    derived = KUKA.derived(id="mine", limits={KUKA.joint_names[0]: {"velocity": 0.5}})
    assert (derived.rated_payload, derived.rated_payload_source) == (6.0, KUKA.rated_payload_source)
    (message,) = warned(derived, None, payload=HEAVIEST)
    assert "exceeds the rated 6 kg of mine" in message


def reversed_by(robot: Robot) -> CertifiedTrajectory:
    trajectory = plan(PlanningProblem(KUKA, [JointWaypoint(HOME), JointWaypoint(ABOVE)])).trajectory
    return reverse_trajectory(robot, trajectory)


def retimed_by(robot: Robot) -> CertifiedTrajectory:
    return retime_trajectory(robot, [HOME, ABOVE])


@pytest.mark.parametrize("operation", [reversed_by, retimed_by])
def test_operations_on_trajectories_warn_of_the_payload(operation: Callable[[Robot], CertifiedTrajectory]) -> None:
    (message,) = said(operation(KUKA.with_payload(HEAVY)).warnings)
    assert message.startswith("the payload of 7 kg exceeds the rated 6 kg of kuka_kr16_l6_2")
    assert not said(operation(KUKA.with_payload(RATED)).warnings)
