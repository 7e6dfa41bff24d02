"""MJCF as robots: kinematics, torques and shapes beside MuJoCo's own."""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import planner
from planner import InvalidRobotModel, Robot, read_robot_files
from planner.spatial import FloatArray
from tests.sizes import SIZE

ROOT = Path(__file__).parents[4]

FAST = 1.0
"""Speed, rad/s or m/s, above which MuJoCo's friction, which is soft about rest, is all there."""

ARM = """
<mujoco model="arm">
  <compiler angle="degree"/>
  <default><default class="visual"><geom contype="0" conaffinity="0"/></default></default>
  <asset><mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.1 0  0 0 0.2"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="base" pos="0.1 0.2 0.3" euler="10 20 30">
      <geom type="box" size="0.1 0.1 0.05" mass="4"/>
      <body name="upper" pos="0 0 0.2">
        <joint name="j1" axis="0 0 1" range="-170 170" ref="20" actuatorfrcrange="-87 87" damping="1" frictionloss="3"
               armature="0.2"/>
        <joint name="j2" axis="0 1 0" pos="0.02 0 0.05" range="-100 90"/>
        <inertial pos="0.05 0.01 0.2" mass="3" fullinertia="0.05 0.06 0.02 0.001 0.002 0.003"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.05"/>
        <body name="fore" pos="0 0 0.4" quat="0.9 0.1 0.2 0.3">
          <joint name="j3" type="slide" axis="1 0 0.2" range="-0.1 0.3" ref="0.1"/>
          <geom type="mesh" mesh="wedge" pos="0.1 0 0" mass="1.5"/>
          <geom type="ellipsoid" size="0.02 0.03 0.04" pos="0 0 0.1" mass="0.2"/>
          <body name="wrist" pos="0.3 0 0">
            <joint name="j4" axis="1 0 0"/>
            <geom type="sphere" size="0.05" mass="0.8"/>
            <geom class="visual" type="sphere" size="0.2" mass="0"/>
            <site name="tool" pos="0.1 0 0" euler="0 90 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="base" body2="fore"/></contact>
  <actuator><motor joint="j2" gear="50" forcerange="-2 2"/></actuator>
  <keyframe><key name="home" qpos="0.3 0.2 0.1 0.5"/></keyframe>
</mujoco>
"""


def _random_arm(seed: int) -> str:
    """Return a chain of bodies with one or two joints each, at random places, with references and anchors."""
    rng = np.random.default_rng(seed)

    def numbers(low: float, high: float, count: int = 3) -> str:
        return " ".join(map(str, rng.uniform(low, high, count)))

    text = '<site name="tool" pos="0.1 0.2 0.3"/>'
    for number in range(5):
        joints = "".join(
            f'<joint name="j{number}{letter}" axis="{numbers(-1, 1)}" pos="{numbers(-0.1, 0.1)}" '
            f'type="{rng.choice(["hinge", "slide"])}" range="-1 1" ref="{rng.uniform(-0.5, 0.5)}" '
            f'frictionloss="{rng.uniform(0, 2)}" damping="{rng.uniform(0, 2)}" armature="{rng.uniform(0, 2)}"/>'
            for letter in "ab"[: rng.integers(1, 3)]
        )
        inertial = f'<inertial pos="{numbers(-0.1, 0.1)}" mass="{rng.uniform(1, 3)}" diaginertia="0.03 0.04 0.05"/>'
        pose = f'pos="{numbers(-0.3, 0.3)}" quat="{numbers(-1, 1, 4)}"'
        text = f"<body {pose}>{joints}{inertial}{text}</body>"
    return f'<mujoco><compiler angle="radian"/><worldbody>{text}</worldbody></mujoco>'


def _read(path: Path, text: str) -> tuple[Robot, mujoco.MjModel]:
    path.write_text(text)
    files = read_robot_files(path)
    robot = Robot.from_urdf(files.urdf, srdf=files.srdf, meshes=files.meshes)
    return robot, mujoco.MjModel.from_xml_path(str(path))


