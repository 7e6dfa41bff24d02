"""The links that are checked against each other, by sampling, with a circle's closed form as the truth."""

from __future__ import annotations

from itertools import product

import coal
import numpy as np
import pinocchio as pin
import pytest

from planner import AttachedObject, Box, Pose, Robot, Scene, catalogue_ids, load_robot
from planner.robots import catalogue
from planner.robots.collision.pairs import contacts, shapes_of_links
from planner.scene import CollisionChecker, is_free

JOINT = """<joint name="{child}_joint" type="revolute"><parent link="{parent}"/><child link="{child}"/>
  <axis xyz="0 0 1"/><limit lower="-3.14159265" upper="3.14159265" velocity="1" effort="1"/></joint>"""


def balls(radius: float) -> Robot:
    """Make a robot with a ball on its base and one 1 m from the z axis of two joints."""
    ball = f'<collision><origin xyz="{{}} 0 0"/><geometry><sphere radius="{radius}"/></geometry></collision>'
    links = [
        f'<link name="base">{ball.format(1.0)}</link>',
        '<link name="upper"/>',
        f'<link name="fore">{ball.format(1.0)}</link>',
    ]
    joints = [JOINT.format(parent=parent, child=child) for parent, child in (("base", "upper"), ("upper", "fore"))]
    return Robot.from_urdf(f'<robot name="r">{"".join([*links, *joints])}</robot>')


def share(robot: Robot, count: int) -> float:
    limits = robot.limit("lower"), robot.limit("upper")
    both = ((0, 1),)
    return contacts(robot.model, limits, robot.collision_shapes, [both], count)[both]


@pytest.mark.parametrize("radius", [0.01, 0.2, 0.5, 0.9])
def test_the_share_of_contacts_is_that_of_the_circle(radius: float) -> None:
    """The sum of two uniform angles is uniform on the circle: the chord is below 2 r for |angle| < 2 arcsin(r)."""
    expected = 2.0 * np.arcsin(radius) / np.pi
    assert share(balls(radius), 4_000) == pytest.approx(expected, abs=4.0 * np.sqrt(expected / 4_000))


@pytest.mark.parametrize(("radius", "reason"), [(1.01, "always"), (0.9975, "always"), (0.9, None), (0.01, None)])
def test_links_that_always_touch_are_not_checked(radius: float, reason: str | None) -> None:
    (pair,) = balls(radius).collision_pairs
    assert (pair.link_1, pair.link_2, pair.reason) == ("base", "fore", reason)


def test_the_pairs_are_the_same_every_time() -> None:
    first, second = (load_robot("kuka_kr16_2").derived(named_positions={}) for _ in range(2))
    assert first.collision_pairs is second.collision_pairs
    assert [pair.reason for pair in first.collision_pairs].count("always") == 1
    narrower = load_robot("kuka_kr16_2").derived(limits={"joint_a2": {"upper": -1.0}})
    assert narrower.collision_pairs is not first.collision_pairs


TORCH = """<collision><origin xyz="0 0.045 {height}"/><geometry><box size="{size}"/></geometry></collision>"""
"""A box 45 mm off the axis of the last joint."""

ARM_AND_TORCH = """<robot name="r">
  <link name="base"><collision><origin xyz="0 0 -0.2"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="wrist">
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
    <collision><origin xyz="0.08 0 0"/><geometry><box size="0.1 0.04 0.04"/></geometry></collision>
  </link>
  <link name="hand"><collision><origin xyz="0 0 0.02"/><geometry><box size="0.04 0.04 0.04"/></geometry></collision>
    {in_hand}</link>
  {torch}
  <joint name="a" type="revolute"><parent link="base"/><child link="wrist"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><parent link="wrist"/><child link="hand"/><origin xyz="0 0 0.05"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
</robot>"""
"""An arm whose hand touches its wrist in every position, like real arms, with a torch that reaches back beside it."""

REACHING_BACK = TORCH.format(size="0.01 0.05 0.01", height=0.02) + (
    '<collision><origin xyz="0 0.07 -0.03"/><geometry><box size="0.01 0.01 0.1"/></geometry></collision>'
)
TORCH_LINK = f"""<link name="torch">{REACHING_BACK}</link>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="torch"/></joint>"""


