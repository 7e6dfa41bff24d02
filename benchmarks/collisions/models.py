"""Robots among objects as other libraries take them: with the same convex pieces that this one uses, or true meshes."""

from __future__ import annotations

from importlib.metadata import distribution
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import coal
import numpy as np
import pinocchio as pin

from benchmarks.plain_urdf import origin, plain_urdf
from planner.robots.collision.estimates import Outline
from planner.robots.collision.mesh_files import MeshReference
from planner.robots.collision.pairs import shapes_of_links
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, Sphere

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from planner.robots import Robot
    from planner.robots.collision.geometry import LinkShape
    from planner.scene import Scene
    from planner.shapes import Shape
    from planner.spatial import FloatArray

PACKAGES = "cmeel.prefix/share"
"""Folder of the package example-robot-data that `package://` means."""

STEP = 0.005
"""The longest distance of joint positions, rad, in checks of a path for contacts: some 5 mm for an arm of 1 m."""


class Contacts:
    """Tells whether a robot touches anything: sampled, with Pinocchio and coal alone.

    Examples:
        `Contacts(robot, scene, true_meshes=True).touches_along(path)` judges; with the convex pieces it serves a peer
        without a geometry of its own.
    """

    def __init__(self, robot: Robot, scene: Scene, *, true_meshes: bool) -> None:
        self._model, self._data = robot.model, robot.model.createData()
        self._geometry = pin.GeometryModel()
        links: list[str] = []
        for link, joint, placement, shape in _meshes(robot) if true_meshes else _pieces(robot):
            self._geometry.addGeometryObject(pin.GeometryObject(f"{link} {len(links)}", joint, placement, shape))
            links.append(link)
        moving = [number for number, shape in enumerate(self._geometry.geometryObjects) if shape.parentJoint]
        count = len(links)
        pairs = np.zeros((count, count), dtype=bool)
        for first, second in _checked_meshes(robot, links) if true_meshes else _checked_pieces(robot):
            pairs[min(first, second), max(first, second)] = True
        for number, (name, shape, position) in enumerate(things_of(scene)):
            placement = pin.SE3(np.eye(3), position)
            self._geometry.addGeometryObject(pin.GeometryObject(f"{name} {number}", 0, placement, shape.geometry))
        every = np.zeros((self._geometry.ngeoms, self._geometry.ngeoms), dtype=bool)
        every[:count, :count] = pairs
        every[np.ix_(moving, range(count, self._geometry.ngeoms))] = True
        self._geometry.setCollisionPairs(every)
        self._request = self._geometry.createData()
        self._manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._model, self._geometry, self._request
        )

    def touches(self, position: FloatArray) -> bool:
        """Tell whether anything touches at a joint position (joints,)."""
        return bool(pin.computeCollisions(self._model, self._data, self._manager, position, True))

    def touches_along(self, positions: FloatArray) -> bool:
        """Tell whether anything touches on the straight ways between joint positions (N, joints), densely sampled."""
        for start, end in pairwise(positions):
            count = max(1, int(np.ceil(np.abs(end - start).max() / STEP)))
            if any(self.touches(start + (end - start) * (k / count)) for k in range(count + 1)):
                return True
        return False


def checked_pairs(robot: Robot) -> set[frozenset[str]]:
    """Return the pairs of links that are checked against each other, except pairs whose shapes always touch."""
    return {
        frozenset((pair.link_1, pair.link_2))
        for pair in robot.collision_pairs
        if pair.reason is None and not pair.always_touching
    }


def _checked_pieces(robot: Robot) -> Iterator[tuple[int, int]]:
    """Yield the numbers of the pieces that this library checks against each other."""
    of_link = shapes_of_links(robot.collision_shapes)
    for pair in robot.collision_pairs:
        yield from pair.checked_shapes(of_link)


