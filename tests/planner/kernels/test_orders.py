"""The local search for orders beside plain numpy."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from time import monotonic

import numpy as np
import pytest

from planner.kernels.orders import OrderProblem, least_joint_distances

NONE = np.zeros(0, dtype=int)


def single_states(durations: np.ndarray, lengths: tuple[int, ...] = (1, 2, 3)) -> OrderProblem:
    """Return tasks with one state each and no rules."""
    count = len(durations)
    return OrderProblem(durations, np.arange(count), np.arange(count), NONE, NONE, np.full(count, -1), lengths)


def total(durations: np.ndarray, order: np.ndarray) -> float:
    return float(durations[order[:-1], order[1:]].sum())


@pytest.mark.parametrize("seed", range(20))
def test_no_reversal_and_no_move_of_a_settled_order_saves_time(seed: int) -> None:
    random = np.random.default_rng(seed)
    durations = random.random((9, 9))
    order = single_states(durations).settled(np.arange(9), np.ones(9, dtype=bool))
    assert order[0] == 0
    assert order[-1] == 8
    assert sorted(order.tolist()) == list(range(9))
    least = total(durations, order)
    assert least <= total(durations, np.arange(9))
    for first in range(1, 8):
        for last in range(first, 8):
            part, rest = order[first : last + 1], np.delete(order, np.arange(first, last + 1))
            others = [(part[::-1], first)]
            if len(part) <= 3:
                others += [(way, place) for way in (part, part[::-1]) for place in range(1, len(rest))]
            for way, place in others:
                assert total(durations, np.insert(rest, place, way)) >= least - 1e-9


def test_no_step_begins_after_the_deadline() -> None:
    durations = np.random.default_rng(1).random((9, 9))
    late = single_states(durations).settled(np.arange(9), np.ones(9, dtype=bool), monotonic())
    assert late.tolist() == list(range(9))
    early = single_states(durations).settled(np.arange(9), np.ones(9, dtype=bool), monotonic() + 60.0)
    assert total(durations, early) < total(durations, np.arange(9))


def test_states_are_the_best_for_the_settled_order() -> None:
    random = np.random.default_rng(3)
    tasks = np.array([0, 1, 1, 2, 2, 2, 3, 3, 4])
    durations = random.random((9, 9))
    opposites = np.array([0, 2, 1, 3, 4, 5, 6, 7, 8])
    problem = OrderProblem(durations, opposites, tasks, NONE, NONE, np.full(5, -1), (1, 2))
    chosen = problem.settled(np.array([0, 1, 3, 6, 8]), np.ones(5, dtype=bool))
    layers = [np.flatnonzero(tasks == task) for task in tasks[chosen]]
    every = np.array(np.meshgrid(*layers)).reshape(5, -1).T
    assert total(durations, chosen) == pytest.approx(min(total(durations, row) for row in every))


def test_settled_order_keeps_precedence_and_groups() -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        durations = random.random((8, 8))
        groups = np.array([-1, 0, 0, 0, 1, 1, -1, -1])
        problem = replace(single_states(durations), before=np.array([3, 5]), after=np.array([1, 6]), groups=groups)
        order = problem.settled(np.array([0, 3, 2, 1, 4, 5, 6, 7]), np.ones(8, dtype=bool)).tolist()
        assert order.index(3) < order.index(1)
        assert order.index(5) < order.index(6)
        for group in ([1, 2, 3], [4, 5]):
            first = min(map(order.index, group))
            assert sorted(order[first : first + len(group)]) == group


def test_unflagged_order_stays() -> None:
    durations = np.random.default_rng(1).random((7, 7))
    worst = max(permutations(range(1, 6)), key=lambda inner: total(durations, np.array([0, *inner, 6])))
    order = np.array([0, *worst, 6])
    assert (single_states(durations).settled(order, np.zeros(7, dtype=bool)) == order).all()


def test_least_distances_are_those_of_all_pairs_of_states() -> None:
    random = np.random.default_rng(2)
    tasks = np.repeat(np.arange(6), [1, 4, 5, 3, 9, 2])
    exits, entries = random.normal(size=(2, len(tasks), 7))
    found = least_joint_distances(exits, entries, tasks)
    distances = np.abs(exits[:, None] - entries).max(axis=2)
    wanted = [[distances[np.ix_(tasks == a, tasks == b)].min() for b in range(6)] for a in range(6)]
    assert found == pytest.approx(np.array(wanted), abs=0.0)


def test_wrong_indices_are_refused() -> None:
    problem = single_states(np.ones((4, 4)))
    with pytest.raises(ValueError, match="index"):
        problem.settled(np.array([0, 1, 2, 4]), np.ones(4, dtype=bool))
    with pytest.raises(ValueError, match="shape"):
        problem.settled(np.array([0, 1, 2]), np.ones(4, dtype=bool))
