"""The moving joints and the tip of a robot's arm: groups, chains, joints, locked ones; and states of groups."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from planner.errors import InvalidRobotModel
from planner.robots import Robot, catalogue, catalogue_ids
from tests.planner.robots.frames import frame_pose
from tests.planner.robots.urdfs import joint, link, robot

FIXED = {"kind": "fixed", "axis": "", "limit": ""}
SLIDE = {"kind": "prismatic", "limit": '<limit lower="0.01" upper="0.3" velocity="1" effort="1"/>'}
TORSO = robot(
    *(link(name) for name in ("base", "torso", "upper", "lower", "hand", "tcp", "thumb", "finger", "head", "camera")),
    joint("lift", "base", "torso", **SLIDE),
    joint("shoulder", "torso", "upper", axis='<axis xyz="0 1 0"/>'),
    joint("elbow", "upper", "lower", axis='<axis xyz="0 1 0"/>'),
    joint("wrist", "lower", "hand", axis='<axis xyz="1 0 0"/>'),
    joint("tool", "hand", "tcp", **FIXED),
    joint("pinch_1", "hand", "thumb", **SLIDE),
    joint("pinch_2", "hand", "finger", more='<mimic joint="pinch_1"/>', **SLIDE),
    joint("pan", "torso", "head"),
    joint("mount", "head", "camera", **FIXED),
)
"""An arm of three joints on a torso that lifts, with a gripper of two fingers, and a head."""
SRDF = """<robot name="test">
  <group name="arm"><joint name="shoulder"/><joint name="elbow"/><joint name="wrist"/></group>
  <group name="arm_torso"><chain base_link="base" tip_link="tcp"/></group>
  <group name="all"><group name="arm_torso"/><joint name="pan"/></group>
  <group name="look"><chain base_link="torso" tip_link="camera"/></group>
  <group_state name="home" group="arm_torso"><joint name="lift" value="0.1"/><joint name="shoulder" value="0.5"/>
    <joint name="elbow" value="-0.5"/><joint name="wrist" value="0"/></group_state>
  <group_state name="home" group="arm"><joint name="shoulder" value="1"/><joint name="elbow" value="-1"/>
    <joint name="wrist" value="1"/></group_state>
  <group_state name="high" group="arm_torso"><joint name="lift" value="0.4"/><joint name="shoulder" value="0"/>
    <joint name="elbow" value="0"/><joint name="wrist" value="0"/></group_state>
  <group_state name="words" group="arm"><joint name="shoulder" value="up"/></group_state>
</robot>"""
ARM, WHOLE = ("shoulder", "elbow", "wrist"), ("lift", "shoulder", "elbow", "wrist")


def codes(arm: Robot, severity: str = "warning") -> set[str]:
    return {finding.code for finding in arm.findings if finding.severity == severity} - {"mimic_joint_held"}


def message(arm: Robot, code: str) -> str:
    (said,) = [finding.message for finding in arm.findings if finding.code == code]
    return said


@pytest.mark.parametrize(
    ("options", "joints", "tip"),
    [
        ({"srdf": SRDF, "group": "arm"}, ARM, "tcp"),
        ({"srdf": SRDF, "group": "arm_torso"}, WHOLE, "tcp"),
        ({"srdf": SRDF, "group": "arm", "tip_frame": "hand"}, ARM, "hand"),
        ({"srdf": SRDF, "group": "look"}, ("pan",), "camera"),
        ({"joints": ("wrist", "shoulder")}, ("shoulder", "wrist"), "tcp"),
        ({"base_frame": "torso", "tip_frame": "lower"}, ("shoulder", "elbow"), "lower"),
        ({"base_frame": "upper"}, ("elbow", "wrist"), "tcp"),
        ({"locked": {"lift": 0.2}}, ARM, "tcp"),
        ({"srdf": SRDF, "group": "arm_torso", "locked": {"elbow": 1.0}}, ("lift", "shoulder", "wrist"), "tcp"),
        ({}, WHOLE, "tcp"),
    ],
)
def test_the_joints_that_are_asked_for_move(options: dict[str, Any], joints: tuple[str, ...], tip: str) -> None:
    """The other joints stand where they are locked: every link agrees with Pinocchio's own reader."""
    arm = Robot.from_urdf(TORSO, **options)
    assert (arm.joint_names, arm.tip_frame) == (joints, tip)
    model = pin.buildModelFromXML(TORSO, mimic=False)
    data, rng = model.createData(), np.random.default_rng(3)
    held = {"lift": 0.01, "pinch_1": 0.01} | options.get("locked", {})
    for q in rng.uniform(0.01, 0.3, (5, arm.dof)):
        known = held | dict(zip(joints, q, strict=True))
        full = np.array([known.get(name, 0.0) for name in list(model.names)[1:]])
        pin.framesForwardKinematics(model, data, full)
        for name in ("torso", "lower", "tcp", "camera", "thumb"):
            expected = data.oMf[model.getFrameId(name, pin.FrameType.BODY)].homogeneous
            np.testing.assert_allclose(frame_pose(arm, q, name), expected, atol=1e-12)


def test_without_a_group_the_arm_ends_before_its_fingers_and_the_other_ends_are_named() -> None:
    arm = Robot.from_urdf(TORSO, srdf=SRDF)
    assert (arm.tip_frame, arm.joint_names) == ("tcp", WHOLE)
    assert codes(arm) == {"several_tips", "state_outside_limits", "state_left_out"}
    said = message(arm, "several_tips")
    assert "tcp, behind 4 joints; other ends are thumb, finger, camera" in said
    assert "arm, arm_torso, all, look" in said
    assert "several_tips" not in codes(Robot.from_urdf(TORSO, tip_frame="thumb"))
    assert Robot.from_urdf(TORSO, tip_frame="thumb").joint_names == (*WHOLE, "pinch_1")


