"""The glTF of a robot, read by a second code (trimesh), against Pinocchio's kinematics."""

from __future__ import annotations

import io

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from api.work.answers.gltf import collision_gltf, visual_gltf
from planner import Robot, Shape, load_robot
from tests.planner.shapes.mesh_files import bodies, stl

TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from the axes of glTF, of which y points up, to the robot's axes."""

ROUND = 0.02
"""Round shapes are drawn with flat sides, inside of them by no more than so much of their radius."""


def robots() -> list[Robot]:
    limit = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
    ends = '<parent link="base"/><child link="arm"/><origin xyz="0 1 0" rpy="1 2 3"/>'
    joint = f'<joint name="j" type="revolute">{ends}{limit}</joint>'
    mesh = '<collision><origin xyz="1 0 0" rpy="0.3 0.2 0.1"/><geometry><mesh filename="a.stl"/></geometry></collision>'
    urdf = f'<robot name="r"><link name="base"/><link name="arm">{mesh}</link>{joint}</robot>'
    meshed = Robot.from_urdf(urdf, meshes={"a.stl": stl(bodies()["dumbbell"])})
    return [meshed, *(load_robot(name) for name in ("kuka_kr16_2", "date_sorting_arm", "ur5e", "three_dof_arm"))]


def reach(robot: Robot, directions: np.ndarray) -> np.ndarray:
    """Return the largest extent of the whole robot along directions at position 0."""
    pin.forwardKinematics(robot.model, robot.data, np.zeros(robot.dof))
    reaches = []
    for each in robot.collision_shapes:
        placement = robot.data.oMi[each.joint] * each.placement
        shape: Shape = each.shape
        reaches.append(shape.support(directions @ placement.rotation) + directions @ placement.translation)
    farthest: np.ndarray = np.max(reaches, axis=0)
    return farthest


@pytest.mark.parametrize("robot", robots(), ids=lambda robot: robot.id)
@pytest.mark.parametrize("kind", ["glb", "gltf"])
def test_a_second_reader_sees_the_shapes_where_they_are(robot: Robot, kind: str) -> None:
    scene = trimesh.load(io.BytesIO(collision_gltf(robot, binary=kind == "glb")), file_type=kind)
    assert len(scene.graph.nodes_geometry) == len(robot.collision_shapes)
    meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh)]
    assert all(mesh.is_watertight and mesh.volume > 0.0 for mesh in meshes), "triangles look outwards"
    n = np.random.default_rng(8).normal(size=(200, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    drawn = np.max([(mesh.vertices @ TO_Z_UP.T @ n.T).max(axis=0) for mesh in meshes], axis=0)
    expected = reach(robot, n)
    assert (drawn <= expected + 1e-6).all()
    assert drawn == pytest.approx(expected, abs=ROUND * 0.3)


def test_a_second_reader_sees_visual_meshes_and_their_colours() -> None:
    """URDF has colours in sRGB, glTF linear ones: 0.5 is 0.2140 (IEC 61966-2-1)."""
    material = '<material name="m"><color rgba="1 0.5 0 1"/></material>'
    shape = '<geometry><mesh filename="a.stl"/></geometry>'
    visual = f'<visual><origin xyz="1 0 0" rpy="0.3 0.2 0.1"/>{shape}{material}</visual>'
    limit = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
    ends = '<parent link="base"/><child link="arm"/><origin xyz="0 1 0" rpy="1 2 3"/><axis xyz="0 1 0"/>'
    joint = f'<joint name="j" type="revolute">{ends}{limit}</joint>'
    urdf = f'<robot name="r"><link name="base">{visual}</link><link name="arm">{visual}{visual}</link>{joint}</robot>'
    arm = Robot.from_urdf(urdf, meshes={"a.stl": stl(bodies()["dumbbell"])})
    scene = trimesh.load(io.BytesIO(visual_gltf(arm)), file_type="glb")
    meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh)]
    assert len(scene.geometry) == 1 and len(meshes) == 3, "one mesh, drawn three times"
    pin.forwardKinematics(arm.model, arm.data, np.zeros(1))
    for mesh, each in zip(meshes, arm.visual_meshes, strict=True):
        at = arm.data.oMi[each.joint] * each.placement
        expected = each.surface.vertices @ at.rotation.T + at.translation
        drawn = mesh.vertices @ TO_Z_UP.T
        corners = [tuple(corner) for corner in expected.round(4).tolist()]
        assert {tuple(corner) for corner in drawn.round(4).tolist()} == set(corners)
        assert mesh.visual.material.baseColorFactor.tolist() == [255, round(255 * 0.2140), 0, 255]
    assert not trimesh.load(io.BytesIO(visual_gltf(load_robot("three_dof_arm"))), file_type="glb").geometry
