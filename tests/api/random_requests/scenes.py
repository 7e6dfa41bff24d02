"""Random scenes: every shape, tiny, huge, flat and repeated shapes, and objects that almost touch the arm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from planner.shapes import Capsule, Sphere
from tests.api.random_requests.draws import Draws
from tests.api.random_requests.poses import NOTATIONS, in_base, written

KINDS = ("box", "sphere", "cylinder", "capsule", "half_space", "convex", "mesh", "point_cloud")
CUBE = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8).T
CUBE_TRIANGLES = [[0, 1, 2], [1, 3, 2], [4, 6, 5], [5, 6, 7], [0, 4, 1], [1, 4, 5], [2, 3, 6], [3, 7, 6]]
CUBE_TRIANGLES += [[0, 2, 4], [2, 6, 4], [1, 5, 3], [3, 5, 7]]

GAPS = (-1e-3, -3e-5, 3e-5, 1e-4, 2e-3)
"""Room beyond the margin where an object grazes the arm, m."""


class Scenes(Draws):
    """Random scenes around a robot."""

    def scene(self, request: dict[str, Any], joint_positions: list[np.ndarray]) -> dict[str, Any]:
        """Return a scene for a request that passes some joint positions."""
        scene: dict[str, Any] = {"objects": []}
        if self.chance(0.5):
            scene["margin"] = self.choice((0.0, 1e-3, 0.01, 0.05))
        count = 30 if self.chance(0.04) else int(self.random.integers(0, 5))
        frames = ["world", "base", *request.get("frames", {})]
        for number in range(count):
            frame = self.choice(frames)
            thing: dict[str, Any] = {"id": f"thing_{number}", "frame": frame}
            if self.chance(0.2):
                thing["margin"] = self.between(1e-4, 0.05)
            if self.chance(0.3):
                margin = thing.get("margin", scene.get("margin", 0.0))
                shape, where = self._grazing(self.choice(joint_positions), margin)
            else:
                shape, where = self.shape(self.choice(KINDS)), self._somewhere()
            there = in_base(self.robot, request, frame).actInv(where)
            pose = written(there, self.choice(NOTATIONS))
            if shape["kind"] == "sphere" and self.chance(0.5):
                pose["orientation"] = None
            scene["objects"].append(thing | {"shape": shape, "pose": pose})
        if count > 1 and self.chance(0.1):
            twin = scene["objects"][0]
            scene["objects"].append(twin | {"id": self.choice(("twin", "twin", "twin", twin["id"]))})
        if self.chance(0.3):
            scene["attached"] = [self._attached(number) for number in range(int(self.random.integers(1, 3)))]
        links = [shape.link for shape in self.robot.collision_shapes]
        names = [thing["id"] for kind in ("objects", "attached") for thing in scene.get(kind, [])]
        if self.chance(0.25) and names:
            scene["allowed_pairs"] = [[self.choice(links), self.choice([*names, *links])] for _ in range(2)]
        return scene

    def speed_zones(self, scene: dict[str, Any]) -> list[dict[str, Any]]:
        """Return speed zones around all or some objects of a scene, occasionally around an unknown one."""
        names = [thing["id"] for thing in scene["objects"]]
        zones: list[dict[str, Any]] = []
        for _ in range(int(self.random.integers(1, 4))):
            zone: dict[str, Any] = {"clearance": self.between(1e-3, 1.0), "speed": self.between(0.01, 2.0)}
            if names and self.chance(0.4):
                zone["objects"] = [self.choice((*names, *names, "nothing") if self.chance(0.1) else names)]
            zones.append(zone)
        return zones

    def _somewhere(self) -> pin.SE3:
        """Return a place around the arm: anywhere, or aligned with the axes of its base."""
        way = self.random.normal(size=3)
        position = way / np.linalg.norm(way) * self.random.uniform(0.4, 1.8)
        if self.chance(0.2):
            return pin.SE3(np.eye(3), np.round(position, 1))
        return pin.SE3(pin.exp3(self.random.normal(size=3)), position)

    def _grazing(self, joint_position: np.ndarray, margin: float) -> tuple[dict[str, Any], pin.SE3]:
        """Return a ball or wall that a link end almost touches at a joint position, in the base frame."""
        data = self.robot.model.createData()
        pin.forwardKinematics(self.robot.model, data, joint_position)
        bodies = [body for body in self.robot.collision_shapes if body.joint]
        body = bodies[int(self.random.integers(len(bodies)))]
        where = data.oMi[body.joint] * body.placement
        shape = body.shape
        end, radius = np.zeros(3), 0.05
        if isinstance(shape, Sphere | Capsule):
            end[2] = shape.length / 2.0 if isinstance(shape, Capsule) else 0.0
            radius = shape.radius
        away = self.random.normal(size=3)
        away[2] = abs(away[2])  # beyond the end of the link
        away = where.rotation @ away / np.linalg.norm(away)
        gap = radius + margin + self.choice(GAPS)
        if self.chance(0.5):
            size = self.between(1e-3, 0.5)
            return {"kind": "sphere", "radius": size}, pin.SE3(np.eye(3), where.act(end) + away * (gap + size))
        offset = float(-away @ (where.act(end) + gap * away))
        return {"kind": "half_space", "normal": (-away).tolist(), "offset": offset}, pin.SE3.Identity()

    def shape(self, kind: str) -> dict[str, Any]:
        size = self.between(0.01, 0.4)
        if self.chance(0.05):
            size = self.choice((1e-6, 1e-4, 10.0, 1e3))
        sides = size * self.random.uniform(0.1, 1.0, 3)
        if self.chance(0.1):
            sides[self.random.integers(3)] = 1e-6
        a, b = np.clip(sides[:2], 1e-6, 1e3).tolist()
        made: dict[str, Any] = {"kind": kind}
        match kind:
            case "box":
                made["size"] = np.clip(sides, 1e-6, 1e3).tolist()
            case "sphere":
                made["radius"] = a
            case "cylinder" | "capsule":
                made |= {"radius": a, "length": b}
            case "half_space":
                made |= {"normal": self._normal(), "offset": -self.between(0.1, 2.0)}
            case "convex":
                made["vertices"] = self._vertices(sides)
            case "mesh":
                made |= self._mesh(sides)
            case "point_cloud":
                made["points"] = self._points(np.clip(sides, 1e-3, 2.0))
                made["radius"] = self.between(1e-4, 0.05)
                if self.chance(0.4):
                    made["voxel"] = self.between(1e-3, 0.1)
        return made

    def _normal(self) -> list[float]:
        if self.chance(0.4):
            axes: list[list[float]] = [[0.0, 0.0, 1.0], [0.0, 0.0, 1e-9], [0.0, -1e6, 0.0], [0.0, 0.0, 0.0]]
            return axes[int(self.random.choice(4, p=[0.5, 0.2, 0.25, 0.05]))]
        return list(self.random.normal(size=3).tolist())

    def _vertices(self, sides: np.ndarray) -> list[list[float]]:
        points = self.random.normal(size=(int(self.random.integers(4, 24)), 3))
        match int(self.random.integers(12)):
            case 0:
                points[:, 2] = 0.0
            case 1:
                points[:, 1:] = 0.0
            case 2:
                points[:] = points[0]
            case 3 | 4 | 5:
                points = CUBE.copy()
            case 6:
                points = self.random.normal(size=(256, 3))
        return list(np.clip(points * sides, -1e3, 1e3).tolist())

    def _mesh(self, sides: np.ndarray) -> dict[str, Any]:
        if self.chance(0.6):
            vertices, triangles = CUBE, CUBE_TRIANGLES
        else:
            vertices = self.random.normal(size=(int(self.random.integers(3, 30)), 3))
            triangles = self.random.integers(0, len(vertices), (int(self.random.integers(1, 40)), 3)).tolist()
        return {"vertices": np.clip(vertices * sides, -1e3, 1e3).tolist(), "triangles": triangles}

    def _points(self, sides: np.ndarray) -> list[list[float]]:
        count = int(self.choice((1, 10, 100, 400, 3000)))
        points = self.random.uniform(-1.0, 1.0, (count, 3)) * sides
        if self.chance(0.3):
            points = np.round(points / sides.max() * 8.0) * sides.max() / 8.0  # aligned, and many of them alike
        if self.chance(0.2):
            points[:, 2] = 0.0
        return list(np.clip(points, -1e3, 1e3).tolist())

    def _attached(self, number: int) -> dict[str, Any]:
        kind = self.choice([kind for kind in KINDS if kind not in ("half_space", "point_cloud")])
        held: dict[str, Any] = {"id": f"held_{number}", "shape": self.shape(kind)}
        links = [shape.link for shape in self.robot.collision_shapes if shape.joint]
        if self.chance(0.5):
            pose = pin.SE3(pin.exp3(self.random.normal(size=3)), 0.1 * self.random.normal(size=3))
            held["pose"] = written(pose, self.choice((*NOTATIONS, None)))
        if self.chance(0.3):
            held["link"] = self.choice(links)
        if self.chance(0.6):
            held["touch_links"] = [str(name) for name in self.random.choice(links, min(3, len(links)), replace=False)]
        if self.chance(0.2):
            held["margin"] = self.between(1e-4, 0.05)
        return held
