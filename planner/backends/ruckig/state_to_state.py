"""Motions of joints from state to state, each as fast as its limits allow: single calls of Ruckig, read as cubics.

A state is a position, a velocity and an acceleration (Berscheid and Kroeger, Jerk-limited Real-time Trajectory
Generation with Arbitrary Target States, 2021). Numbers should be about 1 for the library's absolute tolerances: the
callers choose their units so. Waypoints between start and goal are never handed over: the library would send them to
a server on the internet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import ruckig

from planner.limits import SegmentLimits
from planner.spatial import FloatArray

Synchronization = Literal["phase", "time"]

_SYNCHRONIZATIONS = {
    "phase": ruckig.Synchronization.Phase,
    "time": ruckig.Synchronization.Time,
    "none": ruckig.Synchronization.No,
}
"""The library's names of the synchronizations; with `none` each joint has a duration of its own."""

RATE_LIMITS = ("min_velocity", "max_velocity", "min_acceleration", "max_acceleration", "max_jerk")
"""The library's names of the limits."""


class Rates(NamedTuple):
    """Velocities and accelerations of several states, both (states, joints)."""

    velocity: FloatArray
    acceleration: FloatArray


class Passage(NamedTuple):
    """One motion of all joints from state to state.

    Attributes:
        duration: The duration, s or in the caller's unit of time.
        lowest: The least position (joints,) on the way, relative to the start.
        highest: The greatest position (joints,) on the way, relative to the start.
        phases: The parts of `PhasedMotions` of this motion, Ruckig's phases.
    """

    duration: float
    lowest: FloatArray
    highest: FloatArray
    phases: tuple[FloatArray, ...]


class ShortestTimes:
    """The shortest times of many motions of single joints: one call of the library computes all of them.

    The library's degrees of freedom are the joints of all rows, which it does not synchronise.

    Args:
        travels: Travels (rows, joints).
        limits: The limits of each row and joint.
    """

    def __init__(self, travels: FloatArray, limits: SegmentLimits) -> None:
        self.shape = travels.shape
        self._input = _input(travels, *_rates(limits))
        self._input.synchronization = _SYNCHRONIZATIONS["none"]
        self._library = ruckig.Ruckig(travels.size)
        self._output = ruckig.Trajectory(travels.size)

    def between(self, starts: Rates, ends: Rates) -> FloatArray:
        """Give the shortest times (rows, joints); all of them are infinite where any of these motions is impossible."""
        if not _calculate(self._library, self._input, self._output, starts, ends):
            return np.full(self.shape, np.inf)
        times: FloatArray = np.array(self._output.independent_min_durations).reshape(self.shape)
        return times


class Passages:
    """Motions of all joints at once, row by row.

    Args:
        travels: Travels (rows, joints).
        limits: The limits of each row and joint.
        least: Durations (rows,) that the motions take at least; NaN: as short as can be.
        synchronization: `time`: all joints arrive at the same time. `phase`: on a straight line, too, if the states
            at the ends permit it.
    """

    def __init__(
        self, travels: FloatArray, limits: SegmentLimits, least: FloatArray, synchronization: Synchronization
    ) -> None:
        self._inputs = [_input(*row) for row in zip(travels, *_rates(limits), strict=True)]
        for own, seconds in zip(self._inputs, least.tolist(), strict=True):
            own.synchronization = _SYNCHRONIZATIONS[synchronization]
            own.minimum_duration = None if np.isnan(seconds) else seconds
        self._library = ruckig.Ruckig(travels.shape[1])

    def of(self, rows: Sequence[int], starts: Rates, ends: Rates) -> list[Passage | None]:
        """Compute some of the motions, with rates (motions, joints) at their starts and ends; None: impossible."""
        outputs: list[ruckig.Trajectory | None] = []
        for row, *rates in zip(rows, *starts, *ends, strict=True):
            output = ruckig.Trajectory(len(rates[0]))
            found = _calculate(self._library, self._inputs[row], output, Rates(*rates[:2]), Rates(*rates[2:]))
            outputs.append(output if found else None)
        profiles = [profile for output in outputs if output is not None for profile in output.profiles[0]]
        if not profiles:
            return [None] * len(outputs)
        phases = [np.array([getattr(profile, name) for profile in profiles]) for name in ("p", "v", "a", "j", "t")]
        each = (x.reshape(-1, starts.velocity.shape[1], *x.shape[1:]) for x in (*_extremes(*phases), *phases))
        lowest, highest, *phases = each
        motions = zip(lowest, highest, zip(*phases, strict=True), strict=True)
        return [None if output is None else Passage(output.duration, *next(motions)) for output in outputs]


def _rates(limits: SegmentLimits) -> tuple[FloatArray, ...]:
    """Return the limits of velocity, acceleration and jerk (rows, joints) in the order of `RATE_LIMITS`."""
    return (*limits.velocity, *limits.acceleration, limits.jerk.upper)


def _input(travels: FloatArray, *limits: FloatArray) -> ruckig.InputParameter:
    """Return the library's input for motions from position 0 over travels, each with limits of its own."""
    requested = ruckig.InputParameter(travels.size)
    requested.target_position = travels.ravel().tolist()
    for name, limit in zip(RATE_LIMITS, limits, strict=True):
        setattr(requested, name, limit.ravel().tolist())
    return requested


def _calculate(
    library: ruckig.Ruckig, requested: ruckig.InputParameter, output: ruckig.Trajectory, start: Rates, end: Rates
) -> bool:
    """Return whether the library finds the motion between two states, which is then in `output`."""
    requested.current_velocity, requested.current_acceleration = (rate.ravel().tolist() for rate in start)
    requested.target_velocity, requested.target_acceleration = (rate.ravel().tolist() for rate in end)
    try:
        library.calculate(requested, output)
    except (ruckig.RuckigError, ValueError):  # a ValueError, if its enumeration has no name for the result
        return False
    return True


def _extremes(
    p: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Give the least and the greatest position (profiles,) on the way; the library's `position_extrema` misses many."""
    ends = p
    p, v, a = p[:, :-1], v[:, :-1], a[:, :-1]
    # Both roots of v + a t + j t^2 / 2 without cancellation; what lies beyond the phase counts as its end.
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        q = -a - np.copysign(np.sqrt(np.maximum(a**2 - 2.0 * v * j, 0.0)), a)
        roots = np.nan_to_num(np.stack([q / j, 2.0 * v / q]))
    roots = np.clip(roots, 0.0, t)
    turns = p + roots * (v + roots * (a / 2.0 + roots * j / 6.0))
    return np.minimum(turns.min(axis=(0, 2)), ends.min(axis=1)), np.maximum(turns.max(axis=(0, 2)), ends.max(axis=1))
