"""The meshes of added robots as the service keeps them: as convex pieces, in less room than the files took."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from api.base.errors import InvalidRequest
from api.contract import robots
from api.work.answers.gltf import visual_gltf
from planner.errors import InvalidRobotModel
from planner.robots.collision import MeshReference, files_of, meshes_of
from planner.shapes.meshes import InvalidMesh

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.errors import Finding
    from planner.robots import Robot
    from planner.robots.collision import KeptPieces

DOUBLE = np.dtype("<f8")
"""How a coordinate of a corner is kept: exactly as it was computed."""


def keep_meshes(
    model: robots.UrdfModel, robot: Robot, files: Mapping[str, bytes]
) -> tuple[robots.UrdfModel, tuple[Finding, ...]]:
    """Cut the meshes of a robot into convex pieces and keep these with its model.

    Args:
        model: The model without meshes.
        robot: The robot that it describes.
        files: The files that came with it, by paths with `/`.

    Returns:
        The model with the pieces, and the remarks about the shapes of the robot.

    Raises:
        InvalidRobotModel: A mesh cannot be used.
    """
    if robot.collision is None:
        return model, ()
    collision = replace(robot.collision, meshes=meshes_of(files))
    errors = [finding for finding in collision.findings if finding.severity == "error"]
    if errors:
        raise InvalidRobotModel(f"the robot model cannot be used: {errors[0].message}", collision.findings)
    meshes = [
        robots.KeptMesh(name=mesh.name, scale=list(mesh.scale), pieces=[_packed(corners) for corners in pieces])
        for mesh, pieces in collision.pieces.items()
    ]
    return model.model_copy(update={"meshes": meshes}), collision.findings


def drawn_visuals(robot: Robot, files: Mapping[str, bytes]) -> tuple[bytes, tuple[Finding, ...]]:
    """Read the visual meshes of a robot, and return them as glTF with the remarks about them.

    Args:
        robot: The robot.
        files: The files that came with it, by paths with `/`.
    """
    if robot.visuals is None:
        return b"", ()
    find = files_of(files)

    def find_or_leave_out(name: str) -> bytes | None:
        try:
            return find(name)
        except InvalidRequest as error:
            raise InvalidMesh(error.message) from None

    drawn = replace(robot, visuals=replace(robot.visuals, find=find_or_leave_out))
    return visual_gltf(drawn) if drawn.visual_meshes else b"", drawn.visual_findings


def kept_pieces(meshes: Sequence[robots.KeptMesh]) -> KeptPieces:
    """Read the corners of the pieces of meshes, as `keep_meshes` writes them."""
    return {
        MeshReference(mesh.name, (mesh.scale[0], mesh.scale[1], mesh.scale[2])): [
            np.frombuffer(base64.b64decode(piece), DOUBLE).reshape(-1, 3) for piece in mesh.pieces
        ]
        for mesh in meshes
    }


def _packed(corners: np.ndarray) -> str:
    return base64.b64encode(corners.astype(DOUBLE).tobytes()).decode()
