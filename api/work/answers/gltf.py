"""The collision shapes or visual meshes of a robot as glTF 2.0, the format of viewers of three-dimensional scenes.

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
    from collections.abc import Hashable, Sequence

    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

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
    meshes = _Meshes(list(MATERIALS))
    nodes = _joint_nodes(robot)
    for each in robot.collision_shapes:
        nodes[each.joint]["children"].append(len(nodes))
        number = meshes.number_of((each.shape, each.source), *surface(each.shape), 0 if each.source == "model" else 1)
        nodes.append(
            {"name": each.link, **_placed(as_pose(each.placement)), "mesh": number, "extras": {"source": each.source}}
        )
    return _written(nodes, meshes, binary=binary)


def visual_gltf(robot: Robot) -> bytes:
    """Write the visual meshes of a robot's links with their colours, in the binary form.

    Below the node of a joint stands one for each link, and below that the meshes, placed in the frame of the link.
    """
    meshes = _Meshes([MATERIALS[0]])
    nodes = _joint_nodes(robot)
    links: dict[str, int] = {}
    for each in robot.visual_meshes:
        if each.link not in links:
            links[each.link] = len(nodes)
            nodes[each.joint]["children"].append(len(nodes))
            link = each.placement * each.link_placement.inverse()
            nodes.append({"name": each.link, **_placed(as_pose(link)), "children": []})
        nodes[links[each.link]]["children"].append(len(nodes))
        material = meshes.material_of(each.colour)
        number = meshes.number_of((id(each.surface), material), *each.surface, material)
        nodes.append({**_placed(as_pose(each.link_placement)), "mesh": number})
    return _written(nodes, meshes, binary=True)


def _joint_nodes(robot: Robot) -> list[dict[str, Any]]:
    """Return the topmost node and one for each joint, by Pinocchio's number of the joint."""
    placements = robot.model.jointPlacements.tolist()
    nodes: list[dict[str, Any]] = [{"name": robot.id, "rotation": list(Z_UP), "children": []}]
    for number in range(1, len(placements)):
        nodes.append({"name": robot.model.names[number], **_placed(as_pose(placements[number])), "children": []})
        nodes[robot.model.parents[number]]["children"].append(number)
    return nodes


def _written(nodes: list[dict[str, Any]], meshes: _Meshes, *, binary: bool) -> bytes:
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "trajectory-planner"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{key: value for key, value in node.items() if value != []} for node in nodes],
        "materials": meshes.materials,
        "meshes": meshes.meshes,
        "accessors": meshes.accessors,
        "bufferViews": meshes.views,
        "buffers": [{"byteLength": len(meshes.buffer)}],
    }
    if not meshes.meshes:
        document = {name: value for name, value in document.items() if value != [] and name != "buffers"}
    if binary:
        return _glb(document, bytes(meshes.buffer))
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(meshes.buffer).decode()
    return json.dumps(document, separators=(",", ":")).encode()


class _Meshes:
    """The meshes of a document, each surface once, with their corners and triangles in the buffer, and materials."""

    def __init__(self, materials: list[dict[str, Any]]) -> None:
        self.materials = materials
        self.buffer = bytearray()
        self.meshes: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.numbers: dict[Hashable, int] = {}

    def material_of(self, colour: Sequence[float] | None) -> int:
        """Return the number of the material of a colour, which is added at its first use; None: the first."""
        if colour is None:
            return 0
        look = {"baseColorFactor": [*map(_linear, colour[:3]), colour[3]], "metallicFactor": 0.1}
        material = {"pbrMetallicRoughness": look} | ({"alphaMode": "BLEND"} if colour[3] < 1.0 else {})
        if material not in self.materials:
            self.materials.append(material)
        return self.materials.index(material)

    def number_of(self, key: Hashable, vertices: FloatArray, faces: np.ndarray, material: int) -> int:
        """Return the number of the mesh that a key stands for, which is added at its first use."""
        if key not in self.numbers:
            corners = vertices.astype("<f4")
            range_ = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
            position = self._added(corners, VERTICES, {"componentType": FLOATS, "type": "VEC3", **range_})
            corners_of = faces.astype("<u4").ravel()
            indices = self._added(corners_of, INDICES, {"componentType": INTEGERS, "type": "SCALAR"})
            self.numbers[key] = len(self.meshes)
            primitive = {"attributes": {"POSITION": position}, "indices": indices, "material": material}
            self.meshes.append({"primitives": [primitive]})
        return self.numbers[key]

    def _added(self, array: np.ndarray, target: int, accessor: dict[str, Any]) -> int:
        """Append an array to the buffer and return the number of its accessor."""
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": array.nbytes, "target": target}
        self.accessors.append({"bufferView": len(self.views), "count": len(array), **accessor})
        self.views.append(view)
        self.buffer += array.tobytes()
        return len(self.accessors) - 1


def _linear(part: float) -> float:
    """Convert red, green or blue of sRGB, in which URDF has colours, to that of glTF (IEC 61966-2-1)."""
    return part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4  # noqa: PLR2004 - the standard's


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
