"""Input shaping: motions convolved with three impulses, which leave little residual vibration in a mode of the arm.

The response of a linear mode to the average of three delayed copies is the average of three delayed responses. The
delays and weights are chosen so that these cancel over the whole frequency band. Velocities, accelerations and jerks
of an average keep the limits of joints. A straight joint motion stays on its path; the certificate decides on all else.
"""

from __future__ import annotations

import numpy as np

from planner.paths import JointPath
from planner.problems.residual_vibration import ResidualVibration
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import SegmentedPolynomial, joined, shifted
from planner.trajectories.trajectory import Trajectory


def impulses_of(mode: ResidualVibration) -> tuple[FloatArray, FloatArray]:
    """Return the weights (3,), with sum 1, and the delays (3,), s, of the impulses for a mode.

    It is the extra-insensitive shaper of Singhose, Seering and Singer (1994) with the zeros of its residual vibration
    at two frequencies of the band. They are such that the residual is the same in the middle of the band and at both
    ends. There it is (1 - c) / (1 + c) of the unshaped one without damping, with c as below: 2.8 % for errors of 15 %.
    """
    decay = np.exp(-mode.damping * np.pi / np.sqrt(1.0 - mode.damping**2))
    c = (1.0 + np.cos(np.pi * mode.frequency_error)) / 2.0
    weights = np.array([1.0, 2.0 * c * decay, decay**2])
    return weights / weights.sum(), mode.period * np.array([0.0, 0.5, 1.0])


def shaping_time(mode: ResidualVibration | None, path: JointPath) -> float:
    """Return the time by which shaping lengthens a trajectory on a path, s."""
    return len(path.every_group) * mode.period if mode is not None and mode.suppress else 0.0


def shaped(mode: ResidualVibration | None, path: JointPath, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory with all its motions from rest to rest shaped, if the mode is to be suppressed.

    Each motion takes one period longer. The arrivals at waypoints that it passes are half a period later.
    """
    if mode is None or not shaping_time(mode, path):
        return trajectory
    weights, delays = impulses_of(mode)
    extra = np.zeros(len(trajectory.breakpoints))
    parts, done = [], 0
    for rows in path.rows_of_groups(trajectory):
        first, last = int(rows[0]), int(rows[-1]) + 1
        parts.append(trajectory.of(np.arange(done, first)))
        parts.append(_convolved(trajectory.of(rows), weights, delays))
        extra[first + 1 : last] += delays[-1] / 2.0
        extra[last:] += delays[-1]
        done = last
    whole = joined([*parts, trajectory.of(np.arange(done, len(trajectory.lengths)))])
    times = trajectory.breakpoints + extra
    times[-1] = whole.breakpoints[-1]
    return trajectory.with_pieces(whole, times)


def _convolved(motion: SegmentedPolynomial, weights: FloatArray, delays: FloatArray) -> SegmentedPolynomial:
    """Return the weighted average of delayed copies of a motion from rest to rest.

    A piece belongs to the segment that the motion with half of the largest delay is on.
    """
    longest = float(delays[-1])
    ends = motion.evaluate(motion.breakpoints[[0, -1]], [0])[0]
    before, after = (
        SegmentedPolynomial(np.array([longest]), position[None, :, None], segment)
        for position, segment in zip(ends, (motion.segments[:1], motion.segments[-1:]), strict=True)
    )
    around = before.followed_by(motion, after)
    times = np.sort(np.add.outer(delays, longest + np.append(0.0, motion.breakpoints[1:])).ravel())
    end = times[-1]
    times = times[np.append(True, np.diff(times) > ROUNDING * end)]
    times[-1] = end
    middles = (times[:-1] + times[1:]) / 2.0
    coefficients = 0.0
    for weight, delay in zip(weights.tolist(), delays.tolist(), strict=True):
        pieces, _ = around.locate(middles - delay)
        local = times[:-1] - delay - around.breakpoints[pieces]
        coefficients = coefficients + weight * shifted(around.coefficients[pieces], local[:, None])
    segments = around.segments[around.locate(middles - longest / 2.0)[0]]
    return SegmentedPolynomial(np.diff(times), np.asarray(coefficients), segments)
