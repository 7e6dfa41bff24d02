"""Variants and remedies compose: lists with a free motion get all attempts of lists without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.errors import Collision, InfeasibleDuration, PlanningError
from planner.problems.blend_radii import blend_radii
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.planning.blend_cases import ASKED, BESIDE_A_LINE, along_a_rectangle, ball_at
from tests.planner.scene.brute_force import least_distance

AROUND = [planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT, motion=planner.FreeMotion())]
"""A detour around the wall, with corners."""

SCENE = planner.Scene([WALL], margin=0.01)


def refusal_of(problem: planner.PlanningProblem, **options: object) -> PlanningError:
    with pytest.raises(PlanningError) as refused:
        planner.plan(problem, **options)  # type: ignore[arg-type]
    return refused.value


def beyond(joint: int, by: float) -> planner.JointWaypoint:
    """Return a joint position beside the end of the detour."""
    position = RIGHT.copy()
    position[joint] += by
    return planner.JointWaypoint(position)


@pytest.mark.large_only
def test_blends_become_smaller_beside_a_free_motion() -> None:
    problem = along_a_rectangle(ball_at(*BESIDE_A_LINE), planner.LinearMotion())
    alone = planner.plan(problem)
    back = replace(problem.waypoints[0], motion=planner.FreeMotion())
    together = planner.plan(replace(problem, waypoints=[*problem.waypoints, back]))
    assert blend_radii(together.problem) == blend_radii(alone.problem) != {1: ASKED, 2: ASKED}
    assert [warning.message for warning in together.warnings if warning.code == "blend_reduced"] == [
        warning.message for warning in alone.warnings if warning.code == "blend_reduced"
    ]


@pytest.mark.parametrize("detour", [False, True], ids=["without a free motion", "with one"])
def test_as_many_remedies_with_a_free_motion_as_without(detour: bool) -> None:
    limits = planner.Limits(velocity_scale=0.1)
    short = replace(beyond(3, 1.0), duration=1.5, limits=limits)
    waypoints = [*AROUND, short] if detour else [AROUND[1], short]
    if not detour:
        waypoints[0] = replace(AROUND[1], motion=planner.JointMotion())
    problem = planner.PlanningProblem(ARM, waypoints, scene=SCENE)
    refusal = refusal_of(problem)
    assert isinstance(refusal, InfeasibleDuration)
    last = len(waypoints) - 1
    fields = [remedy.field for remedy in refusal.remedies]
    assert fields == [("waypoints", last, "duration"), ("waypoints", last, "limits", "velocity_scale")]
    for remedy in refusal.remedies:
        planner.plan(remedy.applied_to(problem))


def test_refusals_behind_a_detour_name_waypoints_as_requested() -> None:
    """The corners of the detour were counted: `from waypoint 3 to 4`, beside a segment 1."""
    through = planner.JointWaypoint(LEFT)
    once = planner.Budget(attempts=1)
    refusal = refusal_of(planner.PlanningProblem(ARM, [*AROUND, through], scene=SCENE), budget=once)
    assert isinstance(refusal, Collision)
    assert refusal.segment == 1
    assert "from waypoint 1 to 2" in refusal.message
    assert refusal.message == str(refusal)
    hurried = replace(beyond(3, 1.0), duration=0.01)
    refusal = refusal_of(planner.PlanningProblem(ARM, [*AROUND, hurried], scene=SCENE), budget=once)
    assert isinstance(refusal, InfeasibleDuration)
    assert (refusal.segment, refusal.waypoint) == (1, 2)
    assert refusal.message.startswith("segment 1 cannot be done in 0.01 s")
    far = planner.PoseWaypoint(planner.Pose([9.0, 0.0, 0.0], np.eye(3)))
    problem = planner.PlanningProblem(ARM, [*AROUND, far, replace(AROUND[1], position=LEFT)], scene=SCENE)
    refusal = refusal_of(problem, budget=once)
    assert refusal.waypoint == 2
    assert "waypoint 2" in refusal.message


def test_warnings_behind_a_detour_name_waypoints_as_requested() -> None:
    again = planner.JointWaypoint(RIGHT, dwell=0.5)
    plan = planner.plan(planner.PlanningProblem(ARM, [*AROUND, again], scene=SCENE))
    assert len(plan.problem.waypoints) > 3
    assert plan.problem.numbers[-2:] == (1, 2)
    (repeated,) = [warning.message for warning in plan.warnings if warning.code == "waypoint_repeated"]
    assert repeated.startswith("waypoint 2:")


@pytest.mark.large_only
def test_remedies_are_applied_to_the_requested_waypoint() -> None:
    """A remedy behind a detour applies to the request and leads to a plan."""
    through = planner.JointWaypoint(LEFT)
    problem = planner.PlanningProblem(ARM, [*AROUND, through], scene=SCENE)
    refusal = refusal_of(problem)
    assert refusal.remedies
    for remedy in refusal.remedies:
        plan = planner.plan(remedy.applied_to(problem))
        assert least_distance(ARM, SCENE, plan.trajectory) > 0.01 - 2e-5
        assert remedy.duration is not None


@pytest.mark.large_only
def test_one_budget_bounds_all_attempts() -> None:
    """With a budget of one attempt nothing else is tried, and the refusal is that of the request."""
    problem = along_a_rectangle(ball_at(*BESIDE_A_LINE), planner.LinearMotion())
    refusal = refusal_of(problem, budget=planner.Budget(attempts=1))
    assert isinstance(refusal, Collision)
    assert not refusal.remedies
    assert not isinstance(refusal_of(problem, budget=planner.Budget(seconds=0.0)), planner.InvalidProblem)
    few = planner.plan(problem, budget=planner.Budget(attempts=3))
    assert few.certificate.satisfied
    assert 0.0 < blend_radii(few.problem)[1] < blend_radii(planner.plan(problem).problem)[1]
