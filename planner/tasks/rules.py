"""The rules of an order: precedence between tasks, and groups that stay together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

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
        direct = np.zeros((len(tasks), len(tasks)), dtype=bool)
        for index, task in enumerate(tasks):
            direct[[named[name] for name in task.after], index] = True
        before, after = np.nonzero(_reduced(direct))
        numbers: dict[str | None, int] = {None: -1}
        groups = [numbers.setdefault(task.group, len(numbers) - 1) for task in tasks]
        return cls(before, after, np.array(groups))

    @cached_property
    def _before(self) -> list[set[int]]:
        """The tasks that come before each task."""
        return [set(self.before[self.after == task].tolist()) for task in range(len(self.groups))]

    def allow(self, order: np.ndarray) -> bool:
        """Tell whether an order (tasks,) of all tasks keeps the rules."""
        positions, groups = np.argsort(order), self.groups[order]
        begun = groups[np.append(True, groups[1:] != groups[:-1])]
        together = (begun >= 0).sum() == self.groups.max() + 1
        return bool(together and (positions[self.before] < positions[self.after]).all())

    def ordered(self, tasks: Iterable[int], choose: Callable[[list[int]], int], behind: int | None = None) -> list[int]:
        """Return tasks in an order that the rules allow; shorter if they allow no task to follow.

        Args:
            tasks: The tasks.
            choose: Chooses the next one among the tasks that may follow, in ascending order.
            behind: The task before them; None: there is none.
        """
        missing, order = set(tasks), [] if behind is None else [behind]
        while missing and (following := self._following(order[-1] if order else None, missing)):
            order.append(choose(following))
            missing.remove(order[-1])
        return order if behind is None else order[1:]

    def _following(self, last: int | None, missing: set[int]) -> list[int]:
        """Return the missing tasks that may follow the last one; none is left out that leads to an allowed order."""
        free = [task for task in sorted(missing) if missing.isdisjoint(self._before[task])]
        groups: list[int] = self.groups.tolist()
        if last is not None and groups[last] >= 0 and any(groups[task] == groups[last] for task in missing):
            return [task for task in free if groups[task] == groups[last]]
        waiting = ((task, other) for task in missing for other in self._before[task] & missing)
        blocked = {groups[task] for task, other in waiting if groups[task] != groups[other]} - {-1}
        return [task for task in free if groups[task] not in blocked]


def _reduced(before: np.ndarray) -> np.ndarray:
    """Return the rules (tasks, tasks) without implied ones; all of them if no order keeps them."""
    direct = before.astype(np.float32)
    reachable = before
    for _ in range(len(before).bit_length()):
        reachable = reachable | (reachable.astype(np.float32) @ reachable > 0.0)
    if reachable.diagonal().any():
        return before
    reduced: np.ndarray = before & ~(direct @ reachable > 0.0)
    return reduced


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
    done = Rules.of(tasks).ordered(range(len(tasks)), min)
    if len(done) < len(tasks):
        left = next(index for index, task in enumerate(tasks) if index not in done and (task.after or task.group))
        yield ("tasks", left, "after"), "no order keeps this rule together with the `after` and `group` of all tasks"
