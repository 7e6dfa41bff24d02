"""Remedies of starts and goals in collision, and of missing detours: each is planned as offered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.errors import Collision, NoPathFound, StartInCollision
from planner.shapes import Box
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.scene.brute_force import least_distance

THERE = planner.tool_pose(ARM, RIGHT)

BLOCK = planner.SceneObject("block", [Box([0.4] * 3)], planner.Pose(THERE.position + np.array([0.1, 0.0, -0.15])))
"""A box in the way of the wrist at one of the ends."""

DIE = planner.SceneObject("die", [Box([0.02] * 3)], planner.Pose(THERE.position + np.array([0.0, 0.0, -0.1])))
"""A box 35 mm away from the hand there."""

MOTIONS = [planner.JointMotion(), planner.FreeMotion()]


def refused(problem: planner.PlanningProblem) -> tuple[planner.PlanningError, list[planner.Plan]]:
    """Return the refusal of a problem and the plans of its remedies, each proved clear with its promised duration."""
    with pytest.raises(planner.PlanningError) as refusal:
        planner.plan(problem)
    plans = []
    for remedy in refusal.value.remedies:
        changed = remedy.applied_to(problem)
        plans.append(planner.plan(changed))
        assert plans[-1].trajectory.duration <= remedy.duration * (1.0 + 1e-9)
        assert changed.scene is not None
        if not changed.scene.allowed_pairs:
            assert least_distance(ARM, changed.scene, plans[-1].trajectory) > changed.scene.margin - 2e-5
    return refusal.value, plans


def between(
    start: planner.PoseWaypoint | planner.JointWaypoint,
    goal: planner.PoseWaypoint | planner.JointWaypoint,
    motion: planner.JointMotion,
    scene: planner.Scene,
) -> planner.PlanningProblem:
    return planner.PlanningProblem(ARM, [start, replace(goal, motion=motion)], scene=scene)


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_goal_in_collision_is_drawn_back_along_the_tools_axis(motion: planner.JointMotion) -> None:
    goal = planner.PoseWaypoint(THERE)
    problem = between(planner.JointWaypoint(LEFT), goal, motion, planner.Scene([BLOCK], margin=0.01))
    refusal, _ = refused(problem)
    assert isinstance(refusal, Collision)
    (nearer,) = [remedy for remedy in refusal.remedies if remedy.field == ("waypoints", 1, "pose")]
    assert THERE.rotation is not None
    off = THERE.position - nearer.value.position
    assert off @ THERE.rotation[:, 2] == pytest.approx(0.2)
    assert abs(off @ THERE.rotation[:, 0]) < 1e-12


@pytest.mark.parametrize("motion", MOTIONS)
def test_before_a_joint_goal_in_collision_the_robot_may_stay(motion: planner.JointMotion) -> None:
    scene = planner.Scene([DIE], margin=0.08)
    problem = between(planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT), motion, scene)
    refusal, _ = refused(problem)
    fields = [remedy.field for remedy in refusal.remedies]
    assert fields == [("waypoints", 1, "position"), ("scene", "allowed_pairs"), ("scene", "margin")]
    assert refusal.remedies[2].value == pytest.approx(0.034, abs=1.1e-3)


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_start_in_collision_has_remedies(motion: planner.JointMotion) -> None:
    goal = planner.JointWaypoint(LEFT)
    inside = between(planner.JointWaypoint(RIGHT), goal, motion, planner.Scene([BLOCK], margin=0.01))
    refusal, _ = refused(inside)
    assert isinstance(refusal, StartInCollision)
    (left_out,) = refusal.remedies
    assert left_out.field == ("scene", "allowed_pairs")
    assert {name for _, name in left_out.value} == {"block"}
    near = between(planner.JointWaypoint(RIGHT), goal, motion, planner.Scene([DIE], margin=0.08))
    refusal, _ = refused(near)
    assert [remedy.field for remedy in refusal.remedies] == [("scene", "allowed_pairs"), ("scene", "margin")]
    assert refusal.remedies[0].value == (("link_6", "die"),)


def test_where_few_motions_were_looked_at_a_longer_search_is_offered() -> None:
    problem = between(
        planner.JointWaypoint(LEFT),
        planner.JointWaypoint(RIGHT),
        planner.FreeMotion(most_checks=5),
        planner.Scene([WALL], margin=0.01),
    )
    refusal, plans = refused(problem)
    assert isinstance(refusal, NoPathFound)
    (longer,) = refusal.remedies
    assert longer.field == ("waypoints", 1, "motion", "most_checks")
    assert plans[0].detours[0].has_corners


def wall(name: str, x: tuple[float, float], z: tuple[float, float]) -> planner.SceneObject:
    """Return a wall in the plane of symmetry of both ends."""
    middle = planner.Pose([sum(x) / 2.0, 0.0, sum(z) / 2.0])
    return planner.SceneObject(name, [Box([x[1] - x[0], 0.1, z[1] - z[0]])], middle)


@pytest.mark.large_only
def test_where_no_detour_keeps_the_margin_a_smaller_one_is_offered() -> None:
    """The straight motion goes through a slot, 0.2 m from its upper edge."""
    walls = [wall("low", (0.5, 4.0), (-2.0, 0.35)), wall("high", (0.5, 4.0), (1.55, 5.0))]
    scene = planner.Scene([*walls, wall("back", (-4.0, -0.5), (-2.0, 5.0))], margin=0.25)
    free = planner.FreeMotion(most_checks=1000)
    problem = between(planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT), free, scene)
    refusal, (plan,) = refused(problem)
    assert isinstance(refusal, NoPathFound)
    (smaller,) = refusal.remedies
    assert smaller.field == ("scene", "margin")
    assert smaller.value == pytest.approx(least_distance(ARM, scene, plan.trajectory), abs=3e-3)
