"""The cheapest way through layers of joint positions: by all ways, one by one."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from planner.kernels.layers import Layers, StepCosts, cheapest_way
from planner.spatial import FloatArray

TURN = 2.0 * np.pi


def random_layers(rng: np.random.Generator, sizes: list[int], joints: int) -> Layers:
    states = sum(sizes)
    fewest = rng.integers(-2, 1, (states, joints)).astype(float)
    most = fewest + rng.integers(0, 3, (states, joints)).astype(float)
    costs = np.where(rng.random(states) < 0.15, np.inf, rng.random(states))
    return Layers(np.cumsum([0, *sizes]), rng.uniform(-7.0, 7.0, (states, joints)), fewest, most, costs)


def cost_of(layers: Layers, way: tuple[int, ...], steps: StepCosts) -> tuple[float, list[FloatArray]]:
    """Return the cost of one way, and its joint positions turned one after the other."""
    cost, reached = float(layers.costs[way[0]]), [layers.positions[way[0]]]
    for state in way[1:]:
        turns = np.clip(
            np.round((reached[-1] - layers.positions[state]) / TURN), layers.fewest[state], layers.most[state]
        )
        there = layers.positions[state] + TURN * turns
        moved = np.abs(there - reached[-1])
        cost += float(moved**2 @ steps.weights + layers.costs[state])
        if (moved > steps.furthest).any():
            cost = np.inf
        reached.append(there)
    return cost, reached


@pytest.mark.parametrize("seed", range(20))
def test_no_way_is_cheaper(seed: int) -> None:
    """Without a choice of turns, which depend on the way to a state, the optimum is exact."""
    rng = np.random.default_rng(seed)
    sizes = [2, 5, 4, 6, 3]
    layers = random_layers(rng, sizes, 3)
    layers = layers._replace(fewest=np.zeros_like(layers.fewest), most=np.zeros_like(layers.most))
    steps = StepCosts(rng.uniform(0.1, 2.0, 3), np.array([9.0, 8.0, 11.0]))
    ways = product(*(range(a, b) for a, b in zip(layers.first_of, layers.first_of[1:], strict=False)))
    least = min(cost_of(layers, way, steps)[0] for way in ways)
    states, positions, cost = cheapest_way(layers, steps)
    assert cost == pytest.approx(least)
    if np.isfinite(least):
        own, reached = cost_of(layers, tuple(states.tolist()), steps)
        assert own == pytest.approx(least)
        assert positions == pytest.approx(np.array(reached))
    else:
        assert not len(states)


def test_angles_go_on_to_the_nearest_turn_within_their_limits() -> None:
    rng = np.random.default_rng(1)
    layers = random_layers(rng, [1, 1, 1, 1], 4)._replace(costs=np.zeros(4))
    steps = StepCosts(np.ones(4), np.full(4, np.inf))
    cost, reached = cost_of(layers, (0, 1, 2, 3), steps)
    _, positions, found = cheapest_way(layers, steps)
    assert (positions == pytest.approx(np.array(reached))) and found == pytest.approx(cost)


def test_layers_that_do_not_follow_each_other_are_refused() -> None:
    layers = random_layers(np.random.default_rng(0), [2, 2], 2)
    steps = StepCosts(np.ones(2), np.ones(2))
    with pytest.raises(ValueError, match="behind each other"):
        cheapest_way(layers._replace(first_of=np.array([0, 3, 2])), steps)