@pytest.mark.parametrize("where", ["in_hand", "torch"])
def test_a_tool_is_checked_against_the_link_before_its_joint(where: str) -> None:
    """The torch meets the arm of the wrist at a quarter turn back, wherever the description has it.

    The wrist's arm covers 20 mm on either side of its x axis from 30 to 130 mm. The torch goes around at 65 to 75 mm.
    """
    parts = {"in_hand": "", "torch": ""} | {where: TORCH_LINK if where == "torch" else REACHING_BACK}
    robot = Robot.from_urdf(ARM_AND_TORCH.format(**parts))
    checker = CollisionChecker(robot, self_collision=True)
    straight, turned = [0.0, 0.0], [0.0, -np.pi / 2.0]
    assert is_free(checker, np.array([straight, turned])).tolist() == [True, False]


@pytest.mark.skipif("ur5" not in catalogue_ids(), reason="example-robot-data is not installed")
def test_a_torch_of_the_description_is_refused_like_one_that_is_attached() -> None:
    """The last joint of a UR5 turns a torch 45 mm off its axis, which reaches back over wrist 2."""
    folder = catalogue._package_robots()
    assert folder is not None
    urdf = (folder / "ur_description/urdf/ur5_robot.urdf").read_text(encoding="utf-8")
    shapes = [Box([0.01, 0.05, 0.01]), Box([0.01, 0.01, 0.08])]
    places = [np.array([0.0, 0.02, 0.0]), np.array([0.0, 0.045, -0.04])]
    elements = [
        f'<collision><origin xyz="{x} {y} {z}"/><geometry><box size="{" ".join(map(str, box.size))}"/></geometry>'
        "</collision>"
        for box, (x, y, z) in zip(shapes, places, strict=True)
    ]
    torch = f"""<link name="torch">{"".join(elements)}</link>
      <joint name="torch_mount" type="fixed"><parent link="tool0"/><child link="torch"/></joint></robot>"""
    with_torch = Robot.from_urdf(urdf.replace("</robot>", torch), tip_frame="tool0", meshes=folder.parent.parent)
    attached = [
        AttachedObject(f"torch_{k}", [box], Pose(place, np.eye(3)), "tool0")
        for k, (box, place) in enumerate(zip(shapes, places, strict=True))
    ]
    turn = np.linspace(-2.0, -0.6, 29)
    motion = np.column_stack([np.tile([0.0, -1.2, 1.2, -1.5, -1.57], (29, 1)), turn])
    of_link = is_free(CollisionChecker(with_torch, self_collision=True), motion)
    of_tool = is_free(CollisionChecker(load_robot("ur5"), Scene(attached=attached), self_collision=True), motion)
    assert of_link.tolist() == of_tool.tolist()
    assert not of_link.all()
    assert of_link.any()


@pytest.mark.skipif("ur5" not in catalogue_ids(), reason="example-robot-data is not installed")
@pytest.mark.parametrize("id", ["ur10", "panda", "kinova"])
def test_only_what_touches_in_every_position_is_left_out(id: str) -> None:
    """At independent random positions, no pair left out of the checks is apart, except shapes of one body."""
    robot = load_robot(id)
    shapes, of_link = robot.collision_shapes, shapes_of_links(robot.collision_shapes)
    left_out = [
        both
        for pair in robot.collision_pairs
        for both in product(of_link[pair.link_1], of_link[pair.link_2])
        if both not in pair.checked_shapes(of_link) and shapes[both[0]].joint != shapes[both[1]].joint
    ]
    lower, upper = (np.clip(robot.limit(side), -3.0, 3.0) for side in ("lower", "upper"))
    for q in np.random.default_rng(7).uniform(lower, upper, (20, robot.dof)):
        pin.forwardKinematics(robot.model, robot.data, q)
        placed = {
            number: coal.Transform3s(placement.rotation, placement.translation)
            for number in {number for both in left_out for number in both}
            for placement in [robot.data.oMi[shapes[number].joint] * shapes[number].placement]
        }
        for a, b in left_out:
            distance = coal.distance(
                shapes[a].shape.geometry, placed[a], shapes[b].shape.geometry, placed[b],
                coal.DistanceRequest(), coal.DistanceResult(),
            )  # fmt: skip
            assert distance <= 1e-6, (shapes[a].link, shapes[b].link)
