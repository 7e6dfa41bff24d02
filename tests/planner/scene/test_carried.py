"""Objects that a robot takes and puts down: proved clear with it, checked against dense samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.certificate.clearance import certify_clearance_along, segment_checkers
from planner.errors import ClearanceUnproved, Collision, InvalidProblem
from planner.robots import Robot, load_robot
from planner.scene import CONTACT_TOLERANCE, AttachedObject, CollisionChecker, Scene, SceneObject
from planner.scene.carried import DEEPEST_SUPPORT, ROOM_ON_THE_WAY
from planner.shapes import Box, Cylinder, HalfSpace, Sphere
from planner.spatial import FloatArray, Pose
from tests.planner.capsule_arm import arm_of_capsules
from tests.planner.scene.brute_force import distances_over_time, point_distance
from tests.sizes import SIZE

DATE_ARM = load_robot("date_sorting_arm")
RADIUS = 0.02
"""Radius of the carried ball, m."""

SAMPLES = 120
"""Number of samples of the truth."""

BETWEEN_SAMPLES = 0.02
"""Allowed approach between two samples beyond the distances at the samples, m."""


def tool_in_base(robot: Robot, positions: FloatArray) -> list[pin.SE3]:
    data = robot.model.createData()
    found = []
    for position in positions:
        pin.framesForwardKinematics(robot.model, data, position)
        found.append(data.oMf[robot.tool_frame_id].copy())
    return found


class Apart(NamedTuple):
    """A pair's distance and required distance on a part of a trajectory, m, and whether it touches at an end."""

    distance: float
    requested: float
    touches: bool


def distances_of_pairs(
    problem: planner.PlanningProblem, positions: FloatArray, trajectory: planner.Trajectory, put_down: int, samples: int
) -> Iterator[Apart]:
    """Yield distances of the arm and of a carried ball from the rest of the scene.

    The ball is taken at waypoint 1 and put down at a later one. Distances follow from Pinocchio's kinematics and closed
    forms, at samples.
    """
    robot, scene = problem.robot, problem.scene
    assert scene is not None
    ball, others, margin = scene.objects[0], scene.objects[1:], scene.margin
    picked, placed = tool_in_base(robot, positions[[1, put_down]])
    held_at = picked.inverse().act(ball.pose.position)
    times = np.linspace(0.0, trajectory.duration, samples)
    segments = np.searchsorted(trajectory.departures, times, side="left").clip(1, len(positions) - 1) - 1
    last = robot.model.frames[robot.tool_frame_id].parentJoint
    joints = np.array([shape.joint for shape in robot.collision_shapes])
    arm = distances_over_time(robot, replace(scene, objects=others), times, trajectory)
    yield Apart(float(np.nanmin(arm, initial=np.inf)), margin, touches=False)
    rests = [(1, segments == 0, ball.pose.position)]
    rests += [(put_down, segments == k, placed.act(held_at)) for k in range(put_down, len(positions) - 1)]
    for waypoint, standing, place in rests:
        there = replace(scene, objects=[SceneObject("ball", ball.shapes, Pose(place))])
        (at_waypoint,) = distances_over_time(robot, there, np.array([trajectory.arrivals[waypoint]]), trajectory)
        apart = distances_over_time(robot, there, times[standing], trajectory)[:, :, 0]
        touches = (joints == last) & (at_waypoint[:, 0] < margin) & (segments[standing][0] in (0, put_down))
        for body in np.flatnonzero(joints > 0):
            requested = at_waypoint[body, 0] - ROOM_ON_THE_WAY if touches[body] else margin
            yield Apart(float(apart[:, body].min()), requested, bool(touches[body]))
    carried = (segments >= 1) & (segments < put_down)
    (positions,) = trajectory.evaluate(times[carried], [0])
    centers = np.array([tool.act(held_at) for tool in tool_in_base(robot, positions)])
    for thing in others:
        distance = point_distance(thing, robot.mounting)
        apart = distance(centers) - RADIUS
        ends = distance(np.array([ball.pose.position, placed.act(held_at)])) - RADIUS
        for segment in range(1, put_down):
            near = [end for end, at in zip(ends, (1, put_down - 1), strict=True) if at == segment]
            near = [end for end in near if -DEEPEST_SUPPORT <= end < margin]
            requested = min(near) - ROOM_ON_THE_WAY if near else margin
            yield Apart(float(apart[segments[carried] == segment].min()), requested, bool(near))


