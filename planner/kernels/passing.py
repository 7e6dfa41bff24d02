"""States in which waypoints are passed, by an interior-point method over all joints and durations."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from planner.kernels.library import call, doubles, indices

if TYPE_CHECKING:
    import numpy as np

    from planner.spatial import FloatArray


class PassingProblem(NamedTuple):
    """A program for durations and states, see `planner.backends.ruckig.via_program`.

    Attributes:
        coefficients: Coefficients (rows, unknowns) of the limited quantities by the unknowns of a joint on a segment.
        by_travel: Their coefficients (rows,) by the travel.
        powers: Their orders of differentiation (rows,), from 0 to 3.
        travels: (segments, joints).
        bounds: Upper limits, then magnitudes of lower ones, (2, segments, joints, rows).
        shortest: Least durations (segments,).
        costs: The costs (segments,) of a unit of time.
    """

    coefficients: FloatArray
    by_travel: FloatArray
    powers: np.ndarray
    travels: FloatArray
    bounds: FloatArray
    shortest: FloatArray
    costs: FloatArray


def best_states(problem: PassingProblem, times: FloatArray, states: FloatArray) -> FloatArray:
    """Search for states (segments + 1, joints, 2), velocities and accelerations, of a fast motion.

    Args:
        problem: The program.
        times: Durations (segments,) where the search begins.
        states: States (segments + 1, joints, 2) where it begins.
    """
    (segments, joints), (rows, unknowns) = problem.travels.shape, problem.coefficients.shape
    durations, found = doubles(times, segments).copy(), doubles(states, segments + 1, joints, 2).copy()
    grid = (
        doubles(problem.coefficients, rows, unknowns),
        doubles(problem.by_travel, rows),
        indices(problem.powers, 4, rows),
    )
    limits = doubles(problem.travels, segments, joints), doubles(problem.bounds, 2, segments, joints, rows)
    each = doubles(problem.shortest, segments), doubles(problem.costs, segments)
    call("pass_waypoints", segments, joints, rows, unknowns, *grid, *limits, *each, durations, found)
    return found
