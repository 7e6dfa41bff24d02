"""Costs that make one solution of a pose better than another, and the search for solutions of least cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from planner.kinematics.configurations import Configuration, configurations, in_configuration
from planner.kinematics.costs import tilts
from planner.kinematics.forward import LEAST_MANIPULABILITY, jacobian, manipulability
from planner.kinematics.inverse import all_solutions
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import QUICK, Search, wide_spread
from planner.kinematics.turns import counted_velocity, travel_times
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tool_motions.inverse_jacobian import null_space
from planner.tool_motions.position_limits import shares_of_range
from planner.waypoints.pinned import pinned_at

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


Costs = Callable[[FloatArray], FloatArray]

SIDE = 0.01
"""The weight of the sum over all joints beside the worst one: it decides where that leaves the others open."""

CONTINUUM_STARTS = 6
"""Number of the best solutions that are known of a continuum from which a better one is sought."""


def costs_of(robot: Robot, options: InverseKinematicsOptions) -> Costs | None:
    """Return the preference costs (N,) of joint positions (N, joints); None: only the path counts.

    Args:
        robot: The robot, with its tool; joints behind its own, the offsets of a region, do not count.
        options: The preference and the reference.
    """
    if options.prefer in ("continuous", "arm"):
        return None

    def costs(positions: FloatArray) -> FloatArray:
        own = positions[:, : robot.dof]
        if options.prefer == "weld_flat":
            return tilts(robot, own)
        if options.prefer == "manipulability":
            return -np.log(np.maximum(manipulability(robot, own), LEAST_MANIPULABILITY))
        if options.prefer == "near_reference":  # times, s, at full speed of the joints
            parts = np.abs(own - np.array(options.reference)) / counted_velocity(robot.limit("velocity"))
        else:
            parts = np.abs(shares_of_range(robot, own))
        return np.asarray(parts.max(axis=1) + SIDE * parts.sum(axis=1))

    return costs


def best_of_continuum(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions,
    known: Sequence[FloatArray],
    costs: Costs,
    wanted: Configuration,
) -> list[FloatArray]:
    """Return solutions (joints,) of least cost near known ones, and others spread widely."""
    search = Search(robot, pose, options)
    allowed = partial(_in_configuration, robot, wanted, costs)
    starts = np.array([*known, *wide_spread(search)])
    found = allowed(starts)
    best = [row for row in found.argsort(kind="stable")[:CONTINUUM_STARTS].tolist() if np.isfinite(found[row])]
    return [least_cost(search, starts[row], allowed) for row in best]


def _in_configuration(robot: Robot, wanted: Configuration, costs: Costs, positions: FloatArray) -> FloatArray:
    """Return costs (N,) that are infinite outside the requested configuration."""
    found = costs(positions)
    if wanted.names:
        found = np.where([wanted.allows(other) for other in configurations(robot, positions)], found, np.inf)
    return found


ARM_SHARE = 1e-3
"""The weight of the arm's time beside that of its external axes: it decides where these can stand still."""


def with_still_axes(search: Search, start: FloatArray, wanted: Configuration) -> FloatArray | None:
    """Return the solution of a pose for which external axes move least from a joint position (joints,).

    Args:
        search: For the pose, of a robot with external axes.
        start: (joints,), within the limits.
        wanted: The configuration of the arm.

    Returns:
        The nearest solution of the arm alone. Otherwise a solution with a local minimum of the external axes' motion;
        None: no solution nearby.
    """
    robot, carried = search.robot, len(search.robot.external_axes)
    pinned = pinned_at(robot, dict(zip(robot.external_axes, start.tolist(), strict=False)))
    alone = all_solutions(pinned.robot, search.pose, pinned.options(search.options), pinned.own(start))
    if alone := in_configuration(pinned.robot, alone, wanted):
        return min(pinned.solutions(alone), key=lambda q: float(travel_times(robot, q, start)))
    solution = search.solve(start, QUICK)
    if solution is None:
        return None
    velocity = counted_velocity(robot.limit("velocity"))

    def costs(positions: FloatArray) -> FloatArray:
        """Return the times (N,), s, of the external axes from the start, plus a fraction of the arm's time."""
        times = np.abs(positions - start) / velocity
        found: FloatArray = times[:, :carried].sum(axis=1) + ARM_SHARE * times[:, carried:].sum(axis=1)
        return found

    return least_cost(search, solution, costs)