def room(problem: planner.PlanningProblem, positions: FloatArray, trajectory: planner.Trajectory) -> float:
    """Return the least clearance beyond the margin, m; the ball is carried from waypoint 1 to 3."""
    pairs = distances_of_pairs(problem, positions, trajectory, 3, SAMPLES)
    return min(pair.distance - pair.requested for pair in pairs)


def is_sound(report: planner.ClearanceReport | None, pairs: list[Apart]) -> bool:
    """Tell whether no certified clearance exceeds the samples, for touching pairs and for the rest."""
    assert report is not None
    parts = {True: report.contacts, False: report.scene}
    for pair in pairs:
        part = parts[pair.touches]
        assert part is not None
        if part.lower > pair.distance + 1e-9:
            return False
    return True


def random_problem(rng: np.random.Generator, robot: Robot) -> planner.PlanningProblem:
    """Draw five waypoints and three objects: the ball is taken at the second and put down at the fourth."""
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    start = rng.uniform(lower, upper)
    positions = start + rng.uniform(0.05, 0.35, (5, 1)) * (rng.uniform(lower, upper, (5, robot.dof)) - start)
    handled: dict[int, Any] = {1: {"attach": [planner.Attach("ball")]}, 3: {"detach": ["ball"]}}
    waypoints = [planner.JointWaypoint(q, **handled.get(k, {})) for k, q in enumerate(positions)]
    tool = tool_in_base(robot, positions[1:2])[0]
    held_at = np.array([0.0, 0.15, 0.0] if robot.id == "date_sorting_arm" else [0.0, 0.0, 0.15])
    ball = SceneObject("ball", [Sphere(RADIUS)], Pose(tool.act(held_at + rng.normal(size=3) * 0.03)))
    things: list[SceneObject] = [ball]
    for k in range(2):
        way = rng.normal(size=3)
        shape = Box(rng.uniform(0.05, 0.2, 3)) if rng.random() < 0.5 else Sphere(rng.uniform(0.05, 0.1))
        place = tool.translation + way / np.linalg.norm(way) * rng.uniform(0.3, 0.9)
        things.append(SceneObject(f"thing_{k}", [shape], Pose.from_rpy(place, rng.normal(size=3))))
    return planner.PlanningProblem(robot, waypoints, scene=Scene(things, margin=0.0))


