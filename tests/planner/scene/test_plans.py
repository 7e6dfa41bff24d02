"""Plans in a scene: every back end keeps the margins, or refuses with remedies that work."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import planner
from planner.backends import BACKENDS
from planner.certificate import clearance
from planner.certificate.clearance import certify_clearance
from planner.errors import ClearanceUnproved, Collision, StartInCollision
from planner.paths import solve_path
from planner.planning import variants
from planner.planning.attempts import Attempt, Refused, run
from planner.planning.remedies.collisions import collision_remedies
from planner.problems.problem import PolylineMotion
from planner.problems.transitions import BlendTransition
from planner.robots import load_robot
from planner.scene import CONTACT_TOLERANCE, Budget, CollisionChecker, Scene, SceneObject, clearances
from planner.shapes import Box, HalfSpace, Sphere
from planner.spatial import Pose
from tests.planner.problems_of_tests import backend_of
from tests.planner.scene.around_a_ball import BALL, GOAL, KUKA, REST, effort
from tests.planner.scene.brute_force import distances_over_time, least_distance
from tests.sizes import SIZE

TABLE = SceneObject("table", [Box([1.0, 2.0, 0.05])], Pose([1.3, 0.0, 0.3]))
WALL = SceneObject("wall", [Box([0.3, 0.05, 0.4])], Pose([1.2, 0.0, 0.5]))
LEFT, RIGHT = (planner.PoseWaypoint(Pose.from_rpy([1.2, y, 0.7], [0.0, np.pi, 0.0])) for y in (-0.6, 0.6))
OVER = planner.PoseWaypoint(Pose.from_rpy([1.2, 0.0, 1.1], [0.0, np.pi, 0.0]))


def in_scene(*objects: SceneObject, margin: float = 0.0) -> planner.PlanningProblem:
    return planner.PlanningProblem(KUKA, [LEFT, RIGHT], scene=Scene(objects, margin=margin))


@pytest.mark.long_table
@pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, marks=pytest.mark.large_only if kind == "min_effort" else ()) for kind in BACKENDS],
)
def test_every_back_end_keeps_clear(kind: str) -> None:
    problem = in_scene(TABLE, margin=0.05)
    plan = planner.plan(replace(problem, waypoints=(LEFT, OVER, RIGHT)), backend_of(kind))
    assert problem.scene is not None
    truth = least_distance(KUKA, problem.scene, plan.trajectory)
    clearance = plan.certificate.clearance
    assert clearance is not None
    assert clearance.itself is None
    assert clearance.scene is not None
    assert 0.05 <= clearance.scene.lower <= truth + 1e-6
    assert clearance.scene.upper == pytest.approx(truth, abs=1.1e-3)
    assert clearance.scene.pair == ("link_6", "table")


SEARCHING = planner.MinEffort(knots=8)


@pytest.mark.parametrize("ahead", [variants.EXTRA_MARGINS, ()], ids=["cut off", "held nearer"])
def test_a_search_that_leads_to_a_collision_keeps_clear(
    ahead: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The straight motion is free, and so were the plans of all other back ends: min_effort refused it."""
    monkeypatch.setattr(variants, "EXTRA_MARGINS", ahead)
    problem = planner.PlanningProblem(KUKA, [REST, GOAL], scene=Scene([BALL]))
    assert problem.scene is not None
    blind = planner.plan(replace(problem, scene=None), SEARCHING)
    with pytest.raises(Collision):
        certify_clearance(CollisionChecker(KUKA, problem.scene), blind.trajectory)
    plan, straight = planner.plan(problem, SEARCHING), planner.plan(problem, planner.Quintic())
    assert least_distance(KUKA, problem.scene, plan.trajectory) > 0.0
    assert plan.backend == SEARCHING
    codes = [warning.code for warning in plan.warnings]
    assert codes == ["estimated_shapes"] + ([] if ahead else ["suboptimal"])
    assert plan.trajectory.duration == pytest.approx(straight.trajectory.duration, rel=1e-9)
    least, found, most = (effort(KUKA, each.trajectory) for each in (blind, plan, straight))
    assert found < least + (0.02 if ahead else 0.5) * (most - least)


@pytest.mark.large_only
def test_remedies_of_a_search_work_though_they_are_proved_without_it() -> None:
    ball = replace(BALL, pose=Pose([0.6286, -0.4701, 1.0]), shapes=[Sphere(0.15)])
    problem = planner.PlanningProblem(KUKA, [REST, GOAL], scene=Scene([ball]))
    with pytest.raises(Collision) as refusal:
        planner.plan(problem, SEARCHING)
    assert refusal.value.remedies
    remedy = refusal.value.remedies[0]
    planner.plan(remedy.applied_to(problem), SEARCHING)


