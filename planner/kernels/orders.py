"""Local search for the order of tasks and their states."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray

LANES = 4
"""The number of states in a block, which the kernels compare at once."""


@dataclass(frozen=True, eq=False)
class OrderProblem:
    """Tasks to be put in order, each in one of its states.

    Attributes:
        durations: (states, states), s, from the row to the column.
        opposites: (states,): the index of the state in the opposite direction; the state itself if there is none.
        tasks: (states,): the index of the task of each state, ascending from 0.
        before: (rules,): tasks, each of which comes before the task of the same row in `after`.
        after: (rules,).
        groups: (tasks,): the index of the group of each task; -1: none.
        lengths: The numbers of neighbouring tasks that one step moves together.
        arguments: The same, as the kernel reads it.
    """

    durations: FloatArray
    opposites: np.ndarray
    tasks: np.ndarray
    before: np.ndarray
    after: np.ndarray
    groups: np.ndarray
    lengths: tuple[int, ...]
    arguments: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the arrays once, for many searches.

        Raises:
            ValueError: The shapes differ, or an index is out of range.
        """
        states, count, rules = len(self.tasks), len(self.groups), len(self.before)
        task_of = indices(self.tasks, count, states)
        lengths = np.array(self.lengths, dtype=np.int64)
        arguments = (
            *(states, count, doubles(self.durations, states, states), indices(self.opposites, states, states)),
            *(task_of, np.searchsorted(task_of, np.arange(count + 1))),
            *(rules, indices(self.before, count, rules), indices(self.after, count, rules)),
            *(indices(self.groups + 1, count + 1, count) - 1, len(lengths), lengths),
        )
        object.__setattr__(self, "arguments", arguments)

    def settled(self, chosen: np.ndarray, flags: np.ndarray, deadline: float = inf) -> np.ndarray:
        """Return the local optimum that steps and choices of states lead to.

        Args:
            chosen: (tasks,): the states in an order that the rules allow; its first and last tasks stay.
            flags: (tasks,), bool: whether the steps next to each task are tried.
            deadline: The time on the monotonic clock from which no step begins.

        Raises:
            ValueError: The shapes differ, or an index is out of range.
        """
        count = len(self.groups)
        found = indices(chosen, len(self.tasks), count).copy()
        call("settle_order", *self.arguments, found, indices(flags, 2, count).copy(), float(deadline))
        return found


def least_joint_distances(exits: FloatArray, entries: FloatArray, tasks: np.ndarray) -> FloatArray:
    """Return the least distances (tasks, tasks) from the row's exits to the column's entries, by the farthest joint.

    Args:
        exits: (states, joints).
        entries: (states, joints).
        tasks: (states,): the index of the task of each state, ascending from 0; no task is left out.

    Raises:
        ValueError: The shapes differ.
    """
    states, joints = exits.shape
    count = int(tasks[-1]) + 1
    states_of = np.searchsorted(tasks, np.arange(count + 1))
    sizes = -(-np.diff(states_of) // LANES)
    blocks_of = np.concatenate([[0], np.cumsum(sizes)])
    block = np.arange(blocks_of[-1])
    task = np.repeat(np.arange(count), sizes)
    rows = states_of[task][:, None] + LANES * (block - blocks_of[task])[:, None] + np.arange(LANES)
    rows = np.minimum(rows, states_of[task + 1][:, None] - 1)
    packed = np.ascontiguousarray(doubles(entries, states, joints)[rows].transpose(0, 2, 1))
    least = np.empty((count, count))
    call("least_joint_distances", count, joints, states_of, doubles(exits, states, joints), blocks_of, packed, least)
    return least
