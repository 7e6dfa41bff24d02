"""The rules of an order: precedence between tasks, and groups that stay together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.fields import FieldPath
from planner.tasks.task import Task


@dataclass(frozen=True, eq=False)
class Rules:
    """The rules of an order of tasks.

    Attributes:
        before: (rules,): tasks, each of which comes before the task of the same row in `after`.
        after: (rules,).
        groups: (tasks,): the number of the group of each task; -1: none.
    """

    before: np.ndarray
    after: np.ndarray
    groups: np.ndarray

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> Rules:
        """Make the rules of tasks without faults."""
        named = {task.name: index for index, task in enumerate(tasks)}
        pairs = [(named[name], index) for index, task in enumerate(tasks) for name in task.after]
        before, after = np.array(pairs, dtype=int).reshape(-1, 2).T
        numbers: dict[str | None, int] = {None: -1}
        groups = [numbers.setdefault(task.group, len(numbers) - 1) for task in tasks]
        return cls(before, after, np.array(groups))

    def allow(self, order: np.ndarray) -> bool:
        """Tell whether an order (tasks,) of all tasks keeps the rules."""
        positions, groups = np.argsort(order), self.groups[order]
        begun = groups[np.append(True, groups[1:] != groups[:-1])]
        together = (begun >= 0).sum() == self.groups.max() + 1
        return bool(together and (positions[self.before] < positions[self.after]).all())

    def next_tasks(self, done: Sequence[int]) -> list[int]:
        """Return the tasks that may follow those done; none are left out that lead to an allowed order.

        Args:
            done: The tasks so far, in an order that the rules allow.
        """
        is_missing, groups = np.ones(len(self.groups), dtype=bool), self.groups
        is_missing[list(done)] = False
        waiting = is_missing[self.before]
        is_free = is_missing.copy()
        is_free[self.after[waiting]] = False
        begun = is_missing & (groups >= 0) & np.isin(groups, groups[~is_missing])
        if begun.any():
            return np.flatnonzero(is_free & begun).tolist()
        from_outside = waiting & (groups[self.before] != groups[self.after])
        is_blocked = (groups >= 0) & np.isin(groups, groups[self.after[from_outside]])
        return np.flatnonzero(is_free & ~is_blocked).tolist()


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
        following = rules.next_tasks(done)
        if not following:
            left = next(index for index, task in enumerate(tasks) if index not in done and (task.after or task.group))
            yield (
                ("tasks", left, "after"),
                "no order keeps this rule together with the `after` and `group` of all tasks",
            )
            return
        done.append(following[0])
