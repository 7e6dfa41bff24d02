"""Limits of a waypoint and of the whole list: the narrower hold on its segment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.backends import Quintic
from planner.errors import InfeasibleDuration
from planner.guarantees import TCP_ORDERS
from planner.kinematics import tool_speeds
from planner.limits import Limits
from planner.planning import plan
from planner.problems.problem import PlanningProblem
from tests.planner.tool_problems import JOINTS, LINE, ROBOT

QUANTITIES = ["velocity", "acceleration", "jerk", "torque", *TCP_ORDERS]


@pytest.mark.parametrize(("whole", "own"), [(0.1, 0.4), (0.4, 0.1), (0.1, None), (None, 0.1)])
def test_the_tool_goes_no_faster_than_either_allows(whole: float | None, own: float | None) -> None:
    end = replace(LINE[1], limits=Limits(tcp_linear_velocity=own))
    problem = PlanningProblem(ROBOT, [LINE[0], end], Limits(tcp_linear_velocity=whole))
    trajectory = plan(problem, Quintic()).trajectory
    times = np.linspace(0.0, trajectory.duration, 2000)
    fastest = tool_speeds(ROBOT, *trajectory.evaluate(times, [0, 1]))[0].max()
    assert fastest == pytest.approx(0.1, rel=1e-3)


@given(data=st.data())
def test_any_limit_in_force_is_the_least_of_all_that_are_given(data: st.DataObject) -> None:
    """Limits of the robot, the list and the waypoint apply, times the scales of list and waypoint."""
    quantity = data.draw(st.sampled_from(QUANTITIES))
    share, scale = st.floats(0.01, 1.0), st.floats(0.1, 1.0)
    on_tool, has_scale = quantity in TCP_ORDERS, quantity in ("velocity", "acceleration")
    robots = np.array([np.inf]) if on_tool else ROBOT.limit(quantity)
    requested, given_values, factor = [], [robots], 1.0
    for _ in range(2):
        fields: dict[str, object] = {}
        if data.draw(st.booleans()):
            values = np.array([data.draw(share) for _ in robots]) * np.where(np.isfinite(robots), robots, 1.0)
            fields[quantity] = float(values[0]) if on_tool else tuple(values.tolist())
            given_values.append(values)
        if has_scale:
            fields[f"{quantity}_scale"] = data.draw(scale)
            factor *= float(str(fields[f"{quantity}_scale"]))
        requested.append(Limits(**fields))  # type: ignore[arg-type]
    waypoints = [JOINTS[0], replace(JOINTS[2], limits=requested[1])]
    in_force = PlanningProblem(ROBOT, waypoints, requested[0]).segment_limits().magnitudes(quantity)[0]
    assert np.ravel(in_force) == pytest.approx(np.min(given_values, axis=0) * factor)


def test_ranges_of_both_hold_by_direction() -> None:
    whole, own = ([(-0.2, 0.8)] * 6, [(-0.6, 0.3)] * 6)
    waypoints = [JOINTS[0], replace(JOINTS[2], limits=Limits(velocity_range=tuple(own)))]
    lower, upper = (
        PlanningProblem(ROBOT, waypoints, Limits(velocity_range=tuple(whole))).segment_limits().bounds("velocity")
    )
    assert lower[0] == pytest.approx(-0.2)
    assert upper[0] == pytest.approx(0.3)


def test_both_are_raised_where_a_duration_asks_for_it() -> None:
    end = replace(LINE[1], duration=2.0, limits=Limits(tcp_linear_velocity=0.1))
    problem = PlanningProblem(ROBOT, [LINE[0], end], Limits(tcp_linear_velocity=0.08))
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(problem, Quintic())
    raised = [remedy for remedy in refusal.value.remedies if "limits" in remedy.field]
    assert {remedy.field for remedy in raised} == {
        ("limits", "tcp_linear_velocity"),
        ("waypoints", 1, "limits", "tcp_linear_velocity"),
    }
    for remedy in raised:
        problem = remedy.applied_to(problem)
    assert plan(problem, Quintic()).trajectory.duration == pytest.approx(2.0)