def test_a_collision_says_when_and_where() -> None:
    problem = in_scene(TABLE, WALL)
    assert problem.scene is not None
    blind = planner.plan(replace(problem, scene=None), planner.Quintic()).trajectory
    with pytest.raises(Collision) as refusal:
        certify_clearance(CollisionChecker(KUKA, problem.scene), blind)
    error = refusal.value
    assert error.pair[1] == "wall"
    assert error.segment == 0
    assert error.time is not None
    assert error.point is not None
    times = np.linspace(0.0, blind.duration, 500)
    links = [shape.link for shape in KUKA.collision_shapes]
    rows = [k for k, link in enumerate(links) if link == error.pair[0]]
    apart = distances_over_time(KUKA, problem.scene, times, blind)[:, rows, 1].min(axis=1)
    assert error.time == pytest.approx(times[np.argmax(apart < 0.0)], abs=blind.duration / 499)
    assert error.time > 0.0
    assert error.depth > 0.0
    (positions,) = blind.evaluate(times, [0])
    there = np.argmin(np.abs(positions - error.position).max(axis=1))
    assert apart[there] == pytest.approx(-error.depth, abs=0.01)


@pytest.mark.parametrize("motion", [PolylineMotion, planner.FreeMotion])
def test_a_higher_approach_and_a_detour_are_offered_as_working_remedies(motion: type) -> None:
    problem = in_scene(TABLE, WALL)
    with pytest.raises(Collision) as refusal:
        planner.plan(problem)
    other = [remedy for remedy in refusal.value.remedies if isinstance(remedy.value, motion)]
    assert other
    plan = planner.plan(other[0].applied_to(problem))
    assert problem.scene is not None
    assert least_distance(KUKA, problem.scene, plan.trajectory) > 0.0


@pytest.mark.parametrize("transition", [planner.ThroughTransition(), BlendTransition(0.25)])
def test_stopping_and_cutting_less_are_offered(transition: planner.ThroughTransition | BlendTransition) -> None:
    """A ball in the inside of a corner collides with paths that cut it, or that pass it on a curve."""
    corner = planner.PoseWaypoint(OVER.pose, transition=transition)
    problem = replace(in_scene(), waypoints=(LEFT, corner, RIGHT))
    blind = planner.plan(replace(problem, scene=None))
    stopping = planner.plan(replace(problem, scene=None, waypoints=(LEFT, OVER, RIGHT)))
    ways = [
        planner.forward_kinematics(KUKA, plan.trajectory.evaluate(plan.trajectory.sample_times(0.005), [0])[0])
        for plan in (blind, stopping)
    ]
    points, others = (np.array([pose.position for pose in way]) for way in ways)
    off = np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1)
    apart = float(off.max())
    ball = SceneObject("ball", [Sphere(apart / 4.0)], Pose(points[off.argmax()]))
    arm = [shape.link for shape in KUKA.collision_shapes if shape.link != "link_6"]
    problem = replace(problem, scene=Scene([ball], allowed_pairs=[(link, "ball") for link in dict.fromkeys(arm)]))
    with pytest.raises(Collision) as refusal:
        planner.plan(problem)
    for remedy in refusal.value.remedies:
        planner.plan(remedy.applied_to(problem))


def test_a_margin_that_is_kept_is_offered() -> None:
    problem = in_scene(TABLE, margin=0.4)
    with pytest.raises(StartInCollision) as refusal:
        planner.plan(problem)
    *_, remedy = refusal.value.remedies
    assert remedy.field == ("scene", "margin")
    assert remedy.value == pytest.approx(0.318, abs=2e-3)
    planner.plan(remedy.applied_to(problem))


