"""Bodies and answers about robots."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.common import (
    Answer,
    FrameName,
    JointVector,
    Number,
    Pose,
    Quaternion,
    RobotId,
    Schema,
    Vector3,
)
from api.contract.parts.joints import (  # noqa: TC001 - pydantic evaluates them
    DhJoint,
    ExternalAxis,
    JointDescription,
    OwnLimits,
)
from api.contract.parts.limit_curves import TorqueCurve, VelocityCurves  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.payload_table import PayloadTable  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.problem_documents import ModelFinding  # noqa: TC001 - pydantic evaluates the annotations


class Shown(Schema):
    """Who sees an added robot."""

    visibility: Literal["private", "public"] = "private"
    """Who sees the robot where API keys are required: clients with the key that it was added with (`private`), or
    everybody (`public`). A key's own robot goes before a public one of the same id."""


class UrdfDocument(Schema):
    """A URDF document, and which of its joints move. Files that it names are not opened."""

    kind: Literal["urdf"]
    """The kind of model: a URDF document."""
    urdf: Annotated[str, Field(min_length=1)]
    """The URDF document, `<robot ...>`. Its `limit` elements give the limits, with `acceleration`, `deceleration`
    and `jerk` as in URDF 1.2, and its `safety_controller` elements the soft limits."""
    srdf: Annotated[str, Field(min_length=1)] | None = None
    """An SRDF document that goes with it. Its groups and its disabled collision pairs are kept. States of groups with
    positions of all joints become `named_positions`."""
    tip_frame: FrameName | None = None
    """The link that the poses are about. Omitted: the end of the group. Without a group it is the tip of the SRDF's
    only chain, or the end of the longest chain without its fingers. In the last case a warning among
    the `findings` (`several_tips`) names the other ends."""
    base_frame: FrameName | None = None
    """The link at the start of the chain of moving joints to `tip_frame`; omitted: the root. Poses are in the
    root link's frame in any case. Of `base_frame`, `group` and `joints` one at most may be given."""
    group: FrameName | None = None
    """The group of the SRDF whose joints move; they have to lie on one chain."""
    joints: Annotated[list[FrameName], Field(min_length=1, max_length=64)] | None = None
    """The names of the joints that move, which have to lie on one chain; omitted: all on the way to the tip."""
    locked: Annotated[dict[FrameName, Number], Field(max_length=256)] = Field(default_factory=dict)
    """Positions of other joints, which are fixed there, rad or m, by name; omitted: 0, or the limit nearest to it."""
    velocity_curves: Annotated[dict[FrameName, VelocityCurves], Field(max_length=64)] = Field(
        default_factory=dict, exclude_if=lambda curves: not curves
    )
    """Velocity limits that depend on the position, by the names of joints. The position limits end where a parabola
    leaves less than 2 % of the velocity limit; a remark among the `findings` says so."""
    torque_curves: Annotated[dict[FrameName, TorqueCurve], Field(max_length=64)] = Field(
        default_factory=dict, exclude_if=lambda curves: not curves
    )
    """Torque limits that depend on the speed, by the names of joints. The torque limit is at most that at rest."""
    payload_table: PayloadTable | None = Field(default=None, exclude_if=lambda table: table is None)
    """Factors on the acceleration and jerk limits by the payload mass; omitted: none."""


class KeptMesh(Schema):
    """A mesh as the service keeps it."""

    name: str
    """The name that the URDF has for it."""
    scale: list[float]
    """The factors of x, y and z."""
    pieces: list[str]
    """The corners of its convex pieces, rows of x, y and z as doubles, little endian, in base64."""


class UrdfModel(UrdfDocument):
    """A URDF robot without a name, as the service keeps it: with the convex pieces of its meshes."""

    meshes: list[KeptMesh] = Field(default_factory=list, exclude_if=lambda meshes: not meshes)
    """Its meshes that can collide; none: it has none, or they did not come with it."""
    visuals: str | None = Field(default=None, exclude_if=lambda digest: digest is None)
    """The SHA-256 of its visual meshes as the service keeps them; null: there are none."""


