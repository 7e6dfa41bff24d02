"""Goal sets: waypoints with several options, of which the planner takes one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace

from planner.fields import FieldPath
from planner.problems.actions import Action, AtWaypoint
from planner.problems.problem import AnyWaypoint, PlanningProblem, PoseWaypoint, RelativeWaypoint, Waypoint

OWN_FIELDS = frozenset({"name", "dwell"})
"""The fields of every kind of waypoint that a goal set may have itself."""


@dataclass(frozen=True)
class WaypointSequence:
    """Waypoints that are one option together, such as an approach and its goal.

    Attributes:
        waypoints: One or more, in order. The last one is the goal: actions at the `AnyOf` happen there.
    """

    waypoints: Sequence[AnyWaypoint]

    def __post_init__(self) -> None:
        """Keep a tuple, which cannot change."""
        object.__setattr__(self, "waypoints", tuple(self.waypoints))


@dataclass(frozen=True)
class AnyOf(Waypoint):
    """A goal set: the planner takes the option with the shortest estimated duration that has a plan.

    Each option has its own motion, transition, limits and so on. Of the other fields an `AnyOf` has only `name` and
    `dwell`, a rest at the end of the option besides the option's own.

    Attributes:
        options: Waypoints, or sequences of waypoints. Lists of waypoints become sequences. No option begins with a
            relative waypoint or changes the tool.
    """

    options: Sequence[AnyWaypoint | WaypointSequence]

    def __post_init__(self) -> None:
        """Convert lists to sequences."""
        super().__post_init__()
        given = (WaypointSequence(option) if isinstance(option, list | tuple) else option for option in self.options)
        object.__setattr__(self, "options", tuple(given))


def goal_sets(problem: PlanningProblem) -> dict[int, AnyOf]:
    """Return the goal sets of a problem, by the indices of their waypoints."""
    return {i: waypoint for i, waypoint in enumerate(problem.waypoints) if isinstance(waypoint, AnyOf)}


def waypoints_of(waypoint: AnyWaypoint | WaypointSequence) -> tuple[AnyWaypoint, ...]:
    """Return the waypoints of an option, or a waypoint alone."""
    return tuple(waypoint.waypoints) if isinstance(waypoint, WaypointSequence) else (waypoint,)


@dataclass(frozen=True, repr=False)
class ProblemWithOptions(PlanningProblem):
    """A problem with one option in the place of each goal set.

    Attributes:
        paths: Path in the request of each waypoint besides corners of detours.
    """

    paths: tuple[FieldPath, ...] = ()


def requested_paths(problem: PlanningProblem) -> tuple[FieldPath, ...]:
    """Return the path in the request of each waypoint; a corner of a detour has that of its end."""
    if isinstance(problem, ProblemWithOptions):
        return tuple(problem.paths[number] for number in problem.numbers)
    return tuple(("waypoints", number) for number in problem.numbers)


def requested_indices(problem: PlanningProblem) -> tuple[int, ...]:
    """Return the index in the request of each waypoint; waypoints of an option have that of their goal set."""
    return tuple(int(path[1]) for path in requested_paths(problem))


@dataclass(frozen=True, eq=False)
class Expansion:
    """A problem with one option in the place of each goal set.

    Attributes:
        problem: The problem without goal sets.
        first: Index in `problem` of the first waypoint of each requested one, and the number of waypoints.
    """

    problem: PlanningProblem
    first: tuple[int, ...]

    @classmethod
    def of(cls, problem: PlanningProblem, options: Mapping[int, int]) -> Expansion:
        """Put options in the places of goal sets.

        Args:
            problem: The requested problem.
            options: Index of the option by the index of the goal set; the first option where there is none.
        """
        waypoints: list[AnyWaypoint] = []
        paths: list[FieldPath] = []
        first = [0]
        for i, waypoint in enumerate(problem.waypoints):
            path: FieldPath = ("waypoints", i)
            if isinstance(waypoint, AnyOf):
                chosen = options.get(i, 0)
                option = waypoint.options[chosen]
                path = (*path, "options", chosen)
                *before, last = waypoints_of(option)
                waypoints += [*before, replace(last, dwell=last.dwell + waypoint.dwell) if waypoint.dwell else last]
                paths += _paths_in(option, path)
            else:
                waypoints.append(waypoint)
                paths.append(path)
            first.append(len(waypoints))

        def moved(action: Action) -> Action:
            if not isinstance(action.at, AtWaypoint):
                return action
            index = action.at.waypoint
            there = first[index + 1] - 1 if 0 <= index < len(first) - 1 else len(waypoints)
            return replace(action, at=AtWaypoint(there))

        given = {field.name: getattr(problem, field.name) for field in fields(PlanningProblem)}
        changed = {"waypoints": tuple(waypoints), "actions": tuple(map(moved, problem.actions)), "paths": tuple(paths)}
        return cls(ProblemWithOptions(**(given | changed)), tuple(first))


def _paths_in(option: AnyWaypoint | WaypointSequence, path: FieldPath) -> list[FieldPath]:
    """Return the paths of the waypoints of an option at a path."""
    if isinstance(option, WaypointSequence):
        return [(*path, "waypoints", j) for j in range(len(option.waypoints))]
    return [path]


def goal_set_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of goal sets that their options alone do not show."""
    for i, goal_set in goal_sets(problem).items():
        at: FieldPath = ("waypoints", i)
        for field in fields(Waypoint):
            if field.name not in OWN_FIELDS and getattr(goal_set, field.name) != field.default:
                yield (
                    (*at, field.name),
                    "must be set in the options. A goal set has only a name and a dwell",
                )
        if not 0.0 <= goal_set.dwell < math.inf:
            yield (*at, "dwell"), f"must be finite and not negative; got {goal_set.dwell:g}"
        if not goal_set.options:
            yield (*at, "options"), "must have at least one option"
        for k, option in enumerate(goal_set.options):
            path = (*at, "options", k)
            own = waypoints_of(option)
            if not own:
                yield (*path, "waypoints"), "must have at least one waypoint"
            for waypoint, field_path in zip(own, _paths_in(option, path), strict=True):
                if isinstance(waypoint, AnyOf) or not isinstance(waypoint, Waypoint):
                    yield field_path, f"must be a waypoint of another kind; got {type(waypoint).__name__}"
                elif isinstance(waypoint, PoseWaypoint) and waypoint.on is not None:
                    text = "must be left out in an option: goal sets and rides on moving objects exclude each other"
                    yield (*field_path, "on"), text
                elif waypoint.tool is not None:
                    yield (*field_path, "tool"), "must be None in an option. Set the tool at a waypoint before or after"
            if own and isinstance(own[0], RelativeWaypoint):
                yield path, "must not begin with a relative waypoint. Give its pose or joint position"