@pytest.mark.parametrize("name", ["gripper", "left_finger_joint", "JAW"])
def test_a_single_jaw_is_known_by_its_name(name: str) -> None:
    links = [link(each) for each in ("base", "arm", "jaw")]
    arm = Robot.from_urdf(robot(*links, joint("turn", "base", "arm"), joint(name, "arm", "jaw")))
    assert (arm.tip_frame, arm.joint_names) == ("arm", ("turn",))
    assert "other ends are jaw" in message(arm, "several_tips")
    alone = Robot.from_urdf(robot(*links[1:], joint(name, "arm", "jaw")))
    assert alone.joint_names == (name,)


def test_two_arms_on_a_torso_are_no_fingers() -> None:
    sides = ("left", "right")
    links = [link("base"), link("torso"), *(link(f"{side}_{k}") for side in sides for k in range(3))]
    arms = [
        joint(f"{side}_j{k}", f"{side}_{k - 1}" if k else "torso", f"{side}_{k}") for side in sides for k in range(3)
    ]
    arm = Robot.from_urdf(robot(*links, joint("turn", "base", "torso"), *arms))
    assert arm.joint_names == ("turn", "left_j0", "left_j1", "left_j2")
    assert "other ends are right_2" in message(arm, "several_tips")


def test_a_joint_on_the_way_that_is_held_without_being_locked_is_warned_of() -> None:
    arm = Robot.from_urdf(TORSO, srdf=SRDF, group="arm")
    assert "lift moves the arm but is none of its joints: it is held at 0.01" in message(arm, "joint_held_on_the_way")
    assert "joint_held_on_the_way" not in codes(Robot.from_urdf(TORSO, srdf=SRDF, group="arm", locked={"lift": 0.1}))


def test_states_of_groups_are_named_positions() -> None:
    """Only states with a position for every joint count; of two with one name, the group's."""
    assert Robot.from_urdf(TORSO, srdf=SRDF, group="arm_torso").named_positions == {"home": (0.1, 0.5, -0.5, 0.0)}
    arm = Robot.from_urdf(TORSO, srdf=SRDF, group="arm")
    assert arm.named_positions == {"home": (1.0, -1.0, 1.0), "high": (0.0, 0.0, 0.0)}
    assert Robot.from_urdf(TORSO, srdf=SRDF, group="look").named_positions == {}
    arm = Robot.from_urdf(TORSO, srdf=SRDF, group="arm_torso")
    assert "outside of the position limits" in message(arm, "state_outside_limits")


@pytest.mark.parametrize(
    ("code", "options"),
    [
        ("unknown_group", {"srdf": SRDF, "group": "legs"}),
        ("unknown_group", {"group": "arm"}),
        ("group_is_no_chain", {"srdf": SRDF, "group": "all"}),
        ("group_is_no_chain", {"srdf": SRDF, "group": "arm", "tip_frame": "camera"}),
        ("group_is_no_chain", {"joints": ("elbow", "pan")}),
        ("unknown_joint", {"joints": ("elbow", "knee")}),
        ("unknown_joint", {"joints": ("tool",)}),
        ("unknown_joint", {"joints": ("pinch_2",)}),
        ("no_joints", {"joints": ()}),
        ("no_joints", {"joints": ("elbow",), "locked": {"elbow": 0.0}}),
        ("unknown_base_frame", {"base_frame": "nowhere"}),
        ("unknown_base_frame", {"base_frame": "head", "tip_frame": "tcp"}),
        ("no_joints", {"base_frame": "tcp", "tip_frame": "tcp"}),
        ("several_planning_groups", {"base_frame": "torso", "joints": ("elbow",)}),
        ("several_planning_groups", {"srdf": SRDF, "group": "arm", "joints": ("elbow",)}),
        ("unknown_joint", {"locked": {"knee": 0.0}}),
        ("unknown_joint", {"locked": {"tool": 0.0}}),
        ("outside_position_limits", {"locked": {"lift": 0.0}}),
        ("outside_position_limits", {"locked": {"lift": float("nan")}}),
    ],
)
def test_what_is_no_arm_is_refused(code: str, options: dict[str, Any]) -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        Robot.from_urdf(TORSO, **options)
    assert code in {finding.code for finding in refused.value.findings if finding.severity == "error"}
    assert all(len(finding.message) < 1000 for finding in refused.value.findings)


TIPS = {
    "panda_description/urdf/panda.urdf": ("panda_hand_tcp", 7),
    "ur_description/urdf/ur5_robot.urdf": ("tool0", 6),
    "ur_description/urdf/ur5_gripper.urdf": ("tool0", 6),
    "xarm_description/urdf/xarm7.urdf": ("link_eef", 7),
    "kinova_description/robots/kinova.urdf": ("j2s6s200_end_effector", 6),
    "so_arm_description/urdf/so100.urdf": ("gripper", 5),
    "z1_description/urdf/z1.urdf": ("gripperStator", 6),
    "tiago_description/robots/tiago.urdf": ("hand_grasping_frame", 8),
}


@pytest.mark.parametrize("urdf", TIPS)
@pytest.mark.skipif("panda" not in catalogue_ids(), reason="example-robot-data is not installed")
def test_published_robots_end_in_no_finger(urdf: str) -> None:
    folder = catalogue._package_robots()
    assert folder is not None
    arm = Robot.from_urdf(folder / urdf)
    assert (arm.tip_frame, arm.dof) == TIPS[urdf]
