"""Robots in xacro and URDF files: expansion, packages, meshes, joint limits and calibrations."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import planner
from planner import InvalidRobotModel, Robot, read_robot_files
from tests.planner.robots.urdfs import joint, link, robot

XACRO = """
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="length" default="0.4"/>
  <xacro:include filename="$(find parts)/urdf/segment.xacro"/>
  <link name="base"/>
  <xacro:segment name="one" parent="base" length="$(arg length)"/>
  <xacro:segment name="two" parent="one" length="${2 * float('$(arg length)')}"/>
</robot>
"""

SEGMENT = """
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="segment" params="name parent length">
    <joint name="${name}_joint" type="revolute">
      <parent link="${parent}"/><child link="${name}"/><origin xyz="0 0 ${length}" rpy="${pi / 2} 0 0"/>
      <axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" velocity="2" effort="30"/>
    </joint>
    <link name="${name}"><collision><geometry>
      <mesh filename="package://parts/meshes/wedge.obj"/></geometry></collision></link>
  </xacro:macro>
</robot>
"""

WEDGE = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.2\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


@pytest.fixture
def xacro_file(tmp_path: Path) -> Path:
    """An arm in one package, its segments and meshes in another one beside it."""
    for name in ("arm/urdf", "parts/urdf", "parts/meshes"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "parts/urdf/segment.xacro").write_text(SEGMENT)
    (tmp_path / "parts/meshes/wedge.obj").write_bytes(WEDGE)
    file = tmp_path / "arm/urdf/arm.xacro"
    file.write_text(XACRO)
    return file


@pytest.mark.parametrize(("arguments", "length"), [({}, 0.4), ({"length": "0.25"}, 0.25)])
def test_a_xacro_file_is_expanded_with_its_packages_and_meshes(
    xacro_file: Path, arguments: dict[str, str], length: float
) -> None:
    files = read_robot_files(xacro_file, arguments=arguments)
    arm = Robot.from_urdf(files.urdf, meshes=files.meshes)
    turn = f'rpy="{np.pi / 2} 0 0"'
    by_hand = Robot.from_urdf(
        robot(
            link("base"),
            link("one"),
            link("two"),
            joint("one_joint", "base", "one", origin=f'<origin xyz="0 0 {length}" {turn}/>'),
            joint("two_joint", "one", "two", origin=f'<origin xyz="0 0 {2 * length}" {turn}/>'),
        )
    )
    for q in np.random.default_rng(0).uniform(-1.5, 1.5, (10, 2)):
        poses = [planner.tool_pose(each, q) for each in (arm, by_hand)]
        np.testing.assert_allclose(poses[0].position, poses[1].position, atol=1e-12)
        np.testing.assert_allclose(poses[0].rotation, poses[1].rotation, atol=1e-12)
    assert [(shape.link, shape.source) for shape in arm.collision_shapes] == [("one", "model"), ("two", "model")]


def test_a_urdf_file_with_elements_of_xacro_is_expanded(xacro_file: Path) -> None:
    as_urdf = xacro_file.rename(xacro_file.with_suffix(".urdf"))
    expanded = read_robot_files(as_urdf, arguments={"length": "0.25"})
    assert len(Robot.from_urdf(expanded.urdf).joint_names) == 2
    plain = as_urdf.with_name("expanded.urdf")
    plain.write_text(expanded.urdf.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1))
    assert read_robot_files(plain).urdf == plain.read_text()  # the namespace alone makes no xacro file


def test_packages_elsewhere_are_found_in_the_folders_that_are_named(xacro_file: Path, tmp_path: Path) -> None:
    away = tmp_path / "elsewhere" / "deep"
    away.mkdir(parents=True)
    moved = away / "arm.xacro"
    moved.write_text(XACRO)
    (tmp_path / "parts").rename(tmp_path / "elsewhere/other_parts")
    with pytest.raises(InvalidRobotModel, match="package parts") as raised:
        read_robot_files(moved)
    assert raised.value.findings[0].code in ("package_not_found", "xacro_failed")
    (tmp_path / "workspace").mkdir()
    (tmp_path / "elsewhere/other_parts").rename(tmp_path / "workspace/parts")
    for packages in (tmp_path / "workspace", tmp_path / "workspace/parts"):
        files = read_robot_files(moved, packages=[packages])
        assert list(files.meshes) == ["package://parts/meshes/wedge.obj"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot", "cannot be expanded"),
        (XACRO.replace("$(arg length)", "$(arg width)"), "width"),
        (XACRO.replace("2 * float", "2 / 0 * float"), "division by zero"),
        (XACRO.replace("xacro:segment", "xacro:unknown"), "unknown"),
    ],
)
def test_a_xacro_file_that_cannot_be_expanded_is_refused(xacro_file: Path, text: str, said: str) -> None:
    xacro_file.write_text(text)
    with pytest.raises(InvalidRobotModel, match=said) as raised:
        read_robot_files(xacro_file)
    assert raised.value.findings[0].code == "xacro_failed"


@pytest.mark.parametrize(
    "address", ["parts/wedge.obj", "package://arm/parts/wedge.obj", "file:///home/me/workspace/arm/parts/wedge.obj"]
)
def test_meshes_of_a_urdf_are_found_by_every_kind_of_address(tmp_path: Path, address: str) -> None:
    (tmp_path / "arm/parts").mkdir(parents=True)
    (tmp_path / "arm/package.xml").touch()
    (tmp_path / "arm/parts/wedge.obj").write_bytes(WEDGE)
    mesh = f'<collision><geometry><mesh filename="{address}"/></geometry></collision>'
    file = tmp_path / "arm/arm.urdf"
    file.write_text(robot(link("base"), link("tip", mesh), joint("turn", "base", "tip")))
    files = read_robot_files(file)
    assert files.meshes == {address: WEDGE}
    arm = Robot.from_urdf(files.urdf, meshes=files.meshes)
    assert [shape.source for shape in arm.collision_shapes] == ["model"]
    (tmp_path / "arm/parts/wedge.obj").unlink()
    assert not read_robot_files(file).meshes


UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
UR_LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")


def _ur_like(prefix: str = "") -> str:
    links = ["base", *(f"{prefix}{name}_link" for name in UR_LINKS)]
    joints = [joint(f"{prefix}{name}_joint", *ends) for name, ends in zip(UR_JOINTS, pairwise(links), strict=True)]
    return robot(*map(link, links), *joints)


@pytest.mark.parametrize("prefix", ["", "left_"])
def test_a_calibration_gives_the_origins_of_the_joints(tmp_path: Path, prefix: str) -> None:
    rng = np.random.default_rng(7)
    origins = rng.uniform(-0.5, 0.5, (6, 6))
    keys = ("x", "y", "z", "roll", "pitch", "yaw")
    lines = ["kinematics:"]
    for name, values in zip(UR_LINKS, origins.tolist(), strict=True):
        lines += [f"  {name}:", *(f"    {key}: {value!r}" for key, value in zip(keys, values, strict=True))]
    (tmp_path / "calibration.yaml").write_text("\n".join([*lines, "  hash: calib_1234"]))
    (tmp_path / "arm.urdf").write_text(_ur_like(prefix))
    arm = Robot.from_urdf(read_robot_files(tmp_path / "arm.urdf", calibration=tmp_path / "calibration.yaml").urdf)
    for q in rng.uniform(-1.5, 1.5, (10, 6)):
        transform = np.eye(4)
        for (x, y, z, *rpy), angle in zip(origins, q, strict=True):
            own = np.eye(4)
            own[:3, :3] = (Rotation.from_euler("xyz", rpy) * Rotation.from_euler("z", angle)).as_matrix()
            own[:3, 3] = x, y, z
            transform = transform @ own
        pose = planner.tool_pose(arm, q)
        np.testing.assert_allclose(pose.position, transform[:3, 3], atol=1e-12)
        np.testing.assert_allclose(pose.rotation, transform[:3, :3], atol=1e-12)


def test_a_calibration_of_another_arm_is_refused(tmp_path: Path) -> None:
    numbers = "{x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}"
    (tmp_path / "calibration.yaml").write_text("kinematics:\n" + "".join(f"  {name}: {numbers}\n" for name in UR_LINKS))
    (tmp_path / "arm.urdf").write_text(robot(link("base"), link("tip"), joint("turn", "base", "tip")))
    with pytest.raises(InvalidRobotModel, match="one joint shoulder_pan_joint; the model has 0"):
        read_robot_files(tmp_path / "arm.urdf", calibration=tmp_path / "calibration.yaml")


LIMITS = """
joint_limits:
  turn:
    has_position_limits: true
    min_position: !degrees -60
    max_position: !degrees 60
    has_velocity_limits: true
    max_velocity: !degrees 90
    has_acceleration_limits: true
    max_acceleration: 7.0
    max_deceleration: -6.0
    has_jerk_limits: false
    max_jerk: 3.0
    max_effort: 12
