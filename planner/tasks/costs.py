"""Estimated durations from state to state, and the best states of a fixed order."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property, reduce

import numpy as np

from planner.kernels.orders import least_joint_distances
from planner.spatial import FloatArray
from planner.tasks.changes import ToolsOfTasks
from planner.tasks.states import States
from planner.tasks.travel import UNUSABLE, JointSpeeds


class Costs:
    """The estimated durations from state to state, with what plans have shown of some of them.

    Attributes:
        states: The states of all tasks: the start, the tasks, the end, and then the changes of the tool.
        speeds: The limits of the joints.
        arrivals: (tasks, 2): the requested least duration and duration of the motion to each task, s; 0: any.
        tools: The tool that the robot has when it comes to each task, and when it leaves it.
        end: Index of the end. Without a requested end, the motion to it takes no time.
        has_end: Whether there is a requested end.
        known: Durations, s, of motions between two states, from plans.
    """

    def __init__(
        self, states: States, speeds: JointSpeeds, arrivals: FloatArray, tools: ToolsOfTasks, *, has_end: bool
    ) -> None:
        self.states, self.speeds, self.arrivals, self.tools, self.has_end = states, speeds, arrivals, tools, has_end
        self.end = tools.end
        self.known: dict[tuple[int, int], float] = {}
        self.durations = states.durations.copy()
        if not has_end:
            self.durations[states.of_tasks[self.end]] = 0.0

    @cached_property
    def ordered_states(self) -> int:
        """The number of states up to the end; the states of changes of the tool follow them."""
        return int(self.states.of_tasks[self.end][-1]) + 1

    def between(self, rows: np.ndarray, columns: np.ndarray) -> FloatArray:
        """Return the durations (rows, columns), s, from the exits of some states to the exits of others.

        They include the changes of the tool between them.
        """
        found = self._direct(rows, columns)
        tasks = self.states.tasks
        for left, next_tool in self.tools.changes:
            away, there = self.tools.leaving[tasks[rows]] == left, self.tools.arriving[tasks[columns]] == next_tool
            if away.any() and there.any():
                changing = (self.states.of_tasks[task] for task in self.tools.changing(left, next_tool))
                layers = [rows[away], *changing, columns[there]]
                found[np.ix_(away, there)] = _shortest([self._direct(a, b) for a, b in itertools.pairwise(layers)])
        if not self.has_end:
            found[:, tasks[columns] == self.end] = 0.0
        return found

    def with_changes(self, chosen: np.ndarray) -> np.ndarray:
        """Return states in order with the best states of the changes of the tool between them."""
        chosen = chosen if self.has_end else chosen[:-1]
        given = iter(chosen.tolist())
        order = self.tools.with_changes(self.states.tasks[chosen].tolist())
        of_tasks = self.states.of_tasks
        return self.best_states([of_tasks[task] if task > self.end else np.array([next(given)]) for task in order])[0]

    def _direct(self, rows: np.ndarray, columns: np.ndarray) -> FloatArray:
        """Return the durations (rows, columns), s, without changes of the tool."""
        states = self.states
        found = self.speeds.durations(states.exits[rows][:, None], states.entries[columns])
        found = self.speeds.requested(found, *self.arrivals[states.tasks[columns]].T)
        for (start, end), duration in self.known.items():
            found[np.ix_(rows == start, columns == end)] = duration
        found += self.durations[columns]
        return found

    @property
    def least_arrivals(self) -> FloatArray:
        """The requested least durations (tasks,), s, of the motions to the tasks."""
        return np.asarray(self.arrivals.max(axis=1), dtype=np.float64)

    @cached_property
    def least_between(self) -> FloatArray:
        """Lower bounds (tasks, tasks), s, on the motions between two tasks, in either direction.

        They are beyond the requested duration of the motion to the later task, see `least_arrivals`.
        """
        states, velocity = self.states, self.speeds.velocity
        travels = least_joint_distances(states.exits / velocity, states.entries / velocity, states.tasks)
        direct = self.speeds.requested(self.speeds.least_durations(travels), *self.arrivals.T)
        ordered = range(self.end + 1)
        found = direct[np.ix_(ordered, ordered)]
        least = [float(self.durations[there].min()) for there in states.of_tasks]
        for left, next_tool in self.tools.changes:
            away, there = (np.flatnonzero(self.tools.tools == tool) for tool in (left, next_tool))
            changing = self.tools.changing(left, next_tool)
            layers = [away, *(np.array([task]) for task in changing), there]
            legs = [direct[np.ix_(a, b)] for a, b in itertools.pairwise(layers)]
            found[np.ix_(away, there)] = _shortest(legs) + sum(least[task] for task in changing)
        found = found - self.least_arrivals[ordered]
        if not self.has_end:
            found[:, -1] = 0.0
        found[0, -1] = found[-1] = np.inf  # nothing follows the end, and some task comes before it
        found[1:, 0] = np.inf
        either: FloatArray = np.minimum(found, found.T)
        np.fill_diagonal(either, np.inf)
        return either

    def set_known(self, start: int, end: int, duration: float) -> None:
        """Set the duration, s, of the motion from one state to another, and of the opposite motion, if any."""
        states, (before, after) = self.states, self.states.opposites[[end, start]].tolist()
        self.known[start, end] = duration
        ends = (states.exits[before], states.entries[end]), (states.entries[after], states.exits[start])
        if all(np.array_equal(there, here) for there, here in ends):
            self.known[before, after] = duration

    def exclude(self, state: int) -> None:
        """Exclude a state, and the one in the opposite direction."""
        self.durations[[state, self.states.opposites[state]]] = UNUSABLE

    def total(self, chosen: np.ndarray) -> float:
        """Return the estimated duration, s, of states (tasks,) in order."""
        pairs = itertools.pairwise(chosen)
        return float(sum(self.between(np.array([a]), np.array([b]))[0, 0] for a, b in pairs))

    def best_states(self, layers: Sequence[np.ndarray]) -> tuple[np.ndarray, list[FloatArray]]:
        """Choose the states of tasks in a fixed order, by dynamic programming.

        Args:
            layers: The states to choose among, one array for each task in order.

        Returns:
            The chosen states (tasks,), and for each task the least durations (states,), s, of the whole by each state.
        """
        steps = [self.between(a, b) for a, b in itertools.pairwise(layers)]
        reached = [np.zeros(len(layers[0]))]
        for step in steps:
            reached.append((reached[-1][:, None] + step).min(axis=0))
        left = [np.zeros(len(layers[-1]))]
        for step in reversed(steps):
            left.append((step + left[-1]).min(axis=1))
        rows = [int((reached[0] + left[-1]).argmin())]
        for step, onwards in zip(steps, left[-2::-1], strict=True):
            rows.append(int((step[rows[-1]] + onwards).argmin()))
        chosen = np.array([layer[row] for layer, row in zip(layers, rows, strict=True)])
        return chosen, [a + b for a, b in zip(reached, left[::-1], strict=True)]


def _shortest(legs: Sequence[FloatArray]) -> FloatArray:
    """Return the least durations from the first to the last layer of states, given the durations between layers."""
    found = legs[0]
    for leg in legs[1:]:
        found = reduce(np.minimum, (found[:, [k]] + leg[k] for k in range(len(leg))))
    return found
