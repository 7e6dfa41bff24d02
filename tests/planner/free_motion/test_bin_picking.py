"""Parts picked out of a bin with a free turn of the gripper, against every fixed turn of it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import planner
from planner.problems.regions import Free
from planner.spatial import FloatArray, rotation_z
from tests.planner.free_motion.cases import robot
from tests.planner.scene.brute_force import least_distance
from tests.sizes import NAME

LENGTH, WIDTH, HEIGHT, THICKNESS = 0.6, 0.4, 0.3, 0.01
MIDDLE = 0.75
ABOVE, DOWN, UP = 0.40, 0.365, 0.4
HOME = (0.0, -1.57, 1.57, -1.57, -1.57, 0.0)
MARGIN = 0.003
GRIPPER = ("palm", "finger_1", "finger_2")
POINTING_DOWN = np.diag([1.0, -1.0, -1.0])
PARTS = 18
HARD = 13
"""A part beside a wall that few turns reach, in the second configuration of the search."""

TURNS, TRIED = (24, range(PARTS)) if NAME == "soak" else (8, range(2, PARTS, 3))
"""Number of fixed turns, and the tried parts."""


@lru_cache
def parts() -> tuple[tuple[float, float, float], ...]:
    """Draw positions of the parts, m, and their rotations, rad: no two overlap."""
    rng, found = np.random.default_rng(0), list[tuple[float, float, float]]()
    while len(found) < PARTS:
        x, y, turn = rng.uniform(0.48, 1.02), rng.uniform(-0.17, 0.17), rng.uniform(-np.pi, np.pi)
        if all(np.hypot(x - other[0], y - other[1]) > 0.085 for other in found):
            found.append((float(x), float(y), float(turn)))
    return tuple(found)


def box(name: str, size: list[float], center: list[float], turn: float = 0.0) -> planner.SceneObject:
    return planner.SceneObject(name, [planner.Box(size)], planner.Pose(center, rotation_z(turn)))


def scene() -> planner.Scene:
    """Return five walls, parts, and a gripper of a palm and two fingers."""
    half, beside = HEIGHT / 2.0, THICKNESS / 2.0
    x, y = LENGTH / 2.0 + beside, WIDTH / 2.0 + beside
    walls = [
        box("floor", [LENGTH, WIDTH, THICKNESS], [MIDDLE, 0.0, -beside]),
        *(box(f"side_{s}", [LENGTH + 0.02, THICKNESS, HEIGHT], [MIDDLE, s * y, half]) for s in (-1, 1)),
        *(box(f"end_{s}", [THICKNESS, WIDTH, HEIGHT], [MIDDLE + s * x, 0.0, half]) for s in (-1, 1)),
    ]
    lying = [box(f"part_{k}", [0.06, 0.03, 0.05], [x, y, 0.0255], turn) for k, (x, y, turn) in enumerate(parts())]
    sizes = {"palm": [0.14, 0.06, 0.04], "finger_1": [0.012, 0.025, 0.08], "finger_2": [0.012, 0.025, 0.08]}
    places = {"palm": [0.0, 0.0, -0.09], "finger_1": [0.05, 0.0, -0.03], "finger_2": [-0.05, 0.0, -0.03]}
    attached = [
        planner.AttachedObject(name, [planner.Box(sizes[name])], planner.Pose(places[name]), touch_links=GRIPPER)
        for name in GRIPPER
    ]
    return planner.Scene([*walls, *lying], attached, margin=MARGIN)


def picking(part: int, free: Free | None, turn: float = 0.0) -> planner.PlanningProblem:
    """Go above a part, down in a line, take it, up in a line and home."""
    x, y, _ = parts()[part]

    def line(z: float, **more: object) -> planner.RelativeWaypoint:
        move = planner.CartesianMove((0.0, 0.0, z))
        return planner.RelativeWaypoint(move, frame="base", motion=planner.LinearMotion(), **more)  # type: ignore[arg-type]

    above = planner.Pose([x, y, ABOVE], POINTING_DOWN @ rotation_z(turn))
    waypoints = [
        planner.JointWaypoint(HOME),
        planner.PoseWaypoint(above, free=free, motion=planner.FreeMotion()),
        line(-DOWN, dwell=0.2, attach=[planner.Attach(f"part_{part}", touch_links=GRIPPER)]),
        line(UP),
        planner.JointWaypoint(HOME, motion=planner.FreeMotion()),
    ]
    return planner.PlanningProblem(robot(), waypoints, scene=scene())


def is_planned(problem: planner.PlanningProblem) -> bool:
    try:
        return planner.plan(problem, planner.Toppra()).certificate.satisfied
    except planner.PlanningError:
        return False


def turns_that_plan(part: int, turns: FloatArray) -> list[float]:
    return [turn for turn in turns.tolist() if is_planned(picking(part, None, turn))]


@pytest.mark.large_only
def test_a_part_beside_a_wall_is_picked_by_a_turn_that_was_searched() -> None:
    """A fixed turn plans it; at the requested pose the gripper would be in the wall."""
    assert is_planned(picking(HARD, None))
    assert not is_planned(picking(HARD, planner.Region(rotation_z=(np.pi / 2.0, np.pi / 2.0))))
    made = planner.plan(picking(HARD, "rotation_z"), planner.Toppra())
    x, y, _ = parts()[HARD]
    number = len(made.detours[0].positions) - 1
    above = planner.tool_pose(robot(), made.path.positions[number])
    assert above.rotation is not None
    assert np.abs(above.position - [x, y, ABOVE]).max() < 1e-5
    assert above.rotation[2, 2] == pytest.approx(-1.0, abs=1e-6)


@pytest.mark.large_only
@pytest.mark.parametrize("part", TRIED)
def test_every_part_that_any_fixed_turn_plans_is_planned_with_the_turn_left_open(part: int) -> None:
    feasible = turns_that_plan(part, np.linspace(0.0, 2.0 * np.pi, TURNS, endpoint=False))
    assert is_planned(picking(part, "rotation_z")) or not feasible


@pytest.mark.large_only
def test_most_parts_are_feasible() -> None:
    assert sum(is_planned(picking(part, "rotation_z")) for part in TRIED) > len(TRIED) / 2


@pytest.mark.large_only
def test_a_goal_region_has_a_joint_position_that_keeps_clear() -> None:
    """No motion follows: in the bin the nearest turn of the gripper is in a wall, and others are not."""
    x, _, _ = parts()[0]
    lying = [thing for thing in scene().objects if not thing.id.startswith("part")]
    inside = planner.Pose([x, WIDTH / 2.0 - 0.05, 0.1], POINTING_DOWN @ rotation_z(np.pi / 2.0))
    problem = replace(picking(0, None), scene=replace(scene(), objects=lying))
    start = planner.JointWaypoint(HOME)
    goal = planner.PoseWaypoint(inside, free="rotation_z", motion=planner.FreeMotion())
    across = planner.Region(rotation_z=(-0.02, 0.02))
    with pytest.raises(planner.Collision):
        refused = replace(problem, waypoints=[start, replace(goal, free=across)])
        planner.plan(refused, planner.Toppra(), budget=planner.Budget(attempts=1))
    made = planner.plan(replace(problem, waypoints=[start, goal]), planner.Toppra())
    assert made.problem.scene is not None
    assert least_distance(robot(), made.problem.scene, made.trajectory) > MARGIN - 2e-5


def test_reachability_takes_a_pose_of_the_region_that_keeps_clear() -> None:
    """A ball is at the gripper at the nearest pose of the region; most other poses are collision-free."""
    problem = picking(0, "rotation_z")
    above = problem.waypoints[1]
    without = planner.reachability(robot(), [above], planner.InverseKinematicsOptions(reference=HOME))
    assert without[0].best is not None
    finger = planner.tool_pose(robot(), without[0].best)
    assert finger.rotation is not None
    ball = planner.SceneObject(
        "ball", [planner.Sphere(0.01)], planner.Pose(finger.position + 0.05 * finger.rotation[:, 0])
    )
    around = planner.Scene([ball], scene().attached)
    (found,) = planner.reachability(robot(), [above], planner.InverseKinematicsOptions(reference=HOME), scene=around)
    assert found.free
