"""Clearance from objects that move: nothing is proved that dense samples contradict, nor refused that they clear."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import planner
from planner.certificate import certify_clearance
from planner.problems.rides import handling_of
from planner.scene import CONTACT_TOLERANCE, segment_scenes
from planner.scene.phases import object_phases
from planner.spatial import FloatArray, Pose
from planner.timing.arrivals import with_wait
from tests.planner.cells.brute_force import distance, random_plan, robot_world, se3
from tests.planner.certificate.belts import (
    AHEAD,
    ARM,
    CROSSING,
    LEFT,
    MIDDLE,
    RIGHT,
    UP,
    least_distance,
    on_belt,
    world_of,
)
from tests.sizes import SIZE

SAMPLING_ERROR = 0.02
"""Largest error of least distances at the samples of these tests, m."""

ONCE = planner.Budget(attempts=1)
"""The budget of a plan without remedies."""


def in_scene(*objects: planner.SceneObject, waypoints: Any = (LEFT, RIGHT), margin: float = 0.0) -> planner.Plan:
    """Plan among objects, or refuse without remedies."""
    problem = planner.PlanningProblem(ARM, list(waypoints), scene=planner.Scene(objects, margin=margin))
    return planner.plan(problem, budget=ONCE)


def waits_in_scene(thing: planner.SceneObject, waypoints: Any = (LEFT, RIGHT)) -> tuple[planner.Remedy, Any]:
    """Return the wait that is offered where an object is in the way, and the plan with it."""
    problem = planner.PlanningProblem(ARM, list(waypoints), scene=planner.Scene([thing]))
    with pytest.raises(planner.Collision) as refused:
        planner.plan(problem, budget=planner.Budget(attempts=8))
    (wait,) = (remedy for remedy in refused.value.remedies if remedy.field[-1] == "dwell")
    plan = planner.plan(wait.applied_to(problem), budget=ONCE)
    assert plan.trajectory.duration == pytest.approx(wait.duration)
    assert least_distance(plan, thing, np.linspace(0.0, plan.trajectory.duration, 60)) > 0.0
    return wait, problem


def random_object(rng: np.random.Generator, near: FloatArray, duration: float) -> planner.SceneObject:
    """Return an object that comes near a point during a trajectory."""
    shape = rng.choice([planner.Box(rng.uniform(0.05, 0.3, 3)), planner.Capsule(0.05, 0.3), planner.Sphere(0.1)])
    passes, velocity = rng.uniform(0.0, duration), rng.normal(size=3) * 0.4
    start = Pose.from_rpy(near - velocity * passes + rng.normal(size=3) * 0.2, rng.normal(size=3))
    if rng.random() < 0.5:
        motion: planner.ConstantVelocity | planner.TimedPoses = planner.ConstantVelocity(
            velocity, rng.choice([None, passes])
        )
    else:
        times = np.cumsum(rng.uniform(0.2, duration, 3))
        places = start.position + velocity * times[:, None] + rng.normal(size=(3, 3)) * 0.1
        motion = planner.TimedPoses(times, [Pose.from_rpy(place, rng.normal(size=3)) for place in places])
    return planner.SceneObject("thing", [shape], start, motion=motion)


@pytest.mark.sized
def test_proofs_agree_with_dense_samples_of_time() -> None:
    rng = np.random.default_rng(28)
    proved = refused = 0
    for _ in range(max(4, SIZE.requests // 20)):
        mounting = Pose.from_rpy(rng.normal(size=3) * 0.3, rng.normal(size=3))
        robot = ARM.derived(mounting=mounting)
        plan = random_plan(robot, rng, 3)
        middle = robot_world(robot, plan.trajectory)(plan.trajectory.duration / 2.0)[-1][1].translation
        thing = random_object(rng, middle, plan.trajectory.duration)
        truth = least_distance(plan, thing, np.linspace(0.0, plan.trajectory.duration, 60))
        for margin in (0.0, max(truth - 0.02, 0.0), max(truth + 0.002, 0.0)):
            checker = planner.CollisionChecker(robot, planner.Scene([thing], margin=margin), self_collision=False)
            try:
                report = certify_clearance(checker, plan.trajectory)
            except planner.Collision as refusal:
                refused += 1
                assert truth - SAMPLING_ERROR < margin, "a motion that is clearly free is refused"
                assert refusal.time is not None
                there = least_distance(plan, thing, np.array([refusal.time]))
                assert there == pytest.approx(margin, abs=0.02 if refusal.time else np.inf)
                continue
            proved += 1
            assert report is not None
            assert report.scene is not None
            assert truth > margin - CONTACT_TOLERANCE
            assert margin - CONTACT_TOLERANCE <= report.scene.lower <= truth + 1e-6
    assert proved
    assert refused


def test_bodies_move_as_the_poses_of_their_object_do() -> None:
    rng = np.random.default_rng(3)
    for _ in range(12):
        thing = random_object(rng, rng.normal(size=3), 1.5)
        base = Pose.from_rpy(rng.normal(size=3), rng.normal(size=3)) if rng.random() < 0.7 else None
        world, seen = world_of(thing), 0
        for phase in object_phases(thing, base, 6.0):
            for time in rng.uniform(max(phase.begin, 0.0), min(phase.end, 6.0), 4):
                ((_, expected),) = world(time)
                expected = se3(base).inverse() * expected
                placed, (piece,) = phase.bodies.at(phase.within(time[None], time[None])[0]), phase.bodies.pieces
                rotation = placed.rotations[0, piece.joint]
                there = rotation @ piece.translation + placed.origins[0, piece.joint]
                np.testing.assert_allclose(there, expected.translation, atol=1e-12)
                np.testing.assert_allclose(rotation @ piece.rotation, expected.rotation, atol=1e-12)
                seen += 1
        assert seen


def test_the_margin_of_each_pair_counts() -> None:
    plain, wide = moving(SLIDES), replace(moving(SLIDES), id="wide", margin=0.03)
    held = planner.AttachedObject("held", [planner.Sphere(0.05)], margin=0.05)
    near = [("link_1", "wide", 0.004)]
    scene = planner.Scene([plain, wide], [held], [("link_2", "far")], margin=0.01, pair_margins=near)
    checker = planner.CollisionChecker(ARM, scene)
    expected = {("link_1", plain): 0.01, ("link_1", wide): 0.004, ("link_2", wide): 0.03, ("held", wide): 0.05}
    assert {pair: checker.margin_to(*pair) for pair in expected} == expected
    assert checker.margin_to("link_2", plain) is None


def test_following_errors_widen_margins() -> None:
    errors = {joint.name: {"following_error": 0.02} for joint in ARM.joints}
    follows = ARM.derived(limits=errors)
    plan, thing = in_scene(), on_belt(0.45, across=-0.3)
    for robot, is_free in ((ARM, True), (follows, False)):
        truth = least_distance(plan, thing, np.linspace(0.0, plan.trajectory.duration, 60))
        scene = planner.Scene([thing], margin=truth - 0.01)
        checker = planner.CollisionChecker(robot, scene, self_collision=False)
        if is_free:
            certify_clearance(checker, plan.trajectory)
            continue
        with pytest.raises(planner.Collision):
            certify_clearance(checker, plan.trajectory)


def test_an_object_that_passes_before_or_after_does_not_matter() -> None:
    free = in_scene()
    meets = free.trajectory.duration / 2.0
    for delay in (meets - 1.5, meets + 1.5):
        plan = in_scene(on_belt(delay))
        np.testing.assert_array_equal(plan.trajectory.coefficients, free.trajectory.coefficients)
        assert plan.certificate.clearance.scene.pair[1] == "box"
    with pytest.raises(planner.Collision, match="box, which moves") as refused:
        in_scene(on_belt(meets))
    assert 0.0 < refused.value.time < meets
    assert refused.value.segment == 0


def test_a_margin_holds_exactly_beside_a_passing_object() -> None:
    plan, thing = in_scene(), on_belt(0.45, across=-0.3)
    times = np.linspace(0.0, plan.trajectory.duration, 3000)
    robot, other = robot_world(ARM, plan.trajectory), world_of(thing)
    coarse = [distance(robot(t), other(t)) for t in times[::30].tolist()]
    near = int(np.argmin(coarse)) * 30
    truth = min(distance(robot(t), other(t)) for t in times[max(0, near - 30) : near + 30].tolist())
    assert truth > 0.0
    assert in_scene(thing, margin=truth - 1e-4).certificate.clearance.scene.lower <= truth
    with pytest.raises(planner.Collision):
        in_scene(thing, margin=truth + 1e-4)


@pytest.mark.parametrize(
    "motion", [planner.ConstantVelocity([0.0, 0.0, 0.0]), planner.TimedPoses([2.0], [Pose([0.0, 0.0, 0.0])])]
)
def test_an_object_whose_motion_leads_nowhere_is_static(
    motion: planner.ConstantVelocity | planner.TimedPoses,
) -> None:
    still = planner.SceneObject("box", [planner.Box([0.1, 0.1, 0.5])], Pose(CROSSING))
    if isinstance(motion, planner.TimedPoses):
        motion = planner.TimedPoses(motion.times, [still.pose])
    around = planner.JointWaypoint(RIGHT, motion=planner.FreeMotion())
    first, second = (in_scene(thing, waypoints=(LEFT, around)) for thing in (still, replace(still, motion=motion)))
    np.testing.assert_array_equal(first.trajectory.coefficients, second.trajectory.coefficients)
    assert first.certificate.as_dict() == second.certificate.as_dict()


def test_a_fast_thin_object_between_two_samples_is_seen() -> None:
    duration = in_scene().trajectory.duration
    velocity, passes = np.array([0.0, 0.0, 50.0]), 0.5 * duration
    shape = planner.Box([2.0, 2.0, 1e-3])
    motion = planner.ConstantVelocity(velocity)
    plate = planner.SceneObject("plate", [shape], Pose(CROSSING - velocity * passes), motion=motion)
    with pytest.raises(planner.Collision) as refused:
        in_scene(plate)
    assert refused.value.time == pytest.approx(passes, abs=0.02)


def test_contact_at_the_start_is_refused_there() -> None:
    tool = planner.forward_kinematics(ARM, LEFT).position
    motion = planner.ConstantVelocity([0.0, -1.0, 0.0])
    thing = planner.SceneObject("box", [planner.Box([0.1] * 3)], Pose(tool), motion=motion)
    with pytest.raises(planner.StartInCollision) as refused:
        in_scene(thing)
    assert refused.value.time == 0.0
    assert refused.value.waypoint == 0


def test_the_base_counts_and_what_may_touch_does_not() -> None:
    motion = planner.ConstantVelocity([0.5, 0.0, 0.0], end=0.6)
    low = planner.SceneObject("cart", [planner.Box([0.1, 0.1, 0.02])], Pose([-0.4, 0.0, 0.01]), motion=motion)
    with pytest.raises(planner.Collision) as refused:
        in_scene(low)
    base = refused.value.pair[0]
    assert base in {shape.link for shape in ARM.collision_shapes if shape.joint == 0}
    scene = planner.Scene([low], allowed_pairs=[(base, "cart")])
    problem = planner.PlanningProblem(ARM, [LEFT, RIGHT], scene=scene)
    assert planner.plan(problem, budget=ONCE).certificate.clearance.scene.pair[0] != base


@pytest.mark.parametrize(
    "waypoints", [(LEFT, RIGHT), pytest.param((MIDDLE, LEFT, RIGHT, LEFT), marks=pytest.mark.large_only)]
)
def test_the_shortest_wait_is_offered(waypoints: tuple[list[float], ...]) -> None:
    free = in_scene(waypoints=waypoints).trajectory
    wait, problem = waits_in_scene(on_belt(float(free.arrivals[-1] + free.departures[-2]) / 2.0), waypoints)
    sooner = replace(wait, value=wait.value - 0.002)
    with pytest.raises(planner.Collision):
        planner.plan(sooner.applied_to(problem), budget=ONCE)


@pytest.mark.large_only
def test_waits_are_no_longer_than_brute_force_finds() -> None:
    rng = np.random.default_rng(53)
    compared = 0
    for _ in range(max(1, SIZE.requests // 8)):
        plan = random_plan(ARM, rng, 3)
        middle = robot_world(ARM, plan.trajectory)(plan.trajectory.duration / 2.0)[-1][1].translation
        velocity = rng.normal(size=3) * 0.4
        pose = Pose.from_rpy(middle - velocity * plan.trajectory.duration / 2.0, rng.normal(size=3))
        box = [planner.Box(rng.uniform(0.05, 0.2, 3))]
        thing = planner.SceneObject("box", box, pose, motion=planner.ConstantVelocity(velocity))
        problem = replace(plan.problem, scene=planner.Scene([thing]), self_collision=False)
        try:
            planner.plan(problem, budget=planner.Budget(attempts=3))
            continue
        except planner.PlanningError as refusal:
            offered = [remedy.value for remedy in refusal.remedies if remedy.field[-1] == "dwell"]
        checker = planner.CollisionChecker(ARM, problem.scene, self_collision=False)

        def is_clear(stop: int, wait: float, plan: planner.Plan = plan, checker: Any = checker) -> bool:
            try:
                certify_clearance(checker, with_wait(plan.trajectory, stop, wait), None)
            except planner.PlanningError:
                return False
            return True

        waits = [wait for wait in np.arange(0.1, 2.0, 0.1).tolist() if is_clear(0, wait) or is_clear(1, wait)]
        assert offered or not waits
        if waits and offered:
            compared += 1
            assert offered[0] <= waits[0] + 1e-3
    assert compared


def test_a_wait_lengthens_a_requested_duration() -> None:
    thing, scene = on_belt(1.5), planner.Scene([on_belt(1.5)])
    problem = planner.PlanningProblem(ARM, [LEFT, RIGHT], scene=scene, duration=3.0)
    with pytest.raises(planner.Collision) as refused:
        planner.plan(problem, budget=planner.Budget(attempts=8))
    wait, longer = refused.value.remedies[:2]
    assert longer.field == ("duration",)
    plan = planner.plan(longer.applied_to(wait.applied_to(problem)))
    assert plan.trajectory.duration == pytest.approx(3.0 + wait.value)
    assert least_distance(plan, thing, np.linspace(0.0, plan.trajectory.duration, 60)) > 0.0


@pytest.mark.large_only
def test_the_robot_waits_for_a_door_to_open() -> None:
    shut = Pose(CROSSING + 0.1 * UP)
    opened = Pose.from_rpy(shut.position - 0.8 * AHEAD, [0.0, 0.0, 1.5])
    door = planner.SceneObject(
        "door", [planner.Box([0.5, 0.02, 1.0])], shut, motion=planner.TimedPoses([1.0, 2.5], [shut, opened])
    )
    wait, _ = waits_in_scene(door)
    assert 0.5 < wait.value < 2.5


@pytest.mark.large_only
def test_a_search_gives_way_to_a_motion_that_keeps_clear() -> None:
    thing = on_belt(0.45, across=-0.25)
    backend = planner.MinEffort(max_deviation=0.3)
    problem = planner.PlanningProblem(ARM, [LEFT, RIGHT], duration=0.9, scene=planner.Scene([thing]))
    try:
        plan = planner.plan(problem, backend)
    except planner.Collision as refused:
        assert refused.pair[1] == "box"
    else:
        assert least_distance(plan, thing, np.linspace(0.0, 0.9, 100)) > 0.0


def test_what_is_carried_and_what_was_put_down_count() -> None:
    part = planner.SceneObject("part", [planner.Sphere(0.05)], Pose(CROSSING - 0.1 * UP))
    cart = on_belt(4.0, size=0.08, across=-0.1)
    there = planner.JointWaypoint(MIDDLE, attach=[planner.Attach("part")])
    lifted, back = planner.JointWaypoint(LEFT), planner.JointWaypoint(MIDDLE, detach=["part"])
    away = planner.JointWaypoint(LEFT, dwell=5.0)
    scene = planner.Scene([part, cart])
    problem = planner.PlanningProblem(ARM, [there, lifted, away], scene=scene)
    planner.plan(problem)  # the part is taken away before the box comes
    with pytest.raises(planner.Collision) as refused:
        planner.plan(replace(problem, waypoints=[there, lifted, back, away]), budget=ONCE)
    assert refused.value.pair == ("part", "box")
    assert refused.value.time == pytest.approx(4.0 - (0.05 + 0.08 / 2.0) / 0.4, abs=1e-3)
    stays = replace(away, dwell=0.5)
    plan = planner.plan(replace(problem, waypoints=[there, lifted, back, stays]), budget=ONCE)
    cart_alone = least_distance(plan, cart, np.linspace(0.0, plan.trajectory.duration, 60))
    assert plan.certificate.clearance.scene.lower <= cart_alone + 1e-6
    assert plan.certificate.clearance.scene.upper <= cart_alone + 2e-3


def test_a_part_is_taken_where_its_belt_stops() -> None:
    grasp = planner.forward_kinematics(ARM, MIDDLE)
    above = Pose(grasp.position + 0.15 * UP, grasp.rotation)
    velocity = np.array([0.0, 0.4, 0.0])
    pose, motion = Pose(CROSSING - 2.0 * velocity - 0.041 * UP), planner.ConstantVelocity(velocity, end=2.0)
    part = planner.SceneObject("part", [planner.Box([0.08] * 3)], pose, motion=motion)
    belt = planner.SceneObject("belt", [planner.Box([0.3, 2.0, 0.1])], Pose(CROSSING - 0.131 * UP))
    take = planner.PoseWaypoint(grasp, motion=planner.LinearMotion(), attach=[planner.Attach("part")], dwell=0.2)
    on_time = replace(take, earliest_arrival=2.0)
    lifted = planner.PoseWaypoint(above, motion=planner.LinearMotion())
    waypoints = [planner.JointWaypoint(LEFT), planner.PoseWaypoint(above), on_time, lifted]
    problem = planner.PlanningProblem(ARM, waypoints, scene=planner.Scene([part, belt], margin=0.005))
    plan = planner.plan(problem, budget=ONCE)
    report = plan.certificate.clearance
    before = least_distance(plan, part, np.linspace(0.0, 2.0, 80))
    assert -0.01 < before < 0.0, "the gripper touches the part when it takes it"
    assert report.contacts.lower == pytest.approx(before, abs=2e-3)
    assert report.scene.lower > 0.005 - 1e-3
    assert segment_scenes(ARM, problem.scene, handling_of(plan.problem), plan.path.positions)[-1].objects == (belt,)
    assert plan.problem.waypoints[1].dwell > 0.5
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.plan(replace(problem, waypoints=[*waypoints[:2], take, lifted]))
    assert [fault.field for fault in refused.value.faults] == [("waypoints", 2, "earliest_arrival")]
    falls = planner.ConstantVelocity(-0.4 * UP, end=2.0)
    through = replace(part, pose=Pose(CROSSING + 0.759 * UP), motion=falls)
    with pytest.raises(planner.Collision):
        planner.plan(replace(problem, scene=planner.Scene([through, belt])), budget=ONCE)


def test_a_plan_with_moving_objects_is_saved_to_the_last_bit(tmp_path: Path) -> None:
    plan = in_scene(on_belt(3.0))
    plan.save(tmp_path / "a.plan")
    again = planner.load(tmp_path / "a.plan")
    assert again.problem.scene is not None
    np.testing.assert_array_equal(again.problem.scene.objects[0].motion.velocity, [0.0, 0.4, 0.0])
    assert again.certificate.as_dict() == plan.certificate.as_dict()
    proof = planner.write_proof(plan)
    assert "clearance: objects of the scene move" in proof["statement"]["not_covered"]
    assert "clearance" not in proof["statement"]["claims"]


def moving(motion: planner.ConstantVelocity | planner.TimedPoses, shape: object = None) -> planner.SceneObject:
    """Return an object far away with a motion."""
    return planner.SceneObject("far", [shape or planner.Sphere(0.1)], Pose([9.0, 0.0, 0.0]), motion=motion)  # type: ignore[list-item]


SLIDES = planner.ConstantVelocity([1.0, 0.0, 0.0])
FLOOR = planner.HalfSpace([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("thing", "field"),
    [
        (moving(planner.ConstantVelocity([1.0, 0.0])), ("motion", "velocity")),
        (moving(planner.ConstantVelocity([np.nan, 0.0, 0.0])), ("motion", "velocity")),
        (moving(planner.ConstantVelocity([1.0, 0.0, 0.0], 0.0)), ("motion", "end")),
        (moving(planner.TimedPoses([], [])), ("motion", "times")),
        (moving(planner.TimedPoses([1.0, 1.0], [Pose([0.0] * 3)] * 2)), ("motion", "times")),
        (moving(planner.TimedPoses([0.0], [Pose([0.0] * 3)])), ("motion", "times")),
        (moving(planner.TimedPoses([1.0, 2.0], [Pose([0.0] * 3)])), ("motion", "poses")),
        (moving(planner.TimedPoses([1.0], [Pose([0.0] * 3, np.ones((3, 3)))])), ("motion", "poses", 0)),
        (moving(SLIDES, FLOOR), ("shapes", 0)),
        (moving(SLIDES, planner.PointCloud([[0.0, 0.0, 0.0]], 0.1)), ("shapes", 0)),
    ],
)
def test_motions_that_are_none_are_refused(thing: planner.SceneObject, field: tuple[str | int, ...]) -> None:
    with pytest.raises(planner.InvalidProblem) as refused:
        in_scene(thing)
    assert ("scene", "objects", 0, *field) in [fault.field for fault in refused.value.faults]


def test_moving_objects_are_not_taken_and_have_no_speed_zones() -> None:
    take = planner.JointWaypoint(LEFT, attach=[planner.Attach("far")])
    zones = [planner.SpeedZone(0.3, 0.1), planner.SpeedZone(0.3, 0.1, ["far"])]
    scene = planner.Scene([moving(SLIDES)])
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.plan(planner.PlanningProblem(ARM, [take, RIGHT], scene=scene, speed_zones=zones))
    fields = {fault.field for fault in refused.value.faults}
    assert fields == {
        ("waypoints", 0, "attach", 0, "id"),
        ("speed_zones", 0, "objects"),
        ("speed_zones", 1, "objects", 0),
    }


def test_checks_without_a_time_leave_moving_objects_out() -> None:
    through = replace(moving(SLIDES), pose=Pose(CROSSING))
    checker = planner.CollisionChecker(ARM, planner.Scene([through]), self_collision=False)
    assert planner.is_free(checker, [MIDDLE]).all()


def test_tasks_in_any_order_need_static_objects() -> None:
    scene, problem = planner.Scene([moving(SLIDES)]), planner.PlanningProblem(ARM, [LEFT])
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.order_tasks(replace(problem, scene=scene), [planner.Task([planner.JointWaypoint(RIGHT)])])
    assert [fault.field for fault in refused.value.faults] == [("scene", "objects", 0, "motion")]
