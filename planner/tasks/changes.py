"""Changes of the tool between tasks: which tool each task needs, and where it is taken and put back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from planner.fields import FieldPath
from planner.problems.problem import PlanningProblem
from planner.spatial import Pose
from planner.tasks.task import ChangeableTool, Origin, Task, given_task

OWN = -1
"""The number of the robot's own tool, besides the numbers of the changeable tools."""


@dataclass(frozen=True, eq=False)
class ToolsOfTasks:
    """All tasks with their tools: the start, the tasks, the end, and then `take` and `put_back` of each tool.

    Attributes:
        own: The tool centre point of the robot's own tool in the tip frame.
        changeable: The tools that can be taken.
        ordered: The start, the tasks and the end.
        tools: (ordered,): the number of the tool of each of them; `OWN`: the robot's own.
    """

    own: Pose
    changeable: tuple[ChangeableTool, ...]
    ordered: tuple[Task, ...]
    tools: np.ndarray

    @classmethod
    def of(
        cls, problem: PlanningProblem, tasks: Sequence[Task], changeable: Sequence[ChangeableTool], mounted: str | None
    ) -> ToolsOfTasks:
        """Find the tools of tasks without faults; `mounted` is that of the start and the end."""
        start, end = (replace(given_task(problem, k), tool=mounted) for k in (0, -1))
        numbers: dict[str | None, int] = {None: OWN} | {one.name: k for k, one in enumerate(changeable)}
        own, ordered = problem.robot.tool_in_tip, (start, *tasks, end)
        tools = np.array([numbers[task.tool] for task in ordered])
        return cls(Pose(own.translation, own.rotation), tuple(changeable), ordered, tools)

    @property
    def end(self) -> int:
        """The index of the end."""
        return len(self.ordered) - 1

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """All tasks, changes of the tool included."""
        return (*self.ordered, *(task for one in self.changeable for task in (one.take, one.put_back)))

    @cached_property
    def arriving(self) -> np.ndarray:
        """The tool (all tasks,) that the robot has when it comes to a task."""
        return np.concatenate([self.tools, *([OWN, k] for k in range(len(self.changeable)))])

    @cached_property
    def leaving(self) -> np.ndarray:
        """The tool (all tasks,) that the robot has when it leaves a task."""
        return np.concatenate([self.tools, *([k, OWN] for k in range(len(self.changeable)))])

    @cached_property
    def changes(self) -> list[tuple[int, int]]:
        """The pairs of different tools of tasks."""
        used = np.unique(self.tools).tolist()
        return [(left, after) for left, after in product(used, used) if left != after]

    def changing(self, left: int, after: int) -> list[int]:
        """Return the indices of the tasks that change one tool to another; none if they are the same."""
        if left == after:
            return []
        put_back = [] if left == OWN else [self.end + 2 + 2 * left]
        return put_back + ([] if after == OWN else [self.end + 1 + 2 * after])

    def with_changes(self, order: Sequence[int]) -> list[int]:
        """Return the indices of tasks in order with the changes of the tool between them."""
        pairs = [(*self.changing(int(self.leaving[a]), int(self.arriving[b])), b) for a, b in pairwise(order)]
        return [order[0], *(index for pair in pairs for index in pair)]

    @cached_property
    def points(self) -> list[Pose]:
        """The tool centre point of the poses of each task in the tip frame; of changes, it is the robot's own."""
        taken = [self.own if tool == OWN else self.changeable[tool].tool for tool in self.tools.tolist()]
        return taken + [self.own] * (len(self.tasks) - len(taken))

    def new_point(self, before: int | None, index: int) -> Pose | None:
        """Return the tool centre point of a task where it differs from that of the task before; None: the same."""
        point = self.points[index]
        return None if point is (self.own if before is None else self.points[before]) else point

    def origin(self, index: int, waypoint: int, motion: int | None = None, option: FieldPath = ()) -> Origin:
        """Return the origin of a waypoint of one of all tasks."""
        if index in (0, self.end):
            return Origin(None, min(index, 1))
        if index < self.end:
            return Origin(index - 1, waypoint, motion, option=option)
        tool, which = divmod(index - self.end - 1, 2)
        return Origin(None, waypoint, motion, tool, "put_back" if which else "take")