class UrdfRobot(UrdfDocument, Shown):
    """A robot as a URDF document, with the files of its meshes. Nothing else that it names is read."""

    id: RobotId
    """The id that the robot gets."""
    meshes: Annotated[str, Field(min_length=1, json_schema_extra={"contentEncoding": "base64"})] | None = None
    """A zip archive, in base64, with the files of collision and visual meshes (STL, OBJ or DAE, 32 MiB unpacked in
    all). `package://`, `file://` and relative names in the URDF are looked up in it. Omitted: capsules along the
    kinematics estimate the shapes, and the `findings` say so."""


class DhModel(Schema):
    """A Denavit-Hartenberg table."""

    kind: Literal["dh"]
    """The kind of model: a Denavit-Hartenberg table."""
    convention: Literal["standard", "modified"]
    """The meaning of a row: `standard`, Rot(z, theta) Trans(z, d) Trans(x, a) Rot(x, alpha), or `modified`, Craig's
    Rot(x, alpha) Trans(x, a) Rot(z, theta) Trans(z, d)."""
    joints: Annotated[list[DhJoint], Field(min_length=1, max_length=64)]
    """The rows of the table, from the base to the tip."""
    base: Pose | None = None
    """The pose of the table's first frame in the robot's base frame (m); omitted: they are the same."""
    tip: Pose | None = None
    """The pose of the flange in the table's last frame (m); omitted: they are the same."""
    payload_table: PayloadTable | None = Field(default=None, exclude_if=lambda table: table is None)
    """Factors on the acceleration and jerk limits by the payload mass; omitted: none."""


class DhRobot(DhModel, Shown):
    """A robot as a Denavit-Hartenberg table."""

    id: RobotId | None = None
    """The id that the robot gets; omitted: one that is made from the content."""


class Changes(Schema):
    """The changes of a robot to another one."""

    kind: Literal["derived"]
    """The kind of model: another robot, with changes."""
    limits: Annotated[dict[FrameName, OwnLimits], Field(max_length=64)] = Field(default_factory=dict)
    """The owner's limits by the names of joints. A limit may be wider than the other robot's only where the latter is a
    `default` or an `estimate`. A warning among the `findings` says so. A continuous joint with position limits
    becomes a revolute one."""
    group: FrameName | None = None
    """The name of one of the other robot's `groups`; its other joints are fixed. Omitted: all joints move."""
    locked: Annotated[dict[FrameName, Number], Field(max_length=64)] = Field(default_factory=dict)
    """Positions of joints, which are fixed there, rad or m, by name: they are no joints of the robot. A `group` fixes
    other joints at 0, or at the limit nearest to it."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m), for requests that name no tool; omitted: the other
    robot's."""
    mounting: Pose | None = None
    """The pose of the base in the world (m), whose z axis points up: gravity follows it, poses stay in the base frame.
    Omitted: the other robot's."""
    named_positions: Annotated[dict[FrameName, JointVector], Field(max_length=64)] = Field(default_factory=dict)
    """Joint positions by name, one value for each joint that is not locked, rad or m, in the order of `joint_names`:
    axes of the `positioner` in reverse, `external_axes`, arm. With a `fixed_tool` the arm is in reverse. The other
    robot's named positions stay, with the axes of both at 0, or at the limit nearest to it."""
    external_axes: Annotated[list[ExternalAxis], Field(max_length=8)] = Field(default_factory=list)
    """Axes in front of the arm that carry its base, from the ground on: a rail, a gantry, a turntable. They are the
    first joints of the robot. Its base frame is the frame in which the first axis stands. Poses are in it, and its z
    axis points up unless there is a `mounting`. An axis that carries the workpiece belongs to the `positioner`."""
    arm_origin: Pose | None = None
    """The pose of the arm's base in the link that the last of the `external_axes` moves (m); omitted: the same
    frame."""
    positioner: Annotated[list[ExternalAxis], Field(max_length=3)] = Field(
        default_factory=list, exclude_if=lambda axes: not axes
    )
    """Axes beside the arm that carry the workpiece, from the ground on; the first one's `origin` is in the arm's base
    frame. They are the first joints of the robot, in reverse. Its base frame is the moving workpiece: poses refer to
    it, and speeds of the tool are relative to it. `mass` and so on of the last axis include the workpiece."""
    workpiece: Pose | None = Field(default=None, exclude_if=lambda pose: pose is None)
    """The pose of the workpiece in the link that the last axis of the `positioner` moves (m). With a `fixed_tool` it is
    in the other robot's tip frame. Omitted: the same frame."""
    fixed_tool: Pose | None = Field(default=None, exclude_if=lambda pose: pose is None)
    """The pose in the other robot's base frame (m) of a tool that stands in the cell: a grinding belt, a glue nozzle.
    The arm holds the workpiece. Its joints are in reverse order, from the workpiece on. Its base frame is the moving
    workpiece: poses refer to it, and speeds of the tool are relative to it. A `tool` of a request is in the frame
    `positioner_base`, in which arm and tool stand. Payloads are in the other robot's tip frame."""
    payload_table: PayloadTable | None = Field(default=None, exclude_if=lambda table: table is None)
    """Factors on the acceleration and jerk limits by the payload mass; omitted: the other robot's, which they
    must nowhere exceed."""


