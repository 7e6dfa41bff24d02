"""Progress of a planning: a function hears of each attempt, and may end the planning."""

from __future__ import annotations

import numpy as np
import pytest

import planner

HOME, AWAY = np.zeros(6), np.full(6, 0.4)


def problem(duration: float | None) -> planner.PlanningProblem:
    waypoints = [planner.JointWaypoint(HOME), planner.JointWaypoint(AWAY, duration=duration)]
    return planner.PlanningProblem(planner.load_robot("ur5e"), waypoints)


def test_each_attempt_is_reported_with_the_last_plan() -> None:
    """The request is refused; its remedies have plans."""
    seen: list[planner.Progress] = []
    with pytest.raises(planner.InfeasibleDuration) as refused:
        planner.plan(problem(0.05), budget=planner.Budget(on_progress=seen.append))
    assert [step.attempts for step in seen] == list(range(1, len(seen) + 1))
    assert len(seen) > len(refused.value.remedies) > 0
    assert seen[0].plan is None
    last = seen[-1].plan
    assert last is not None
    assert last.certificate.satisfied
    times = [step.seconds for step in seen]
    assert times == sorted(times)
    assert times[0] > 0.0


def test_the_plan_is_the_same_and_the_budget_bounds_the_reports() -> None:
    seen: list[planner.Progress] = []
    plan = planner.plan(problem(None), budget=planner.Budget(on_progress=seen.append))
    np.testing.assert_array_equal(plan.trajectory.coefficients, planner.plan(problem(None)).trajectory.coefficients)
    seen.clear()
    with pytest.raises(planner.InfeasibleDuration):
        planner.plan(problem(0.05), budget=planner.Budget(attempts=1, on_progress=seen.append))
    assert [step.attempts for step in seen] == [1]


@pytest.mark.parametrize("error", [KeyboardInterrupt, StopIteration])
def test_an_exception_of_the_function_ends_the_planning(error: type[BaseException]) -> None:
    def cancel(_: planner.Progress) -> None:
        raise error

    with pytest.raises(error):
        planner.plan(problem(None), budget=planner.Budget(on_progress=cancel))
