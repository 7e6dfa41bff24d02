"""The collision shapes of a robot as glTF 2.0, the format of viewers of three-dimensional scenes.

Each joint is a node at its place at position 0, with its links below it. Turning a joint's node about its z axis moves
the arm as the joint does. The robot's z axis points up, the y axis of glTF does: the topmost node turns between.
"""

from __future__ import annotations

import base64
import json
import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from api.work.answers.robots import placed
from planner.shapes import surface
from planner.spatial import as_pose

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.shapes import Shape
    from planner.spatial import Pose

Z_UP = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""The quaternion x, y, z, w of the turn that takes the z axis to the y axis of glTF."""

VERTICES = 34962
"""The code of glTF for a part of the buffer with corners."""

INDICES = 34963
"""The code of glTF for a part of the buffer with triangles."""

FLOATS = 5126
"""The code of glTF for numbers of 32 bits."""

INTEGERS = 5125
"""The code of glTF for unsigned integers of 32 bits."""

MATERIALS = [
    {"name": "model", "pbrMetallicRoughness": {"baseColorFactor": [0.65, 0.68, 0.72, 1.0], "metallicFactor": 0.1}},
    {
        "name": "estimate",
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [0.95, 0.6, 0.2, 0.5], "metallicFactor": 0.0},
    },
]
"""The colours of glTF, by where shapes come from: grey from the model, transparent orange for an estimate."""


def collision_gltf(robot: Robot, *, binary: bool) -> bytes:
    """Write the shapes of a robot's links.

    Args:
        robot: The robot.
        binary: Whether to write the binary form (GLB), or JSON with the corners in base64.
    """
    buffer = bytearray()
    meshes = _Meshes(buffer)
    placements = robot.model.jointPlacements.tolist()
    nodes: list[dict[str, Any]] = [{"name": robot.id, "rotation": list(Z_UP), "children": []}]
    for number in range(1, len(placements)):
        nodes.append({"name": robot.model.names[number], **_placed(as_pose(placements[number])), "children": []})
        nodes[robot.model.parents[number]]["children"].append(number)
    for each in robot.collision_shapes:
        nodes[each.joint]["children"].append(len(nodes))
        number = meshes.number_of(each.shape, each.source)
        nodes.append(
            {"name": each.link, **_placed(as_pose(each.placement)), "mesh": number, "extras": {"source": each.source}}
        )
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "trajectory-planner"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{key: value for key, value in node.items() if value != []} for node in nodes],
        "materials": MATERIALS,
        "meshes": meshes.meshes,
        "accessors": meshes.accessors,
        "bufferViews": meshes.views,
        "buffers": [{"byteLength": len(buffer)}],
    }
    if binary:
        return _glb(document, bytes(buffer))
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    return json.dumps(document, separators=(",", ":")).encode()


class _Meshes:
    """The meshes of a document, each shape once, with their corners and triangles in the buffer."""

    def __init__(self, buffer: bytearray) -> None:
        self.buffer = buffer
        self.meshes: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.numbers: dict[tuple[Shape, str], int] = {}

    def number_of(self, shape: Shape, source: str) -> int:
        """Return the number of a shape's mesh, which is added if it is not there."""
        if (shape, source) not in self.numbers:
            hull = surface(shape)
            corners = hull.vertices.astype("<f4")
            range_ = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
            position = self._added(corners, VERTICES, {"componentType": FLOATS, "type": "VEC3", **range_})
            faces = hull.faces.astype("<u4").ravel()
            indices = self._added(faces, INDICES, {"componentType": INTEGERS, "type": "SCALAR"})
            material = 0 if source == "model" else 1
            self.numbers[shape, source] = len(self.meshes)
            primitive = {"attributes": {"POSITION": position}, "indices": indices, "material": material}
            self.meshes.append({"primitives": [primitive]})
        return self.numbers[shape, source]

    def _added(self, array: np.ndarray, target: int, accessor: dict[str, Any]) -> int:
        """Append an array to the buffer and return the number of its accessor."""
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": array.nbytes, "target": target}
        self.accessors.append({"bufferView": len(self.views), "count": len(array), **accessor})
        self.views.append(view)
        self.buffer += array.tobytes()
        return len(self.accessors) - 1


def _placed(pose: Pose) -> dict[str, list[float]]:
    values = placed(pose)
    return {"translation": values["position"], "rotation": values["quaternion_xyzw"]}


def _glb(document: dict[str, Any], buffer: bytes) -> bytes:
    """Return the binary form: a header, the JSON, the buffer, each of a multiple of four bytes."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    buffer += bytes(-len(buffer) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
