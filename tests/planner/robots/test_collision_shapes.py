"""Collision shapes of a robot, by its description and its kinematics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner import Box, Capsule, Cylinder, InvalidRobotModel, Robot, Sphere, catalogue_ids, load_robot

SHAPES = """
<robot name="r">
  <link name="base"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <link name="arm">
    <collision><origin xyz="0.2 0 0" rpy="0 1.5707963 0"/>
      <geometry><cylinder radius="0.05" length="0.4"/></geometry></collision>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>
    <collision><origin xyz="0.4 0 0"/><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
  <link name="hand"><collision>{hand}</collision></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.2"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
  <joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
</robot>
"""


def robot(hand: str) -> Robot:
    return Robot.from_urdf(SHAPES.format(hand=f"<geometry>{hand}</geometry>"))


def test_the_shapes_of_a_description_stand_where_it_has_them() -> None:
    model = robot('<capsule radius="0.04" length="0.1"/>')
    base, arm, *balls, hand = model.collision_shapes
    assert (base.link, base.joint, base.source, base.shape) == ("base", 0, "model", Box([0.2, 0.2, 0.2]))
    assert (arm.shape, hand.shape) == (Cylinder(0.05, 0.4), Capsule(0.04, 0.1))
    assert {ball.shape for ball in balls} == {Sphere(0.05)}
    q = np.array([np.pi / 2.0, 0.0])  # the arm points down
    pin.forwardKinematics(model.model, model.data, q)
    centres = [model.data.oMi[shape.joint].act(shape.placement.translation) for shape in model.collision_shapes]
    expected = [[0, 0, 0.1], [0, 0, 0], [0, 0, 0.2], [0, 0, -0.2], [0, 0, -0.2]]
    assert np.array(centres) == pytest.approx(np.array(expected), abs=1e-9)
    axis = (model.data.oMi[arm.joint].rotation @ arm.placement.rotation)[:, 2]
    assert np.abs(axis) == pytest.approx([0, 0, 1], abs=1e-6)


def test_shapes_that_a_joint_connects_are_not_checked_against_each_other() -> None:
    """Only shapes at the joint between two links always touch; these pairs are not checked.

    The tube reaches from the base's joint to the hand's.
    """
    pairs = {(pair.link_1, pair.link_2): pair for pair in robot('<sphere radius="0.04"/>').collision_pairs}
    assert [pair.reason for pair in pairs.values()] == [None] * 3
    touching = {links: pair.always_touching for links, pair in pairs.items()}
    assert touching == {("base", "arm"): ((0, 1), (0, 2)), ("arm", "hand"): ((1, 4), (3, 4)), ("base", "hand"): ()}


def test_an_srdf_takes_pairs_out() -> None:
    srdf = '<robot name="r"><disable_collisions link1="hand" link2="base" reason="Never"/></robot>'
    model = Robot.from_urdf(SHAPES.format(hand='<geometry><sphere radius="1"/></geometry>'), srdf=srdf)
    assert {(pair.link_1, pair.link_2): pair.reason for pair in model.collision_pairs}["base", "hand"] == "srdf"


@pytest.mark.parametrize("hand", ['<mesh filename="package://r/hand.stl"/>', '<cone radius="1"/>'])
def test_what_is_not_known_of_a_link_is_estimated(hand: str) -> None:
    """URDF readers leave unknown shapes out; then a part of the robot could not collide with anything."""
    shapes = robot(hand).collision_shapes
    assert [(shape.link, shape.source) for shape in shapes if shape.source == "estimate"] == [("hand", "estimate")]
    assert len(shapes) == 5


@pytest.mark.parametrize(
    ("hand", "code"),
    [
        ('<box size="-1 1 1"/>', "invalid_shape"),
        ('<sphere radius="1e5"/>', "invalid_shape"),
        ('<capsule radius="nan" length="1"/>', "non_finite_number"),
        ('<sphere radius="wide"/>', "not_a_number"),
        ('<box size="1 1"/>', "wrong_number_count"),
        ('<sphere radius="1"/>' * 1000, "too_many_shapes"),
    ],
)
def test_shapes_without_sense_are_refused(hand: str, code: str) -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        robot(hand)
    assert code in [finding.code for finding in refused.value.findings]


@pytest.mark.parametrize(
    ("hand", "code"), [('<box size="0 0 0"/>', "shape_without_size"), ('<cone radius="1"/>', "unknown_shape")]
)
def test_what_is_left_out_is_a_finding(hand: str, code: str) -> None:
    assert code in [finding.code for finding in robot(hand).findings]


def described_by_its_maker(id: str) -> bool:
    collision = load_robot(id).collision
    return collision is not None and any(element.source == "model" for element in collision.elements)


ESTIMATED = [robot for robot in catalogue_ids() if not described_by_its_maker(robot)]


@pytest.mark.parametrize("id", ESTIMATED)
def test_every_body_that_moves_has_shapes_around_its_joints(id: str) -> None:
    """Some estimated shape of each body, or of the body before it, reaches each joint's origin."""
    model = load_robot(id)
    shapes = model.collision_shapes
    assert {shape.joint for shape in shapes} >= set(range(1, model.dof + 1))
    pin.forwardKinematics(model.model, model.data, model.middle)
    for number in range(2, model.dof + 1):
        origin = model.data.oMi[number].translation
        inside = []
        for shape in shapes:
            start, end, radius = shape.shape.bounding_capsule  # type: ignore[misc]  # no half space
            placement = model.data.oMi[shape.joint] * shape.placement
            a, b = placement.act(start), placement.act(end)
            share = np.clip((origin - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0.0, 1.0)
            inside.append(np.linalg.norm(origin - a - share * (b - a)) <= radius + 0.03)
        assert any(inside), f"joint {number}"


def test_an_estimate_follows_the_table() -> None:
    """The base stands on the floor, the links have the table's lengths, and the radius is the stated one."""
    arm = load_robot("welding_arm")
    assert {shape.source for shape in arm.collision_shapes} == {"estimate"}
    sizes = [(shape.link, round(getattr(shape.shape, "length", 0.0), 6)) for shape in arm.collision_shapes]
    assert sizes[:5] == [("base", 0.475), ("link_1", 0.45), ("link_2", 0.68), ("link_3", 0.0), ("link_4", 0.7)]
    assert arm.collision_shapes[2].shape == Capsule(0.11, 0.68)
    base = arm.collision_shapes[0]
    down = base.placement.rotation.T @ np.array([0.0, 0.0, -1.0])
    assert base.shape.support(down[None])[0] == pytest.approx(base.placement.translation[2], abs=1e-12)


def test_what_slides_has_a_rod_behind_it() -> None:
    arm = load_robot("date_sorting_arm")
    rods = [shape for shape in arm.collision_shapes if shape.link in ("link_2", "link_3")]
    assert [round(getattr(rod.shape, "length", 0.0), 6) for rod in rods] == [0.5, 0.5]


def test_held_joints_keep_the_shapes_where_they_are() -> None:
    arm = load_robot("kuka_kr16_2")
    held = arm.derived(locked={"joint_a2": -1.0})
    q = np.array([0.3, 1.2, 0.4, 0.5, 0.6])
    pin.forwardKinematics(held.model, held.data, q)
    pin.forwardKinematics(arm.model, arm.data, np.insert(q, 1, -1.0))
    for own, other in zip(arm.collision_shapes, held.collision_shapes, strict=True):
        expected = arm.data.oMi[own.joint] * own.placement
        assert (held.data.oMi[other.joint] * other.placement).isApprox(expected, 1e-9)
        assert own.shape is other.shape
