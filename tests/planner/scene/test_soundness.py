"""No motion is proved that collides at dense samples, and none is refused that they find free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.robots import load_robot
from planner.scene import CONTACT_TOLERANCE, Budget, CollisionChecker, Scene, SceneObject, clearances, edge
from planner.scene.checker import AMONG_OBJECTS
from planner.shapes import Box, Capsule, HalfSpace, Sphere
from planner.spatial import Pose
from planner.trajectories.trajectory import Trajectory
from tests.planner.capsule_arm import arm_of_capsules
from tests.planner.scene.brute_force import least_distance
from tests.planner.scene.random_scenes import in_capsules, motion_between, random_scene
from tests.sizes import NAME, SIZE

ARMS = ("kuka_kr16_2", "date_sorting_arm", "welding_arm", "ngv_refuelling_arm", "ur5e", "fr3")
"""Arms of six kinds: with prismatic joints, with seven joints, with estimates of their shapes."""

GRAZING = (-1e-3, -3e-5, 1e-4, 2e-3)
"""Differences of the clearance from the margin, m."""

BRUTE_FORCE_ERROR = 2e-6
"""Error of the least distance by dense samples, m: they stand 0.2 ms apart."""


@pytest.mark.sized
@pytest.mark.parametrize("arm", ARMS)
def test_proofs_agree_with_dense_samples(arm: str) -> None:
    rng = np.random.default_rng(len(arm))
    for _ in range(2 if NAME == "quick" else SIZE.requests // 4):
        robot = replace(arm_of_capsules(arm))  # a copy of its own, whose shapes are changed
        if rng.random() < 0.3:
            robot = robot.derived(mounting=Pose.from_rpy(rng.normal(size=3) * 0.2, rng.normal(size=3)))
        lower, upper = np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0)
        start, goal = rng.uniform(lower, upper, (2, robot.dof))
        motion = motion_between(start, start + rng.uniform(0.2, 0.6) * (goal - start))
        scene = random_scene(rng, 1.0 if arm in ("ur5e", "fr3") else 1.5)
        in_capsules(robot)
        truth = least_distance(robot, scene, motion)
        margins = [0.0] if truth < 0.003 else [0.0, *(truth - more for more in GRAZING)]
        for margin in margins:
            checker = CollisionChecker(robot, replace(scene, margin=margin), self_collision=False)
            decided, measured = clearances(checker, motion), clearances(checker, motion, tolerance=1e-3)
            for found in (decided, measured):
                if found.is_proved:
                    assert truth > margin - CONTACT_TOLERANCE - BRUTE_FORCE_ERROR
                else:
                    assert truth < margin
                    assert found.hit is not None
            if measured.is_proved:
                assert measured.lower[1] <= truth + BRUTE_FORCE_ERROR
                assert measured.upper[1] >= truth - BRUTE_FORCE_ERROR
                assert measured.upper[1] - measured.lower[1] <= 1e-3 + 1e-9


STRAIGHT = np.zeros(3)
ARM = load_robot("three_dof_arm")


def turning(angle: float) -> Trajectory:
    return motion_between(STRAIGHT, np.array([angle, 0.0, 0.0]))


@pytest.mark.parametrize("size", [1e-5, 1e3])
def test_tiny_and_huge_objects(size: float) -> None:
    """A speck on the path is found, and so is a wall far beyond the robot's reach."""
    middle = planner.tool_pose(ARM, [0.5, 0.0, 0.0]).position
    away = Pose(middle) if size < 1.0 else Pose([0.0, 0.0, -size / 2.0 - 2.0])
    found = clearances(CollisionChecker(ARM, Scene([SceneObject("thing", [Box([size] * 3)], away)])), turning(1.0))
    assert found.is_proved == (size > 1.0)