@pytest.mark.parametrize("arm", ["kuka_kr16_2", "date_sorting_arm"])
def test_what_is_carried_is_proved_clear_where_dense_samples_see_it_clear(arm: str) -> None:
    rng = np.random.default_rng([7, len(arm)])
    decided = {True: 0, False: 0}
    for _ in range(max(1, SIZE.requests // 40)):
        truth = -1.0
        while truth < 2.5 * BETWEEN_SAMPLES:  # else everything would be refused
            problem = random_problem(rng, arm_of_capsules(arm))
            idle = [replace(waypoint, attach=(), detach=()) for waypoint in problem.waypoints]
            blind = planner.plan(replace(problem, scene=None, waypoints=idle))
            truth = room(problem, blind.path.positions, blind.trajectory)
        assert problem.scene is not None
        for margin in (0.0, max(0.0, truth - 2.0 * BETWEEN_SAMPLES), max(0.0, truth + 1e-3)):
            requested = replace(problem, scene=replace(problem.scene, margin=margin))
            left = room(requested, blind.path.positions, blind.trajectory)
            checkers = segment_checkers(replace(requested, self_collision=False), blind.path.positions)
            try:
                report = certify_clearance_along(checkers, blind.trajectory)
            except (Collision, ClearanceUnproved) as refusal:
                assert isinstance(refusal, Collision) and left < BETWEEN_SAMPLES, (margin, left, refusal.message)
                decided[False] += 1
                continue
            assert left > -2.0 * CONTACT_TOLERANCE, (margin, left)
            pairs = distances_of_pairs(requested, blind.path.positions, blind.trajectory, 3, SAMPLES)
            assert is_sound(report, list(pairs))
            decided[True] += 1
    assert min(decided.values()) > 0, decided


def carried_over(height: float, **changes: Any) -> planner.PlanningProblem:
    """Make a problem that lifts a ball from one tray to another with l1 alone, the arm's tool down."""
    down = [-np.pi / 2.0, np.pi / 2.0, 0.0]
    places = {"from": (-0.3, 0.4), "to": (0.7, 0.25)}

    def at(place: str, lift: float, **more: Any) -> planner.JointWaypoint:
        turn, out = places[place]
        return planner.JointWaypoint([turn, 0.05 + lift, out, *down], **more)

    waypoints = [
        at("from", height),
        at("from", 0.0, attach=[planner.Attach("ball")], payload=planner.Payload(0.1)),
        at("from", height),
        at("to", height),
        at("to", 0.0, detach=["ball"], put_down=True),
        at("to", height),
    ]
    stands = planner.tool_pose(DATE_ARM, waypoints[1].position).position - [0.0, 0.0, 0.02 + RADIUS]
    goes = planner.tool_pose(DATE_ARM, waypoints[4].position).position - [0.0, 0.0, 0.02 + RADIUS]
    trays = [
        SceneObject(name, [Box([0.2, 0.2, 0.04])], Pose(place - [0.0, 0.0, 0.02 + RADIUS]))
        for name, place in (("tray_1", stands), ("tray_2", goes))
    ]
    between = (stands + goes) / 2.0 * [1.0, 1.0, 0.0] * 1.05 + [0.0, 0.0, stands[2] + 0.05]
    wall = SceneObject("wall", [Box([0.02, 0.5, 0.1])], Pose.from_rpy(between, [0.0, 0.0, 0.2]))
    ball = SceneObject("ball", [Sphere(RADIUS)], Pose(stands))
    scene = Scene([ball, *trays, wall], margin=0.01)
    return replace(planner.PlanningProblem(DATE_ARM, waypoints, scene=scene), **changes)


@pytest.mark.large_only
def test_a_part_may_stand_on_what_it_is_taken_from_and_put_on() -> None:
    """The ball touches its tray and its holder there; everything else keeps 10 mm, also the wall from the ball.

    The certificate has both, and neither hides the other.
    """
    problem = carried_over(0.3)
    plan = planner.plan(problem, planner.Quintic())
    clearance = plan.certificate.clearance
    assert clearance is not None and clearance.scene is not None and clearance.contacts is not None
    assert "ball" in (clearance.contacts.pair or ())
    pairs = list(distances_of_pairs(problem, plan.path.positions, plan.trajectory, 4, 4000))
    for part, touches in ((clearance.contacts, True), (clearance.scene, False)):
        truth = min(pair.distance for pair in pairs if pair.touches == touches)
        assert part.upper is not None
        assert part.lower <= truth + 1e-9 and part.upper == pytest.approx(truth, abs=1.2e-3), (touches, truth)
        assert part.upper - part.lower <= 1e-3 + 1e-9
    assert -2e-4 < clearance.contacts.lower < clearance.scene.lower
    assert clearance.scene.lower >= 0.01 - CONTACT_TOLERANCE
    assert planner.ClearanceReport.from_dict(clearance.as_dict()) == clearance


@pytest.mark.large_only
def test_what_is_put_down_about_links_is_not_entered_deeper_unseen() -> None:
    """Links deeper inside than their radius could go anywhere, and the clearance exceeded the one of the samples."""
    arm = load_robot("three_dof_arm")
    rng = np.random.default_rng(6)
    drum = AttachedObject(
        "drum",
        [Cylinder(0.13, 0.14)],
        link="link_3",
        touch_links=["link_1", "link_2"],
        pose=Pose([0.0, 0.0, 0.03], np.eye(3)),
    )
    planned = 0
    for _ in range(24):
        start = arm.middle + rng.uniform(-0.4, 0.4, 3)
        ends = [planner.JointWaypoint(start, detach=["drum"]), planner.JointWaypoint(start + rng.uniform(-0.5, 0.5, 3))]
        problem = planner.PlanningProblem(arm, ends, scene=Scene(attached=[drum]))
        try:
            plan = planner.plan(problem, planner.Trapezoidal())
        except Collision:
            continue
        planned += 1
        data = arm.model.createData()
        pin.framesForwardKinematics(arm.model, data, start)
        link = data.oMf[arm.model.getFrameId("link_3")]
        standing = SceneObject("drum", drum.shapes, drum.pose.from_frame(Pose(link.translation, link.rotation)))
        times = np.linspace(0.0, plan.trajectory.duration, 400)
        truth = float(np.nanmin(distances_over_time(arm, Scene([standing]), times, plan.trajectory)))
        found = plan.certificate.clearance
        assert found is not None and found.contacts is not None and found.contacts.upper is not None
        assert found.contacts.lower <= truth + 1e-9 and found.contacts.lower <= found.contacts.upper
        assert truth < -0.05
    assert 0 < planned < 24


def test_without_a_touch_there_are_no_contacts() -> None:
    """The arm alone passes trays and wall without touching them."""
    problem = carried_over(0.3)
    idle = [replace(waypoint, attach=(), detach=(), payload=None, put_down=False) for waypoint in problem.waypoints]
    assert problem.scene is not None
    alone = replace(problem, waypoints=idle, scene=replace(problem.scene, objects=problem.scene.objects[1:]))
    clearance = planner.plan(alone).certificate.clearance
    assert clearance is not None and clearance.scene is not None and clearance.contacts is None


@pytest.mark.large_only
def test_a_margin_that_is_kept_beside_what_touches_is_offered() -> None:
    """The wall is 40 mm away, not 60: the remedy offers that margin, though the ball touches its trays."""
    problem = carried_over(0.3)
    assert problem.scene is not None
    with pytest.raises(Collision) as refusal:
        planner.plan(replace(problem, scene=replace(problem.scene, margin=0.06)))
    (remedy,) = (each for each in refusal.value.remedies if each.field == ("scene", "margin"))
    assert planner.plan(remedy.applied_to(problem)).certificate.satisfied


def test_what_is_carried_hits_what_the_arm_alone_does_not() -> None:
    low = carried_over(0.115)
    empty = [replace(waypoint, attach=(), detach=(), payload=None, put_down=False) for waypoint in low.waypoints]
    assert low.scene is not None
    without = replace(low, waypoints=empty, scene=replace(low.scene, objects=low.scene.objects[1:]))
    assert planner.plan(without).certificate.satisfied
    with pytest.raises(Collision) as refusal:
        planner.plan(low)
    error = refusal.value
    assert (error.pair, error.segment) == (("ball", "wall"), 2)
    assert error.time is not None and error.depth > 0.0
    assert f"too near from {error.time:.4g} s on" in error.message


def test_what_is_taken_out_of_something_else_is_refused_where_that_is() -> None:
    """The ball is 5 mm inside a stone, with a margin of 10: the refusal says from which waypoint on."""
    problem = carried_over(0.3)
    assert problem.scene is not None
    (ball,) = (thing for thing in problem.scene.objects if thing.id == "ball")
    stone = SceneObject(
        "stone", [Sphere(RADIUS)], Pose(ball.pose.position + np.array([2.0 * RADIUS - 0.005, 0.0, 0.0]))
    )
    with pytest.raises(Collision) as refusal:
        planner.plan(replace(problem, scene=replace(problem.scene, objects=[*problem.scene.objects, stone])))
    found = refusal.value
    assert (found.waypoint, found.segment, set(found.pair)) == (1, 1, {"ball", "stone"})
    assert found.message.startswith("from waypoint 1 on, ") and type(found) is Collision
    assert found.depth == pytest.approx(0.015, abs=1e-6)
    assert found.position == pytest.approx(np.array(problem.waypoints[1].position), abs=1e-9)


def test_what_was_put_down_stays_there() -> None:
    """A sweep at the height of the released ball ends in it; without the release, nothing is hit."""
    problem = carried_over(0.3)
    down = [-np.pi / 2.0, np.pi / 2.0, 0.0]
    sweep = [planner.JointWaypoint([turn, lift, 0.25, *down]) for turn, lift in ((1.3, 0.35), (1.3, 0.05), (0.7, 0.05))]
    whole = replace(problem, waypoints=[*problem.waypoints, *sweep])
    with pytest.raises(Collision) as refusal:
        planner.plan(whole)
    assert refusal.value.pair == ("link_6", "ball")
    assert refusal.value.segment == len(problem.waypoints) + 1
    idle = [replace(waypoint, attach=(), detach=(), payload=None, put_down=False) for waypoint in whole.waypoints]
    assert planner.plan(replace(whole, waypoints=[*idle[3:4], *idle[5:]])).certificate.satisfied


@pytest.mark.large_only
def test_checkers_are_prepared_once_however_often_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Speed zones and the certificate use the same checkers of segments; another list of waypoints has its own."""
    made: list[CollisionChecker] = []
    prepare = CollisionChecker.__init__

    def counted(checker: CollisionChecker, *args: Any, **more: Any) -> None:
        made.append(checker)
        prepare(checker, *args, **more)

    monkeypatch.setattr(CollisionChecker, "__init__", counted)
    problem = carried_over(0.3)
    plan = planner.plan(problem, planner.Quintic())
    alone, at_waypoints, beside_what_touches, on_segments = 1, 1, 3, 5
    assert len(made) <= alone + at_waypoints + beside_what_touches + on_segments
    made.clear()
    slowed = planner.plan(replace(problem, speed_zones=[planner.SpeedZone(0.1, 0.25)]), planner.Quintic())
    assert slowed.trajectory.duration > 1.01 * plan.trajectory.duration
    assert not made

    positions = plan.path.positions.copy()
    checkers = segment_checkers(problem, positions)
    positions[2] += 0.01  # where nothing is taken nor put down
    assert segment_checkers(problem, positions) == checkers and not made
    positions[4] += 0.01
    elsewhere = segment_checkers(problem, positions)
    balls = [found[-1].scene.objects[-1].pose.position for found in (checkers, elsewhere)]
    assert np.abs(balls[1] - balls[0]).max() > 1e-3
    kept = replace(problem, waypoints=[*problem.waypoints[:4], replace(problem.waypoints[4], detach=())])
    assert [thing.id for thing in segment_checkers(kept, positions[:5])[-1].scene.attached] == ["ball"]


def test_a_gripper_is_put_down_and_taken_again() -> None:
    """A gripper attached from the start is put down, is an obstacle where it lies, and is taken again."""
    tool = planner.AttachedObject("tool", [Box([0.03, 0.03, 0.03])], Pose([0.0, 0.03, 0.0]))
    down = [-np.pi / 2.0, np.pi / 2.0, 0.0]

    def at(turn: float, lift: float, **more: Any) -> planner.JointWaypoint:
        return planner.JointWaypoint([turn, lift, 0.3, *down], **more)

    there = [at(0.0, 0.3), at(0.0, 0.1, detach=["tool"]), at(0.0, 0.3), at(0.8, 0.3)]
    back = [at(0.0, 0.3), at(0.0, 0.1, attach=[planner.Attach("tool")]), at(0.8, 0.1)]
    scene = Scene(attached=[tool], margin=0.005)
    plan = planner.plan(planner.PlanningProblem(DATE_ARM, [*there, *back], scene=scene))
    assert plan.certificate.clearance is not None
    with pytest.raises(Collision) as refusal:  # straight down on it, where it does not take it
        planner.plan(planner.PlanningProblem(DATE_ARM, [*there, at(0.0, 0.3), at(0.0, 0.07)], scene=scene))
    assert "tool" in refusal.value.pair and refusal.value.segment == 4


@pytest.mark.parametrize("kind", ["attached", "taken"])
def test_an_object_that_another_may_touch_is_put_down(kind: str) -> None:
    """The holder stays at the tool and names the part that is put down, whichever list the part came from."""
    down = [-np.pi / 2.0, np.pi / 2.0, 0.0]
    holder = AttachedObject("holder", [Box([0.03, 0.03, 0.03])], Pose([0.0, 0.03, 0.0]), touch_links=["part"])
    part = AttachedObject("part", [Sphere(RADIUS)], Pose([0.0, 0.0, 0.03 + RADIUS]))

    def at(lift: float, **more: Any) -> planner.JointWaypoint:
        return planner.JointWaypoint([0.0, lift, 0.3, *down], **more)

    first = at(0.3)
    scene = Scene(attached=[part, holder], margin=0.005)
    if kind == "taken":
        place = tool_in_base(DATE_ARM, np.array([first.position]))[0].act(part.pose.position)
        scene = replace(scene, objects=[SceneObject("part", part.shapes, Pose(place))], attached=[holder])
        first = at(0.3, attach=[planner.Attach("part")])
    waypoints = [first, at(0.1, detach=["part"]), at(0.3)]
    plan = planner.plan(planner.PlanningProblem(DATE_ARM, waypoints, scene=scene))
    assert plan.certificate.clearance is not None
    last = segment_checkers(plan.problem, plan.path.positions)[-1].scene
    assert [thing.id for thing in last.objects] == ["part"]
    assert [(held.id, held.touch_links) for held in last.attached] == [("holder", ("part",))]


def test_a_free_motion_goes_around_with_what_is_carried() -> None:
    """On the straight motion, the ball would hit the wall; the detour is for the arm with the ball."""
    problem = carried_over(0.115)
    waypoints = list(problem.waypoints)
    waypoints[3] = replace(waypoints[3], motion=planner.FreeMotion())
    plan = planner.plan(replace(problem, waypoints=waypoints))
    assert plan.detours and plan.certificate.clearance is not None


@pytest.mark.parametrize(
    ("index", "changes", "field"),
    [
        (1, {"attach": [planner.Attach("nothing")]}, ("waypoints", 1, "attach", 0, "id")),
        (1, {"attach": [planner.Attach("floor")]}, ("waypoints", 1, "attach", 0, "id")),
        (2, {"attach": [planner.Attach("ball")]}, ("waypoints", 2, "attach", 0, "id")),
        (1, {"attach": [planner.Attach("ball", link="none")]}, ("waypoints", 1, "attach", 0, "link")),
        (1, {"attach": [planner.Attach("ball", touch_links=["x"])]}, ("waypoints", 1, "attach", 0, "touch_links", 0)),
        (2, {"detach": ["wall"]}, ("waypoints", 2, "detach", 0)),
        (1, {"transition": planner.BlendTransition(0.01)}, ("waypoints", 1, "transition")),
    ],
)
def test_what_cannot_be_taken_is_said(index: int, changes: dict[str, Any], field: tuple[Any, ...]) -> None:
    problem = carried_over(0.3)
    assert problem.scene is not None
    floor = SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0])])
    waypoints = list(problem.waypoints)
    waypoints[index] = replace(waypoints[index], **changes)
    scene = replace(problem.scene, objects=[*problem.scene.objects, floor])
    with pytest.raises(InvalidProblem) as refusal:
        planner.plan(replace(problem, waypoints=waypoints, scene=scene))
    assert field in [fault.field for fault in refusal.value.faults]


def test_without_a_scene_there_is_nothing_to_take() -> None:
    with pytest.raises(InvalidProblem) as refusal:
        planner.plan(replace(carried_over(0.3), scene=None))
    assert refusal.value.faults[0].field == ("waypoints", 1, "attach")
