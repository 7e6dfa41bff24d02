"""Bodies and answers about robots."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.schemas.common import LARGEST, Answer, Number, Pose, Positive, RobotId, Schema, Vector3
from api.schemas.problems import ModelFinding  # noqa: TC001 - pydantic evaluates the annotations

FrameName = Annotated[str, Field(min_length=1, max_length=200)]
JointName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-/ ]*$", max_length=100)]


class UrdfModel(Schema):
    """A URDF document. Meshes and files that it names are not read."""

    kind: Literal["urdf"]
    urdf: Annotated[str, Field(min_length=1)]
    """The document, `<robot ...>`."""
    srdf: Annotated[str, Field(min_length=1)] | None = None
    """An SRDF document that goes with it: its groups and its disabled collision pairs are kept."""
    tip_frame: FrameName | None = None
    """The link that the poses are about; omitted: the tip of the SRDF's chain if it has exactly one, or else the
    link at the end of the longest chain."""


class UrdfRobot(UrdfModel):
    """A robot as a URDF document. Meshes and files that it names are not read."""

    id: RobotId
    """Its name here."""


class DhJoint(Schema):
    """One row of a Denavit-Hartenberg table."""

    kind: Literal["revolute", "continuous", "prismatic"]
    """`continuous`: revolute without position limits."""
    theta: Number
    """Angle about z, rad; of a revolute joint: where its zero is."""
    d: Number
    """Offset along z, m; of a prismatic joint: where its zero is."""
    a: Number
    """Length along x, m."""
    alpha: Number
    """Twist about x, rad."""
    name: JointName | None = None
    """Omitted: `joint_1`, `joint_2`, ..."""
    lower: Number | None = None
    """Position limit, rad or m; omitted: none."""
    upper: Number | None = None
    """Position limit, rad or m; omitted: none."""
    velocity: Positive | None = None
    """Limit, rad/s or m/s; omitted: a default, as the answer says."""
    acceleration: Positive | None = None
    """Limit, rad/s^2 or m/s^2; omitted: a default, as the answer says."""
    jerk: Positive | None = None
    """Limit, rad/s^3 or m/s^3; omitted: a default, as the answer says."""
    torque: Positive | None = None
    """Limit, N m or N; omitted: none."""
    mass: Annotated[float, Field(ge=0.0, le=LARGEST)] | None = None
    """Of the link that the joint moves, kg; omitted: unknown."""
    center_of_mass: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Of that link, m, in the frame that this row ends in."""
    inertia: Annotated[list[Number], Field(min_length=6, max_length=6)] | None = None
    """About the center of mass, in the axes of that frame, kg m^2: ixx, ixy, ixz, iyy, iyz, izz."""


class DhModel(Schema):
    """A Denavit-Hartenberg table."""

    kind: Literal["dh"]
    convention: Literal["standard", "modified"]
    """Rot(z) Trans(z) Trans(x) Rot(x), or Craig's Rot(x) Trans(x) Rot(z) Trans(z)."""
    joints: Annotated[list[DhJoint], Field(min_length=1, max_length=64)]
    """From the base to the tip."""
    base: Pose | None = None
    """Of the table's first frame in the robot's base frame; omitted: the same."""
    tip: Pose | None = None
    """Of the flange in the table's last frame; omitted: the same."""


class DhRobot(DhModel):
    """A robot as a Denavit-Hartenberg table."""

    id: RobotId | None = None
    """Its name here; omitted: made from the content."""


RobotModel = TypeAliasType(
    "RobotModel", Annotated[UrdfModel | DhModel, Field(discriminator="kind", description="A robot without a name.")]
)
RobotDefinition = TypeAliasType(
    "RobotDefinition",
    Annotated[UrdfRobot | DhRobot, Field(discriminator="kind", description="A robot to add.")],
)


class JointDescription(Answer):
    """One degree of freedom."""

    name: str
    kind: Literal["revolute", "continuous", "prismatic"]
    lower: float | None
    """rad or m; null: none."""
    upper: float | None
    """rad or m; null: none."""
    velocity: float | None
    """rad/s or m/s; null: none."""
    acceleration: float | None
    """rad/s^2 or m/s^2; null: none."""
    jerk: float | None
    """rad/s^3 or m/s^3; null: none."""
    torque: float | None
    """N m or N; null: none."""
    provenance: dict[str, Literal["published", "datasheet", "estimate", "default"]]
    """Where each limit comes from."""


class JointGroup(Answer):
    """Joints that belong together."""

    name: str
    joints: list[str]
    """Its moving joints, from the root to the tips; those that are not among `joint_names` are held still."""
    tip_frame: str | None
    """The link at the end of a group that is one chain; null: it is something else."""


class DisabledCollision(Answer):
    """Two links that need no collision check against each other."""

    link_1: str
    link_2: str
    reason: str | None
    """In the words of the SRDF; null: not given."""


class RobotDescription(Answer):
    """A robot."""

    id: str
    content: str | None
    """Digest of the definition without its id, `sha256:...`; null: a robot of the catalogue."""
    source: str
    """Where the model comes from."""
    dof: int
    """Degrees of freedom."""
    joint_names: list[str]
    """In the order of every joint array."""
    joints: list[JointDescription]
    tip_frame: str
    frames: list[str]
    mass: float
    """Of everything that moves, kg; 0: unknown."""
    geometry: list[Any] = Field(default_factory=list, description="Simple shapes to look at.")
    groups: list[JointGroup]
    """Joints that belong together, as the SRDF says."""
    disabled_collisions: list[DisabledCollision]
    """Pairs of links that the SRDF takes out of collision checks."""


class AddedRobot(RobotDescription):
    """The robot that was added, with remarks about its model."""

    findings: list[ModelFinding]


class RobotsAnswer(Answer):
    """The catalogue's robots and the added ones."""

    robots: list[RobotDescription]
