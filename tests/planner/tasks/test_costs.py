"""The duration of a motion in a plan counts for the opposite motion only where that takes the same way."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.tasks.changes import ToolsOfTasks
from planner.tasks.costs import Costs
from planner.tasks.states import states_of_tasks
from planner.tasks.travel import JointSpeeds
from tests.planner.tasks.parts import HOME, ROBOT, joint_waypoint


@pytest.mark.parametrize("reversible", [False, True])
def test_known_duration_counts_backwards_only_for_tasks_that_are_reversed(*, reversible: bool) -> None:
    problem = planner.PlanningProblem(ROBOT, ["home", "home"])
    ends = np.array(HOME) + np.array([[0.1], [0.3], [-0.2], [-0.6]])
    tasks = [
        planner.Task([joint_waypoint(a), joint_waypoint(b)], reversible=reversible) for a, b in (ends[:2], ends[2:])
    ]
    tools = ToolsOfTasks.of(problem, tasks, (), None)
    speeds = JointSpeeds.of(problem, stops=True)
    states = states_of_tasks(problem, tools.tasks, [ROBOT] * 4, None, speeds)
    costs = Costs(states, speeds, np.zeros((4, 2)), tools, has_end=True)
    everything = np.arange(len(states.tasks))
    before = costs.between(everything, everything)
    first, second = states.of_tasks[1][0], states.of_tasks[2][0]
    costs.set_known(first, second, 100.0)
    changed = costs.between(everything, everything) > before + 50.0
    expected = {(first, second)}
    if reversible:
        expected.add((states.of_tasks[2][1], states.of_tasks[1][1]))
    assert {(int(a), int(b)) for a, b in np.argwhere(changed)} == expected
