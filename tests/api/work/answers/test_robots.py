"""Descriptions of robots, against Pinocchio and a second convex hull."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial import ConvexHull as Qhull

from api.work.answers.robots import DRAWN_CORNERS, describe, describe_drawn_links
from planner.robots import DHJoint, Robot, load_robot
from planner.shapes import ConvexHull
from tests.planner.robots.frames import frame_pose, product, rot, trans
from tests.planner.shapes.mesh_files import box, stl
from tests.robots_extra import OWN

MESH_URDF = """<robot name="r"><link name="base"/><link name="arm">
  <collision><origin xyz="1 0 0"/><geometry><mesh filename="b.stl"/></geometry></collision></link>
  <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


@pytest.mark.parametrize("robot_id", sorted(OWN))
def test_geometry_stands_on_frames_of_the_robot(robot_id: str) -> None:
    description = describe(load_robot(robot_id))
    sizes = {"box": {"size"}, "cylinder": {"radius", "length"}, "sphere": {"radius"}}
    assert len(description["geometry"]) >= 6
    for shape in description["geometry"]:
        assert shape["frame"] in description["frames"]
        assert set(shape) == {"kind", "frame", "position", "rpy"} | sizes[shape["kind"]]
        assert np.min([np.min(shape[size]) for size in sizes[shape["kind"]]]) > 0.0


@pytest.mark.parametrize("robot_id", sorted(OWN))
def test_the_description_is_plain_json(robot_id: str) -> None:
    robot = load_robot(robot_id)
    description = json.loads(json.dumps(describe(robot), allow_nan=False))
    assert description["id"] == robot_id
    assert description["dof"] == robot.dof == len(description["joints"])
    assert description["tip_frame"] in description["frames"]
    for joint, plain in zip(robot.joints, description["joints"], strict=True):
        for name in ("lower", "upper", "velocity", "acceleration", "jerk", "torque"):
            value = getattr(joint, name)
            assert plain[name] == (value if math.isfinite(value) else None)


@pytest.mark.parametrize("robot_id", sorted(OWN))
def test_frames_can_be_placed_by_the_description(robot_id: str) -> None:
    """Frames that a viewer computes from `chain` and `placements` equal Pinocchio's frames."""
    robot = load_robot(robot_id)
    description = describe(robot)
    (q,) = np.random.default_rng(3).uniform(-2.0, 2.0, (1, robot.dof))

    def placed(at: dict[str, Any]) -> pin.SE3:
        return pin.SE3(pin.Quaternion(np.array(at["quaternion_xyzw"])), np.array(at["position"]))

    joints = [pin.SE3.Identity()]
    for joint, at, position in zip(description["joints"], description["chain"], q, strict=True):
        step = np.array(at["axis"]) * position
        turns = joint["kind"] != "prismatic"
        moved = pin.SE3(pin.exp3(step), np.zeros(3)) if turns else pin.SE3(np.eye(3), step)
        joints.append(joints[-1] * placed(at) * moved)
    assert [at["frame"] for at in description["placements"]] == description["frames"]
    for at in description["placements"]:
        found = joints[at["after"]] * placed(at)
        np.testing.assert_allclose(found.homogeneous, frame_pose(robot, q, at["frame"]), atol=1e-12)


def test_frames_at_zero_are_products_of_a_matrices() -> None:
    rows = [(0.3, 0.2, 0.1, 0.5), (-0.4, 0.0, 0.35, -1.2), (0.1, 0.15, -0.05, 0.7)]
    table = [DHJoint(kind="revolute", theta=theta, d=d, a=a, alpha=alpha) for theta, d, a, alpha in rows]
    placements = describe(Robot.from_dh(table, convention="standard", id="arm"))["placements"]
    found = {at["frame"]: np.array(at["matrix_at_zero"]) for at in placements}
    expected = np.eye(4)
    for k, (theta, d, a, alpha) in enumerate(rows, 1):
        expected = product(expected, rot("z", theta), trans(z=d), trans(x=a), rot("x", alpha))
        np.testing.assert_allclose(found[f"link_{k}"], expected, atol=1e-12)
    np.testing.assert_allclose(found["flange"], expected, atol=1e-12)


def test_a_robot_with_one_joint_is_described() -> None:
    table = [DHJoint(kind="revolute", theta=0.0, d=0.1, a=0.4, alpha=0.0)]
    described = describe(Robot.from_dh(table, convention="standard", id="one_joint"))
    assert [joint["axis"] for joint in described["chain"]] == [[0.0, 0.0, 1.0]]


def test_what_is_drawn_of_a_mesh_is_small_and_round() -> None:
    """A ball of 2000 corners is drawn with few of them, nowhere more than 3 % of its radius inside of it."""
    directions = np.random.default_rng(3).normal(size=(2000, 3))
    corners = 0.2 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    ball = ConvexHull(corners)
    mesh = stl(ball.vertices[ball.faces])
    (link,) = describe_drawn_links(Robot.from_urdf(MESH_URDF, meshes={"b.stl": mesh}))
    drawn = Qhull(link["shape"]["vertices"])
    assert len(drawn.points) <= DRAWN_CORNERS
    assert len(link["shape"]["faces"]) == len(drawn.simplices)
    assert -drawn.equations[:, 3].max() > 0.97 * 0.2
    assert link["position"] == [1.0, 0.0, 0.0]


def test_what_is_drawn_of_a_box_is_the_box() -> None:
    (link,) = describe_drawn_links(Robot.from_urdf(MESH_URDF, meshes={"b.stl": stl(box((0, 0, 0), (0.1, 0.1, 0.1)))}))
    corners = {(x, y, z) for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)}
    assert {tuple(corner) for corner in link["shape"]["vertices"]} == corners
