"""The convex shapes of a robot's links, from its description or, where that has none, from its kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import pinocchio as pin

from planner.robots.collision.derived import derived_capsules

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.shapes import Shape

ShapeSource = Literal["model", "estimate"]

BODY = pin.FrameType.BODY
"""The kind of frame that links are."""


class CollisionElement(NamedTuple):
    """A shape of a link.

    Attributes:
        link: Name of the link.
        placement: Placement of the shape's frame in the link's.
        shape: The shape.
        source: `model`, the robot's description; or `estimate`, derived from its kinematics.
    """

    link: str
    placement: pin.SE3
    shape: Shape
    source: ShapeSource = "model"


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
class CollisionGeometry:
    """The shapes of an arm by its links. All robots derived from one share it: nothing is computed twice.

    Attributes:
        model: The arm as it was read, with all its joints.
        tip_frame: Name of the link at its end.
        travels: How far each joint slides out, m; 0 for one that turns.
        elements: The shapes of its description.
        unread: Names of links whose description has shapes that are not known, such as meshes without their files.
        link_radii: Radii of the capsules that are derived where there are no shapes, m: of the base, and of what each
            joint carries; empty: they follow from the reach of the arm.
    """

    model: pin.Model
    tip_frame: str
    travels: Sequence[float]
    elements: tuple[CollisionElement, ...] = ()
    unread: frozenset[str] = frozenset()
    link_radii: tuple[float, ...] = ()

    @cached_property
    def shapes(self) -> tuple[CollisionElement, ...]:
        """The shapes of all links: those of the description, and derived capsules of what it leaves open.

        Left open are the links that move with one whose shapes are not known or, without a description of any shape,
        all of them.
        """
        if self.elements and not self.unread:
            return self.elements
        carrier = {frame.name: frame.parentJoint for frame in self.model.frames if frame.type == BODY}
        open_ones = {carrier[link] for link in (self.unread if self.elements else carrier)}
        derived = derived_capsules(self.model, self.tip_frame, self.travels, self.link_radii)
        estimates = (CollisionElement(link, placement, shape, "estimate") for link, placement, shape in derived)
        return self.elements + tuple(element for element in estimates if carrier[element.link] in open_ones)

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
