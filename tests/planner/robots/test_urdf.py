"""The URDF reader against Pinocchio's own, and the rules for what URDF leaves open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import InvalidRobotModel
from planner.robots import Robot
from planner.spatial import Pose
from tests.planner.robots.frames import frame_pose, pinocchio_configuration
from tests.planner.robots.urdfs import INERTIAL, LIMIT, inertial, joint, link, robot, two_links

ARM = robot(
    *(link(name, INERTIAL) for name in ("base", "a", "b", "bracket", "c", "d", "e")),
    joint("j2", "a", "b", origin='<origin xyz="0.1 -0.2 0.3" rpy="0.4 0.5 -0.6"/>', axis='<axis xyz="1 2 -3"/>'),
    joint("j1", "base", "a", kind="continuous", axis='<axis xyz="0 0 -1"/>', limit=""),
    joint("mount", "b", "bracket", kind="fixed", origin='<origin xyz="0 0.1 0" rpy="1 0 0"/>', axis="", limit=""),
    joint("j3", "bracket", "c", kind="prismatic", axis='<axis xyz="0 1 0"/>'),
    joint("j4", "c", "d", origin='<origin rpy="0 -1.2 0"/>', axis=""),
    joint("flange", "d", "e", kind="fixed", origin='<origin xyz="0 0 0.1"/>', axis="", limit=""),
)
LINKS = ("base", "a", "b", "bracket", "c", "d", "e")


@given(q=st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4))
def test_every_link_stands_where_pinocchio_puts_it(q: list[float]) -> None:
    arm = Robot.from_urdf(ARM)
    assert arm.joint_names == ("j1", "j2", "j3", "j4")
    assert arm.model.nq == arm.model.nv == 4
    model = pin.buildModelFromXML(ARM)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pinocchio_configuration(model, arm, np.array(q)))
    for name in LINKS:
        expected = data.oMf[model.getFrameId(name, pin.FrameType.BODY)].homogeneous
        np.testing.assert_allclose(frame_pose(arm, np.array(q), name), expected, atol=1e-12)


@given(values=st.lists(st.floats(-2.0, 2.0), min_size=12, max_size=12))
def test_torques_are_those_of_pinocchios_own_reader(values: list[float]) -> None:
    q, v, a = np.array(values).reshape(3, 4)
    arm = Robot.from_urdf(ARM)
    model = pin.buildModelFromXML(ARM)
    expected = pin.rnea(model, model.createData(), pinocchio_configuration(model, arm, q), v, a)
    np.testing.assert_allclose(pin.rnea(arm.model, arm.data, q, v, a), expected, atol=1e-10)


def test_kinds_limits_and_their_provenance() -> None:
    arm = Robot.from_urdf(ARM)
    assert [joint.kind for joint in arm.joints] == ["continuous", "revolute", "prismatic", "revolute"]
    np.testing.assert_array_equal(arm.limit("lower"), [-np.inf, -1.5, -1.5, -1.5])
    np.testing.assert_array_equal(arm.limit("velocity"), [np.pi, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(arm.limit("acceleration"), [4.0 * np.pi, 8.0, 8.0, 8.0])
    np.testing.assert_array_equal(arm.limit("jerk"), [40.0 * np.pi, 80.0, 80.0, 80.0])
    np.testing.assert_array_equal(arm.limit("torque"), [np.inf, 30.0, 30.0, 30.0])
    assert arm.joints[0].provenance == dict.fromkeys(("velocity", "acceleration", "jerk"), "default")
    published = dict.fromkeys(("position", "velocity", "torque"), "published")
    assert arm.joints[1].provenance == {**published, "acceleration": "default", "jerk": "default"}
    assert arm.mass == pytest.approx(6 * 3.5)
    assert arm.tip_frame == "e"
    assert {finding.severity for finding in arm.findings} == {"warning", "info"}  # the warning: the axis 1 2 -3


@pytest.mark.parametrize("turned", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (0.6, 0, 0.8), (1, 1, 1)])
def test_any_axis_turns_as_rodrigues_says(turned: tuple[float, float, float]) -> None:
    axis = '<axis xyz="{} {} {}"/>'.format(*turned)
    arm = Robot.from_urdf(two_links(axis=axis, origin=""))
    x, y, z = np.array(turned) / np.linalg.norm(turned)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    expected = np.eye(3) + np.sin(0.7) * K + (1 - np.cos(0.7)) * K @ K
    np.testing.assert_allclose(frame_pose(arm, [0.7])[:3, :3], expected, atol=1e-15)
    np.testing.assert_array_equal(frame_pose(arm, [0.0])[:3, :3].round(15), np.eye(3))


def test_joints_off_the_chain_are_held_at_the_nearest_limit_to_zero() -> None:
    slide = '<limit lower="0.02" upper="0.04" velocity="1" effort="1"/>'
    fingers = (
        joint("f1", "tip", "finger_1", kind="prismatic", axis='<axis xyz="0 1 0"/>', limit=slide),
        joint(
            "f2",
            "tip",
            "finger_2",
            kind="prismatic",
            axis='<axis xyz="0 1 0"/>',
            more='<mimic joint="f1" offset="-0.3"/>',
        ),
        joint("f3", "tip", "finger_3"),
    )
    links = (link("base"), link("tip"), *(link(f"finger_{i}", inertial()) for i in (1, 2, 3)))
    arm = Robot.from_urdf(robot(*links, joint("turn", "base", "tip"), *fingers), tip_frame="tip")
    assert arm.joint_names == ("turn",)
    np.testing.assert_allclose(frame_pose(arm, [0.0], "finger_1")[:3, 3], [0.0, 0.02, 0.6])
    np.testing.assert_allclose(frame_pose(arm, [0.0], "finger_2")[:3, 3], [0.0, 0.02 - 0.3, 0.6])
    np.testing.assert_allclose(frame_pose(arm, [0.0], "finger_3")[:3, 3], [0.0, 0.0, 0.6])
    assert arm.mass == pytest.approx(3.0)
    assert {(f.code, f.subject) for f in arm.findings if f.code.endswith("held")} == {
        ("joint_held", "f1"),
        ("mimic_joint_held", "f2"),
        ("joint_held", "f3"),
    }


def test_the_tip_is_the_end_of_the_chain_with_the_most_joints() -> None:
    """The chain with the most links may be a long fixed antenna, which is no arm."""
    antenna = [link(f"n{i}") for i in range(6)]
    stack = [joint(f"x{i}", f"n{i - 1}" if i else "base", f"n{i}", kind="fixed", axis="", limit="") for i in range(6)]
    links = (link("base"), link("elbow"), link("hand"), link("flange"), *antenna)
    fixed = joint("plate", "hand", "flange", kind="fixed", axis="", limit="")
    arm = (joint("j1", "base", "elbow"), joint("j2", "elbow", "hand"), fixed)
    assert Robot.from_urdf(robot(*links, *stack, *arm)).tip_frame == "flange"
    shorter = Robot.from_urdf(robot(*links, *stack, *arm), tip_frame="elbow")
    assert (shorter.tip_frame, shorter.joint_names) == ("elbow", ("j1",))


def test_simple_shapes_are_kept_and_a_mesh_is_not_looked_for_outside() -> None:
    shapes = (
        '<visual><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><geometry><box size="1 2 3"/></geometry></visual>'
        '<visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>'
        '<visual><geometry><sphere radius="0.5"/></geometry></visual>'
        '<visual><geometry><mesh filename="file:///etc/passwd"/></geometry></visual>'
        '<collision><geometry><sphere radius="9"/></geometry></collision>'
    )
    arm = Robot.from_urdf(two_links(shapes))
    here = {"frame": "tip", "position": [0.0] * 3, "rpy": [0.0] * 3}
    assert list(arm.geometry) == [
        {"kind": "box", **here, "position": [1.0, 2.0, 3.0], "rpy": [0.1, 0.2, 0.3], "size": [1.0, 2.0, 3.0]},
        {"kind": "cylinder", **here, "radius": 0.1, "length": 2.0},
        {"kind": "sphere", **here, "radius": 0.5},
    ]
    assert arm.visual_meshes == ()
    assert [(f.code, f.severity) for f in arm.visual_findings] == [("visual_mesh_not_found", "info")]


def test_a_link_may_be_called_tool_and_carry_a_tool() -> None:
    arm = Robot.from_urdf(two_links().replace('"tip"', '"tool"'))
    arm = arm.with_tool(Pose(np.array([0.0, 0.0, 0.25])))
    pin.framesForwardKinematics(arm.model, arm.data, np.zeros(1))
    np.testing.assert_allclose(arm.data.oMf[arm.tool_frame_id].translation, [0.0, 0.0, 0.55])
    np.testing.assert_allclose(arm.data.oMf[arm.tip_frame_id].translation, [0.0, 0.0, 0.3])


SOFT_ZEROS = '<safety_controller k_velocity="10" soft_lower_limit="0" soft_upper_limit="0"/>'
REMARKS = [
    ("absurd_limit", "warning", two_links(limit=LIMIT.replace('velocity="2"', 'velocity="1000"'))),
    ("absurd_limit", "warning", two_links(kind="prismatic", limit=LIMIT.replace('velocity="2"', 'velocity="100"'))),
    ("axis_normalised", "warning", two_links(axis='<axis xyz="0 0 2"/>')),
    ("default_limits", "info", two_links()),
    ("inertia_missing", "warning", two_links(inertial(moments='ixx="0" iyy="0" izz="0"'))),
    ("inertia_not_positive_definite", "warning", two_links(inertial(moments='ixx="-1e-9" iyy="1e-8" izz="1e-8"'))),
    ("inertia_triangle_inequality", "warning", two_links(inertial(moments='ixx="1" iyy="1" izz="3"'))),
    ("inertia_without_mass", "warning", two_links(inertial(mass="0"))),
    (
        "visual_mesh_unread",
        "warning",
        two_links('<visual><geometry><mesh filename="x.stl" scale="1 0 1"/></geometry></visual>'),
    ),
    ("no_torque_limit", "info", two_links(limit=LIMIT.replace('effort="30"', 'effort="0"'))),
    ("no_torque_limit", "info", two_links(limit=LIMIT.replace('effort="30"', ""))),
    ("no_masses", "info", two_links()),
    ("no_reach", "warning", two_links()),
    ("position_limit_ignored", "info", two_links(kind="continuous")),
    ("deceleration_limit", "info", two_links(limit=LIMIT.replace("/>", ' acceleration="5" deceleration="4"/>'))),
    ("soft_limits", "info", two_links(more='<safety_controller soft_lower_limit="-1"/>')),
    ("soft_limits_ignored", "warning", two_links(more=SOFT_ZEROS)),
    ("shape_without_size", "warning", two_links('<visual><geometry><sphere radius="0"/></geometry></visual>')),
    ("suspicious_angle", "warning", two_links(limit='<limit lower="-180" upper="180" velocity="2" effort="1"/>')),
    ("suspicious_angle", "warning", two_links(limit='<limit lower="-90" upper="90" velocity="2" effort="1"/>')),
    ("suspicious_angle", "warning", two_links(limit=LIMIT.replace('velocity="2"', 'velocity="156"'))),
    ("suspicious_angle", "warning", two_links(origin='<origin rpy="0 -90 0"/>')),
    ("suspicious_inertia", "warning", two_links(inertial(moments='ixx="2e4" iyy="2e4" izz="2e4"'))),
    ("suspicious_inertia", "warning", two_links(inertial(moments='ixx="1e-9" iyy="1e-9" izz="1e-9"'))),
    ("suspicious_length", "warning", two_links(origin='<origin xyz="0 0 350"/>')),
    ("suspicious_length", "warning", two_links(kind="prismatic", limit='<limit lower="0" upper="500" velocity="1"/>')),
    ("suspicious_mass", "warning", two_links(inertial(mass="8400"))),
    ("suspicious_mass", "warning", two_links(inertial(mass="1e-6"))),
    ("too_many_shapes", "warning", two_links("<visual><geometry><sphere radius='1'/></geometry></visual>" * 1001)),
    ("zero_limit", "warning", two_links(limit=LIMIT.replace('velocity="2"', 'velocity="0"'))),
    ("default_limits", "info", two_links(limit=LIMIT.replace('velocity="2"', ""))),
]


@pytest.mark.parametrize(("code", "severity", "urdf"), REMARKS, ids=[f"{i}-{r[0]}" for i, r in enumerate(REMARKS)])
def test_a_usable_model_is_remarked_upon(code: str, severity: str, urdf: str) -> None:
    arm = Robot.from_urdf(urdf)
    assert (code, severity) in {(finding.code, finding.severity) for finding in arm.findings}
    assert np.isfinite(frame_pose(arm, [0.3])).all()
    assert np.isfinite(arm.limit("velocity")).all()
    assert (arm.limit("torque") > 0.0).all()


@pytest.mark.parametrize(
    ("attributes", "acceleration", "jerk", "published"),
    [
        ('acceleration="5" jerk="60"', 5.0, 60.0, {"acceleration", "jerk"}),
        ('acceleration="5"', 5.0, 50.0, {"acceleration"}),
        ('jerk="60"', 8.0, 60.0, {"jerk"}),
        ('acceleration="5" deceleration="4"', 4.0, 40.0, {"acceleration"}),
        ('acceleration="5" deceleration="7"', 5.0, 50.0, {"acceleration"}),
        ('acceleration="5" deceleration="0"', 5.0, 50.0, {"acceleration"}),
        ('deceleration="4"', 4.0, 40.0, {"acceleration"}),
        ('acceleration="0" jerk="0"', 8.0, 80.0, set()),
    ],
)
def test_limits_of_urdf_1_2_are_the_robots_own(
    attributes: str, acceleration: float, jerk: float, published: set[str]
) -> None:
    """Missing attributes follow the default rule: full speed (2 rad/s) in 0.25 s, full acceleration in 0.1 s."""
    (turn,) = Robot.from_urdf(two_links(limit=LIMIT.replace("/>", f" {attributes}/>"))).joints
    assert (turn.acceleration, turn.jerk) == (acceleration, jerk)
    origins = {name: turn.provenance[name] for name in ("acceleration", "jerk")}
    assert origins == {name: "published" if name in published else "default" for name in origins}


@pytest.mark.parametrize(
    ("attributes", "bounds"),
    [
        ('soft_lower_limit="-1" soft_upper_limit="0.5"', (-1.0, 0.5)),
        ('soft_lower_limit="-9" soft_upper_limit="0.5"', (-1.5, 0.5)),
        ('soft_upper_limit="1"', (-1.5, 1.0)),
        ('soft_lower_limit="-9" soft_upper_limit="9"', (-1.5, 1.5)),
        ('soft_lower_limit="2" soft_upper_limit="3"', (-1.5, 1.5)),
        ('soft_lower_limit="0" soft_upper_limit="0"', (-1.5, 1.5)),
        ('k_velocity="10"', (-1.5, 1.5)),
    ],
)
def test_soft_limits_narrow_the_position_limits(attributes: str, bounds: tuple[float, float]) -> None:
    arm = Robot.from_urdf(two_links(more=f"<safety_controller {attributes}/>"))
    (turn,) = arm.joints
    assert (turn.lower, turn.upper) == bounds
    assert turn.provenance["position"] == "published"
    assert bool({"soft_limits", "soft_limits_ignored"} & {finding.code for finding in arm.findings}) == (
        bounds != (-1.5, 1.5) or 'soft_lower_limit="2"' in attributes or 'soft_lower_limit="0"' in attributes
    )


def test_soft_limits_stand_in_for_missing_ones_but_not_of_a_continuous_joint() -> None:
    soft = '<safety_controller soft_lower_limit="-1" soft_upper_limit="1"/>'
    (turn,) = Robot.from_urdf(two_links(limit='<limit velocity="2" effort="1"/>', more=soft)).joints
    assert (turn.lower, turn.upper) == (-1.0, 1.0)
    (wheel,) = Robot.from_urdf(two_links(kind="continuous", limit="", more=soft)).joints
    assert (wheel.lower, wheel.upper) == (-np.inf, np.inf)


def test_enormous_limits_are_no_limits() -> None:
    arm = Robot.from_urdf(two_links(limit='<limit lower="-1e16" upper="1e16" velocity="1e300" effort="1e308"/>'))
    (turn,) = arm.joints
    assert (turn.lower, turn.upper, turn.torque) == (-np.inf, np.inf, np.inf)
    assert turn.provenance == dict.fromkeys(("velocity", "acceleration", "jerk"), "default")


def sound_arm(lengths: str = "0.3", missing: int | None = None) -> str:
    """Return three joints, `lengths` apart; the link at `missing` has no mass."""
    names = [f"l{i}" for i in range(5)]
    links = [link(name, "" if i in (0, 4, missing) else INERTIAL) for i, name in enumerate(names)]
    origin = f'<origin xyz="{lengths} 0 0"/>'
    joints = [joint(f"j{i}", names[i - 1], names[i], origin=origin) for i in (1, 2, 3)]
    return robot(*links, *joints, joint("tip", "l3", "l4", kind="fixed", origin=origin, axis="", limit=""))


def warnings_of(urdf: str) -> list[tuple[str, str | None]]:
    return [(f.code, f.subject) for f in Robot.from_urdf(urdf).findings if f.severity == "warning"]


def test_a_sound_arm_gets_no_warning() -> None:
    assert warnings_of(sound_arm()) == []


def test_an_arm_is_measured_as_a_whole() -> None:
    """Each length could belong to a crane, but the three beyond the first joint sum up to 54 m."""
    assert warnings_of(sound_arm("16.6")) == []
    assert warnings_of(sound_arm("18")) == [("suspicious_length", None)]


def test_a_joint_without_a_mass_is_named() -> None:
    arm = Robot.from_urdf(sound_arm(missing=2))
    (said,) = [finding for finding in arm.findings if finding.severity == "warning"]
    assert said.code == "mass_missing"
    assert "between j2 and" in said.message
    assert arm.mass == pytest.approx(2 * 3.5)


def test_an_inertia_may_be_as_large_as_the_arm_is_long() -> None:
    """3.5 kg at a radius of gyration of 2 m are impossible on a short arm but possible on a long one."""
    wide = 'ixx="14" ixy="0" ixz="0" iyy="14" iyz="0" izz="14"'
    narrow = 'ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.03" iyz="0.0015" izz="0.025"'
    assert warnings_of(sound_arm().replace(narrow, wide)) == [("suspicious_inertia", f"l{i}") for i in (1, 2, 3)]
    assert warnings_of(sound_arm("1.0").replace(narrow, wide)) == []


def test_a_file_is_opened_by_its_path_only(tmp_path: Path) -> None:
    """A client's text that looks like a path must not open a file."""
    urdf, srdf = tmp_path / "arm.urdf", tmp_path / "arm.srdf"
    urdf.write_text(ARM, encoding="utf-8")
    srdf.write_text('<robot name="test"><group name="g"><joint name="j2"/></group></robot>', encoding="utf-8")
    from_files, from_text = Robot.from_urdf(urdf, srdf=srdf), Robot.from_urdf(ARM)
    assert from_files.joints == from_text.joints
    assert [group.name for group in from_files.groups] == ["g"]
    with pytest.raises(InvalidRobotModel):
        Robot.from_urdf(str(urdf))
