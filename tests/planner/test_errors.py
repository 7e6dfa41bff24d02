"""Paths to fields, and remedies applied to the library's own values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Quintic, Ruckig
from planner.errors import Fault, InvalidProblem, Remedy
from planner.fields import KIND, field_name, with_field
from planner.limits import Limits
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import BlendTransition, StopTransition
from planner.robots import load_robot
from planner.robots.payload import Payload


@pytest.fixture
def problem() -> PlanningProblem:
    first = JointWaypoint(position=(0.0, 0.1, 0.2))
    second = JointWaypoint(position=(0.3, 0.4, 0.5), limits=Limits(velocity=(1.0, 2.0, 3.0)), duration=2.0)
    return PlanningProblem(load_robot("three_dof_arm"), (first, second), payload=Payload(1.0))


def test_a_remedy_changes_one_field_and_nothing_else(problem: PlanningProblem) -> None:
    first, second = problem.waypoints
    for remedy, expected in (
        (Remedy(("waypoints", 1, "duration"), None, ""), replace(second, duration=None)),
        (
            Remedy(("waypoints", 1, "transition"), BlendTransition(0.1), ""),
            replace(second, transition=BlendTransition(0.1)),
        ),
        (
            Remedy(("waypoints", 1, "limits", "velocity", 2), 9.0, ""),
            replace(second, limits=Limits(velocity=(1.0, 2.0, 9.0))),
        ),
    ):
        changed = remedy.applied_to(problem)
        assert changed == replace(problem, waypoints=(first, expected))
        assert problem.waypoints == (first, second)
    changed = Remedy(("payload", "mass"), 0.5, "").applied_to(problem)
    assert changed == replace(problem, payload=Payload(0.5))


def test_a_remedy_of_the_back_end_leaves_the_problem_alone(problem: PlanningProblem) -> None:
    remedy = Remedy(("backend", "initial_velocity"), None, "")
    backend = Ruckig(initial_velocity=(1.0, 0.0, 0.0), synchronization="time")
    assert remedy.applied_to(problem) is problem
    assert remedy.applied_to_backend(backend) == Ruckig(synchronization="time")
    assert Remedy(("payload", "mass"), 0.5, "").applied_to_backend(backend) is backend


def test_what_is_not_there_cannot_be_changed(problem: PlanningProblem) -> None:
    for field in (("waypoints", 7, "duration"), ("waypoints", 1, "colour"), ("weather",)):
        with pytest.raises((IndexError, AttributeError, TypeError)):
            Remedy(field, 1.0, "").applied_to(problem)
    with pytest.raises((AttributeError, TypeError)):
        Remedy(("backend", "knots"), 1, "").applied_to_backend(Quintic())


def test_faults_say_where_they_are() -> None:
    error = InvalidProblem([(("waypoints", 0, KIND), "cannot be relative"), (("limits", "jerk", 2), "too wide")])
    assert error.faults == (
        Fault(("waypoints", 0, KIND), "cannot be relative"),
        Fault(("limits", "jerk", 2), "too wide"),
    )
    assert str(error) == "waypoints[0]: cannot be relative; limits.jerk[2]: too wide"
    assert field_name(("waypoints", 1, "duration")) == "waypoints[1].duration"


def test_the_empty_path_is_the_value_itself() -> None:
    assert with_field(StopTransition(), (), BlendTransition(1.0)) == BlendTransition(1.0)
    array = np.zeros(2)
    assert with_field((array, 1), (1,), 5)[0] is array
