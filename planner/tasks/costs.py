"""Estimated durations from state to state, and the best states of a fixed order."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from planner.kernels.orders import least_joint_distances
from planner.spatial import FloatArray
from planner.tasks.states import States
from planner.tasks.travel import UNUSABLE, JointSpeeds


class Costs:
    """The estimated durations from state to state, with what plans have shown of some of them.

    Attributes:
        states: The states of all tasks; the first task is the start, the last the end.
        speeds: The limits of the joints.
        arrivals: (tasks, 2): the requested least duration and duration of the motion to each task, s; 0: any.
        has_end: Whether the last task is a requested end; otherwise the motion to it takes no time.
        known: Durations, s, of motions between two states, from plans.
    """

    def __init__(self, states: States, speeds: JointSpeeds, arrivals: FloatArray, *, has_end: bool) -> None:
        self.states, self.speeds, self.arrivals, self.has_end = states, speeds, arrivals, has_end
        self.known: dict[tuple[int, int], float] = {}
        self.durations = states.durations.copy()

    def between(self, rows: np.ndarray, columns: np.ndarray) -> FloatArray:
        """Return the durations (rows, columns), s, from the exits of some states to the exits of others."""
        states = self.states
        found = self.speeds.durations(states.exits[rows][:, None], states.entries[columns])
        found = self.speeds.requested(found, *self.arrivals[states.tasks[columns]].T)
        for (start, end), duration in self.known.items():
            found[np.ix_(rows == start, columns == end)] = duration
        if not self.has_end:
            found[:, states.tasks[columns] == states.tasks[-1]] = 0.0
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
        found = self.speeds.requested(self.speeds.least_durations(travels), *self.arrivals.T) - self.least_arrivals
        if not self.has_end:
            found[:, -1] = 0.0
        found[0, -1] = found[-1] = np.inf  # nothing follows the end, and some task comes before it
        found[1:, 0] = np.inf
        either: FloatArray = np.minimum(found, found.T)
        np.fill_diagonal(either, np.inf)
        return either

    def set_known(self, start: int, end: int, duration: float) -> None:
        """Set the duration, s, of the motion from one state to another, and of the opposite motion."""
        back = int(self.states.opposites[end]), int(self.states.opposites[start])
        self.known[start, end] = self.known[back] = duration

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
