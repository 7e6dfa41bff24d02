"""The convex shapes of a robot's links, from its description or, where that has none, from its kinematics."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import pinocchio as pin

from planner.errors import Finding
from planner.fields import PickledByFields
from planner.robots.collision.estimates import OUTLINE_UNCERTAINTY, Outline, derived_capsules
from planner.robots.collision.mesh_files import FindPieces, KeptPieces, MeshReference, no_meshes
from planner.robots.findings import Findings, listed, shown
from planner.shapes import Shape
from planner.shapes.meshes.mesh import InvalidMesh
from planner.spatial import FloatArray

ShapeSource = Literal["model", "estimate"]

BODY = pin.FrameType.BODY
"""The kind of frame that links are."""


LONGEST_MESH = 20.0
"""Length of a mesh, m, above which a remark calls it long: it was probably meant in millimetres."""

COARSE_VOLUME_RATIO = 1.5
"""Volume of a mesh's pieces relative to the mesh above which a remark calls them coarse."""


class CollisionElement(NamedTuple):
    """A shape of a link.

    Attributes:
        link: Name of the link.
        placement: Placement of the shape's frame in the link's.
        shape: The shape, or the mesh or outline that it is.
        source: `model`, the robot's description; or `estimate`, an outline of the machine.
        uncertainty: Largest distance of the machine's surface outside the shape, m.
    """

    link: str
    placement: pin.SE3
    shape: Shape | MeshReference | Outline
    source: ShapeSource = "model"
    uncertainty: float = 0.0


