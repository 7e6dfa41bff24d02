"""Meshes of a robot: they are found only beside its description, and remarks report them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial import ConvexHull as Qhull

from planner import ConvexHull, Robot, load_robot
from planner.robots.catalogue import _package_robots
from planner.robots.collision.mesh_files import meshes_among, meshes_in_folder
from tests.planner.shapes.mesh_files import bodies, box, stl

CUBE = stl(box((0, 0, 0), (0.1, 0.1, 0.1)))


def urdf(mesh: str) -> str:
    joint = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/>'
    return f"""<robot name="r"><link name="base"/><link name="arm">
      <collision><origin xyz="1 0 0"/><geometry>{mesh}</geometry></collision></link>
      <joint name="j" type="revolute"><parent link="base"/><child link="arm"/>{joint}</joint></robot>"""


def codes(robot: Robot) -> list[str]:
    return [finding.code for finding in robot.collision_findings]


def test_a_mesh_is_scaled_and_placed() -> None:
    mesh = '<mesh filename="package://r/arm.stl" scale="1 2 -3"/>'
    (shape,) = Robot.from_urdf(urdf(mesh), meshes={"arm.stl": CUBE}).collision_shapes
    assert (shape.link, shape.source) == ("arm", "model")
    assert isinstance(shape.shape, ConvexHull)
    corners = shape.shape.vertices + shape.placement.translation
    assert corners.min(axis=0) == pytest.approx([1.0, 0.0, -0.3], abs=1e-7)
    assert corners.max(axis=0) == pytest.approx([1.1, 0.2, 0.0], abs=1e-7)


@pytest.mark.parametrize(
    ("reference", "file"),
    [
        ("package://r/meshes/arm.stl", "r/meshes/arm.stl"),
        ("package://r/meshes/arm.stl", "meshes/arm.stl"),
        ("package://r/meshes/arm.stl", "my robots/r/meshes/arm.stl"),
        ("package://r/meshes/arm.stl", "arm.stl"),
        ("package://r/x/../meshes/./arm.stl", "r/meshes/arm.stl"),
        ("model://r/arm.stl", "r/arm.stl"),
        ("file:///home/me/ws/r/meshes/arm.stl", "home/me/ws/r/meshes/arm.stl"),
        ("file:///home/me/ws/r/meshes/arm.stl", "r/meshes/arm.stl"),
        ("file:///home/me/my%20robots/arm.stl", "my robots/arm.stl"),
        ("file:///C:/ws/r/meshes/arm.stl", "r/meshes/arm.stl"),
        ("/home/me/ws/r/meshes/arm.stl", "home/me/ws/r/meshes/arm.stl"),
        ("/home/me/ws/r/meshes/arm.stl", "r/meshes/arm.stl"),
        ("/home/me/ws/r/meshes/arm.stl", "arm.stl"),
        ("meshes/arm.stl", "meshes/arm.stl"),
        ("./arm.stl", "arm.stl"),
    ],
)
def test_a_reference_is_found_among_files(reference: str, file: str) -> None:
    assert meshes_among({file: b"mesh", "other/thing.stl": b""})(reference) == b"mesh"


@pytest.mark.parametrize(
    "reference",
    [
        "",
        ".",
        "..",
        "package://",
        "package://r",
        "package://r/../../secret.stl",
        "../secret.stl",
        "meshes/../../secret.stl",
        "/secret.stl",
        "//secret.stl",
        "/packages/../../secret.stl",
        "package:///etc/passwd",
        "file:///secret.stl",
        "file:///packages/../../secret.stl",
        "file:///%2e%2e/secret.stl",
        "file://http://there/secret.stl",
        "http://there/secret.stl",
        "package://r/..\\..\\secret.stl",
        "package://r/secret.stl\0",
        "package://r/link.stl",
        "package://r/none.stl",
    ],
)
def test_nothing_outside_is_opened(reference: str, tmp_path: Path) -> None:
    package = tmp_path / "packages" / "r"
    package.mkdir(parents=True)
    (tmp_path / "secret.stl").write_bytes(CUBE)
    (package / "link.stl").symlink_to(tmp_path / "secret.stl")
    assert meshes_in_folder(tmp_path / "packages")(reference) is None
    assert meshes_among({"a/secret.stlx": CUBE, "etc/passwd": CUBE})(reference) is None


@pytest.mark.parametrize("scheme", ["file://", ""])
def test_an_absolute_address_is_found_by_its_longest_tail(tmp_path: Path, scheme: str) -> None:
    address = f"{scheme}/home/me/ws/r/meshes/arm.stl"
    files = {"arm.stl": b"short", "copy/meshes/arm.stl": b"long", "other/arm.stl": b"other"}
    assert meshes_among(files)(address) == b"long"
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    assert meshes_in_folder(tmp_path)(address) == b"short", "not below a folder of another name"
    assert meshes_in_folder(tmp_path / "copy")(address) == b"long"


def test_an_absolute_path_is_read_in_the_folder_only(tmp_path: Path) -> None:
    """A file of this machine outside the folder is not read."""
    outside, folder = tmp_path / "outside.stl", tmp_path / "folder"
    outside.write_bytes(CUBE)
    folder.mkdir()
    assert meshes_in_folder(folder)(str(outside)) is None
    (folder / "outside.stl").write_bytes(b"inside")
    assert meshes_in_folder(folder)(str(outside)) == b"inside"


def test_a_message_shows_the_end_of_a_long_mesh_address() -> None:
    address = f"file:///home/{'somebody/' * 30}meshes/collision/forearm.stl"
    (finding,) = (
        finding
        for finding in Robot.from_urdf(urdf(f'<mesh filename="{address}"/>')).collision_findings
        if finding.code == "mesh_not_found"
    )
    assert "file:///home/" in finding.message
    assert "meshes/collision/forearm.stl of arm" in finding.message
    assert len(finding.message) < 150


def test_a_name_that_two_files_end_with_is_not_guessed() -> None:
    files = {"left/arm.stl": b"left", "right/arm.stl": b"right"}
    assert meshes_among(files)("package://r/arm.stl") is None
    assert meshes_among(files)("package://r/right/arm.stl") == b"right"


def test_a_folder_has_one_folder_for_each_package(tmp_path: Path) -> None:
    (tmp_path / "r" / "meshes").mkdir(parents=True)
    (tmp_path / "r" / "meshes" / "arm.stl").write_bytes(CUBE)
    for root in (tmp_path, tmp_path / "r"):
        robot = Robot.from_urdf(urdf('<mesh filename="package://r/meshes/arm.stl"/>'), meshes=root)
        assert [shape.source for shape in robot.collision_shapes] == ["model"]


@pytest.mark.parametrize(
    ("files", "code"),
    [
        ({}, "mesh_not_found"),
        ({"arm.stl": b"nonsense"}, "invalid_mesh"),
        ({"arm.stl": CUBE[:-3]}, "invalid_mesh"),
        ({"arm.stl": stl(100.0 * bodies()["box"])}, "suspicious_length"),
        ({"arm.stl": stl(bodies()["open_tube"])}, None),
        ({"arm.stl": stl(bodies()["sheet"])}, "coarse_pieces"),
        ({"arm.stl": CUBE}, None),
    ],
)
def test_what_there_is_to_remark(files: dict[str, bytes], code: str | None) -> None:
    robot = Robot.from_urdf(urdf('<mesh filename="package://r/arm.stl"/>'), meshes=files)
    assert robot.findings == Robot.from_urdf(urdf('<mesh filename="package://r/arm.stl"/>')).findings
    found = codes(robot)
    assert (code in found) if code else not found
    assert bool(robot.collision_shapes), "what cannot be read is estimated"
    assert ("estimated_shapes" in found) == (code in ("mesh_not_found", "invalid_mesh"))


@pytest.mark.parametrize("id", ["panda", "ur5", pytest.param("kinova", marks=pytest.mark.large_only)])
def test_robots_of_the_package_have_the_shapes_of_their_makers(id: str) -> None:
    robot = load_robot(id)
    assert {shape.source for shape in robot.collision_shapes} == {"model"}
    assert {shape.joint for shape in robot.collision_shapes} == set(range(robot.dof + 1))
    assert not [finding for finding in robot.collision_findings if finding.severity != "info"]


@pytest.mark.parametrize("id", ["ur5", pytest.param("xarm7", marks=pytest.mark.large_only)])
def test_pieces_stand_around_the_meshes_that_pinocchio_places(id: str) -> None:
    """At a random position, the corners read (by assimp) and placed by Pinocchio are inside one of our pieces."""
    folder = _package_robots()
    if folder is None:
        pytest.skip("the package example-robot-data is not installed")
    robot = load_robot(id)
    urdf = str(folder / {"ur5": "ur_description/urdf/ur5_robot.urdf", "xarm7": "xarm_description/urdf/xarm7.urdf"}[id])
    model = pin.buildModelFromUrdf(urdf)
    geometry = pin.buildGeomFromUrdf(model, urdf, pin.GeometryType.COLLISION, package_dirs=[str(folder.parent.parent)])
    q = np.random.default_rng(3).uniform(-1.0, 1.0, robot.dof)
    names = [model.names[number] for number in range(1, model.njoints)]
    whole = pin.neutral(model)
    for name, value in zip(robot.joint_names, q, strict=True):
        whole[model.joints[names.index(name) + 1].idx_q] = value
    data, placed = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, placed, whole)
    pin.forwardKinematics(robot.model, robot.data, q)
    for number, each in enumerate(geometry.geometryObjects):
        if not hasattr(each.geometry, "vertices"):
            continue
        there = placed.oMg[number]
        corners = np.asarray(each.geometry.vertices())[::31] @ there.rotation.T + there.translation
        link = model.frames[each.parentFrame].name
        depths = []
        for shape in (shape for shape in robot.collision_shapes if shape.link == link):
            here = robot.data.oMi[shape.joint] * shape.placement
            local = (corners - here.translation) @ here.rotation
            planes = Qhull(shape.shape.vertices).equations  # type: ignore[attr-defined]  # all are hulls
            depths.append((local @ planes[:, :3].T + planes[:, 3]).max(axis=1))
        assert np.min(depths, axis=0).max() < 1e-7


def test_no_mesh_is_opened_before_it_is_asked_for() -> None:
    requested: list[str] = []

    class Files(dict[str, bytes]):
        def __contains__(self, name: object) -> bool:
            requested.append(str(name))
            return super().__contains__(name)

    robot = Robot.from_urdf(urdf('<mesh filename="arm.stl"/>'), meshes=Files({"arm.stl": CUBE}))
    heavier = robot.derived(limits={"j": {"velocity": 0.5}})
    assert np.isfinite(heavier.limit("velocity")).all()
    assert not requested
    assert robot.collision_shapes[0].shape is heavier.collision_shapes[0].shape
    assert requested == ["arm.stl"]