def _checked_meshes(robot: Robot, links: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Yield the numbers of the meshes that are checked against each other, by the links of all."""
    checked = checked_pairs(robot)
    for both in combinations(range(len(links)), 2):
        if frozenset(links[number] for number in both) in checked:
            yield both


def things_of(scene: Scene) -> Iterator[tuple[str, Box | Cylinder, FloatArray]]:
    """Yield the shapes of a scene of the benchmark, none of which is turned, with their positions (3,)."""
    for thing in scene.objects:
        for shape in thing.shapes:
            if not isinstance(shape, Box | Cylinder):
                raise TypeError(f"the scenes have boxes and cylinders, no {type(shape).__name__}")
            yield thing.id, shape, np.asarray(thing.pose.position, dtype=np.float64)


def urdf_with_pieces(robot: Robot, folder: Path) -> str:
    """Write a robot as URDF: one link for each of its own, fixed to its joint's, with its convex pieces.

    Args:
        robot: The arm.
        folder: Where the files of hulls are written, as OBJ.
    """
    of_link: dict[str, list[LinkShape]] = {}
    for shape in robot.collision_shapes:
        of_link.setdefault(shape.link, []).append(shape)
    parts = []
    for link, shapes in of_link.items():
        elements = "".join(
            _collision(part, placement, folder / f"{robot.id}_{link}_{number}.obj")
            for number, shape in enumerate(shapes)
            for part, placement in _simple(shape)
        )
        joint = shapes[0].joint
        parts.append(f'<link name="{shape_link(link)}">{elements}</link>')
        parts.append(
            f'<joint name="carries_{link}" type="fixed"><parent link="link_{joint}"/>'
            f'<child link="{shape_link(link)}"/></joint>'
        )
    urdf = plain_urdf(robot, clipped=False).removesuffix("</robot>") + "".join(parts) + "</robot>"
    return urdf.replace("<robot ", '<robot xmlns:drake="http://drake.mit.edu" ')


def shape_link(link: str) -> str:
    """Return the name of the link of the URDF that has the pieces of one of the robot's."""
    return f"pieces_of_{link}"


def _simple(shape: LinkShape) -> Iterator[tuple[Shape, pin.SE3]]:
    """Yield a shape as what URDF knows: a capsule is a cylinder and two balls."""
    if not isinstance(shape.shape, Capsule):
        yield shape.shape, shape.placement
        return
    half = shape.shape.length / 2.0
    yield Cylinder(shape.shape.radius, shape.shape.length), shape.placement
    for z in (-half, half):
        yield Sphere(shape.shape.radius), shape.placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, z]))


def _collision(shape: Shape, placement: pin.SE3, file: Path) -> str:
    """Return the collision element of a shape, whose file is written if it needs one."""
    if isinstance(shape, Box):
        inner = f'<box size="{" ".join(map(str, shape.size))}"/>'
    elif isinstance(shape, Cylinder):
        inner = f'<cylinder radius="{shape.radius}" length="{shape.length}"/>'
    elif isinstance(shape, Sphere):
        inner = f'<sphere radius="{shape.radius}"/>'
    elif isinstance(shape, ConvexHull):
        hull = shape.geometry
        corners, faces = np.asarray(hull.points()), [hull.polygons(k) for k in range(hull.num_polygons)]
        lines = ["v {} {} {}".format(*corner) for corner in corners]
        lines += ["f {} {} {}".format(*(int(face[k]) + 1 for k in range(3))) for face in faces]
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        inner = f'<mesh filename="file://{file}"><drake:declare_convex/></mesh>'
    else:
        raise TypeError(f"a link has a {type(shape).__name__}, which URDF does not know")
    return f"<collision>{origin(placement)}<geometry>{inner}</geometry></collision>"


def _pieces(robot: Robot) -> Iterator[tuple[str, int, pin.SE3, coal.CollisionGeometry]]:
    for shape in robot.collision_shapes:
        yield shape.link, shape.joint, shape.placement, shape.shape.geometry


def _meshes(robot: Robot) -> Iterator[tuple[str, int, pin.SE3, coal.CollisionGeometry]]:
    """Yield the meshes as their files have them; a robot without any has its pieces, which are all there is."""
    elements = () if robot.collision is None else robot.collision.elements
    if not any(isinstance(element.shape, MeshReference) for element in elements):
        yield from _pieces(robot)
        return
    loader = coal.MeshLoader()
    package = str(distribution("example-robot-data").locate_file(PACKAGES))
    for element in elements:
        if not robot.model.existBodyName(element.link):
            continue
        frame = robot.model.frames[robot.model.getFrameId(element.link)]
        placement = frame.placement * element.placement
        shape = element.shape
        if isinstance(shape, MeshReference):
            file = shape.name.replace("package://", f"{package}/")
            yield element.link, int(frame.parentJoint), placement, loader.load(file, np.array(shape.scale))
        else:
            solid = shape.hull() if isinstance(shape, Outline) else shape
            yield element.link, int(frame.parentJoint), placement, solid.geometry
