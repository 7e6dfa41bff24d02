"""Free motions beside moving objects: clear at dense samples, by a detour or a wait, or refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import planner
from planner.planning.moving.swept import with_swept
from planner.scene import CONTACT_TOLERANCE
from planner.spatial import Pose
from tests.planner.cells.brute_force import distance
from tests.planner.certificate.belts import ARM, CROSSING, LEFT, RIGHT, least_distance, on_belt, world_of

MARGIN = 0.01
FREE = planner.FreeMotion()


def free_problem(
    thing: planner.SceneObject, *more: planner.SceneObject, motion: Any = FREE, **fields: Any
) -> planner.PlanningProblem:
    """Return the problem of a free motion across the way of an object."""
    goal = planner.JointWaypoint(RIGHT, motion=motion)
    scene = planner.Scene([thing, *more], margin=MARGIN)
    return planner.PlanningProblem(ARM, [LEFT, goal], scene=scene, **fields)


def pillar(speed: float, delay: float = 0.3, height: float = 0.1, width: float = 0.1) -> planner.SceneObject:
    """Return a box that crosses the way of the arm at a speed, m/s, after a delay, s."""
    thing = on_belt(delay, speed)
    return replace(thing, shapes=[planner.Box([width, 0.1, height])])


@pytest.mark.parametrize(
    ("thing", "way"),
    [
        (pillar(0.4), "detour"),
        (pillar(0.05, height=0.7), "detour"),
        pytest.param(pillar(0.1), "detour", marks=pytest.mark.large_only),
        (pillar(0.4, height=1.2, width=0.3), "wait"),
    ],
)
def test_a_free_motion_keeps_clear_of_a_passing_object_at_dense_samples(thing: planner.SceneObject, way: str) -> None:
    with pytest.raises(planner.Collision):
        planner.plan(free_problem(thing, motion=planner.JointMotion()), budget=planner.Budget(attempts=1))
    plan = planner.plan(free_problem(thing), budget=planner.Budget(attempts=12))
    assert plan.certificate.clearance is not None and plan.certificate.clearance.scene is not None
    least = least_distance(plan, thing, np.linspace(0.0, plan.trajectory.duration, 150))
    assert MARGIN - CONTACT_TOLERANCE <= plan.certificate.clearance.scene.lower <= least + 1e-9
    (detour,) = plan.detours
    said = [warning.message for warning in plan.warnings if warning.code == "waits_for_object"]
    assert detour.has_corners == (way == "detour")
    assert bool(said) == (way == "wait") == (plan.trajectory.departures[0] > 0.0)
    if said:
        waited = plan.trajectory.departures[0]
        assert said == [f"the robot waits {waited:.4g} s longer at waypoint 0, until box has passed"]


@pytest.mark.parametrize(("delay", "way"), [(0.4, "detour"), (0.1, "wait")])
def test_a_robot_that_has_taken_an_object_that_stopped_goes_around_another_or_waits(delay: float, way: str) -> None:
    tip, velocity = planner.forward_kinematics(ARM, LEFT).position, np.array([0.0, 0.0, 0.5])
    motion = planner.ConstantVelocity(velocity, end=1.0)
    crate = planner.SceneObject("crate", [planner.Box([0.06] * 3)], Pose(tip - velocity), motion=motion)
    thing = pillar(0.4, delay=6.0 + delay)
    take = planner.JointWaypoint(LEFT, earliest_arrival=6.0, attach=[planner.Attach("crate")])
    waypoints: list[Any] = [[0.8, -1.6, 1.4, -1.77, -1.57, 0.0], take, planner.JointWaypoint(RIGHT, motion=FREE)]
    problem = planner.PlanningProblem(ARM, waypoints, scene=planner.Scene([thing, crate], margin=MARGIN))
    plan = planner.plan(problem, budget=planner.Budget(attempts=12))
    assert least_distance(plan, thing, np.linspace(6.0, plan.trajectory.duration, 100)) >= MARGIN - CONTACT_TOLERANCE
    assert plan.detours[0].has_corners == (way == "detour")
    assert (plan.trajectory.departures[1] > 6.0) == (way == "wait")


def test_a_detour_that_takes_longer_than_a_wait_is_not_taken() -> None:
    thing = pillar(0.4, height=1.2, width=0.3)
    waited = planner.plan(free_problem(thing)).trajectory
    for speed in (0.4, 2.0):  # the faster one has passed sooner
        plan = planner.plan(free_problem(pillar(speed, 0.35, 0.7)), budget=planner.Budget(attempts=12))
        assert plan.trajectory.duration < waited.duration


def test_free_motions_that_meet_no_moving_object_are_as_before() -> None:
    away = pillar(0.4, delay=20.0)
    seen: list[planner.Progress] = []
    with_it = planner.plan(free_problem(away), budget=planner.Budget(on_progress=seen.append))
    still = replace(away, motion=None, pose=Pose([3.0, 3.0, 0.0]))
    without = planner.plan(free_problem(still))
    assert (with_it.trajectory.coefficients == without.trajectory.coefficients).all()
    assert len(seen) == 1


def test_where_neither_a_detour_nor_a_wait_helps_the_refusal_says_so() -> None:
    goal = planner.forward_kinematics(ARM, RIGHT).position
    wall = replace(
        pillar(1.0), pose=Pose(goal - [0.0, 0.3, 0.0]), motion=planner.ConstantVelocity([0, 1.0, 0], end=0.3)
    )
    with pytest.raises(planner.Collision, match="no detour that was found avoids box, and no wait where") as refusal:
        planner.plan(free_problem(wall), budget=planner.Budget(attempts=3))
    assert refusal.value.segment == 0
    # A requested duration leaves no time to wait.
    with pytest.raises(planner.Collision, match="no wait"):
        given = free_problem(pillar(0.4, delay=0.6, height=1.2, width=0.3), duration=1.2)
        planner.plan(given, budget=planner.Budget(attempts=3))


def test_copies_with_their_margins_cover_an_object_at_all_times() -> None:
    rng = np.random.default_rng(5)
    door = planner.TimedPoses(
        [0.5, 1.2], [Pose.from_rpy([0.5, 0.2, 0.1], [0, 0, 1.2]), Pose([0.1, 0.4, 0.0], np.eye(3))]
    )
    box = [planner.Box([0.1, 0.3, 0.2])]
    things = [
        planner.SceneObject("door", box, Pose([0.4, 0.0, 0.0], np.eye(3)), motion=door),
        planner.SceneObject("part", box, Pose(CROSSING), margin=0.02, motion=planner.ConstantVelocity([0.0, 1.5, 0.3])),
    ]
    scene = planner.Scene(
        things, margin=0.005, allowed_pairs=[("link_1", "door")], pair_margins=[("link_2", "part", 0.1)]
    )
    begin, end = 0.3, 1.4
    swept = with_swept(scene, things, begin, end)
    assert swept.objects[:2] == tuple(things)
    balls = [planner.Sphere(1e-3)]
    for thing, own in zip(things, (0.005, 0.02), strict=True):
        copies = [other for other in swept.objects[2:] if other.id.startswith(thing.id)]
        pairs = {name for pair in swept.allowed_pairs for name in pair}
        assert (copies[0].id in pairs) == (thing.id == "door")
        assert len([row for row in swept.pair_margins if row[1] == copies[0].id]) == (thing.id == "part")
        for time in rng.uniform(begin, end, 25).tolist():
            ((_, placed),) = world_of(thing)(time)
            point = placed.translation + placed.rotation @ (rng.uniform(-0.5, 0.5, 3) * [0.1, 0.3, 0.2])
            ball = [(balls[0], type(placed)(np.eye(3), point))]
            gaps = [distance(ball, world_of(copy)(0.0)) - (copy.margin or 0.0) for copy in copies]
            assert min(gaps) <= -own + 1e-9, "a point of the object is within the margin of a copy"
