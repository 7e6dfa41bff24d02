"""Properties of every plan of every back end, on random requests."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.corpus.promises import (
    is_continuous,
    keeps_joint_limits,
    keeps_least_durations,
    keeps_sampled_limits,
    times_its_actions,
)
from planner.backends import BACKENDS, BackEnd
from planner.planning import plan
from planner.problems.problem import PlanningProblem
from tests.planner.every_bit import every_bit
from tests.planner.problems_of_tests import PARTS, REQUESTS, backend_of, problems, try_on_random

CONTINUITY = {"cubic": 1, "trapezoidal": 1, "quintic": 2, "toppra": 1, "min_effort": 2, "ruckig": 2, "auto": 2}


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", sorted(BACKENDS))
def test_every_plan_keeps_its_promises(kind: str, part: int) -> None:
    check = partial(keeps_its_promises, backend_of(kind))
    try_on_random(REQUESTS * 9 // 10 // len(PARTS), part, problems(kind), check)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
@settings(max_examples=max(4, settings.default.max_examples // 50))
@given(data=st.data())
def test_the_same_request_gives_the_same_plan(kind: str, data: st.DataObject) -> None:
    problem = data.draw(problems(kind))
    result = plan(problem, backend_of(kind))
    assert every_bit(plan(problem, backend_of(kind))) == every_bit(result)


def keeps_its_promises(backend: BackEnd, problem: PlanningProblem) -> None:
    result = plan(problem, backend)
    trajectory = result.trajectory
    positions = np.array([waypoint.position for waypoint in problem.waypoints])

    assert (np.diff(trajectory.sample_times(trajectory.duration / 97.3)) > 0.0).all()
    assert (np.diff(trajectory.breakpoints) > 0.0).all()
    met, velocity = trajectory.evaluate(trajectory.arrivals, [0, 1])
    assert np.abs(met - positions).max() <= 1e-9
    assert np.abs(velocity).max() <= 1e-9
    assert np.abs(trajectory.evaluate(trajectory.departures, [0])[0] - positions).max() <= 1e-9
    keeps_joint_limits(result)
    keeps_least_durations(result)
    times_its_actions(result)
    keeps_sampled_limits(result)
    is_continuous(result, CONTINUITY[backend.kind])
