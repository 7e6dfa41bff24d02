"""The rules of an order: precedence between tasks, and groups that stay together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.fields import FieldPath
    from planner.tasks.task import Task


@dataclass(frozen=True, eq=False)
class Rules:
    """The rules of an order of tasks.

    Attributes:
        before: (rules,): tasks, each of which comes before the task of the same row in `after`.
        after: (rules,).
        groups: The tasks of each group.
    """

    before: np.ndarray
    after: np.ndarray
    groups: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> Rules:
        """Make the rules of tasks without faults."""
        named = {task.name: index for index, task in enumerate(tasks)}
        pairs = [(named[name], index) for index, task in enumerate(tasks) for name in task.after]
        before, after = np.array(pairs, dtype=int).reshape(-1, 2).T
        names = dict.fromkeys(task.group for task in tasks if task.group is not None)
        groups = (np.array([i for i, task in enumerate(tasks) if task.group == name]) for name in names)
        return cls(before, after, tuple(groups))

    def allow(self, order: np.ndarray) -> bool:
        """Tell whether an order (tasks,) of all tasks keeps the rules."""
        positions = np.argsort(order)
        spans = (np.ptp(positions[group]) + 1 == len(group) for group in self.groups)
        return bool((positions[self.before] < positions[self.after]).all()) and all(spans)

    def next_tasks(self, done: Sequence[int], count: int) -> list[int]:
        """Return the tasks that may follow those done; none are left out that lead to an allowed order.

        Args:
            done: The tasks so far, in an order that the rules allow.
            count: The number of all tasks.
        """
        missing = set(range(count)) - set(done)
        waiting = {b: a for a, b in zip(self.before.tolist(), self.after.tolist(), strict=True) if a in missing}
        free = [index for index in missing if index not in waiting]
        for group in self.groups:
            members = set(group.tolist())
            if members & missing and members - missing:
                return [index for index in free if index in members]
            blocked = any(
                b in members and a in missing and a not in members
                for a, b in zip(self.before.tolist(), self.after.tolist(), strict=True)
            )
            if blocked:
                free = [index for index in free if index not in members]
        return free


def rule_faults(tasks: Sequence[Task]) -> Iterator[tuple[FieldPath, str]]:
    """Find names that occur twice or are unknown, and rules that no order keeps."""
    named: dict[str, int] = {}
    for index, task in enumerate(tasks):
        if task.name is not None and task.name in named:
            yield (
                ("tasks", index, "name"),
                f"must occur once; {task.name!r} is also the name of task {named[task.name]}",
            )
        elif task.name is not None:
            named[task.name] = index
    unknown = False
    for index, task in enumerate(tasks):
        for k, name in enumerate(task.after):
            if named.get(name, index) == index:
                unknown = True
                yield ("tasks", index, "after", k), f"must be the name of another task; got {name!r}"
    if unknown or len(named) < sum(task.name is not None for task in tasks):
        return
    done: list[int] = []
    rules = Rules.of(tasks)
    while len(done) < len(tasks):
        following = rules.next_tasks(done, len(tasks))
        if not following:
            left = next(index for index, task in enumerate(tasks) if index not in done and (task.after or task.group))
            yield (
                ("tasks", left, "after"),
                "no order keeps this rule together with the `after` and `group` of all tasks",
            )
            return
        done.append(following[0])
