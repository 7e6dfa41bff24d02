"""Local search for the order of tasks and their states.

Dynamic programming chooses the states of the tasks for an order. Reversals of parts (2-opt, Croes 1958) and moves of up
to three tasks (Or 1976) improve the order for these states. A reversed part has its states in the opposite direction.
Where neither helps, the search exchanges two neighbouring parts, or shuffles a part, and begins again.
"""

from __future__ import annotations

from math import factorial
from time import monotonic

import numpy as np

from planner.kernels.orders import OrderProblem
from planner.spatial import FloatArray
from planner.tasks.costs import Costs
from planner.tasks.rules import Rules

MOST_STATES = 1000
"""The largest number of states whose durations the local search keeps: 8 MB."""

FEWEST_STATES = 2
"""The fewest states of a task that the local search keeps."""

MOST_MOVED = 3
"""The largest number of neighbouring tasks that one step moves together, besides whole groups."""

LONGEST_EXCHANGED = 30
"""The largest number of tasks in each of the parts that are exchanged to leave a local optimum."""

MOST_CHANGES = 1_000
"""The largest number of such changes without a gain after which the search ends."""

CHANGES = 20_000
"""The number of such changes without a gain, times the number of tasks, after which it ends."""

CHANGES_OF_AN_ORDER = 10
"""The number of such changes, times the number of orders of all tasks, after which it ends: few tasks have few."""

SHUFFLES = 20
"""The number of other changes that are drawn where the rules do not allow an exchange."""

LONGEST_SHUFFLED = 8
"""The largest number of tasks that such a change shuffles."""

FEWEST_EXCHANGED = 3
"""The number of places, with start and end, up to which no two parts can be exchanged."""

LEAST_GAIN = 1e-9
"""The smallest gain, s, of a step."""


class Search:
    """The search among some states of every task."""

    def __init__(self, costs: Costs, rules: Rules, kept: np.ndarray) -> None:
        """Compute the durations between the states `kept`, in the order of their tasks."""
        self.rules, self.tasks = rules, costs.states.tasks[kept]
        rows = np.full(len(costs.states.tasks), -1)
        rows[kept] = np.arange(len(kept))
        count = costs.end + 1
        sizes = np.bincount(rules.groups[rules.groups >= 0])
        lengths = {*range(1, MOST_MOVED + 1), *sizes.tolist()}
        self.problem = OrderProblem(
            costs.between(kept, kept),
            rows[costs.states.opposites[kept]],
            self.tasks,
            rules.before,
            rules.after,
            rules.groups,
            tuple(sorted(length for length in lengths if length < count - 2)),
        )

    def total(self, chosen: np.ndarray) -> float:
        """Return the duration, s, of states (tasks,) in order."""
        return float(self.problem.durations[chosen[:-1], chosen[1:]].sum())

    def run(self, chosen: np.ndarray, deadline: float) -> np.ndarray:
        """Return better states (tasks,) in order.

        Args:
            chosen: The first order.
            deadline: The time on the monotonic clock at which the search ends.
        """
        random = np.random.default_rng(0)
        best = self.problem.settled(chosen, np.ones(len(chosen), dtype=bool), deadline)
        orders = factorial(min(len(best) - 2, LONGEST_SHUFFLED))
        least, in_vain = self.total(best), 0
        most = min(MOST_CHANGES, CHANGES // len(best), CHANGES_OF_AN_ORDER * orders)
        while in_vain < most and monotonic() < deadline and len(best) > FEWEST_EXCHANGED:
            other = self._changed(best, random, deadline)
            total = self.total(other)
            in_vain = 0 if total < least - LEAST_GAIN else in_vain + 1
            if total <= least:
                best, least = other, total
        return best

    def _changed(self, chosen: np.ndarray, random: np.random.Generator, deadline: float) -> np.ndarray:
        """Change a part of the order at random, and return the local optimum from there."""
        other = _exchanged(chosen, random)
        for _ in range(SHUFFLES):
            moved = np.flatnonzero(other != chosen)
            if len(moved) and self.rules.allow(self.tasks[other]):
                flags = np.zeros(len(chosen), dtype=bool)
                flags[self.tasks[other[np.unique([moved - 1, moved, moved + 1])]]] = True
                return self.problem.settled(other, flags, deadline)
            other = self._shuffled(chosen, random)
        return chosen

    def _shuffled(self, chosen: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return an order with a part in a random order that the rules allow, or unchanged."""
        first, last = np.sort(random.choice(np.arange(1, len(chosen)), 2, replace=False)).tolist()
        last = min(last, first + LONGEST_SHUFFLED)
        tasks = self.tasks[chosen]
        part = tasks[first:last].tolist()
        behind = int(tasks[first - 1])
        order = self.rules.ordered(part, lambda following: following[random.integers(len(following))], behind)
        if len(order) < len(part):
            return chosen
        other = chosen.copy()
        other[first:last] = chosen[np.argsort(tasks)[order]]
        return other


def _exchanged(chosen: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return an order with two neighbouring parts exchanged."""
    count = len(chosen)
    first = int(random.integers(1, count - 2))
    middle = first + int(random.integers(1, min(LONGEST_EXCHANGED, count - 2 - first) + 1))
    last = middle + int(random.integers(1, min(LONGEST_EXCHANGED, count - 1 - middle) + 1))
    return np.concatenate([chosen[:first], chosen[middle:last], chosen[first:middle], chosen[last:]])


def best_order(costs: Costs, rules: Rules, deadline: float, chosen: np.ndarray | None = None) -> np.ndarray:
    """Find states (tasks,) in an order of short duration.

    Args:
        costs: The durations, and the states; the first task is the start, the last the end.
        rules: The rules of the order.
        deadline: The time on the monotonic clock at which the search ends.
        chosen: States in an allowed order to begin with; None: the nearest task follows each task.
    """
    of_tasks = costs.states.of_tasks
    order = _nearest_first(costs, rules) if chosen is None else costs.states.tasks[chosen].tolist()
    share = max(FEWEST_STATES, MOST_STATES // (costs.end + 1))
    while True:
        best, totals = costs.best_states([of_tasks[task] for task in order])
        kept = _kept(costs, best, totals, share)
        search = Search(costs, rules, kept)
        found: np.ndarray = kept[search.run(np.searchsorted(kept, best), deadline)]
        if len(kept) == costs.ordered_states or monotonic() >= deadline:
            return found
        if costs.total(found) >= costs.total(best) - LEAST_GAIN:
            return best
        order = costs.states.tasks[found].tolist()


def _kept(costs: Costs, chosen: np.ndarray, totals: list[FloatArray], share: int) -> np.ndarray:
    """Return the best states of each task, up to `share` and their opposites, ascending."""
    states, kept = costs.states, []
    for state, total in zip(chosen.tolist(), totals, strict=True):
        own = states.of_tasks[states.tasks[state]]
        best = own[np.argsort(total, kind="stable")[:share]]
        best = np.append(best, state)
        kept += [best, states.opposites[best]]
    return np.unique(np.concatenate(kept))


def _nearest_first(costs: Costs, rules: Rules) -> list[int]:
    """Return all tasks in an allowed order, each the nearest to the one before in any of their states."""
    last = costs.end
    order = [0]

    def nearest(following: list[int]) -> int:
        order.append(following[int(costs.least_between[order[-1], following].argmin())])
        return order[-1]

    rules.ordered(range(1, last), nearest, 0)
    return [*order, last]