@pytest.mark.long_table
@pytest.mark.parametrize("name", ["one waypoint", "one waypoint twice", "rests at the end", "taken at the end"])
def test_where_a_robot_rests_in_a_collision_its_remedies_are_of_its_waypoints(name: str) -> None:
    """Where nothing moves before it, a collision is `start_in_collision`; at the end of a motion it names a segment."""
    (low,) = planner.plan(replace(in_scene(), waypoints=[RIGHT])).path.positions
    there, away = planner.JointWaypoint(low, dwell=1.0), planner.JointWaypoint(low - [0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
    block = SceneObject("block", [Box([0.1, 0.1, 0.1])], Pose(np.array([1.2, 0.6, 0.7])))
    taken = replace(there, attach=[planner.Attach("part")])
    lists = {
        "one waypoint": [there],
        "one waypoint twice": [there, there],
        "rests at the end": [away, there, there],
        "taken at the end": [away, taken],
    }
    part = SceneObject("part", [Sphere(0.02)], Pose(np.array([1.2, 0.6, 0.6])))
    problem = replace(in_scene(block, part, margin=0.01), waypoints=lists[name])
    with pytest.raises(Collision) as refusal:
        planner.plan(problem)
    assert isinstance(refusal.value, StartInCollision) == name.startswith("one")
    assert refusal.value.segment == (None if name.startswith("one") else 0)
    for remedy in refusal.value.remedies:
        assert remedy.field[0] != "waypoints" or int(remedy.field[1]) < len(problem.waypoints)
        planner.plan(remedy.applied_to(problem))


def test_a_robot_that_only_rests_has_no_other_way() -> None:
    """No request leads there: where nothing moves, a collision exists at the start. Remedies do not rely on it."""
    problem = replace(in_scene(TABLE), waypoints=[RIGHT])
    refusal = Collision("", pair=("link_6", "table"), depth=0.1, point=None, position=np.zeros(6), segment=0)
    refused = Refused(Attempt(problem, planner.Cubic(), (), solve_path(problem)), refusal)
    remedies = run(collision_remedies(refused, refusal), planner.Budget())
    assert {remedy.field for remedy in remedies} == {("waypoints", 0, "configuration"), ("scene", "allowed_pairs")}


def test_what_takes_too_long_to_prove_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tool moves a metre along a plane, just above the margin: that takes more than a few distances."""
    near = planner.plan(replace(in_scene(), waypoints=(LEFT, replace(RIGHT, motion=planner.LinearMotion()))))
    floor = SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0])])
    others = [(shape.link, "floor") for shape in KUKA.collision_shapes if shape.link != "link_6"]
    links = [shape.link for shape in KUKA.collision_shapes]
    times = np.linspace(0.0, near.trajectory.duration, 200)
    apart = distances_over_time(KUKA, Scene([floor]), times, near.trajectory)
    least = float(np.nanmin(apart[:, links.index("link_6")]))
    checker = CollisionChecker(KUKA, Scene([floor], allowed_pairs=others, margin=least + 5e-6))
    assert certify_clearance(checker, near.trajectory) is not None
    monkeypatch.setattr(clearance, "clearances", partial(clearances, budget=Budget(5, 5)))
    with pytest.raises(ClearanceUnproved) as refusal:
        certify_clearance(checker, near.trajectory)
    assert refusal.value.pair == ("link_6", "floor")


def test_an_arm_that_meets_itself_is_refused_where_that_is_asked() -> None:
    robot = load_robot("ur5")
    home, folded = (planner.JointWaypoint(q) for q in ([0, -1.5, 1.5, 0, 0.5, 0], [0, -1.5, 3.1, 0, 0.5, 0]))
    problem = planner.PlanningProblem(robot, [home, folded], self_collision=True)
    with pytest.raises(Collision) as refusal:
        planner.plan(problem)
    assert refusal.value.pair[0] != refusal.value.pair[1]
    assert planner.plan(replace(problem, self_collision=None)).certificate.clearance is None
    near = planner.JointWaypoint([0.2, -1.5, 1.5, 0, 0.5, 0])
    short = planner.plan(planner.PlanningProblem(robot, [home, near], self_collision=True))
    clearance = short.certificate.clearance
    assert clearance is not None
    assert clearance.itself is not None
    assert clearance.scene is None


@pytest.mark.long_table
@pytest.mark.parametrize("kind", [kind for kind in BACKENDS if kind != "min_effort"])
def test_random_plans_are_clear_or_refused(kind: str) -> None:
    """Waypoints passed, blended or stopped at, among balls: dense samples of returned plans keep every margin."""
    rng, robot = np.random.default_rng(len(kind)), load_robot("date_sorting_arm")
    lower, upper = robot.limit("lower").clip(-1.5, None), robot.limit("upper").clip(None, 1.5)
    planned = 0
    for _ in range(max(2, SIZE.requests // 72)):
        centers = rng.uniform([-1.0, -1.0, 0.2], [1.0, 1.0, 1.5], (4, 3))
        balls = [SceneObject(f"ball_{k}", [Sphere(0.1)], Pose(center)) for k, center in enumerate(centers)]
        scene = Scene(balls, margin=float(rng.choice([0.0, 0.01, 0.05])))
        corner = rng.choice([planner.StopTransition(), planner.ThroughTransition(), BlendTransition(0.05)])
        first, middle, last = (planner.JointWaypoint(q) for q in rng.uniform(lower, upper, (3, robot.dof)))
        waypoints = (first, replace(middle, transition=corner), last)
        try:
            plan = planner.plan(planner.PlanningProblem(robot, waypoints, scene=scene), backend_of(kind))
        except (Collision, ClearanceUnproved):
            continue
        planned += 1
        assert least_distance(robot, scene, plan.trajectory) > scene.margin - CONTACT_TOLERANCE
    assert planned
