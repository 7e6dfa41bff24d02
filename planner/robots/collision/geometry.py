"""The convex shapes of a robot's links, from its description or, where that has none, from its kinematics."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import pinocchio as pin

from planner.fields import PickledByFields
from planner.robots.collision.derived import derived_capsules
from planner.robots.collision.mesh_files import MeshReference, no_meshes
from planner.robots.findings import Findings, listed, shown
from planner.shapes.meshes.mesh import InvalidMesh

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.errors import Finding
    from planner.robots.collision.mesh_files import FindPieces, KeptPieces
    from planner.shapes import Shape
    from planner.spatial import FloatArray

ShapeSource = Literal["model", "estimate"]

BODY = pin.FrameType.BODY
"""The kind of frame that links are."""


LONGEST_MESH = 20.0
"""Length of a mesh, m, from which on it is remarked that it is long: it was probably meant in millimetres."""

COARSE = 1.5
"""Volume of a mesh's pieces relative to its own from which on it is remarked that they are coarse."""


class CollisionElement(NamedTuple):
    """A shape of a link.

    Attributes:
        link: Name of the link.
        placement: Placement of the shape's frame in the link's.
        shape: The shape, or the mesh that it is.
        source: `model`, the robot's description; or `estimate`, derived from its kinematics.
    """

    link: str
    placement: pin.SE3
    shape: Shape | MeshReference
    source: ShapeSource = "model"


class PlacedShape(NamedTuple):
    """A convex shape of a link, placed in the link's frame."""

    link: str
    placement: pin.SE3
    shape: Shape
    source: ShapeSource


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A convex shape that moves with a robot.

    Attributes:
        link: Name of the link that it belongs to.
        joint: Pinocchio's number of the joint that carries it; 0: it does not move.
        placement: Placement of the shape's frame in that joint's frame.
        shape: The shape.
        source: `model`, the robot's description; or `estimate`, derived from its kinematics.

    Examples:
        >>> import planner
        >>> shapes = planner.load_robot("kuka_kr16_2").collision_shapes
        >>> isinstance(shapes[0], planner.LinkShape), shapes[2].link, shapes[2].shape, shapes[2].source
        (True, 'link_2', Capsule(radius=0.14, length=0.68), 'estimate')
    """

    link: str
    joint: int
    placement: pin.SE3
    shape: Shape
    source: ShapeSource


@dataclass(frozen=True, eq=False)
class CollisionGeometry(PickledByFields):
    """The shapes of an arm by its links. All robots derived from one share it: nothing is computed twice.

    Attributes:
        model: The arm as it was read, with all its joints.
        tip_frame: Name of the link at its end.
        travels: How far each joint slides out, m; 0 for one that turns.
        elements: The shapes of its description.
        unread: Names of links whose description has shapes that URDF does not know.
        meshes: What finds its meshes.
        link_radii: Radii of the capsules that are derived where there are no shapes, m: of the base, and of what each
            joint carries; empty: they follow from the reach of the arm.
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
        """The shapes of all links: those of the description, and derived capsules of what it leaves open.

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
        estimates = [capsule for capsule in derived if carrier[capsule[0]] in open_ones]
        if estimates:
            radii = ", ".join(f"{radius:.3g}" for radius in sorted({shape.radius for _, _, shape in estimates}))
            links = listed(link for link, _, _ in estimates)
            text = f"what can collide is estimated by capsules with radii of {radii} m: {links}"
            findings.info("estimated_shapes", None, text)
        shapes += [PlacedShape(*capsule, "estimate") for capsule in estimates]
        return tuple(shapes), tuple(findings.items)

    def _pieces(self, element: CollisionElement, unread: set[str], findings: Findings) -> Iterator[PlacedShape]:
        """Yield the convex shapes of an element; the link of a mesh that is not there is `unread`."""
        link, placement, shape, source = element
        if not isinstance(shape, MeshReference):
            yield PlacedShape(link, placement, shape, source)
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
        if pieces.excess > COARSE:
            times = "the mesh is not closed" if pieces.excess == math.inf else f"{pieces.excess:.1f} times its volume"
            text = f"the {len(pieces.hulls)} convex pieces of the mesh {name} of {subject} are coarse: {times}"
            findings.info("coarse_pieces", subject, text)
        for hull in pieces.hulls:
            yield PlacedShape(link, placement, hull, source)

    def on(self, model: pin.Model) -> tuple[LinkShape, ...]:
        """Give the shapes to the joints of a model that has the same links.

        Args:
            model: The arm, perhaps with fewer joints.
        """
        carried = {frame.name: (frame.parentJoint, frame.placement) for frame in model.frames if frame.type == BODY}
        shapes = []
        for link, placement, shape, source in self.shapes:
            joint, link_placement = carried[link]
            shapes.append(LinkShape(link, int(joint), link_placement * placement, shape, source))
        return tuple(shapes)
