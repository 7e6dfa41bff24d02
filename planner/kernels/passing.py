"""States in which waypoints are passed, by an interior-point method over all joints and durations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.library import call, doubles, indices
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


class PhasedMotions(NamedTuple):
    """Motions of all joints from state to state, in phases of constant jerk.

    Attributes:
        position: Positions (motions, joints, phases + 1) at the starts of phases and at the end, relative to the start.
        velocity: Velocities (motions, joints, phases + 1) there.
        acceleration: Accelerations (motions, joints, phases + 1) there.
        jerk: Jerks (motions, joints, phases).
        times: Durations (motions, joints, phases) of the phases.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    times: FloatArray


def read_cubics(
    phased: PhasedMotions, travels: FloatArray, velocities: FloatArray, accelerations: FloatArray, rounding: float
) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Read motions as cubics on common pieces: the phases of all joints.

    Rounding leaves a difference between the end of a motion and the wanted state. The least change of the jerks
    removes it.

    Args:
        phased: The motions.
        travels: Travels (motions, joints) from start to end.
        velocities: Velocities (motions, joints) at the end.
        accelerations: Accelerations (motions, joints) at the end.
        rounding: Share of a motion's duration up to which two times count as one.

    Returns:
        The motion (pieces,) that each piece belongs to, lengths (pieces,), and coefficients (pieces, joints, 4),
        ascending powers of local time.
    """
    motions, joints, phases = phased.times.shape
    most = motions * joints * phases
    counts, lengths, coefficients = np.empty(motions, dtype=np.int64), np.empty(most), np.empty((most, joints, 4))
    states = (doubles(part, motions, joints, phases + 1) for part in phased[:3])
    rates = (doubles(part, motions, joints, phases) for part in phased[3:])
    ends = (doubles(part, motions, joints) for part in (travels, velocities, accelerations))
    call("cubics", motions, joints, phases, *states, *rates, *ends, rounding, counts, lengths, coefficients)
    of = np.repeat(np.arange(motions), counts)
    return of, lengths[: len(of)], coefficients[: len(of)]


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