def _states(model: mujoco.MjModel, seed: int, count: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.stack([rng.uniform(-1.5, 1.5, (count, model.nv)) for _ in range(3)], axis=1)


@pytest.mark.sized
@pytest.mark.parametrize("seed", [None, *range(min(SIZE.examples // 2, 60))])
def test_poses_and_torques_are_those_of_mujoco(tmp_path: Path, seed: int | None) -> None:
    robot, model = _read(tmp_path / "arm.xml", ARM if seed is None else _random_arm(seed))
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "tool")
    assert robot.tip_frame == "tool"
    for q, v, a in _states(model, seed or 0, 20):
        v += np.copysign(FAST, v)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        pose = planner.tool_pose(robot, q)
        np.testing.assert_allclose(pose.position, data.site_xpos[site], atol=1e-12)
        np.testing.assert_allclose(pose.rotation, data.site_xmat[site].reshape(3, 3), atol=1e-12)
        data.qacc[:] = a
        mujoco.mj_inverse(model, data)
        torques = data.qfrc_inverse
        found = planner.inverse_dynamics(robot, [q], [v], [a])[0]
        np.testing.assert_allclose(found, torques, atol=1e-10 * max(1.0, np.abs(torques).max()))


def test_shapes_limits_names_and_exclusions_are_read(tmp_path: Path) -> None:
    robot, model = _read(tmp_path / "arm.xml", ARM)
    assert [(joint.name, joint.kind) for joint in robot.joints] == [
        ("j1", "revolute"),
        ("j2", "revolute"),
        ("j3", "prismatic"),
        ("j4", "continuous"),
    ]
    np.testing.assert_allclose([joint.lower for joint in robot.joints], [*np.radians([-170, -100]), -0.1, -np.inf])
    assert [joint.torque for joint in robot.joints] == [87.0, 100.0, np.inf, np.inf]
    assert robot.named_positions["home"] == (0.3, 0.2, 0.1, 0.5)
    excluded = [pair for pair in robot.collision_pairs if pair.reason == "srdf"]
    assert [{pair.link_1, pair.link_2} for pair in excluded] == [{"base", "fore"}]
    assert {shape.source for shape in robot.collision_shapes} == {"model"}

    data = mujoco.MjData(model)
    data.qpos[:] = [0.5, -0.4, 0.2, 1.0]
    mujoco.mj_forward(model, data)
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "fore")
    mesh = int(model.body_geomadr[geom])
    theirs = model.mesh_vert @ data.geom_xmat[mesh].reshape(3, 3).T + data.geom_xpos[mesh]
    (shape,) = (shape for shape in robot.collision_shapes if isinstance(shape.shape, planner.ConvexHull))
    state = robot.model.createData()
    pin.forwardKinematics(robot.model, state, data.qpos)
    placement = state.oMi[shape.joint] * shape.placement
    ours = np.array([placement * vertex for vertex in shape.shape.vertices])
    np.testing.assert_allclose(*(points[np.lexsort(points.round(6).T)] for points in (ours, theirs)), atol=1e-7)


def test_a_urdf_that_mujoco_writes_as_mjcf_is_the_same_robot(tmp_path: Path) -> None:
    urdf = ROOT / "planner/robots/data/kuka_kr16_2.urdf"
    mujoco.mj_saveLastXML(str(tmp_path / "kuka.xml"), mujoco.MjModel.from_xml_path(str(urdf)))
    second, _ = _read(tmp_path / "again.xml", (tmp_path / "kuka.xml").read_text())
    first = Robot.from_urdf(urdf, tip_frame=second.tip_frame)
    for q in np.random.default_rng(0).uniform(-1.0, 1.0, (20, 6)):
        poses = [planner.tool_pose(robot, q) for robot in (first, second)]
        np.testing.assert_allclose(poses[0].position, poses[1].position, atol=1e-6)
        np.testing.assert_allclose(poses[0].rotation, poses[1].rotation, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        (
            "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>",
            "unsupported_joint_kind",
            "free",
        ),
        (
            "<mujoco><worldbody><body><joint name='b' type='ball'/><geom size='1'/></body></worldbody></mujoco>",
            "unsupported_joint_kind",
            "b is a ball joint",
        ),
        ("<mujoco><worldbody><body><joint type='hinge'/></body></worldbody></mujoco>", "mjcf_failed", "mass"),
        ("<mujoco><nothing/></mujoco>", "mjcf_failed", "nothing"),
    ],
)
def test_what_is_no_arm_is_refused(tmp_path: Path, text: str, code: str, said: str) -> None:
    file = tmp_path / "arm.xml"
    file.write_text(text)
    with pytest.raises(InvalidRobotModel, match=said) as raised:
        read_robot_files(file)
    assert raised.value.findings[0].code == code


def test_the_package_that_is_missing_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InvalidRobotModel, match="install `mujoco-core`"):
        read_robot_files(tmp_path / "arm.xml")
