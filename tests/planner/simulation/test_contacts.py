"""Contacts of simulated arms: MuJoCo agrees with coal, and with trigonometry."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

import planner
from planner import Servo
from planner.scene.checker import CollisionChecker
from planner.simulation.contacts import find_contacts
from planner.simulation.geometry import Geometry

HOME = (0.0, -1.2, 1.8, -0.6, 1.6, 0.3)
BALL = 0.05
"""Radius of the ball in the hand, m."""

AHEAD = planner.Pose([0.0, 0.0, 0.1])
"""The place of the ball in the frame of the tool."""

BETWEEN = 1e-4
"""The largest distance, m, at which two libraries may disagree about contacts."""

rng = np.random.default_rng(7)
SHAPES = {
    "box": planner.Box([0.3, 0.5, 0.4]),
    "ball": planner.Sphere(0.25),
    "cylinder": planner.Cylinder(0.15, 0.5),
    "capsule": planner.Capsule(0.15, 0.4),
    "hull": planner.ConvexHull(rng.uniform(-0.3, 0.3, (20, 3))),
    "plane": planner.HalfSpace([0.1, 0.2, 1.0], -0.1),
}


def _around() -> list[planner.SceneObject]:
    """Return an object of each shape at a random place within reach."""
    poses = [planner.Pose.from_rpy(rng.uniform(-0.7, 0.7, 3), rng.uniform(-3.0, 3.0, 3)) for _ in SHAPES]
    return [planner.SceneObject(name, [shape], pose) for (name, shape), pose in zip(SHAPES.items(), poses, strict=True)]


def test_overlaps_are_those_of_coal() -> None:
    """All pairs of pieces are compared, also the arm with itself; pairs within the tolerance may differ."""
    arm = planner.load_robot("ur5e")
    held = planner.AttachedObject("held", [planner.Box([0.1, 0.2, 0.3])], planner.Pose([0.0, 0.0, 0.2]))
    checker = CollisionChecker(arm, planner.Scene(_around(), attached=[held], allowed_pairs=[("link_6", "box")]))
    geometry, seen = Geometry(checker), set()
    for position in rng.uniform(-2.5, 2.5, (40, 6)):
        placements = checker.bodies.at(position[None])
        inside, near = set(), set()
        for pair in range(checker.own_pairs + checker.margins.size):
            if not np.isfinite(checker.margins_of(np.array([pair]))[0]):
                continue
            distance = _distance(checker, placements, pair)
            inside |= {checker.names(pair)} if distance < -BETWEEN else set()
            near |= {checker.names(pair)} if abs(distance) <= BETWEEN else set()
        found = {pair for pair, _ in geometry.overlaps(0.0, position)}
        assert inside <= found <= inside | near
        seen |= found
    assert {second for _, second in seen} >= {*SHAPES, "held"}
    assert ("link_6", "box") not in seen


@pytest.mark.parametrize("name", ["positioner", "fixed tool"])
def test_overlaps_of_a_workpiece_that_moves_are_those_of_coal(name: str) -> None:
    """The workpiece meets objects of the world where it is at the position of the joints."""
    arm, table = planner.load_robot("ur5e"), planner.ExternalAxis("turn", "continuous", (1, 2, 3))
    part = planner.AttachedObject("part", [planner.Box([0.2, 0.3, 0.4])], planner.Pose([0.1, 0.3, 0.2]), "workpiece")
    how = {"positioner": [table]} if name == "positioner" else {"fixed_tool": planner.Pose([0.5, 0.0, 0.5])}
    checker = CollisionChecker(arm.derived(id="cell", **how), planner.Scene(_around(), attached=[part]))
    geometry, met = Geometry(checker), 0
    pairs = range(checker.own_pairs, checker.own_pairs + checker.margins.size)
    of_part = [pair for pair in pairs if checker.names(pair)[0] == "part"]
    for position in rng.uniform(-2.5, 2.5, (15, checker.dof)):
        placements = checker.bodies.at(position[None])
        distances = {checker.names(pair)[1]: _distance(checker, placements, pair) for pair in of_part}
        found = {second for (first, second), _ in geometry.overlaps(0.0, position) if first == "part"}
        assert {other for other, distance in distances.items() if distance < -BETWEEN} <= found
        assert found <= {other for other, distance in distances.items() if distance <= BETWEEN}
        met += len(found)
    assert met > 3


def _distance(checker: CollisionChecker, placements: object, pair: int) -> float:
    """Return the distance of a pair by coal, m; negative inside."""
    frames = placements.rotations[0], placements.origins[0]  # type: ignore[attr-defined]
    placed = []
    for number in checker.numbers_of(np.array([pair]))[0].tolist():
        if number < len(checker.bodies.pieces):
            piece = checker.bodies.pieces[number]
            turn, at = frames[0][piece.joint], frames[1][piece.joint]
            placed.append((piece.shape.geometry, turn @ piece.rotation, turn @ piece.translation + at))
        else:
            obstacle = checker.obstacles.all[number - len(checker.bodies.pieces)]
            placed.append((obstacle.shape.geometry, obstacle.rotation, obstacle.translation))
    (first, *at_first), (second, *at_second) = placed
    places = coal.Transform3s(*at_first), coal.Transform3s(*at_second)
    return float(coal.distance(first, places[0], second, places[1], coal.DistanceRequest(), coal.DistanceResult()))


def test_an_arm_that_sags_touches_the_table_as_deep_as_its_hand_is_below() -> None:
    """The certified plan keeps clear of the table; the arm without feed-forward does not."""
    arm = planner.load_robot("ur5e")
    ball = planner.AttachedObject("ball", [planner.Sphere(BALL)], AHEAD)
    ends = [HOME, (0.2, *HOME[1:])]
    below = planner.tool_pose(arm.with_tool(AHEAD), HOME).position - [0.0, 0.0, BALL + 0.01]
    table = planner.SceneObject("table", [planner.Box([0.8, 0.8, 0.02])], planner.Pose(below - [0.0, 0.0, 0.01]))
    height, scene = float(below[2]), planner.Scene([table], [ball])
    plan = planner.plan(planner.PlanningProblem(arm, [planner.JointWaypoint(end) for end in ends], scene=scene))
    assert planner.simulate(plan).contacts == ()
    run = planner.simulate(plan, Servo(feed_forward="none", frequency=4.0))
    [contact] = [one for one in run.contacts if "ball" in one.pair]
    data, depths = arm.model.createData(), []
    for position in run.position:
        pin.framesForwardKinematics(arm.model, data, position)
        depths.append(height + BALL - data.oMf[arm.tool_frame_id].act(AHEAD.position)[2])
    first = int(np.argmax(np.array(depths) > 1e-5))
    assert contact.pair == ("ball", "table")
    assert contact.time == run.time[first] > 0.0
    assert contact.depth == pytest.approx(max(depths), abs=1e-7)
    assert contact.depth_time == run.time[int(np.argmax(depths))]
    assert "contact: ball and table" in run.plot().svg().decode()


def test_a_part_that_is_taken_and_put_down_is_no_contact() -> None:
    """The hand is 20 mm in the part, which stands on the table; both count once the arm sags."""
    arm = planner.load_robot("ur5e")
    ends = [HOME, (0.3, -1.0, 1.8, -0.8, 1.6, 0.3), (0.8, -1.0, 1.8, -0.8, 1.6, 0.3), (0.8, *HOME[1:])]
    hand = planner.AttachedObject("hand", [planner.Sphere(BALL)], AHEAD)
    at = planner.tool_pose(arm.with_tool(AHEAD), ends[1]).position - [0.0, 0.0, 0.08]
    part = planner.SceneObject("part", [planner.Sphere(BALL)], planner.Pose(at))
    table = planner.SceneObject("table", [planner.HalfSpace([0.0, 0.0, 1.0], float(at[2]) - BALL)])
    waypoints = [
        planner.JointWaypoint(ends[0]),
        planner.JointWaypoint(ends[1], attach=[planner.Attach("part", touch_links=["hand"])]),
        planner.JointWaypoint(ends[2], detach=["part"]),
        planner.JointWaypoint(ends[3]),
    ]
    scene = planner.Scene([part, table], [hand])
    plan = planner.plan(planner.PlanningProblem(arm, waypoints, scene=scene))
    assert planner.simulate(plan).contacts == ()
    sagging = planner.simulate(plan, Servo(feed_forward="none", frequency=2.0))
    assert ("part", "table") in {contact.pair for contact in sagging.contacts}


def test_an_object_that_moves_is_met_where_it_is_then() -> None:
    """A ball on a belt reaches the plane of the resting hand when trigonometry says so."""
    arm = planner.load_robot("ur5e").derived(id="turned", mounting=planner.Pose.from_rpy([0.1, 0.2, 0.3], [0, 0, 1.0]))
    hand = planner.AttachedObject("hand", [planner.Sphere(BALL)], AHEAD)
    there = planner.tool_pose(arm.with_tool(AHEAD), HOME).from_frame(arm.mounting)
    belt = planner.ConstantVelocity([0.0, 0.0, 0.5])
    part = planner.SceneObject("part", [planner.Sphere(BALL)], planner.Pose(there.position - [0, 0, 0.3]), motion=belt)
    checker = CollisionChecker(arm, planner.Scene([part], [hand]))
    times = np.arange(0.0, 1.5, 1e-3)
    contacts = find_contacts([checker] * len(times), times, np.tile(HOME, (len(times), 1)))
    [contact] = [one for one in contacts if "hand" in one.pair]
    assert contact.pair == ("hand", "part")
    assert contact.time == pytest.approx((0.3 - 2.0 * BALL) / 0.5, abs=1.1e-3)
    assert contact.depth == pytest.approx(2.0 * BALL, abs=1e-6)
    assert contact.depth_time == pytest.approx(0.3 / 0.5, abs=1e-3)
