"""Tasks: waypoints that the robot visits together, in a direction and from an entry that the planner chooses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, NamedTuple

from planner.fields import FieldPath
from planner.problems.actions import Action, AtWaypoint
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    Motion,
    PlanningProblem,
    PolylineMotion,
    SplineMotion,
    Waypoint,
)
from planner.spatial import FloatArray, Pose, convert_poses

ARRIVAL = ("motion", "duration", "minimum_duration", "limits", "process_force")
"""The fields of a waypoint about the segment that ends there."""


class Visit(NamedTuple):
    """The way in which the robot visits the waypoints of a task.

    Attributes:
        first: Index of the waypoint at which it begins, in the given direction.
        is_reversed: Whether it visits the waypoints in the opposite direction.
        options: The index of the option for each goal set of the task, in order. The other fields are about the task
            with these options.
    """

    first: int = 0
    is_reversed: bool = False
    options: tuple[int, ...] = ()


FORWARDS = Visit()
"""The visit in the given direction, from the first waypoint on."""


class Origin(NamedTuple):
    """The origin of a waypoint of the plan.

    Attributes:
        task: Index of the task; None: the start, the end or a change of the tool.
        waypoint: Index of the waypoint in its task, or in the change; in the problem for the start and the end.
        motion: Index of the waypoint of the task whose motion leads here; None: the motion from another task.
        tool: Index of the tool that is taken or put back; None: none.
        change: Which of the two, as the field of `ChangeableTool`.
        option: The path from a goal set to the waypoint in its options; empty: it is no goal set.
    """

    task: int | None
    waypoint: int
    motion: int | None = None
    tool: int | None = None
    change: Literal["take", "put_back"] | None = None
    option: FieldPath = ()

    @property
    def field(self) -> FieldPath:
        """The field of the waypoint: in the problem, in `tasks` or in `tools`."""
        if self.task is not None:
            return ("tasks", self.task, "waypoints", self.waypoint, *self.option)
        if self.tool is not None and self.change is not None:
            return ("tools", self.tool, self.change, "waypoints", self.waypoint)
        return ("waypoints", self.waypoint)


@dataclass(frozen=True)
class Task:
    """Waypoints that belong together: a point, a line or seam, a closed contour, or a pick with its place.

    Attributes:
        waypoints: One or more, in the given direction. The robot goes to the first one by the `travel` motion.
            The motion of every other waypoint starts at the waypoint before it. Goal sets (`AnyOf`) are only in tasks
            that are neither reversible nor closed.
        name: A name for people and for `after`; None: none.
        reversible: Whether the robot may visit the waypoints in the opposite direction.
        closed: Whether the waypoints are a closed contour, which the robot may enter at any of them and then leaves
            there. The motion of the first waypoint closes the contour: it starts at the last one.
        after: The names of tasks that come before this one.
        group: The name of a group, whose tasks follow each other without another task between; None: none.
        actions: Outputs and waits at the waypoints of the task, by their indices in it. Tasks that are reversible or
            closed have none.
        tool: The name of the tool of the task, one of the changeable tools; None: the robot's own.

    Examples:
        >>> import planner
        >>> planner.Task([planner.JointWaypoint([0.0, 0.5])], name="hole").reversible
        False
    """

    waypoints: Sequence[AnyWaypoint]
    name: str | None = None
    reversible: bool = False
    closed: bool = False
    after: Sequence[str] = ()
    group: str | None = None
    actions: Sequence[Action] = ()
    tool: str | None = None

    def __post_init__(self) -> None:
        """Keep tuples, which cannot change."""
        for name in ("waypoints", "after", "actions"):
            object.__setattr__(self, name, tuple(getattr(self, name)))

    @property
    def arrival(self) -> tuple[float, float]:
        """The least duration and the duration, s, that the motion from another task is to have; 0: any."""
        first = self.waypoints[0]
        return (0.0, 0.0) if self.closed else (first.minimum_duration, first.duration or 0.0)

    def actions_after(self, count: int) -> list[Action]:
        """Return the actions with the indices of their waypoints in a list where so many waypoints come before."""
        return [
            replace(action, at=AtWaypoint(count + action.at.waypoint))
            for action in self.actions
            if isinstance(action.at, AtWaypoint)
        ]

    def steps(self, visit: Visit = FORWARDS) -> list[int]:
        """Return the indices of the waypoints in the order of a visit; a closed contour ends where it begins."""
        count = len(self.waypoints)
        order = [(visit.first + k) % count for k in range(count + self.closed)]
        return order[::-1] if visit.is_reversed else order

    def motions(self, visit: Visit = FORWARDS) -> list[int | None]:
        """Return for each step of a visit the index of the waypoint whose motion leads there; None: travel.

        A motion belongs to the waypoint at its end in the given direction.
        """
        steps = self.steps(visit)
        return [None, *(steps[:-1] if visit.is_reversed else steps[1:])]

    def visited(self, visit: Visit, travel: Motion, positions: FloatArray) -> list[AnyWaypoint]:
        """Return the waypoints of a visit, with joint positions where joint motions end.

        Args:
            visit: The direction and the first waypoint.
            travel: The motion to the first waypoint.
            positions: (steps, joints), rad or m: the joint positions of the visit.
        """
        found = []
        steps = zip(self.steps(visit), self.motions(visit), positions, strict=True)
        for index, motion, position in steps:
            if motion is None:
                source = Waypoint() if self.closed else self.waypoints[0]
                arrival = {name: getattr(source, name) for name in ARRIVAL} | {"motion": travel}
            else:
                source = self.waypoints[motion]
                arrival = {name: getattr(source, name) for name in ARRIVAL}
                arrival["motion"] = _reversed(source.motion) if visit.is_reversed else source.motion
            waypoint = replace(self.waypoints[index], **arrival)
            found.append(_at_position(waypoint, position) if isinstance(waypoint.motion, JointMotion) else waypoint)
        return found

    def visits(self) -> list[Visit]:
        """Return the ways in which the robot may visit the waypoints; every one is followed by its opposite, if any."""
        directions = (False, True) if self.reversible else (False,)
        return [Visit(first, way) for first in range(len(self.waypoints) if self.closed else 1) for way in directions]


@dataclass(frozen=True)
class ChangeableTool:
    """A tool of a tool changer, which the robot takes before its tasks and puts back after them.

    Attributes:
        name: The name that tasks give.
        tool: The tool centre point in the tip frame.
        take: The waypoints at which the robot takes the tool, with what else happens there: dwells, outputs, the
            payload, an object to `attach`. Poses are for the robot's own tool.
        put_back: The waypoints at which the robot puts it back, likewise.
    """

    name: str
    tool: Pose
    take: Task
    put_back: Task

    def __post_init__(self) -> None:
        """Convert other types of poses."""
        convert_poses(self, "tool")


def given_task(problem: PlanningProblem, index: int) -> Task:
    """Return the start (0) or the end (-1) of a problem as a task, with its actions."""
    number = index % len(problem.waypoints)
    there = [action for action in problem.actions if action.at == AtWaypoint(number)]
    return Task([problem.waypoints[index]], actions=[replace(action, at=AtWaypoint(0)) for action in there])


def _reversed(motion: Motion) -> Motion:
    """Return a motion in the opposite direction."""
    if isinstance(motion, PolylineMotion | SplineMotion):
        return replace(motion, poses=motion.poses[::-1])
    return motion


def _at_position(waypoint: AnyWaypoint, position: FloatArray) -> JointWaypoint:
    """Return a waypoint at a joint position (joints,), which no whole turn changes."""
    motion = waypoint.motion
    assert isinstance(motion, JointMotion)  # noqa: S101 - the caller's condition
    kept: dict[str, Any] = {field.name: getattr(waypoint, field.name) for field in fields(Waypoint)}
    turned = motion if isinstance(motion, FreeMotion) else replace(motion, turns="as_given")
    return JointWaypoint(**kept | {"motion": turned}, position=tuple(position.tolist()))
