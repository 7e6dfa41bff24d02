"""Remedies of a refused waypoint or motion of the tool work."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import Ruckig
from planner.backends.splines.cubic import Cubic
from planner.errors import JointPositionLimit, PlanningError, UnreachableWaypoint
from planner.kinematics import forward_kinematics
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.robots import load_robot
from planner.spatial import Pose
from tests.planner.problems_of_tests import ARMS
from tests.sizes import SIZE

LISTS = min(100, SIZE.examples // 8)
"""Number of lists of waypoints, nearly all with an unreachable one."""


def unreachable_list(seed: int) -> PlanningProblem:
    """Draw poses in and out of reach with lines that leave it, aligned with the axes in every second list."""
    rng = np.random.default_rng(seed)
    robot = load_robot(ARMS[seed % len(ARMS)])
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    waypoints: list[AnyWaypoint] = [JointWaypoint(position=rng.uniform(lower, upper))]
    for _ in range(rng.integers(1, 4)):
        (pose,) = forward_kinematics(robot, [rng.uniform(lower, upper)])
        stretched = pose.position * rng.choice([1.0, 1.5, 3.0])
        if seed % 2:
            stretched = np.round(stretched, 1)
        motion = LinearMotion() if rng.random() < 0.4 else JointMotion()
        if rng.random() < 0.3:
            move = CartesianMove(tuple(rng.choice([-3.0, 0.0, 0.5, 2.0], 3)))
            waypoints.append(RelativeWaypoint(move=move, frame="base", motion=motion))
        else:
            rotation = None if robot.dof == 3 or rng.random() < 0.3 else pose.rotation
            waypoints.append(PoseWaypoint(pose=Pose(stretched, rotation), motion=motion))
    return PlanningProblem(robot, waypoints)


@pytest.mark.large_only
@pytest.mark.sized
def test_every_remedy_of_an_unreachable_list_leads_to_a_plan() -> None:
    refused = told = 0
    for seed in range(LISTS):
        problem = unreachable_list(seed)
        try:
            plan(problem, Cubic())
        except PlanningError as refusal:
            refused += 1
            for remedy in refusal.remedies:
                told += 1
                assert plan(remedy.applied_to(problem), Cubic()).certificate.satisfied
            for hint in refusal.hints:
                with pytest.raises(PlanningError):
                    plan(hint.applied_to(problem), Cubic())
    assert refused >= LISTS // 2
    assert told >= LISTS // 5


@pytest.mark.parametrize("count", [1, 2])
def test_a_position_in_millimetres_is_said_to_look_like_it(count: int) -> None:
    """The remedy mends one such position; of two positions, each remedy mends one."""
    robot = load_robot("kuka_kr16_2")
    here = np.array([0.1, -1.2, 1.4, 0.2, 0.6, -0.3])
    (pose,) = forward_kinematics(robot, [here])
    far = PoseWaypoint(pose=Pose(pose.position * 1000.0, pose.rotation))
    problem = PlanningProblem(robot, [JointWaypoint(position=here + 0.2), *[far] * count])
    with pytest.raises(UnreachableWaypoint, match="looks like millimetres") as refusal:
        plan(problem)
    (change,) = refusal.value.remedies + refusal.value.hints
    assert len(refusal.value.remedies) == (count == 1)
    assert np.allclose(change.value.position, pose.position)


@pytest.mark.parametrize(("duration", "helps"), [(None, True), (0.05, False)])
def test_rest_at_the_start_is_a_remedy_only_where_nothing_else_is_refused(duration: float | None, helps: bool) -> None:
    """A slide at its limit starts with a velocity towards it; at rest it could start, but not within 0.05 s."""
    start, end = np.array([[0.0, 0.0, 0.2, 0.0, 0.3, 0.0], [0.1, 0.1, 0.2, 0.0, 0.3, 0.0]])
    waypoints = [JointWaypoint(start), JointWaypoint(end, duration=duration)]
    problem = PlanningProblem(load_robot("date_sorting_arm"), waypoints)
    with pytest.raises(JointPositionLimit) as refused:
        plan(problem, Ruckig(initial_velocity=(0.0, -0.05, 0.0, 0.0, 0.0, 0.0)))
    (remedy,) = refused.value.remedies if helps else refused.value.hints
    assert remedy.field == ("backend", "initial_velocity")
    assert bool(refused.value.remedies) == helps
