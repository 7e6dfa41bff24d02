"""Goal sets: waypoints with several options, of which the plan has one."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.actions import WaypointAction  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.common import Schema
from api.contract.parts.waypoints import JointWaypoint, NamedWaypoint, PoseWaypoint, RelativeWaypoint, SingleWaypoint


class WaypointSequence(Schema):
    """Waypoints that are one option together, such as an approach and its goal."""

    kind: Literal["sequence"]
    """The kind of option: several waypoints."""
    waypoints: Annotated[list[SingleWaypoint], Field(min_length=1)]
    """The waypoints in order, without `actions`, `tool` and a relative one at the start. The last one is the goal:
    the goal set's `actions` happen there."""


Option = TypeAliasType(
    "Option",
    Annotated[
        JointWaypoint | NamedWaypoint | PoseWaypoint | WaypointSequence,
        Field(discriminator="kind", description="One option of a goal set, without `actions` and `tool`."),
    ],
)


class GoalSet(Schema):
    """A goal set: several options, of which the planner takes the one with the shortest estimated duration.

    If that option has no plan, the planner takes the next one. Each option has its own motion, transition, limits and
    so on. `choices` of the answer has the chosen option and the outcomes of the others.
    """

    kind: Literal["any_of"]
    """The kind of waypoint: a goal set."""
    name: Annotated[str, Field(max_length=200)] | None = None
    """A name for people; the waypoints of the chosen option have their own."""
    options: Annotated[list[Option], Field(min_length=1, max_length=1000)]
    """The options. A tie goes to the first of them."""
    actions: Annotated[list[WaypointAction], Field(max_length=100)] = Field(default_factory=list)
    """The actions on arrival at the chosen option, one after the other."""


Waypoint = TypeAliasType(
    "Waypoint",
    Annotated[
        JointWaypoint | NamedWaypoint | PoseWaypoint | RelativeWaypoint | GoalSet,
        Field(discriminator="kind", description="Where the robot is to go, or several options for it."),
    ],
)
