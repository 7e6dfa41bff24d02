"""Motions slow down near objects, by dense samples, and stay unchanged otherwise."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import planner
from planner.backends import BACKENDS
from planner.certificate import SpeedZoneCheck, interpolated
from planner.certificate.speed_zones import certify_speed_zones
from planner.errors import InfeasibleDuration, InvalidProblem
from planner.problems.problem import LinearMotion
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import Robot
from planner.scene import CollisionChecker, Scene, SceneObject
from planner.shapes import Box, HalfSpace, Sphere
from planner.spatial import FloatArray, Pose
from planner.speed_zones import (
    RESOLUTION,
    SPEED_BOUND_EXCESS,
    ZONE_TIME_ACCURACY,
    SpeedZone,
    most_speed,
    moving_bodies,
    near_intervals,
    speed_reached,
)
from tests.planner.capsule_arm import CAPSULE_ARM, arm_of_capsules
from tests.planner.problems_of_tests import backend_of
from tests.planner.scene.brute_force import distances_over_time
from tests.planner.scene.random_scenes import in_capsules, motion_between, random_scene
from tests.planner.scene.slow_enough import RING, assert_slow_enough, speeds_in_zone, speeds_over_time
from tests.sizes import SIZE

KUKA = CAPSULE_ARM
PERSON = SceneObject("person", [Sphere(0.2)], Pose([1.75, 0.0, 0.8]))
TABLE = SceneObject("table", [Box([1.0, 2.0, 0.05])], Pose([1.3, 0.0, 0.1]))
CELL = Scene([PERSON, TABLE])
IN_FULL = partial(pytest.param, marks=pytest.mark.large_only)
"""A case that the quick tests leave to CI."""

ZONE = SpeedZone(0.45, 0.25, ["person"])


def at(y: float, z: float = 0.8) -> planner.PoseWaypoint:
    return planner.PoseWaypoint(Pose.from_rpy([1.1, y, z], [0.0, np.pi, 0.0]))


LEFT, BESIDE, RIGHT = at(-0.9), at(0.0), at(0.9)
PAST = planner.PlanningProblem(KUKA, [LEFT, RIGHT], scene=CELL, speed_zones=[ZONE])


def in_line(waypoint: planner.PoseWaypoint, **more: object) -> planner.PoseWaypoint:
    return replace(waypoint, motion=LinearMotion(), **more)  # type: ignore[arg-type]


def slow_plan(problem: planner.PlanningProblem, kind: str = "quintic") -> planner.Plan:
    """Plan a problem and assert, by samples, that speeds in its zones are at most the certified peaks."""
    plan = planner.plan(problem, backend_of(kind))
    assert problem.scene is not None
    seen = assert_slow_enough(problem.robot, problem.scene, plan.trajectory, problem.speed_zones)
    for check, fastest in zip(plan.certificate.speed_zones, seen, strict=True):
        assert check.satisfied
        assert fastest <= check.peak * (1.0 + 1e-9)
    return plan


@pytest.mark.large_only
@pytest.mark.parametrize(
    "kind",
    [kind if kind == "ruckig" else IN_FULL(kind) for kind in BACKENDS],
)
def test_every_back_end_slows_down_past_a_person(kind: str) -> None:
    plan = slow_plan(PAST, kind)
    plain = planner.plan(replace(PAST, speed_zones=()), backend_of(kind))
    (check,) = plan.certificate.speed_zones
    assert plan.certificate.satisfied
    assert plan.certificate.continuity >= plain.certificate.continuity
    assert check.ratio == pytest.approx(0.995, abs=0.006)
    speeds = speeds_in_zone(KUKA, CELL, plan.trajectory, ZONE.clearance, ZONE.objects)
    assert speeds.mean() > 0.93 * ZONE.speed, "it has to be no slower than it is asked to be"


def test_the_path_is_that_of_the_plain_plan() -> None:
    plan, plain = (planner.plan(problem, planner.Trapezoidal()) for problem in (PAST, replace(PAST, speed_zones=())))
    start, way = plain.path.positions[0], np.diff(plain.path.positions, axis=0)[0]
    (positions,) = plan.trajectory.evaluate(plan.trajectory.sample_times(0.01), [0])
    off = positions - start - np.outer((positions - start) @ way / (way @ way), way)
    assert np.abs(off).max() < 1e-9
    assert plan.certificate.clearance is not None
    assert plain.certificate.clearance is not None
    one, other = (report.scene for report in (plan.certificate.clearance, plain.certificate.clearance))
    assert one is not None
    assert other is not None
    assert one.upper == pytest.approx(other.upper, abs=2e-3)


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("waypoints", "zones"),
    [
        pytest.param([BESIDE, RIGHT], [ZONE], id="start inside"),
        IN_FULL([LEFT, BESIDE], [ZONE], id="end inside"),
        IN_FULL([BESIDE, at(0.05), at(0.0, 0.85)], [ZONE], id="whole inside"),
        pytest.param([LEFT, RIGHT], [SpeedZone(50.0, 0.4)], id="a zone without end"),
        IN_FULL([LEFT, RIGHT], [SpeedZone(0.3, 0.01, ["person"])], id="very slow"),
        IN_FULL(
            [LEFT, RIGHT], [SpeedZone(0.6, 0.6, ["person"]), ZONE, SpeedZone(0.3, 0.15, ["person"])], id="several zones"
        ),
        IN_FULL([LEFT, replace(BESIDE, dwell=0.3), RIGHT], [ZONE], id="a rest inside"),
        pytest.param([LEFT, replace(BESIDE, transition=ThroughTransition()), RIGHT], [ZONE], id="passed through"),
        pytest.param([LEFT, in_line(RIGHT)], [ZONE], id="a line"),
        pytest.param(
            [LEFT, in_line(BESIDE, transition=BlendTransition(0.1)), in_line(at(0.0, 1.3))], [ZONE], id="blended lines"
        ),
    ],
)
@pytest.mark.parametrize("kind", ["trapezoidal", IN_FULL("ruckig")])
def test_structured_cases(waypoints: list[planner.PoseWaypoint], zones: list[SpeedZone], kind: str) -> None:
    problem = replace(PAST, waypoints=waypoints, speed_zones=zones)
    plan = slow_plan(problem, kind)
    plain = planner.plan(replace(problem, speed_zones=()), backend_of(kind))
    assert plan.trajectory.duration > plain.trajectory.duration
    assert plan.certificate.waypoint_error < 1e-9
    rests = plan.trajectory.departures - plan.trajectory.arrivals
    assert rests == pytest.approx(plain.trajectory.departures - plain.trajectory.arrivals, abs=1e-9)


@pytest.mark.parametrize("zone", [SpeedZone(0.3, 0.1, ["person"]), SpeedZone(0.45, 50.0)])
def test_a_motion_that_is_slow_or_away_is_the_plain_one(zone: SpeedZone) -> None:
    line = replace(PAST, waypoints=[LEFT, in_line(RIGHT)])
    plan = slow_plan(replace(line, speed_zones=[zone]))
    plain = planner.plan(replace(line, speed_zones=()), planner.Quintic())
    assert np.array_equal(plan.trajectory.coefficients, plain.trajectory.coefficients)
    (check,) = plan.certificate.speed_zones
    assert (check.time is None) == (check.peak == 0.0) == (not check.intervals)


def test_what_is_carried_belongs_to_the_robot() -> None:
    bar = planner.AttachedObject("bar", [Box([0.6, 0.02, 0.02])], Pose([0.0, 0.0, 0.05]))
    along = replace(PAST, waypoints=[LEFT, in_line(RIGHT)], speed_zones=[SpeedZone(0.25, 0.25, ["person"])])
    empty = planner.plan(along, planner.Quintic())
    assert empty.certificate.speed_zones[0].intervals == ()
    carrying = planner.plan(replace(along, scene=Scene([PERSON, TABLE], [bar])), planner.Quintic())
    assert carrying.certificate.speed_zones[0].ratio == pytest.approx(0.995, abs=0.006)
    assert carrying.trajectory.duration > 1.2 * empty.trajectory.duration


@pytest.mark.large_only
def test_a_tool_counts_where_it_has_no_shape() -> None:
    long = KUKA.with_tool(Pose([0.4, 0.0, 0.3]))
    start, end = (planner.JointWaypoint([0.3, -1.2, 1.4, 0.0, 1.0, turn]) for turn in (-1.5, 1.5))
    zone = SpeedZone(50.0, 1.0)
    plan = slow_plan(planner.PlanningProblem(long, [start, end], scene=CELL, speed_zones=[zone]), "ruckig")
    times = plan.trajectory.sample_times(0.001)
    assert speeds_over_time(long, times, plan.trajectory).max() == pytest.approx(1.0, rel=0.015)


@pytest.mark.large_only
def test_a_free_motion_is_slowed() -> None:
    wall = SceneObject("wall", [Box([0.8, 0.1, 1.2])], Pose([1.3, 0.0, 0.6]))
    scene, zones = Scene([wall], margin=0.02), [SpeedZone(0.2, 0.3)]
    problem = planner.PlanningProblem(
        KUKA, [LEFT, replace(RIGHT, motion=planner.FreeMotion())], scene=scene, speed_zones=zones
    )
    plan = slow_plan(problem, "quintic")
    assert plan.detours[0].has_corners
    assert plan.certificate.speed_zones[0].ratio > 0.98


@pytest.mark.large_only
@pytest.mark.parametrize("kind", ["cubic", IN_FULL("ruckig")])
def test_durations_are_kept(kind: str) -> None:
    shortest = planner.plan(PAST, backend_of(kind)).trajectory.duration
    enough = planner.plan(replace(PAST, duration=shortest + 1.0), backend_of(kind))
    assert enough.certificate.satisfied
    assert enough.trajectory.duration == shortest + 1.0
    segment = slow_plan(replace(PAST, waypoints=[LEFT, replace(RIGHT, duration=shortest + 1.0)]), kind)
    assert segment.trajectory.duration == pytest.approx(shortest + 1.0, rel=1e-12)


@pytest.mark.large_only
@pytest.mark.parametrize("kind", ["cubic", "ruckig"])
def test_durations_that_are_too_short_are_refused(kind: str) -> None:
    shortest = planner.plan(PAST, backend_of(kind)).trajectory.duration
    for problem in (
        replace(PAST, duration=shortest - 1.0),
        replace(PAST, waypoints=[LEFT, replace(RIGHT, duration=shortest - 1.0)]),
    ):
        with pytest.raises(InfeasibleDuration) as refusal:
            planner.plan(problem, backend_of(kind))
        remedy = refusal.value.remedies[0]
        assert remedy.value == pytest.approx(shortest, rel=1e-6)
        slow_plan(remedy.applied_to(problem), kind)


@pytest.mark.parametrize(
    ("problem", "backend", "field"),
    [
        (replace(PAST, scene=None), planner.Cubic(), ("speed_zones",)),
        (
            replace(PAST, speed_zones=[SpeedZone(0.3, 0.2, ["nobody"])]),
            planner.Cubic(),
            ("speed_zones", 0, "objects", 0),
        ),
        (replace(PAST, speed_zones=[ZONE, SpeedZone(0.3, 0.0)]), planner.Cubic(), ("speed_zones", 1, "speed")),
        (replace(PAST, speed_zones=[SpeedZone(-0.1, 0.1)]), planner.Cubic(), ("speed_zones", 0, "clearance")),
        (replace(PAST, speed_zones=[SpeedZone(0.3, 0.1, [])]), planner.Cubic(), ("speed_zones", 0, "objects")),
        (PAST, planner.Trapezoidal(acceleration_time=0.3), ("backend", "acceleration_time")),
        (PAST, planner.Ruckig(final_velocity=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0)), ("backend", "final_velocity")),
        (
            replace(
                PAST,
                waypoints=[
                    LEFT,
                    replace(BESIDE, transition=ThroughTransition([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])),
                    RIGHT,
                ],
            ),
            planner.Ruckig(),
            ("waypoints", 1, "transition", "velocity"),
        ),
    ],
)
def test_what_cannot_be_kept_is_refused(
    problem: planner.PlanningProblem, backend: planner.BackEnd, field: tuple[str | int, ...]
) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        planner.plan(problem, backend)
    assert [fault.field for fault in refusal.value.faults] == [field]


def test_pairs_that_may_touch_do_not_count() -> None:
    links = sorted({shape.link for shape in KUKA.collision_shapes})
    allowed = replace(PAST, scene=Scene([PERSON], allowed_pairs=[(link, "person") for link in links]))
    (check,) = planner.plan(allowed, planner.Quintic()).certificate.speed_zones
    assert check.intervals == ()


def test_a_trajectory_of_another_origin_is_held_against_zones() -> None:
    plain = planner.plan(replace(PAST, speed_zones=()), planner.Quintic()).trajectory
    (check,) = certify_speed_zones([ZONE], [CollisionChecker(KUKA, CELL)], [KUKA], plain)
    truth = speeds_in_zone(KUKA, CELL, plain, ZONE.clearance, ZONE.objects).max()
    assert not check.satisfied
    assert truth <= check.peak <= 1.02 * truth
    assert check.time is not None
    there = speeds_over_time(KUKA, np.array([check.time]), plain, RING)[0]
    assert 0.98 * there <= check.lower <= there * (1.0 + 1e-3), "some point is that fast, and hardly any faster"
    assert check.exceeded == check.intervals, "it flies past"
    assert check.link in {shape.link for shape in KUKA.collision_shapes}
    assert SpeedZoneCheck.from_dict(check.as_dict()) == check


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_it_is_told_when_a_zone_is_broken(speed: float) -> None:
    """The reported intervals contain all samples that are too fast, and only such samples away from their ends."""
    plain = planner.plan(replace(PAST, speed_zones=()), planner.Quintic()).trajectory
    zone = SpeedZone(5.0, speed)
    (check,) = certify_speed_zones([zone], [CollisionChecker(KUKA, CELL)], [KUKA], plain)
    assert not check.satisfied
    times = plain.sample_times(2e-3)
    speeds, edges = speeds_over_time(KUKA, times, plain), np.array(check.exceeded)
    apart = ZONE_TIME_ACCURACY * plain.duration
    outer = ((times[:, None] >= edges[:, 0]) & (times[:, None] <= edges[:, 1])).any(axis=1)
    inner = ((times[:, None] >= edges[:, 0] + apart) & (times[:, None] <= edges[:, 1] - apart)).any(axis=1)
    assert outer[speeds > speed * (1.0 + 1e-9)].all()
    assert inner.any()
    assert (speeds[inner] > 0.95 * speed).all(), "bounds of capsules are a little higher than what samples see"
    assert not outer.all()


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_velocities_that_jump_are_no_faster_than_they_are(share: float) -> None:
    """A joint moves to and fro at a constant speed, as linear samples: three times its speed was reported."""
    start, turn = np.array([0.0, -1.2, 1.4, 0.0, 1.0, 0.0]), np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    times = np.arange(9.0)
    to_and_fro = interpolated(KUKA, times, start + np.outer(times % 2.0, turn), interpolation="linear")
    fastest = speeds_over_time(KUKA, np.array([0.3]), to_and_fro, RING)[0]
    zone = SpeedZone(5.0, share * fastest)
    (check,) = certify_speed_zones([zone], [CollisionChecker(KUKA, CELL)], [KUKA], to_and_fro)
    assert check.satisfied == (share > 1.0)
    assert check.peak == pytest.approx(fastest, rel=1e-2)
    assert check.lower == pytest.approx(fastest, rel=1e-2)
    assert check.exceeded == (() if check.satisfied else ((0.0, 8.0),))


ARMS = ("kuka_kr16_2", "date_sorting_arm", "welding_arm", "ngv_refuelling_arm")


@pytest.mark.sized
@pytest.mark.parametrize("arm", ARMS)
def test_bounds_hold_on_random_motions(arm: str) -> None:
    """The intervals contain all near samples and extend no further than allowed; none is faster."""
    rng = np.random.default_rng(ARMS.index(arm))
    robot = replace(arm_of_capsules(arm))  # a copy of its own, whose shapes are changed
    in_capsules(robot)
    for _ in range(max(1, SIZE.examples // 50)):
        start, end = random_positions(robot, rng)
        motion, scene = motion_between(start, end), random_scene(rng, 1.5)
        checker, clearance = CollisionChecker(robot, scene), float(rng.uniform(0.01, 0.5))
        intervals = near_intervals(checker, motion, clearance, None)
        times = np.linspace(0.0, motion.duration, 600)
        apart = np.nanmin(distances_over_time(robot, scene, times, motion), axis=(1, 2))
        inside = (times[:, None] >= intervals[:, 0]) & (times[:, None] <= intervals[:, 1])
        assert inside.any(axis=1)[apart < clearance - 1e-6].all()
        assert (apart[inside.any(axis=1)] < clearance + 2.0 * RESOLUTION + 1e-4).all()
        bound, _ = most_speed(moving_bodies(robot, checker), motion, np.array([[0.0, motion.duration]]))
        truth = speeds_over_time(robot, times, motion).max()
        assert truth <= bound * (1.0 + 1e-9)
        assert bound <= 1.15 * truth * (1.0 + SPEED_BOUND_EXCESS)
        at = float(rng.uniform(0.0, motion.duration))
        lower, _ = speed_reached(moving_bodies(robot, checker), motion, at)
        there = speeds_over_time(robot, np.array([at]), motion, RING)[0]
        assert 0.85 * there <= lower <= there * (1.0 + 5e-3), (
            "no faster than some point, which may be off the directions"
        )


def random_positions(robot: Robot, rng: np.random.Generator) -> FloatArray:
    lower, upper = (np.clip(robot.limit(name), -3.0, 3.0) for name in ("lower", "upper"))
    return rng.uniform(lower, upper, (2, robot.dof))


def test_rest_near_a_wall_takes_no_time_to_prove() -> None:
    wall = SceneObject("wall", [HalfSpace([0.0, 0.0, 1.0], -1.0)])
    position = np.array([0.3, -1.2, 1.4, 0.0, 1.0, 0.0])
    motion = motion_between(position, position)
    checker = CollisionChecker(KUKA, Scene([wall]))
    assert near_intervals(checker, motion, 10.0, None).tolist() == [[0.0, motion.duration]]
    assert most_speed(moving_bodies(KUKA, checker), motion, np.array([[0.0, 1.5]]))[0] == pytest.approx(0.0, abs=1e-12)
