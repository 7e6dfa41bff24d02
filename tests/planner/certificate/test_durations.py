"""Requested durations as a check of the certificate: by arrivals, departures and dwells."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.backends import BACKENDS, Cubic, MinEffort
from planner.certificate.durations import DURATION_ERROR, certify_durations
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import StopTransition, ThroughTransition
from planner.robots import load_robot
from tests.planner.problems_of_tests import backend_of

if TYPE_CHECKING:
    from planner.certificate import Check
    from planner.plans.result import Plan

ROBOT = load_robot("kuka_kr16_2")
START, NEAR, FAR = (0, -1.5, 1.5, 0, 0.5, 0), (0.1, -1.4, 1.5, 0, 0.5, 0.1), (1.0, -1.2, 1.2, 0, 0.5, 0.5)


def duration_checks(made: Plan) -> list[Check]:
    return [check for check in made.certificate.checks if check.quantity == DURATION_ERROR]


@pytest.mark.parametrize("whole", [1.85, 1.9, 2.0])
def test_min_effort_keeps_a_minimum_duration_within_a_duration_of_the_whole(whole: float) -> None:
    """The search beats the quintic, so the whole may be shorter than the quintic that keeps the minimum."""
    waypoints = [JointWaypoint(START), JointWaypoint(NEAR, minimum_duration=1.0), JointWaypoint(FAR)]
    made = plan(PlanningProblem(ROBOT, waypoints, duration=whole), MinEffort(knots=16))
    assert made.trajectory.arrivals[1] >= 1.0 - 1e-9
    assert made.trajectory.duration == whole
    (check,) = duration_checks(made)
    assert check.satisfied and check.enforced


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
@pytest.mark.parametrize("passed", [StopTransition(), ThroughTransition()], ids=["stop", "through"])
def test_every_back_end_keeps_all_kinds_of_durations_at_once(
    kind: str, passed: StopTransition | ThroughTransition
) -> None:
    waypoints = [
        JointWaypoint(START, dwell=0.25),
        JointWaypoint(NEAR, minimum_duration=1.3, transition=passed),
        JointWaypoint(FAR, dwell=0.5),
        JointWaypoint(NEAR, duration=2.5),
        JointWaypoint(NEAR, minimum_duration=0.75),
    ]
    made = plan(PlanningProblem(ROBOT, waypoints, duration=8.0), backend_of(kind))
    arrivals, departures = made.trajectory.arrivals, made.trajectory.departures
    assert arrivals[1] - departures[0] >= 1.3 - 1e-9
    assert arrivals[3] - departures[2] == pytest.approx(2.5, abs=1e-9)
    assert arrivals[4] - departures[3] >= 0.75 - 1e-9
    assert departures[[0, 2]] - arrivals[[0, 2]] == pytest.approx([0.25, 0.5], abs=1e-9)
    for waypoint in (0, 2):
        (speeds,) = made.trajectory.evaluate(np.linspace(arrivals[waypoint], departures[waypoint], 9)[1:-1], [1])
        assert not speeds.any()
    assert made.trajectory.duration == arrivals[-1] == 8.0
    (check,) = duration_checks(made)
    assert check.satisfied


@pytest.mark.parametrize(
    ("fields", "whole", "error"),
    [
        ({"duration": 2.0}, None, 0.25),
        ({"duration": 1.5}, None, 0.25),
        ({"minimum_duration": 2.0}, None, 0.25),
        ({"minimum_duration": 1.75}, None, 0.0),
        ({"dwell": 0.5}, None, 0.125),
        ({"dwell": 0.375}, 2.125, 0.0),
        ({}, 2.5, 0.375),
    ],
)
def test_the_check_measures_the_error_of_the_requested_duration(
    fields: dict[str, float], whole: float | None, error: float
) -> None:
    """A trajectory of 1.75 s and a dwell of 0.375 s, checked against other requests."""
    end = JointWaypoint(FAR, duration=1.75, dwell=0.375)
    made = plan(PlanningProblem(ROBOT, [JointWaypoint(START), end]), Cubic()).trajectory
    requested = replace(JointWaypoint(FAR), **fields)  # type: ignore[arg-type] # of any field
    (check,) = certify_durations(made, [JointWaypoint(START), requested], whole)
    assert check.peak == pytest.approx(error, abs=1e-12)
    assert check.satisfied == (error == 0.0)


def test_a_dwell_in_which_a_joint_moves_is_no_rest() -> None:
    end = JointWaypoint(FAR, duration=1.75, dwell=0.375)
    made = plan(PlanningProblem(ROBOT, [JointWaypoint(START), end]), Cubic()).trajectory
    coefficients = made.coefficients.copy()
    coefficients[-1, 0, 1] = 1e-3
    (check,) = certify_durations(replace(made, coefficients=coefficients), [JointWaypoint(START), end], None)
    assert check.peak == pytest.approx(0.375)
    assert not check.satisfied


def test_there_is_no_check_where_no_duration_is_requested() -> None:
    made = plan(PlanningProblem(ROBOT, [JointWaypoint(START), JointWaypoint(FAR)]), Cubic())
    assert not duration_checks(made)