class PlacedShape(NamedTuple):
    """A convex shape of a link, placed in the link's frame."""

    link: str
    placement: pin.SE3
    shape: Shape
    source: ShapeSource
    uncertainty: float


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A convex shape that moves with a robot.

    Attributes:
        link: Name of the link that it belongs to.
        joint: Pinocchio's number of the joint that carries it; 0: it does not move.
        placement: Placement of the shape's frame in that joint's frame.
        shape: The shape.
        source: `model`, the robot's description; or `estimate`, an outline of the machine or capsules along its axes.
        uncertainty: Largest distance of the machine's surface outside an estimated shape, m: the advised margin.

    Examples:
        >>> import planner
        >>> shapes = planner.load_robot("welding_arm").collision_shapes
        >>> isinstance(shapes[0], planner.LinkShape), shapes[2].link, shapes[2].shape, shapes[2].source
        (True, 'link_2', Capsule(radius=0.11, length=0.68), 'estimate')
    """

    link: str
    joint: int
    placement: pin.SE3
    shape: Shape
    source: ShapeSource
    uncertainty: float = 0.0

    @property
    def is_coarse(self) -> bool:
        """Whether it is a capsule along the kinematics, too coarse for checks of the arm against itself by default."""
        return self.uncertainty > OUTLINE_UNCERTAINTY


@dataclass(frozen=True, eq=False)
class CollisionGeometry(PickledByFields):
    """The shapes of an arm by its links. All robots derived from one share it: nothing is computed twice.

    Attributes:
        model: The arm as it was read, with all its joints.
        tip_frame: Name of the link at its end.
        travels: Largest extension of each prismatic joint, m; 0 for a revolute joint.
        elements: The shapes of its description.
        unread: Names of links whose description has shapes that URDF does not know.
        meshes: What finds its meshes.
        link_radii: Radii of the derived capsules, m, used without collision shapes: of the base, and of the links of
            each joint. Empty: they follow from the reach of the arm.
    """

    model: pin.Model
    tip_frame: str
    travels: Sequence[float]
    elements: tuple[CollisionElement, ...] = ()
    unread: frozenset[str] = frozenset()
    link_radii: tuple[float, ...] = ()
    meshes: FindPieces = no_meshes

    @cached_property
    def shapes(self) -> tuple[PlacedShape, ...]:
        """The shapes of all links: from the description, and derived capsules for links without shapes.

        Left open are the links that move with one whose shapes are not known or, without a description of any shape,
        all of them.
        """
        return self._read[0]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Remarks about the shapes and the files of meshes; an error is a file that is there and cannot be used."""
        return self._read[1]

    @property
    def pieces(self) -> KeptPieces:
        """The corners of the convex pieces of all meshes that can be used, by which the robot can be made again."""
        found: dict[MeshReference, list[FloatArray]] = {}
        for reference in (element.shape for element in self.elements):
            if isinstance(reference, MeshReference) and reference not in found:
                with suppress(InvalidMesh):
                    pieces = self.meshes(reference)
                    if pieces is not None:
                        found[reference] = [hull.vertices for hull in pieces.hulls]
        return found

    @cached_property
    def _read(self) -> tuple[tuple[PlacedShape, ...], tuple[Finding, ...]]:
        findings = Findings()
        unread = set(self.unread)
        shapes = [shape for element in self.elements for shape in self._pieces(element, unread, findings)]
        carrier = {frame.name: frame.parentJoint for frame in self.model.frames if frame.type == BODY}
        open_ones = {carrier[link] for link in (unread if self.elements else carrier)}
        derived = derived_capsules(self.model, self.tip_frame, self.travels, self.link_radii)
        capsules = [capsule for capsule in derived if carrier[capsule[0]] in open_ones]
        shapes += [PlacedShape(*capsule, "estimate", capsule[2].radius) for capsule in capsules]
        estimates = [shape for shape in shapes if shape.source == "estimate"]
        if estimates:
            links = listed(dict.fromkeys(shape.link for shape in estimates))
            uncertainty = max(shape.uncertainty for shape in estimates)
            text = f"the shapes of {links} are estimates: the machine may stick out of them by {uncertainty:.3g} m"
            findings.info("estimated_shapes", None, text)
        return tuple(shapes), tuple(findings.items)

    def _pieces(self, element: CollisionElement, unread: set[str], findings: Findings) -> Iterator[PlacedShape]:
        """Yield the convex shapes of an element; the link of a mesh that is not there is `unread`."""
        link, placement, shape, source, uncertainty = element
        if not isinstance(shape, MeshReference):
            solid = shape.hull() if isinstance(shape, Outline) else shape
            yield PlacedShape(link, placement, solid, source, uncertainty)
            return
        subject, name = shown(link), shown(shape.name)
        try:
            pieces = self.meshes(shape)
        except InvalidMesh as error:
            unread.add(link)
            findings.error("invalid_mesh", subject, f"the mesh {name} of {subject} cannot be used: {error}")
            return
        if pieces is None:
            unread.add(link)
            findings.warning("mesh_not_found", subject, f"the mesh {name} of {subject} is not there")
            return
        if pieces.size.max() > LONGEST_MESH:
            text = f"the mesh {name} of {subject} is {pieces.size.max():g} m long: is it in millimetres?"
            findings.warning("suspicious_length", subject, text)
        if pieces.excess > COARSE_VOLUME_RATIO:
            times = "the mesh is not closed" if pieces.excess == math.inf else f"{pieces.excess:.1f} times its volume"
            text = f"the {len(pieces.hulls)} convex pieces of the mesh {name} of {subject} are coarse: {times}"
            findings.info("coarse_pieces", subject, text)
        for hull in pieces.hulls:
            yield PlacedShape(link, placement, hull, source, uncertainty)

    def on(self, model: pin.Model) -> tuple[LinkShape, ...]:
        """Give the shapes to the joints of a model that has the same links.

        Args:
            model: The arm, perhaps with fewer joints.
        """
        carried = {frame.name: (frame.parentJoint, frame.placement) for frame in model.frames if frame.type == BODY}
        shapes = []
        for link, placement, shape, source, uncertainty in self.shapes:
            joint, link_placement = carried[link]
            shapes.append(LinkShape(link, int(joint), link_placement * placement, shape, source, uncertainty))
        return tuple(shapes)
