"""The shapes of a robot and its surroundings in MuJoCo, whose collision detection is not the planner's."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from planner.scene.carried import DEEPEST_SUPPORT
from planner.scene.checker import CONTACT_TOLERANCE, CONTACTS, CollisionChecker
from planner.scene.point_cloud import Cluster
from planner.scene.scene import HERE, SceneObject
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from planner.simulation.plant import add_joints, joint_numbers, mujoco_quaternion
from planner.spatial import FloatArray

ROBOT = {"contype": 1, "conaffinity": 0}
"""The masks of shapes of the robot: MuJoCo compares them with objects, and of their own kind with named pairs only."""

AROUND = {"contype": 0, "conaffinity": 1}
"""The masks of objects around the robot."""


class Geometry:
    """The shapes of a robot and its surroundings: they have no masses and exert no forces.

    Attributes:
        checker: The robot and its surroundings, with the pairs to check. Of a pair that may touch, an overlap counts
            that is `DEEPEST_SUPPORT` deeper than where the robot takes the object or puts it down.
    """

    def __init__(self, checker: CollisionChecker) -> None:
        self.checker = checker
        self._model: Any = None
        if checker.is_empty and not checker.moving:
            return
        self._spec = mujoco.MjSpec()
        bodies = add_joints(self._spec, checker.bodies.tree)
        self._count = len(checker.bodies.pieces)
        touching = checker.requested.get(CONTACTS, False)
        least = np.minimum(checker.margins, 0.0) - np.where(touching, DEEPEST_SUPPORT, 0.0)
        self._least = np.column_stack([least, *(self._least_to(thing) for thing in checker.moving)])
        for number, piece in enumerate(checker.bodies.pieces):
            self._add(bodies[piece.joint], number, piece.shape, piece.rotation, piece.translation, ROBOT)
        for number, obstacle in enumerate(checker.obstacles.all, self._count):
            pose = obstacle.rotation, obstacle.translation
            self._add(self._spec.worldbody, number, obstacle.shape, *pose, AROUND)
        for number, thing in enumerate(checker.moving, self._count + len(checker.obstacles.all)):
            body = self._spec.worldbody.add_body(mocap=True)
            for k, shape in enumerate(shape for shape in thing.shapes if isinstance(shape, Shape)):
                geom = self._geom(f"{number}.{k}", shape, np.eye(3), np.zeros(3))
                body.add_geom(name=f"{number}.{k}", **geom, **AROUND)
        for first, second in zip(checker.first.tolist(), checker.second.tolist(), strict=True):
            self._spec.add_pair(geomname1=f"{first}", geomname2=f"{second}")
        self._model = self._spec.compile()
        self._data: Any = mujoco.MjData(self._model)
        self._joints = joint_numbers(self._model, checker.dof)
        names = (self._model.geom(k).name for k in range(self._model.ngeom))
        self._numbers = np.array([int(name.partition(".")[0]) for name in names], dtype=int)

    def overlaps(self, time: float, position: FloatArray) -> list[tuple[tuple[str, str], float]]:
        """Return the names of pairs that overlap, with their depth, m.

        Args:
            time: Time, s, of the objects that move.
            position: (joints,), rad or m, of the robot.
        """
        if self._model is None:
            return []
        self._data.qpos[self._joints] = position
        for k, thing in enumerate(self.checker.moving):
            pose = thing.pose_at(time).to_frame(self.checker.base or HERE)
            rotation = np.eye(3) if pose.rotation is None else pose.rotation
            self._data.mocap_pos[k], self._data.mocap_quat[k] = pose.position, mujoco_quaternion(rotation)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        contacts = self._data.contact
        if not len(contacts.dist):
            return []
        pairs = np.sort(self._numbers[contacts.geom], axis=1)
        found = []
        for (first, second), distance in zip(pairs.tolist(), contacts.dist.tolist(), strict=True):
            least = 0.0 if second < self._count else self._least[first, second - self._count]
            if distance < least - CONTACT_TOLERANCE:
                found.append(((self._name(first), self._name(second)), -distance))
        return found

    def _name(self, number: int) -> str:
        names = [body.name for body in self.checker.bodies.pieces]
        names += [obstacle.name for obstacle in self.checker.obstacles.all]
        return names[number] if number < len(names) else self.checker.moving[number - len(names)].id

    def _least_to(self, thing: SceneObject) -> list[float]:
        """Return the allowed distances of the bodies from an object that moves, m, 0 or negative."""
        margins = (self.checker.margin_to(piece.name, thing) for piece in self.checker.bodies.pieces)
        return [-np.inf if margin is None else min(margin, 0.0) for margin in margins]

    def _add(
        self,
        body: Any,
        number: int,
        shape: Shape | Cluster,
        rotation: FloatArray,
        translation: FloatArray,
        masks: dict[str, int],
    ) -> None:
        """Add a shape to a body at a pose in its frame; a cloud becomes a ball for each point."""
        if not isinstance(shape, Cluster):
            body.add_geom(name=f"{number}", **self._geom(f"{number}", shape, rotation, translation), **masks)
            return
        for k, (center, radius) in enumerate(zip(shape.centers, shape.radii.tolist(), strict=True)):
            ball = self._geom("", Sphere(radius), rotation, rotation @ center + translation)
            body.add_geom(name=f"{number}.{k}", **ball, **masks)

    def _geom(self, name: str, shape: Shape, rotation: FloatArray, translation: FloatArray) -> dict[str, Any]:
        """Return MuJoCo's description of a shape at a pose."""
        pose = {"pos": translation, "quat": mujoco_quaternion(rotation)}
        kinds = mujoco.mjtGeom
        match shape:
            case Sphere():
                return {"type": kinds.mjGEOM_SPHERE, "size": [shape.radius, 0.0, 0.0], **pose}
            case Box():
                return {"type": kinds.mjGEOM_BOX, "size": shape.size / 2.0, **pose}
            case Cylinder():
                return {"type": kinds.mjGEOM_CYLINDER, "size": [shape.radius, shape.length / 2.0, 0.0], **pose}
            case Capsule():
                return {"type": kinds.mjGEOM_CAPSULE, "size": [shape.radius, shape.length / 2.0, 0.0], **pose}
            case HalfSpace():
                normal = rotation @ shape.normal
                pose = {"pos": translation + shape.offset * normal, "zaxis": normal}
                return {"type": kinds.mjGEOM_PLANE, "size": [0.0, 0.0, 1.0], **pose}
            case ConvexHull():
                mesh = self._spec.add_mesh(name=name, uservert=shape.vertices.ravel())
                mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
                return {"type": kinds.mjGEOM_MESH, "meshname": name, **pose}
        raise TypeError(f"MuJoCo has no {type(shape).__name__}")