def test_standing_still_in_contact() -> None:
    """An arm that rests and just touches is accepted; a tenth of a millimetre deeper it is refused."""
    still = motion_between(STRAIGHT, STRAIGHT)
    at_zero = least_distance(ARM, Scene([SceneObject("floor", [HalfSpace([0, 0, 1], -5.0)])]), still) - 5.0
    for raised, is_free in ((0.0, True), (1e-4, False)):
        floor = SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0], at_zero + raised)])
        assert clearances(CollisionChecker(ARM, Scene([floor])), still).is_proved == is_free


def test_a_fast_passage_between_two_samples_is_seen() -> None:
    """The joint turns by 6 rad in a millisecond, past a speck that the first joint positions miss."""
    speck = SceneObject("speck", [Sphere(1e-3)], Pose(planner.tool_pose(ARM, [2.1234, 0.0, 0.0]).position))
    fast = motion_between(STRAIGHT, np.array([6.0, 0.0, 0.0]), 1e-3)
    found = clearances(CollisionChecker(ARM, Scene([speck])), fast)
    assert found.hit is not None


def test_a_budget_leaves_a_motion_unproved() -> None:
    margin = 5.0 + least_distance(ARM, Scene([SceneObject("floor", [HalfSpace([0, 0, 1], -5.0)])]), turning(2.0)) - 5.0
    scene = Scene([SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0], -5.0)])], margin=margin - 1e-6)
    found = clearances(CollisionChecker(ARM, scene), turning(2.0), budget=Budget(positions=1, distances=1))
    assert not found.is_proved
    assert found.hit is None
    assert found.undecided is not None


@pytest.mark.parametrize("budget", [Budget(0, 0), Budget(0, 20_000), Budget(20_000, 0)])
def test_without_a_budget_nothing_is_proved(budget: Budget) -> None:
    """Unchecked parts were forgotten, and a motion through an object was reported as free."""
    thing = SceneObject("thing", [Box([0.2] * 3)], Pose(planner.tool_pose(ARM, [0.5, 0.0, 0.0]).position))
    goal = np.array([1.0, 0.0, 0.0])
    for checker in (CollisionChecker(ARM, Scene([thing])), CollisionChecker(ARM, self_collision=True)):
        assert not clearances(checker, edge(STRAIGHT, goal), budget=budget).is_proved
    found = clearances(CollisionChecker(ARM, Scene([thing])), turning(1.0), tolerance=1e-3, budget=budget)
    assert found.hit is None and found.undecided is not None and found.undecided.margin == 0.0
    assert found.lower[AMONG_OBJECTS] == -np.inf
    assert not clearances(CollisionChecker(ARM, Scene([thing])), edge(STRAIGHT, goal)).is_proved


def test_a_plane_that_was_found_elsewhere_is_not_kept_until_time_is_rounding() -> None:
    """Intervals were split without end towards the time at which an old plane gave exactly the requested distance.

    The clearance was 2 mm, and the motion came out as unproved.
    """
    robot = replace(load_robot("welding_arm"))
    in_capsules(robot)
    start = [2.683594232296384, -0.9282972529350477, 1.78702004361143]
    start += [-2.1094727413589864, -2.432844842543785, 2.5976498863876456]
    way = [-1.5416014561077809, 0.4759651548599096, 0.3140993713507845]
    way += [0.4427791634999534, 0.15183358582957496, -1.451234282670575]
    rotation = [
        [0.4557486215043489, 0.8555633119619019, 0.24556997622198645],
        [-0.023096820962821014, -0.26442783760076355, 0.9641288583810753],
        [0.8898088170266111, -0.44507228393438014, -0.10075182983518158],
    ]
    pose = Pose(np.array([-0.07115829823071511, 1.1834851084409401, -0.3915245054740539]), np.array(rotation))
    capsule = SceneObject("capsule", [Capsule(0.1327062012703212, 0.24995387554389156)], pose)
    checker = CollisionChecker(robot, Scene([capsule], margin=0.4027330646103531), self_collision=False)
    assert clearances(checker, motion_between(np.array(start), np.add(start, way))).is_proved
