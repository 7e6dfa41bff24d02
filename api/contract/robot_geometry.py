"""What of a robot can collide, as answers have it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.common import Answer, Schema, Vector3
from api.contract.parts.problem_documents import ModelFinding  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.robots import Placement


class SphereShape(Schema):
    """A ball around the origin of its frame."""

    kind: Literal["sphere"]
    """The kind of shape: a ball."""
    radius: float
    """The radius, m."""


class BoxShape(Schema):
    """A cuboid around the origin of its frame."""

    kind: Literal["box"]
    """The kind of shape: a cuboid."""
    size: Vector3
    """The lengths of the sides along x, y and z, m."""


class CylinderShape(Schema):
    """A cylinder along z around the origin of its frame."""

    kind: Literal["cylinder"]
    """The kind of shape: a cylinder with flat ends."""
    radius: float
    """The radius, m."""
    length: float
    """The length, m."""


class CapsuleShape(Schema):
    """A cylinder along z with half balls at its ends, around the origin of its frame."""

    kind: Literal["capsule"]
    """The kind of shape: a cylinder with round ends."""
    radius: float
    """The radius, m."""
    length: float
    """The length between the centres of the half balls, m."""


class ConvexShape(Schema):
    """The convex hull of points."""

    kind: Literal["convex"]
    """The kind of shape: a convex hull, such as a piece of a mesh."""
    vertices: list[Vector3]
    """The corners x, y, z of shape (N, 3), m."""
    faces: list[list[int]]
    """The triangles of the surface of shape (F, 3), by the indices of their corners, counterclockwise seen from
    outside."""


LinkShapeForm = TypeAliasType(
    "LinkShapeForm",
    Annotated[
        SphereShape | BoxShape | CylinderShape | CapsuleShape | ConvexShape,
        Field(discriminator="kind", description="A convex shape in a frame of its own."),
    ],
)


class LinkShape(Placement):
    """A shape that moves with a robot, and where its frame stands behind the joint that moves it."""

    link: str
    """The name of the link that it belongs to."""
    after: int
    """The number of joints before it, as in the `placements` of a robot."""
    source: Literal["model", "estimate"]
    """Where it comes from: the robot's description (`model`), or an `estimate`: an outline of the machine, or a capsule
    along its kinematics."""
    uncertainty: float
    """The distance that the machine may stick out of an estimate, m: the advised margin; 0: the shape is the model."""
    shape: LinkShapeForm
    """The shape."""


class LinkPair(Answer):
    """Two links that have shapes."""

    link_1: str
    """The name of the first link."""
    link_2: str
    """The name of the second link."""
    reason: Literal["neighbours", "srdf", "always"] | None
    """Why the two are not checked against each other; null: they are checked. `neighbours`: no joint is between them.
    `srdf`: it says so. `always`: all their shapes are in contact in 95 % of random positions or more."""
    always_touching: list[list[int]]
    """The shapes of a checked pair that are left out, in contact in 95 % of random positions or more, shape (pairs, 2):
    the index in `shapes` of a shape of `link_1`, and of one of `link_2`."""
    contact_share: float | None
    """The share of random positions in which a checked pair is in contact, from 0 to 1, without unit; null: it is not
    checked."""


class RobotGeometry(Answer):
    """What of a robot can collide."""

    id: str
    """The id by which requests name the robot."""
    shapes: list[LinkShape]
    """The convex shapes of the links; meshes are cut into pieces that cover them."""
    pairs: list[LinkPair]
    """All pairs of links that have shapes."""
    sampled_positions: int
    """The number of random positions that `contact_share` rests on."""
    findings: list[ModelFinding]
    """The remarks about the shapes."""
