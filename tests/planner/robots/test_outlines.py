"""Outlines of the catalogue's machines, against points on their surfaces and the meshes of a close relative."""

from __future__ import annotations

import json

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner import ConvexHull, Robot, catalogue_ids, load_robot
from planner.robots.collision.estimates import Outline, outline_directions
from planner.robots.collision.geometry import BODY
from planner.scene.separations import Placed, separation
from tests.locations import DATA

SURFACES: dict[str, dict[str, list[list[float]]]] = json.loads((DATA / "surface_points.json").read_text())
"""Points x, y, z on the makers' meshes of each link, in its frame, m, to 1 mm."""

ROUNDED = 1e-3
"""Allowed distance of a rounded point from the surface, m."""


def depth_outside(robot: Robot, joint: int, points: np.ndarray) -> float:
    """Return the largest distance of points (N, 3) of a joint's frame outside all shapes that it carries, m."""
    shapes = [shape for shape in robot.collision_shapes if shape.joint == joint]
    placed = [Placed(shape.shape, shape.placement.rotation, shape.placement.translation) for shape in shapes]
    ball = planner.Sphere(1e-4)
    return max(min(separation(each, Placed(ball, np.eye(3), point)).distance for each in placed) for point in points)


@pytest.mark.parametrize("id", SURFACES)
def test_shapes_contain_the_surface_of_the_machine(id: str) -> None:
    robot = load_robot(id)
    for link, points in SURFACES[id].items():
        frame = robot.model.frames[robot.model.getFrameId(link, BODY)]
        inside = np.array([frame.placement.act(np.array(point)) for point in points])
        assert depth_outside(robot, frame.parentJoint, inside) <= ROUNDED, link


@pytest.mark.skipif("panda" not in catalogue_ids(), reason="example-robot-data is not installed")
def test_shapes_of_the_fr3_contain_the_panda() -> None:
    """The FR3 is the Panda with other insides: their housings differ by some millimetres at most."""
    panda, fr3 = load_robot("panda"), load_robot("fr3")
    q = np.array([0.3, -0.4, 0.2, -1.5, 0.4, 1.2, -0.3])
    pin.forwardKinematics(panda.model, panda.data, np.append(q, np.zeros(panda.dof - 7)))
    pin.forwardKinematics(fr3.model, fr3.data, q)
    for joint in range(8):
        of_joint = [s for s in panda.collision_shapes if s.joint == joint and s.link == f"panda_link{joint}"]
        corners = [
            (fr3.data.oMi[joint].inverse() * panda.data.oMi[joint] * shape.placement).act(corner)
            for shape in of_joint
            if isinstance(shape.shape, ConvexHull)
            for corner in shape.shape.vertices[::10]
        ]
        assert depth_outside(fr3, joint, np.array(corners)) <= 5e-3, joint


def test_an_outline_contains_what_was_measured_and_little_more() -> None:
    """A tilted cylinder's surface is inside; the outline of a cylinder along an axis is at most 2 % wider."""
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(200)])
    upright = np.concatenate([0.1 * circle + [0.0, 0.0, z] for z in (-0.2, 0.2)])
    hull = Outline(tuple((outline_directions() @ upright.T).max(axis=1))).hull()
    around = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(200)])
    assert (hull.support(around) >= 0.1 - 1e-6).all()
    assert (hull.support(around) <= 0.102).all()
    tilted = upright @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    hull = Outline(tuple((outline_directions() @ tilted.T).max(axis=1))).hull()
    directions = np.random.default_rng(2).normal(size=(500, 3))
    assert (hull.support(directions) >= (directions @ tilted.T).max(axis=1) - 1e-6).all()


BALL_ON_WRIST = planner.Pose([-0.6083960158344756, -0.3247738043375646, 0.5152262465223959])
"""A point on the surface of wrist 2 of a UR5e at the position below."""

UR5E_AT_BALL = [0.3, -1.2, 1.4, -1.7, -1.5, 0.2]


def test_a_ball_on_the_surface_of_the_wrist_is_refused() -> None:
    ball = planner.SceneObject("ball", [planner.Sphere(0.01)], BALL_ON_WRIST)
    waypoints = [planner.JointWaypoint([*UR5E_AT_BALL[:5], last]) for last in (0.2, 0.5)]
    with pytest.raises(planner.StartInCollision):
        planner.plan(planner.PlanningProblem(load_robot("ur5e"), waypoints, scene=planner.Scene([ball])))


def test_a_plan_says_that_its_clearance_is_that_of_estimates() -> None:
    far = planner.SceneObject("ball", [planner.Sphere(0.01)], planner.Pose([3.0, 0.0, 0.5]))
    waypoints = [planner.JointWaypoint([*UR5E_AT_BALL[:5], last]) for last in (0.2, 0.5)]
    plan = planner.plan(planner.PlanningProblem(load_robot("ur5e"), waypoints, scene=planner.Scene([far])))
    clearance = plan.certificate.clearance
    assert clearance is not None
    assert clearance.scene is not None
    assert clearance.itself is not None
    assert (clearance.scene.shapes, clearance.scene.uncertainty) == ("estimate", 0.01)
    (warning,) = [warning for warning in plan.warnings if warning.code == "estimated_shapes"]
    assert "0.02 m" in warning.message, "both links may stick out by 0.01 m"


def test_an_estimated_arm_does_not_go_through_itself() -> None:
    """At the goal, the flange is inside the base: 40 mm from its axis and 31 mm above the floor."""
    robot = load_robot("ur5e")
    goal = np.array([-1.59, 0.9, 2.61, 0.73, 2.97, -1.59])
    position = planner.tool_pose(robot, goal).position
    assert np.hypot(*position[:2]) < 0.06
    assert 0.0 < position[2] < 0.09
    waypoints = [planner.JointWaypoint([0.0, -1.5, 1.0, -1.0, -1.5, 0.0]), planner.JointWaypoint(goal)]
    with pytest.raises(planner.Collision):
        planner.plan(planner.PlanningProblem(robot, waypoints, scene=planner.Scene()))
