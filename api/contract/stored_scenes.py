"""Bodies and answers about scenes that the service keeps."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from api.contract.parts.common import (
    DEFAULT_DEADLINE,
    Answer,
    Deadline,
    FrameName,
    JointVector,
    Mounting,
    NamedRobot,
    Pose,
    Schema,
    SelfCollision,
    Tool,
)
from api.contract.parts.scenes import (
    MOST_ATTACHED,
    MOST_OBJECTS,
    AllowedPairs,
    AttachedObject,
    Margin,
    Name,
    ObjectMotion,
    Scene,
    SceneId,
    SceneObject,
    SceneShape,
    SolidShape,
)

MOST_SAMPLES = 2000
"""The most samples of a roadmap."""

MOST_POSITIONS = 32
"""The most joint positions that a request for a roadmap gives."""


class SceneToKeep(Scene):
    """A scene to keep."""

    id: SceneId | None = None
    """The id that the scene gets; omitted: one that is made from the content."""
    visibility: Literal["private", "public"] = "private"
    """Who sees the scene where API keys are required: clients with the key that it was added with (`private`), or
    everybody (`public`). A key's own scene goes before a public one of the same id."""


class ObjectChange(Schema):
    """An object to change, if there is one of this id, or else to add. Omitted fields stay as they are."""

    id: Name
    """The id of the object."""
    shape: SceneShape | None = None
    """Its shape; a new object needs one."""
    pose: Pose | None = None
    """Its pose in its frame (m); null: at the origin."""
    frame: FrameName | None = None
    """The frame of the pose: one of a request's `frames`, `base` or `world`; of a new object `world` if omitted."""
    margin: Margin | None = None
    """The least distance that the robot keeps from it, m; null: that of the scene."""
    motion: ObjectMotion | None = None
    """Its motion in the time of a trajectory; null: it is static."""


class AttachedChange(Schema):
    """An attached object to change, if there is one of this id, or else to add. Omitted fields stay as they are."""

    id: Name
    """The id of the attached object."""
    shape: SolidShape | None = None
    """Its shape; a new one needs one."""
    pose: Pose | None = None
    """Its pose in the frame of its link or of the tool (m); null: at the origin."""
    link: Name | None = None
    """The name of the link that it moves with; null: it is attached to the tool."""
    touch_links: Annotated[list[Name], Field(max_length=64)] | None = None
    """The names of links and objects carried that it may touch, in place of those before; null: none."""
    margin: Margin | None = None
    """The least distance that it keeps from objects, m; null: that of the object or the scene."""


class SceneChange(Schema):
    """The changes of a scene; omitted fields stay as they are."""

    remove: Annotated[list[Name], Field(max_length=MOST_OBJECTS)] = Field(default_factory=list)
    """The ids of objects and attached objects that go, before others come. Allowed pairs with them go, too, unless
    they come back."""
    objects: Annotated[list[ObjectChange], Field(max_length=MOST_OBJECTS)] = Field(default_factory=list)
    """Objects that are changed or added; the others stay."""
    attached: Annotated[list[AttachedChange], Field(max_length=MOST_ATTACHED)] = Field(default_factory=list)
    """Attached objects that are changed or added; the others stay."""
    allowed_pairs: AllowedPairs | None = None
    """Pairs of names that may touch, in place of those before; shape (pairs, 2), without unit."""
    margin: Margin | None = None
    """The least distance of the robot and its attached objects from other objects, m."""


class SceneSummary(Answer):
    """A scene in a list of scenes."""

    id: str
    """The id by which requests name the scene."""
    content: str
    """The SHA-256 of the scene without its id, `sha256:...`: it changes with the scene."""
    number_of_objects: int
    """How many objects stand in it; a number without unit."""
    number_of_attached: int
    """How many objects are attached to the robot; a number without unit."""
    margin: float
    """The least distance of the robot and its attached objects from other objects, m."""


class StoredScene(Answer):
    """A scene that the service keeps."""

    id: str
    """The id by which requests name the scene."""
    content: str
    """The SHA-256 of the scene without its id, `sha256:...`: it changes with the scene."""
    objects: list[SceneObject]
    """The objects that stand still."""
    attached: list[AttachedObject]
    """The objects that move with the robot."""
    allowed_pairs: AllowedPairs
    """Pairs of names that may touch; shape (pairs, 2), without unit."""
    margin: float
    """The least distance of the robot and its attached objects from other objects, m."""


class ScenesAnswer(Answer):
    """A page of the scenes that are kept."""

    scenes: list[SceneSummary]
    """The scenes, in the order of the ids."""
    next_cursor: str | None
    """The `cursor` of the next page; null: this is the last."""


class RoadmapRequest(Schema):
    """A roadmap of a robot in a stored scene. Plans use it that have the same robot, `tool` and `mounting`."""

    robot: NamedRobot
    tool: Tool = None
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Work objects by name, each with its pose in the world (m), for the objects of the scene that stand in them."""
    mounting: Mounting = None
    self_collision: SelfCollision = None
    samples: Annotated[int, Field(ge=0, le=MOST_SAMPLES)] = 600
    """The number of sampled joint positions, without unit; collision-free ones become nodes of the roadmap."""
    positions: Annotated[list[JointVector], Field(max_length=MOST_POSITIONS)] = Field(default_factory=list)
    """The joint positions at which the robot works, shape (positions, joints), rad or m. They become nodes, too, with
    short paths between them."""
    deadline: Deadline = DEFAULT_DEADLINE


class RoadmapDescription(Answer):
    """A roadmap that the service keeps with a scene."""

    is_current: bool
    """Whether it was proved for the robot and the scene as they are; requests use only such a roadmap."""
    robot: str
    """The id of the robot."""
    created: str
    """The time at which it was built, or proved again (RFC 3339)."""
    digest: str
    """The SHA-256 of its content, `sha256:...`: equal roadmaps give equal plans."""
    number_of_nodes: int
    """The number of collision-free joint positions, without unit."""
    number_of_motions: int
    """The number of proved straight motions between them, without unit."""
    number_of_paths: int
    """The number of short paths between the `positions` of the request, without unit."""
    number_of_checks: int
    """The number of joint positions and motions that were checked to build it, without unit: few if an earlier roadmap
    was proved again."""
    bytes: int
    """The size of its content, bytes."""


class RoadmapsAnswer(Answer):
    """The roadmaps of a scene."""

    roadmaps: list[RoadmapDescription]
    """The roadmaps, in the order of the ids of their robots."""
