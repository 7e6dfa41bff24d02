"""Bodies and answers of the collision check."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from api.contract.parts.common import DEFAULT_DEADLINE, Answer, Deadline, FrameName, NamedRobot, Pose, Tool
from api.contract.parts.scenes import (  # noqa: TC001 - pydantic evaluates the annotations
    ClearancesAnswer,
    CollisionAnswer,
    SceneOrId,
    SpeedZoneAnswer,
    SpeedZones,
)
from api.contract.requests import GivenTrajectory, Rows


class CollisionCheckRequest(GivenTrajectory):
    """Joint positions, or a trajectory of any origin, to check against a scene and the robot itself."""

    robot: NamedRobot
    scene: SceneOrId | None = None
    """The scene around it; omitted: nothing."""
    self_collision: bool | None = None
    """Whether the arm is checked against itself; omitted: unless its shapes are capsules along its
    kinematics."""
    positions: Annotated[Rows, Field(max_length=10_000)] | None = None
    """Joint positions, shape (positions, joints), rad or m; each is checked by itself. In place of a trajectory."""
    speed_zones: SpeedZones = Field(default_factory=list)
    """The speeds that no point of the robot may exceed near objects of the `scene`; only beside a trajectory."""
    tolerance: Annotated[float, Field(ge=2e-4, le=0.1)] = 1e-3
    """The largest distance between the two bounds of a clearance, m."""
    tool: Tool = None
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Frames by name, each with its pose in the world (m), for the objects."""
    mounting: Pose | None = None
    """The pose of the base in the world (m); omitted: the robot's own."""
    deadline: Deadline = DEFAULT_DEADLINE


class CollisionResult(Answer):
    """The result for one joint position, or for a trajectory."""

    free: bool
    """Whether every pair is proved to keep its margin."""
    clearance: ClearancesAnswer | None
    """The distance of the robot; null: it is not free, or there is nothing to check."""
    collision: CollisionAnswer | None
    """The pair that does not keep its margin; null: it is free."""
    speed_zones: list[SpeedZoneAnswer] | None = None
    """The speed of the robot near objects, in each of the requested zones, whether it is free or not. Missing: no zone
    was requested."""


class CollisionCheckAnswer(Answer):
    """The results for the joint positions, or for the trajectory."""

    free: bool
    """Whether all of them are free."""
    results: list[CollisionResult]
    """One a joint position in their order, or one for the trajectory."""