class DerivedRobot(Changes, Shown):
    """A robot made from another one, with limits, a tool and a mounting of its owner."""

    id: RobotId
    """The id that the robot gets."""
    base: RobotId = Field(alias="from")
    """The id of the other robot, of the catalogue or added; deleting that one changes nothing here."""


class DerivedModel(Changes):
    """A derived robot without a name, as the service keeps it: with the definition of the other robot."""

    base: RobotId | None = Field(alias="from")
    """The id of the robot of the catalogue that it is made from; null: an added one."""
    definition: RobotModel | None
    """The definition of the added robot that it is made from; null: one of the catalogue."""


RobotModel = TypeAliasType(
    "RobotModel",
    Annotated[UrdfModel | DhModel | DerivedModel, Field(discriminator="kind", description="A robot without a name.")],
)
RobotDefinition = TypeAliasType(
    "RobotDefinition",
    Annotated[UrdfRobot | DhRobot | DerivedRobot, Field(discriminator="kind", description="A robot to add.")],
)


class JointGroup(Answer):
    """Joints that belong together."""

    name: str
    """The name of the group."""
    joints: list[str]
    """The moving joints, from the root to the tips; joints that are not among `joint_names` are fixed."""
    tip_frame: str | None
    """The link at the end of a group that is one chain; null: it is something else."""


class DisabledCollision(Answer):
    """Two links that need no collision check against each other."""

    link_1: str
    """The name of the first link."""
    link_2: str
    """The name of the second link."""
    reason: str | None
    """Why they need none, in the words of the SRDF; null: it does not say."""


class Placement(Answer):
    """Where a frame stands in another one."""

    position: Annotated[list[float], Field(min_length=3, max_length=3)]
    """The origin x, y, z, m."""
    quaternion_xyzw: Quaternion
    """The orientation as a quaternion of norm 1 without unit: the vector part x, y, z, then the scalar part w."""


class ChainJoint(Placement):
    """Where a joint stands in the one before it, at position 0, and how it moves."""

    axis: Vector3
    """The direction that the joint turns about or moves along, in its own frame, without unit."""


class FramePlacement(Placement):
    """Where a frame stands behind the joint that moves it."""

    frame: str
    """The name of the frame."""
    after: int
    """The number of joints before the frame: 0, it stands still in the base frame; 1, it moves with the first joint."""
    matrix_at_zero: list[Annotated[list[float], Field(min_length=4, max_length=4)]] = Field(min_length=4, max_length=4)
    """The frame in the base frame with all joints at 0, as a 4 x 4 homogeneous matrix, row by row, m. For a
    Denavit-Hartenberg table it is the product of the A matrices up to the frame."""


