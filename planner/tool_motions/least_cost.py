"""Along the solutions of a pose to the one of least cost: for arms with joints to spare, and for goal regions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.kinematics.forward import jacobian
from planner.kinematics.search import QUICK, Search
from planner.spatial import FloatArray
from planner.tool_motions.inverse_jacobian import null_space

LONGEST_DESCENT_STEP = 0.5
"""The longest step along the solutions, rad or m."""

LEAST_DESCENT_STEP = 1e-5
"""The step, rad or m, below which the search ends; no controller resolves smaller ones."""

COMPARED_STEPS = 0.5 ** np.arange(6)
"""The steps that are compared at once, by the longest of them."""

RANDOM_WAYS = 24
"""Number of random directions besides the basis: where costs have kinks, all directions of the basis may ascend."""

MOST_DESCENT_STEPS = 200
"""The most steps: about forty are needed."""

NO_GAIN = 1e-9
"""The smallest gain of a joint position that counts, in the unit of the cost."""


def least_cost(
    search: Search,
    start: FloatArray,
    costs: Callable[[FloatArray], FloatArray],
    allowed: Callable[[FloatArray], np.ndarray] | None = None,
) -> FloatArray:
    """Return a solution of least cost near `start` (joints,), itself a solution.

    Each step is in the null space of the Jacobian, in the direction of least predicted cost among its basis and some
    random ones. Then the solution returns to the pose. Steps become shorter if none reduces the cost, so costs may have
    kinks. This is a compass search (Kolda, Lewis and Torczon 2003).

    Args:
        search: The pose, and the arm.
        start: (joints,), rad or m.
        costs: The costs (N,) of joint positions (N, joints); infinite where they are not allowed.
        allowed: Tells which solutions (N, joints) may be returned, where that takes longer than their costs; None: all.
    """
    q, cost, step = start, float(costs(start[None])[0]), LONGEST_DESCENT_STEP
    rng = np.random.default_rng(0)
    for _ in range(MOST_DESCENT_STEPS):
        idle = null_space(jacobian(search.robot, q)[: search.rows])
        if not len(idle) or step < LEAST_DESCENT_STEP:
            break
        ways = np.vstack([np.eye(len(idle)), -np.eye(len(idle)), rng.normal(size=(RANDOM_WAYS, len(idle)))])
        ways = ways / np.linalg.norm(ways, axis=1, keepdims=True) @ idle
        lengths = np.repeat(step * COMPARED_STEPS, len(ways))
        ahead = np.clip(q + lengths[:, None] * np.tile(ways, (len(COMPARED_STEPS), 1)), search.lower, search.upper)
        predicted = costs(ahead)
        best = int(predicted.argmin())
        solved = search.solve(ahead[best], QUICK) if predicted[best] < cost - NO_GAIN else None
        if solved is not None and allowed is not None and not allowed(solved[None])[0]:
            solved = None
        found = np.inf if solved is None else float(costs(solved[None])[0])
        if solved is not None and found < cost - NO_GAIN:
            q, cost, step = solved, found, min(2.0 * float(lengths[best]), LONGEST_DESCENT_STEP)
        else:
            step = min(step, float(lengths[best])) / 2.0
    return q
