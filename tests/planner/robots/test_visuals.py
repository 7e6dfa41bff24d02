"""Visual meshes of URDFs: their places and colours against Pinocchio's own reader, and their faults."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

import planner
from planner.robots import visuals
from tests.planner.robots.urdfs import joint, link, robot
from tests.planner.shapes.mesh_files import box, stl

BLUE = '<material name="blue"/>'
RED = '<material name="own"><color rgba="0.9 0.1 0.05 0.5"/></material>'


def visual(file: str, *, material: str = "", scale: str = "1 1 1", origin: str = "") -> str:
    return f'<visual>{origin}<geometry><mesh filename="{file}" scale="{scale}"/></geometry>{material}</visual>'


PLACE = '<origin xyz="0.1 -0.2 0.3" rpy="0.4 0.5 0.6"/>'
ARM = robot(
    '<material name="blue"><color rgba="0.1 0.2 0.8 1"/></material>',
    link("base", visual("package://r/base.stl", material=BLUE)),
    link("upper", visual("package://r/part.stl", material=RED, scale="0.5 2 -1", origin=PLACE)),
    link("lower", visual("package://r/part.stl", material=BLUE, origin=PLACE) + visual("package://r/base.stl")),
    joint("j1", "base", "upper", axis='<axis xyz="0 1 0"/>', origin='<origin xyz="0 0 1" rpy="0.1 0.2 0.3"/>'),
    joint("j2", "upper", "lower", axis='<axis xyz="1 2 3"/>', origin='<origin xyz="0.5 0 0" rpy="0 0.7 0"/>'),
)
FILES = {
    "r/base.stl": stl(box((-0.2, -0.2, 0.0), (0.2, 0.1, 0.3))),
    "r/part.stl": stl(box((0.0, 0.0, 0.0), (0.1, 0.2, 0.6))),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    return tmp_path


def drawn_by_pinocchio(urdf: str, folder: Path, position: list[float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the triangles (F, 3, 3) in the base frame, and the colour, of each visual mesh."""
    model = pin.buildModelFromXML(urdf)
    shapes = pin.GeometryModel()
    pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.VISUAL, shapes, str(folder))
    data = model.createData()
    pin.forwardKinematics(model, data, np.array(position))
    found = []
    for shape in shapes.geometryObjects:
        triangles = trimesh.load(shape.meshPath, file_type="stl").triangles * shape.meshScale
        at = data.oMi[shape.parentJoint] * shape.placement
        found.append((triangles @ at.rotation.T + at.translation, np.array(shape.meshColor)))
    return found


def sorted_corners(triangles: np.ndarray) -> np.ndarray:
    rounded = triangles.reshape(-1, 3).round(5) + 0.0
    return rounded[np.lexsort(rounded.T)]


def volume(triangles: np.ndarray) -> float:
    return float(np.einsum("ij,ij->i", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6.0)


def test_meshes_stand_where_pinocchio_puts_them_in_the_colours_of_their_materials(folder: Path) -> None:
    position = [0.4, -0.7]
    arm = planner.Robot.from_urdf(ARM, meshes=folder)
    expected = drawn_by_pinocchio(ARM, folder, position)
    assert len(arm.visual_meshes) == len(expected) == 4 and arm.visual_findings == ()
    pin.forwardKinematics(arm.model, arm.data, np.array(position))
    left = list(expected)
    for mesh in arm.visual_meshes:
        at = arm.data.oMi[mesh.joint] * mesh.placement
        triangles = mesh.surface.vertices[mesh.surface.faces] @ at.rotation.T + at.translation
        assert volume(triangles) > 0.0, "seen from outside, also where a factor mirrors it"
        same = [i for i, (other, _) in enumerate(left) if np.allclose(sorted_corners(other), sorted_corners(triangles))]
        _, colour = left.pop(same[0])
        if mesh.colour is not None:
            np.testing.assert_allclose(mesh.colour, colour)
    assert not left
    assert [mesh.colour is None for mesh in arm.visual_meshes] == [False, False, False, True]
    again = pickle.loads(pickle.dumps(arm))  # noqa: S301 - just written
    assert [mesh.link for mesh in again.visual_meshes] == ["base", "upper", "lower", "lower"]


def test_a_derived_robot_has_the_same_meshes(folder: Path) -> None:
    arm = planner.Robot.from_urdf(ARM, meshes=folder)
    locked = arm.derived(locked={"j2": 0.3})
    pin.forwardKinematics(arm.model, arm.data, np.array([0.2, 0.3]))
    pin.forwardKinematics(locked.model, locked.data, np.array([0.2]))
    for one, other in zip(arm.visual_meshes, locked.visual_meshes, strict=True):
        at, there = arm.data.oMi[one.joint] * one.placement, locked.data.oMi[other.joint] * other.placement
        np.testing.assert_allclose(at.homogeneous, there.homogeneous, atol=1e-12)


def test_proofs_read_no_visual_mesh(folder: Path) -> None:
    with_meshes, without = planner.Robot.from_urdf(ARM, meshes=folder), planner.Robot.from_urdf(ARM)
    assert [shape.shape for shape in with_meshes.collision_shapes] == [
        shape.shape for shape in without.collision_shapes
    ]
    assert {shape.source for shape in with_meshes.collision_shapes} == {"estimate"}


@pytest.mark.parametrize(
    ("file", "code"),
    [
        (None, "visual_mesh_not_found"),
        (b"solid nothing", "visual_mesh_unread"),
        (FILES["r/part.stl"][:-7], "visual_mesh_unread"),
    ],
)
def test_a_mesh_that_is_missing_or_broken_is_a_finding(file: bytes | None, code: str) -> None:
    arm = planner.Robot.from_urdf(
        ARM, meshes=FILES | ({"r/part.stl": file} if file else {}) if file else {"r/base.stl": FILES["r/base.stl"]}
    )
    assert {finding.code for finding in arm.visual_findings} == {code}
    assert "error" not in {finding.severity for finding in arm.visual_findings}
    assert [mesh.link for mesh in arm.visual_meshes] == ["base", "lower"]


@pytest.mark.parametrize(
    "element",
    [
        visual("x.stl", origin='<origin xyz="a b c"/>'),
        visual("x.stl", scale="1 nan 1"),
        visual("x.stl", scale="0 1 1"),
        visual("x.stl", origin='<origin xyz="1e99 0 0"/>'),
    ],
)
def test_a_faulty_element_is_no_reason_to_refuse_a_robot(element: str) -> None:
    arm = planner.Robot.from_urdf(robot(link("base"), link("tip", element), joint("turn", "base", "tip")))
    assert "visual_mesh_unread" in {finding.code for finding in arm.findings} and not arm.visual_meshes


@pytest.mark.parametrize("colour", ["1 0 0", "red", "", "nan 0 0 1", "0 0 2 1"])
def test_what_is_no_colour_is_none(colour: str) -> None:
    material = f'<material name="m"><color rgba="{colour}"/></material>'
    arm = planner.Robot.from_urdf(
        robot(link("base"), link("tip", visual("r/part.stl", material=material)), joint("turn", "base", "tip")),
        meshes=FILES,
    )
    assert arm.visual_meshes[0].colour is None


def test_too_many_triangles_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(visuals, "MOST_TRIANGLES", 30)
    arm = planner.Robot.from_urdf(ARM, meshes=FILES)
    assert len(arm.visual_meshes) == 2
    assert [finding.code for finding in arm.visual_findings] == ["visual_meshes_left_out"]
