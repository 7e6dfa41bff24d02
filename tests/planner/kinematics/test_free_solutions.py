"""Collision-free solutions go before all others: checked against distances by closed forms."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import planner
from planner.certificate.clearance import at_rest
from planner.kinematics.turns import travel_times
from planner.robots import DHJoint, Robot
from planner.scene import CONTACT_TOLERANCE, CollisionChecker, Scene, SceneObject
from planner.shapes import Box, Capsule, HalfSpace, Sphere
from planner.spatial import FloatArray, Pose
from tests.planner.scene.brute_force import distances_over_time

ARM = planner.load_robot("welding_arm")
TABLE = SceneObject("table", [Box([1.0, 2.0, 0.05])], Pose([1.4, 0.0, 0.55]))
"""A table that the forearm enters if the arm reaches over it with the elbow down."""

ROUNDING = 1e-6
"""Error of distances by golden sections, m."""


def room(robot: Robot, scene: Scene, position: FloatArray) -> float:
    """Return the least distance minus the margin, m, of an arm of capsules."""
    return float(np.nanmin(distances_over_time(robot, scene, np.zeros(1), at_rest(position)))) - scene.margin


def over_the_table(rng: np.random.Generator, count: int) -> list[Pose]:
    """Return poses above the table, some of them too low."""
    lower, upper = [0.9, -0.5, 0.5, -0.3, 1.5], [1.3, 0.5, 0.95, 0.3, 3.1]
    return [Pose.from_rpy(x[:3], [x[3], x[4], 0.0]) for x in rng.uniform(lower, upper, (count, 5))]


def seven_joints() -> Robot:
    """Return a shoulder, an elbow and a wrist of three, one, and three joints (standard Denavit-Hartenberg)."""
    twists, offsets = [-1, 1, 1, -1, -1, 1, 0], [0.3, 0.0, 0.45, 0.0, 0.45, 0.0, 0.1]
    return Robot.from_dh(
        [
            DHJoint("revolute", d=d, alpha=turn * np.pi / 2.0, lower=-2.9, upper=2.9, velocity=2.0)
            for d, turn in zip(offsets, twists, strict=True)
        ]
    )


def deep_as_it_is(scene: Scene, position: FloatArray, left: float, collision: planner.PositionCollision) -> None:
    """Fail if the pair or its depth differs from the closed forms, where these give depths."""
    (apart,) = distances_over_time(ARM, scene, np.zeros(1), at_rest(position))
    assert collision.pair[1] == "table"
    bodies = [(shape.link, shape.shape) for shape in ARM.collision_shapes]
    inside = [isinstance(shape, Capsule) and apart[k, 0] <= -shape.radius for k, (_, shape) in enumerate(bodies)]
    if not any(inside):  # of an axis that is in the table they know how deep its points are, and not how deep it is
        assert collision.depth == pytest.approx(-left, abs=ROUNDING)
        assert collision.pair[0] == bodies[int(np.nanargmin(apart[:, 0]))][0]


@pytest.mark.large_only
def test_free_solutions_come_first_and_what_is_in_the_way_is_said() -> None:
    rng = np.random.default_rng(8)
    scene = Scene([TABLE], margin=0.01)
    checker = CollisionChecker(ARM, scene)
    is_free = partial(planner.is_free, checker)
    counts = {"some": 0, "none": 0}
    for pose in over_the_table(rng, 10):
        reference = rng.uniform(-1.0, 1.0, ARM.dof)
        known = planner.all_solutions(ARM, pose, reference=reference)
        if not known:
            continue
        found = np.array(planner.all_solutions(ARM, pose, reference=reference, is_free=is_free))
        assert sorted(map(tuple, found)) == sorted(map(tuple, known))
        rooms = np.array([room(ARM, scene, position) for position in found])
        clear = rooms > -CONTACT_TOLERANCE
        assert np.abs(rooms + CONTACT_TOLERANCE).min() > ROUNDING  # else it is not known
        assert (np.diff(clear.astype(int)) <= 0).all(), "free ones first"
        times = travel_times(ARM, found, reference)
        assert all((np.diff(times[part]) >= -1e-9).all() for part in (clear, ~clear))
        collisions = planner.collisions_at(checker, found)
        for position, left, is_clear, collision in zip(found, rooms, clear, collisions, strict=True):
            assert (collision is None) == is_clear
            if collision is not None:
                deep_as_it_is(scene, position, left, collision)
        assert not clear.all()  # with the elbow down it never is
        counts["some" if clear.any() else "none"] += 1
    assert min(counts.values()) > 0, counts


@pytest.mark.large_only
def test_the_nearest_is_the_nearest_free_one_as_long_as_there_is_one() -> None:
    rng = np.random.default_rng(9)
    scene = Scene([TABLE])
    is_free = partial(planner.is_free, CollisionChecker(ARM, scene))
    counts = {"as before": 0, "another": 0, "none": 0}
    for pose in over_the_table(rng, 10):
        known = planner.all_solutions(ARM, pose)
        if not known:
            continue
        reference = known[rng.integers(len(known))] + rng.uniform(-0.1, 0.1, ARM.dof)
        solutions = np.array(planner.all_solutions(ARM, pose, reference=reference))
        clear = np.array([room(ARM, scene, position) > 0.0 for position in solutions])
        before = planner.inverse_kinematics(ARM, pose, reference=reference)
        found = planner.inverse_kinematics(ARM, pose, reference=reference, is_free=is_free)
        assert found.status == "solved" and found.position_error < 1e-6
        if not clear.any():
            counts["none"] += 1
            assert found.position == pytest.approx(before.position, abs=1e-9)
            continue
        nearest = solutions[clear][travel_times(ARM, solutions[clear], reference).argmin()]
        assert found.position == pytest.approx(nearest, abs=1e-6)
        counts["as before" if room(ARM, scene, before.position) > 0.0 else "another"] += 1
        without = planner.inverse_kinematics(ARM, pose, is_free=is_free)
        assert room(ARM, scene, without.position) > 0.0
    assert min(counts.values()) > 0, counts


def test_poses_in_turn_are_free_each_and_each_nearest_to_the_one_before() -> None:
    """From an elbow-down position, the first goes up and the others stay there; an unreachable one is skipped."""
    scene = Scene([TABLE])
    is_free = partial(planner.is_free, CollisionChecker(ARM, scene))
    poses = [Pose.from_rpy([1.0, y, 0.8], [0.0, 2.5, 0.0]) for y in np.linspace(-0.2, 0.2, 6)]
    poses.insert(3, Pose.from_rpy([9.0, 0.0, 0.8], [0.0, 2.5, 0.0]))
    down = next(q for q in planner.all_solutions(ARM, poses[0]) if room(ARM, scene, q) < 0.0)
    found = planner.inverse_kinematics_many(ARM, poses, reference=down, is_free=is_free)
    assert [one.status for one in found] == ["solved"] * 3 + ["unreachable_waypoint"] + ["solved"] * 3
    assert found[0].position != pytest.approx(down, abs=0.1)
    before = down
    for pose, one in zip(poses, found, strict=True):
        if one.status == "solved":
            alone = planner.inverse_kinematics(ARM, pose, reference=before, is_free=is_free)
            assert (one.position == alone.position).all()
            assert room(ARM, scene, one.position) > 0.0
            before = one.position
    elbows = np.array([one.position[:3] for one in found if one.status == "solved"])
    assert np.abs(np.diff(elbows, axis=0)).max() < 0.2


def test_an_arm_with_seven_joints_keeps_its_elbow_clear() -> None:
    robot = seven_joints()
    rng = np.random.default_rng(3)
    for _ in range(4):
        position = rng.uniform(-1.2, 1.2, robot.dof)
        position[3] = rng.uniform(1.0, 1.5)  # a stretched elbow cannot go anywhere
        pose = planner.tool_pose(robot, position)
        before = planner.inverse_kinematics(robot, pose, reference=position).position
        elbow = CollisionChecker(robot).bodies.at(before[None]).origins[0, 4]
        scene = Scene([SceneObject("ball", [Sphere(0.05)], Pose(elbow))])
        checker = CollisionChecker(robot, scene, self_collision=False)
        found = planner.inverse_kinematics(robot, pose, reference=position, is_free=partial(planner.is_free, checker))
        assert room(robot, scene, before) < 0.0 < room(robot, scene, found.position)
        assert found.position_error < 1e-6 and (found.orientation_error or 0.0) < 1e-6


def test_more_of_a_continuum_is_looked_at_where_none_of_the_first_is_free() -> None:
    robot = seven_joints()
    pose = planner.tool_pose(robot, np.array([0.3, 0.6, -0.2, 0.9, 0.4, 0.7, 0.1]))
    first = np.array(planner.all_solutions(robot, pose))

    def is_free(positions: FloatArray) -> np.ndarray:
        return np.asarray(np.abs(positions[:, None] - first).max(axis=2).min(axis=1) > 1e-6)

    found = planner.all_solutions(robot, pose, is_free=is_free)
    assert len(found) > len(first) and is_free(found[0][None])[0]
    reached = planner.forward_kinematics(robot, np.array(found))
    assert max(float(np.abs(there.position - pose.position).max()) for there in reached) < 2e-6


def test_a_robot_with_nothing_around_it_is_free_everywhere() -> None:
    """Without a scene, and without shapes that count, there is no distance to check."""
    pose = planner.tool_pose(ARM, np.full(6, 0.4))
    checker = CollisionChecker(ARM, Scene())
    assert checker.is_empty
    known = planner.all_solutions(ARM, pose)
    found = planner.all_solutions(ARM, pose, is_free=partial(planner.is_free, checker))
    assert all((one == other).all() for one, other in zip(known, found, strict=True))
    assert planner.collisions_at(checker, np.array(found)) == (None,) * len(found)


def test_of_several_things_in_the_way_the_deepest_is_named() -> None:
    """Heights over two half spaces are exact, and the arm is deeper in the second, the higher the second is."""
    position = np.zeros(6)
    for first, second in ((0.1, 0.2), (0.3, 0.15)):
        floors = [
            SceneObject(name, [HalfSpace([0.0, 0.0, 1.0], height)]) for name, height in (("a", first), ("b", second))
        ]
        (found,) = planner.collisions_at(CollisionChecker(ARM, Scene(floors, margin=0.02)), position[None])
        apart = distances_over_time(ARM, Scene(floors), np.zeros(1), at_rest(position))[0]
        if np.nanmin(apart) >= 0.02:
            assert found is None
            continue
        assert found is not None and found.pair[1] == ("a" if first > second else "b")
        assert found.depth == pytest.approx(0.02 - np.nanmin(apart), abs=1e-9)
