"""The cheapest way through layers of joint positions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray


class Layers(NamedTuple):
    """Layers of states, each a joint position.

    Attributes:
        first_of: The first state of each layer, and the number of states, (layers + 1,).
        positions: (states, joints), rad or m.
        fewest: (states, joints): fewest whole turns of each joint that keep it within its limits; 0 of slides.
        most: (states, joints), likewise.
        costs: (states,): infinite for a state that is left out.
    """

    first_of: np.ndarray
    positions: FloatArray
    fewest: FloatArray
    most: FloatArray
    costs: FloatArray


class StepCosts(NamedTuple):
    """The costs of steps d from layer to layer: sum_j weights_j d_j^2.

    Attributes:
        weights: (joints,).
        furthest: (joints,): largest |d_j| of a step.
    """

    weights: FloatArray
    furthest: FloatArray


def cheapest_way(layers: Layers, steps: StepCosts) -> tuple[np.ndarray, FloatArray, float]:
    """Return the states (layers,) of the cheapest way, their joint positions (layers, joints), and its cost.

    Angles go to the whole turn nearest to the state before, within their limits. The cost is infinite if no way leads
    to the last layer; states and positions are empty then.

    Raises:
        ValueError: The shapes differ.
    """
    states, joints = layers.positions.shape
    first_of = indices(layers.first_of, states + 1, len(layers.first_of))
    positions = doubles(layers.positions, states, joints).copy()
    turns = doubles(layers.fewest, states, joints), doubles(layers.most, states, joints)
    numbers = (doubles(values, joints) for values in steps)
    totals, origins = np.empty(states), np.empty(states, dtype=np.int64)
    costs = doubles(layers.costs, states)
    if not (first_of[0] == 0 and first_of[-1] == states and (np.diff(first_of) >= 0).all()):
        raise ValueError("the layers are not behind each other")
    call("cheapest_ways", len(first_of) - 1, joints, first_of, *turns, costs, *numbers, positions, totals, origins)
    last = totals[first_of[-2] :]
    if not np.isfinite(last).any():
        return np.empty(0, dtype=np.int64), np.empty((0, joints)), np.inf
    state = int(first_of[-2] + last.argmin())
    way = [state]
    while origins[way[-1]] >= 0:
        way.append(int(origins[way[-1]]))
    rows = np.array(way[::-1])
    return rows, positions[rows], float(totals[state])
