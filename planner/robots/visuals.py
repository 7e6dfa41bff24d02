"""The visual meshes of a robot's links with their colours: for viewers only, no proof reads them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
import pinocchio as pin

from planner.errors import Finding
from planner.fields import PickledByFields
from planner.robots.collision.geometry import BODY
from planner.robots.collision.mesh_files import FindFile, MeshReference, no_meshes
from planner.robots.findings import Findings, shown
from planner.shapes.meshes.files import read_mesh
from planner.shapes.meshes.mesh import InvalidMesh
from planner.shapes.surfaces import Surface

MOST_TRIANGLES = 200_000
"""Number of triangles of all visual meshes of a robot; further meshes are left out."""

Colour: TypeAlias = tuple[float, float, float, float]


class VisualElement(NamedTuple):
    """A visual mesh that a description names.

    Attributes:
        link: Name of the link.
        placement: Placement of the mesh's frame in the link's.
        mesh: The mesh.
        colour: Red, green, blue and opacity from 0 to 1; None: the description has none.
    """

    link: str
    placement: pin.SE3
    mesh: MeshReference
    colour: Colour | None


@dataclass(frozen=True, eq=False)
class VisualMesh:
    """A visual mesh that moves with a robot.

    Attributes:
        link: Name of the link that it belongs to.
        joint: Pinocchio's number of the joint that carries it; 0: it does not move.
        placement: Placement of the mesh's frame in that joint's frame.
        link_placement: Placement of the mesh's frame in the link's frame.
        surface: The triangles.
        colour: Red, green, blue (sRGB) and opacity from 0 to 1; None: the description has none.

    Examples:
        >>> import planner
        >>> meshes: tuple[planner.VisualMesh, ...] = planner.load_robot("ur5e").visual_meshes
        >>> len(meshes)  # the catalogue has no files of this arm
        0
    """

    link: str
    joint: int
    placement: pin.SE3
    link_placement: pin.SE3
    surface: Surface
    colour: Colour | None


@dataclass(frozen=True, eq=False)
class VisualGeometry(PickledByFields):
    """The visual meshes of an arm by its links. All robots derived from one share it.

    Attributes:
        elements: The visual meshes of its description.
        find: What finds the files.
    """

    elements: tuple[VisualElement, ...] = ()
    find: FindFile = no_meshes

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Remarks about files that are not there, cannot be read, or are too many; none of them is an error."""
        return self._read[1]

    @cached_property
    def _read(self) -> tuple[tuple[Surface | None, ...], tuple[Finding, ...]]:
        """Read the surface of each element; None: it is left out."""
        findings = Findings()
        read: dict[MeshReference, Surface | None] = {}
        triangles = 0
        surfaces: list[Surface | None] = []
        for element in self.elements:
            if element.mesh not in read:
                read[element.mesh] = self._surface(element, findings)
            surface = read[element.mesh]
            triangles += 0 if surface is None else len(surface.faces)
            surfaces.append(surface if triangles <= MOST_TRIANGLES else None)
        if triangles > MOST_TRIANGLES:
            text = f"the visual meshes have {triangles} triangles: those beyond {MOST_TRIANGLES} are not drawn"
            findings.warning("visual_meshes_left_out", None, text)
        return tuple(surfaces), tuple(findings.items)

    def _surface(self, element: VisualElement, findings: Findings) -> Surface | None:
        subject, name = shown(element.link), shown(element.mesh.name)
        try:
            data = self.find(element.mesh.name)
            if data is None:
                text = f"the visual mesh {name} of {subject} is not there and not drawn"
                findings.info("visual_mesh_not_found", subject, text)
                return None
            mesh = read_mesh(element.mesh.name, data).scaled(np.array(element.mesh.scale))
        except InvalidMesh as error:
            text = f"the visual mesh {name} of {subject} is not drawn: {error}"
            findings.warning("visual_mesh_unread", subject, text)
            return None
        vertices, indices = np.unique(mesh.triangles.reshape(-1, 3).astype(np.float32), axis=0, return_inverse=True)
        faces = indices.reshape(-1, 3)
        return Surface(vertices.astype(float), faces[:, ::-1] if np.prod(element.mesh.scale) < 0.0 else faces)

    def on(self, model: pin.Model) -> tuple[VisualMesh, ...]:
        """Give the meshes to the joints of a model that has the same links.

        Args:
            model: The arm, perhaps with fewer joints.
        """
        carried = {frame.name: (frame.parentJoint, frame.placement) for frame in model.frames if frame.type == BODY}
        return tuple(
            VisualMesh(link, int(carried[link][0]), carried[link][1] * placement, placement, surface, colour)
            for (link, placement, _, colour), surface in zip(self.elements, self._read[0], strict=True)
            if surface is not None
        )
