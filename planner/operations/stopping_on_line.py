"""The fastest stop of joints that move along a straight line: that of one joint, in closed form."""

from __future__ import annotations

import numpy as np

from planner.limits import SegmentLimits
from planner.operations.certified import JointState
from planner.operations.stopping import Braking, Phase, fastest_stop, joined_phases
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory

OFF_LINE = 1e-9
"""Distance from the straight line, rad or m, or share of an acceleration across it, that counts as rounding."""

PROGRESS_SHARES = np.linspace(0.0, 1.0, 9)
"""Fractions of the duration of a piece at which the trajectory's progress along the line is measured."""


def stop_on_line(
    state: JointState, trajectory: Trajectory, limits: SegmentLimits, *, limits_jerk: bool
) -> Trajectory | None:
    """Find the fastest synchronous stop on a straight line; None: the trajectory leaves the line before.

    Args:
        state: The state in which the stop begins.
        trajectory: What would follow from there on; it ends the line that the stop may use.
        limits: Limits in force, of which the joints' accelerations and jerks count.
        limits_jerk: Whether jerks are limited.
    """
    speed = float(np.linalg.norm(state.velocity))
    if speed == 0.0:
        return None
    direction = state.velocity / speed
    along = float(state.acceleration @ direction)
    if np.abs(state.acceleration - along * direction).max() > OFF_LINE * max(1.0, abs(along)):
        return None
    with np.errstate(divide="ignore", over="ignore"):
        most, jerk = (float((own.narrower[0] / np.abs(direction)).min()) for own in (limits.acceleration, limits.jerk))
    jerk = jerk if limits_jerk else np.inf
    if not np.isfinite(most):
        return None
    phases = fastest_stop((0.0, speed, along), Braking(most, jerk))
    ends = [phase.at(phase.duration) for phase in phases]
    if not phases or min(velocity for _, velocity, _ in ends) < -OFF_LINE * speed:
        return None
    if not _follows(trajectory, state.position, direction, ends[-1][0]):
        return None
    motions = [
        [
            Phase(phase.duration, start + part * phase.position, *(part * value for value in phase[2:]))
            for phase in phases
        ]
        if part != 0.0
        else []
        for start, part in zip(state.position.tolist(), direction.tolist(), strict=True)
    ]
    return joined_phases(state.position, motions)


def _follows(trajectory: Trajectory, start: FloatArray, direction: FloatArray, way: float) -> bool:
    """Tell whether a trajectory keeps to the line from a position (joints,) on for so far, rad or m."""
    for length, coefficients in zip(trajectory.lengths.tolist(), trajectory.coefficients, strict=True):
        powers = coefficients * length ** np.arange(coefficients.shape[1])
        powers[:, 0] -= start
        along = direction @ powers
        if np.abs(powers - np.outer(direction, along)).max() > OFF_LINE:
            return False
        if (PROGRESS_SHARES[:, None] ** np.arange(len(along)) @ along).max() >= way - OFF_LINE:
            return True
    return False