class RobotSummary(Answer):
    """A robot in a list of robots."""

    id: str
    """The id by which requests name the robot."""
    content: str | None
    """The SHA-256 of the definition without its id, `sha256:...`; null: a robot of the catalogue, which belongs to the
    version of the service."""
    source: str
    """Where the model comes from."""
    notes: list[str] = Field(
        default_factory=list,
        description="What a user of the model should know, such as limits that nobody publishes: sentences for people.",
    )
    dof: int
    """The number of degrees of freedom, which is the length of every joint array."""
    joint_names: list[str]
    """The names of the joints in the order of every joint array."""
    joints: list[JointDescription]
    """The joints, in the same order."""
    tip_frame: str
    """The name of the frame that poses are about unless a tool is given."""
    mass: float
    """The mass of everything that moves, kg; 0: unknown."""


class RobotDescription(RobotSummary):
    """A robot."""

    limit_sources: dict[str, str]
    """The document that limits come from, or the rule of an estimate, by the name of their quantity. Other quantities
    come from the same document as the model, or from the default rule."""
    rated_payload: float | None = None
    """The largest payload for which the maker builds the robot, tool included, kg; a plan that carries more is
    refused, `payload_exceeded`. Null: unknown."""
    rated_payload_source: str | None = None
    """The document that the rated payload comes from; null: it is unknown."""
    payload_table: PayloadTable | None = Field(default=None, exclude_if=lambda table: table is None)
    """Factors on the acceleration and jerk limits by the payload mass; omitted: none."""
    frames: list[str]
    """The names of all frames of the model."""
    chain: list[ChainJoint]
    """The joints from the base to the tip. A joint's frame at position q is its placement, turned by q about its axis,
    or moved by q along it."""
    placements: list[FramePlacement]
    """Where all frames of the model stand, behind which joint."""
    tool: Placement
    """The tool centre point in the tip frame, for requests that name no tool."""
    mounting: Placement | None
    """The base in the world, whose z axis points up, or with a positioner the frame in which arm and positioner stand;
    null: gravity is as the model has it."""
    external_axes: list[str]
    """The names of the first joints, which are not the arm's own; none: all are the arm's."""
    positioner: list[str] = Field(default_factory=list, exclude_if=lambda names: not names)
    """The names of the first joints, which carry the workpiece, from the workpiece on. They are `external_axes`, or all
    joints of an arm with a `fixed_tool`. The base frame moves with the workpiece then, and the frame `positioner_base`
    stands still. Omitted: the base frame stands still."""
    named_positions: dict[str, list[float]]
    """Joint positions by name, one value a joint in the order of `joint_names`, rad or m; a waypoint may go to one."""
    geometry: list[Any] = Field(
        default_factory=list,
        description="Simple shapes to look at: boxes, cylinders and spheres, in m, with the colour of their material.",
    )
    has_visual_meshes: bool = Field(default=False, exclude_if=lambda has: not has)
    """Whether its description names visual meshes, which `get_robot_visuals` has; omitted: it names none."""
    groups: list[JointGroup]
    """Joints that belong together, as the SRDF says."""
    disabled_collisions: list[DisabledCollision]
    """Pairs of links that the SRDF takes out of collision checks."""


class AddedRobot(RobotDescription):
    """The robot that was added, with remarks about its model."""

    findings: list[ModelFinding]
    """The remarks about the model, errors first."""


class RobotsAnswer(Answer):
    """A page of the catalogue's robots and the added ones."""

    robots: list[RobotSummary]
    """The robots, the catalogue first, each part in the order of the ids."""
    next_cursor: str | None
    """The `cursor` of the next page; null: this is the last."""
