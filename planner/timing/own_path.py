"""Slowing of motions on their own path, with limits that hold only on parts of them.

The slowed motion of a segment group is q(x(t)), with the back end's motion q(x) and a pace x' of at most 1. So it is
nowhere faster than before. The module finds the fastest x(t) within this pace, all limits that the back end keeps, and
the limits of the parts.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from planner.constraints import Constraint
from planner.kinematics.forward import JointStates
from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray
from planner.time_scaling.compose import compose
from planner.time_scaling.fastest import refined, retimed
from planner.time_scaling.limits_on_curve import LimitsOnCurve
from planner.time_scaling.retiming import RequestedDurations, fastest_retiming
from planner.time_scaling.uniform import slowest, time_scalings
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial, joined, shifted
from planner.trajectories.trajectory import Trajectory

LEAST_TIME_SCALING_PIECES = 200
"""Number of pieces of the time-scaling function, at least, before its refinement."""

PATH_GAP = 1e-3
"""Largest relative gap to the fastest time-scaling function."""

CLOSEST = 0.05
"""Least distance of two ends of pieces, but for the breakpoints of the motion, as a share of an even piece."""


@dataclass(frozen=True)
class Pace(Constraint):
    """The speed x' along the motion q(x)."""

    name: str = "pace"
    unit: str = ""
    order: int = 1

    def values(self, states: JointStates) -> FloatArray:
        """Return 1 (N, 1), the pace of the motion itself."""
        return np.ones((len(states.q), 1))


class Part(NamedTuple):
    """A part of a motion with a limit of its own.

    Attributes:
        intervals: (N, 2), s, ascending: the times of the limit.
        constraint: The limited quantity.
        limit: Its limit.
        excess: Function of the slowed motion and its intervals (M, 2): the factor on all times that is still necessary.
    """

    intervals: FloatArray
    constraint: Constraint
    limit: float
    excess: Callable[[PiecewisePolynomial, FloatArray], float]

    def meets(self, pieces: PiecewisePolynomial) -> np.ndarray:
        """Return whether pieces (N,) of the motion meet any of the intervals."""
        first = np.searchsorted(self.intervals[:, 1], pieces.breakpoints[:-1], side="right")
        meets = np.append(self.intervals[:, 0], np.inf)[first] < pieces.breakpoints[1:]
        return np.asarray(meets, dtype=bool)


def slow_down(
    path: JointPath,
    trajectory: Trajectory,
    kept: frozenset[str],
    parts_of: Callable[[SegmentGroup, SegmentedPolynomial], Sequence[Part]] = lambda _run, _motion: (),
    requested: Mapping[int, float] = MappingProxyType({}),
) -> Trajectory:
    """Slow parts of a trajectory on its own path; return it unchanged without such parts.

    Args:
        path: The path.
        trajectory: A trajectory on it.
        kept: The quantities whose limits are kept.
        parts_of: The parts of a group's motion that are slowed; if there are any, the motion rests at its ends.
        requested: Longer durations of some segments, s; their segment groups start and end at rest.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    path = path.keeping(kept)
    if "jerk" not in kept:
        path = replace(path, limits=path.limits.without(["jerk"]))
    changed = False
    motions = [trajectory.of(np.array([row])) for row in range(len(trajectory.segments))]
    for group, rows in zip(path.every_group, path.rows_of_groups(trajectory), strict=True):
        if not len(rows):
            continue
        motion = trajectory.of(rows)
        parts, own_requested = (
            parts_of(group, motion),
            {k: requested[k] for k in group.segments.tolist() if k in requested},
        )
        if parts or own_requested:
            slow = _slowed(path, group, motion, parts, own_requested, kept)
            for row, own in zip(rows.tolist(), slow, strict=True):
                motions[row] = own
            changed = True
    return _assembled(trajectory, motions) if changed else trajectory


def _slowed(
    path: JointPath,
    group: SegmentGroup,
    motion: SegmentedPolynomial,
    parts: Sequence[Part],
    requested: Mapping[int, float],
    kept: frozenset[str],
) -> list[SegmentedPolynomial]:
    """Return the replacement of each piece of the motion of a segment group."""
    curve = _cut(motion, [part.intervals for part in parts])
    under = motion.locate(curve.breakpoints[:-1] + curve.lengths / 2.0)[0]
    limits, within = path.limits.of(motion.segments[under]), [part.meets(curve) for part in parts]
    further = {**limits.further, Pace(): np.ones(len(under))}
    for part, there in zip(parts, within, strict=True):
        wider = further.get(part.constraint, np.full(len(under), np.inf))
        further[part.constraint] = np.where(there, np.minimum(wider, part.limit), wider)
    rows = curve.of_segments(np.arange(len(under)))
    bounds = LimitsOnCurve(path.dynamics.robot_on(group.first), replace(limits, further=further), rows)
    as_planned = np.stack([curve.breakpoints[:-1], np.ones(len(under))], axis=1)[:, None]
    scaling = PiecewisePolynomial(curve.lengths, as_planned)

    def requested_of(scaling: PiecewisePolynomial) -> RequestedDurations:
        """Return the requested durations of segments on the pieces of a time-scaling function."""
        segments = motion.segments[under[bounds.pieces(scaling)]]
        return RequestedDurations.of_parts(
            scaling.lengths, segments == np.array([*requested])[:, None], np.array([*requested.values()])
        )

    linear = bounds.along(scaling)
    scaling = retimed(scaling, fastest_retiming(scaling.lengths, linear, PATH_GAP, requested_of(scaling)))
    scaling = bounds.on_segments(refined(bounds, scaling, PATH_GAP, requested=requested_of))
    timed, of = compose(curve, scaling, group.tolerance)
    row = scaling.segments[of]
    pieces = timed.of_segments(motion.segments[under[row]])
    factor = slowest(time_scalings(path, pieces, kept).values()).factor
    times = np.column_stack([pieces.breakpoints[:-1], pieces.breakpoints[1:]])
    factors = [part.excess(pieces, times[own[row]]) for part, own in zip(parts, within, strict=True)]
    factors += [duration / pieces.lengths[pieces.segments == k].sum() for k, duration in requested.items()]
    pieces = pieces.stretched(max(1.0, factor, *factors))
    return [pieces.of(np.flatnonzero(under[row] == k)) for k in range(len(motion.lengths))]


def _cut(motion: PiecewisePolynomial, parts: Sequence[FloatArray]) -> PiecewisePolynomial:
    """Return a motion in short pieces that end where its own and where intervals (N, 2) of parts do, s."""
    nodes = motion.breakpoints.tolist()
    even = np.linspace(0.0, nodes[-1], LEAST_TIME_SCALING_PIECES + 1)
    for at in np.concatenate([*map(np.ravel, parts), even]).tolist():
        k = bisect(nodes, at)
        if min(abs(at - node) for node in nodes[max(k - 1, 0) : k + 1]) > CLOSEST * even[1]:
            nodes.insert(k, at)
    on, local = motion.locate(np.array(nodes[:-1]))
    return PiecewisePolynomial(np.diff(nodes), shifted(motion.coefficients[on], local[:, None]))


def _assembled(trajectory: Trajectory, motions: Sequence[SegmentedPolynomial]) -> Trajectory:
    """Return a trajectory with motions in the place of its pieces; waypoints stay at the breakpoints where they are."""
    whole = joined(motions)
    last = np.cumsum([0, *(len(motion.lengths) for motion in motions)])
    return trajectory.with_pieces(whole, whole.breakpoints[last])