"""


def test_joint_limits_of_moveit_replace_those_of_the_urdf(tmp_path: Path) -> None:
    (tmp_path / "joint_limits.yaml").write_text(LIMITS)
    (tmp_path / "arm.urdf").write_text(robot(link("base"), link("tip"), joint("turn", "base", "tip")))
    files = read_robot_files(tmp_path / "arm.urdf", joint_limits=tmp_path / "joint_limits.yaml")
    (turn,) = Robot.from_urdf(files.urdf).joints
    found = turn.lower, turn.upper, turn.velocity, turn.acceleration, turn.torque
    np.testing.assert_allclose(found, [-np.pi / 3, np.pi / 3, np.pi / 2, 6.0, 12.0])
    assert turn.provenance["jerk"] == "default"


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("- 1", "not_yaml", "has no fields"),
        ("{", "not_yaml", "is not YAML"),
        ("joint_limits: 3", "missing_field", "joint_limits"),
        ("joint_limits: {elbow: {max_velocity: 1}}", "unknown_joint", "elbow"),
        ("joint_limits: {turn: {max_velocity: fast}}", "not_a_number", "max_velocity.*'fast'"),
        ("joint_limits: {turn: {max_velocity: .inf}}", "not_a_number", "max_velocity"),
        ("joint_limits: {turn: {max_velocity: !!python/name:os.system x}}", "not_yaml", "python"),
        ("joint_limits: {turn: {max_velocity: !degrees x}}", "not_yaml", "not YAML"),
    ],
)
def test_a_file_without_limits_is_refused(tmp_path: Path, text: str, code: str, said: str) -> None:
    (tmp_path / "joint_limits.yaml").write_text(text)
    (tmp_path / "arm.urdf").write_text(robot(link("base"), link("tip"), joint("turn", "base", "tip")))
    with pytest.raises(InvalidRobotModel, match=said) as raised:
        read_robot_files(tmp_path / "arm.urdf", joint_limits=tmp_path / "joint_limits.yaml")
    assert raised.value.findings[0].code == code


@pytest.mark.parametrize("package", ["xacro", "yaml"])
def test_the_package_that_is_missing_is_named(
    xacro_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    (tmp_path / "joint_limits.yaml").write_text(LIMITS)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InvalidRobotModel, match="the extra `models`"):
        read_robot_files(xacro_file, joint_limits=tmp_path / "joint_limits.yaml")


def test_a_document_that_is_no_xml_is_left_to_the_reader_of_urdf(tmp_path: Path) -> None:
    for text in ("", "no xml", "<!DOCTYPE robot [<!ENTITY a 'b'>]><robot/>"):
        (tmp_path / "arm.urdf").write_text(text)
        with pytest.raises(InvalidRobotModel):
            Robot.from_urdf(read_robot_files(tmp_path / "arm.urdf").urdf)
