"""Goal sets of tasks: each combination of options makes an ordinary task."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import NamedTuple

from planner.fields import FieldPath
from planner.problems.any_of import AnyOf, Expansion, requested_paths
from planner.problems.problem import PlanningProblem
from planner.tasks.task import Task

MOST_COMBINATIONS = 100
"""The largest number of combinations of options of a task."""


class ChosenTask(NamedTuple):
    """A task with one option in the place of each goal set.

    Attributes:
        task: The task without goal sets.
        paths: The path in the requested task of each waypoint.
    """

    task: Task
    paths: tuple[FieldPath, ...]


def number_of_combinations(task: Task) -> int:
    """Return the number of combinations of options of a task; 1 without goal sets."""
    return math.prod(len(waypoint.options) for waypoint in task.waypoints if isinstance(waypoint, AnyOf))


def combinations(task: Task) -> list[tuple[int, ...]]:
    """Return the combinations of options of a task: one index for each goal set."""
    sizes = (range(len(waypoint.options)) for waypoint in task.waypoints if isinstance(waypoint, AnyOf))
    return list(product(*sizes))


def with_options(problem: PlanningProblem, task: Task, options: tuple[int, ...]) -> ChosenTask:
    """Put one option in the place of each goal set of a task.

    Args:
        problem: The problem of the tasks.
        task: The task.
        options: The index of the option for each goal set, in order; empty: the task has none.
    """
    if not options:
        return ChosenTask(task, tuple(("waypoints", k) for k in range(len(task.waypoints))))
    sets = (k for k, waypoint in enumerate(task.waypoints) if isinstance(waypoint, AnyOf))
    own = replace(problem, waypoints=task.waypoints, actions=task.actions)
    expanded = Expansion.of(own, dict(zip(sets, options, strict=True))).problem
    return ChosenTask(replace(task, waypoints=expanded.waypoints, actions=expanded.actions), requested_paths(expanded))
