"""Jerk-limited motions by Ruckig: every joint as fast as its velocity, acceleration and jerk limits allow."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import numpy as np

from planner.backends.base import enforced
from planner.backends.jerk_limited.s_curves import along_lines
from planner.backends.ruckig.state_to_state import Synchronization
from planner.backends.ruckig.via_groups import least_stopping_time, time_joint_group
from planner.backends.shared.assembly import assemble
from planner.backends.shared.straight_lines import smoothed, time_lines
from planner.errors import InfeasibleDuration, LimitsUnsatisfiable
from planner.guarantees import ALL_HARD, Capabilities, EndStates, Guarantee, end_states
from planner.kinematics.turns import counted_velocity
from planner.paths import JointPath, SegmentGroup, StraightMotions
from planner.time_scaling.fastest import time_group
from planner.trajectories.polynomials import SegmentedPolynomial, joined
from planner.trajectories.trajectory import Trajectory

FEW_SEGMENTS = 20
"""Number of segments up to which each joint's own time scaling is always tried; 50 dense segments take 1 s."""

STRAIGHT_LIST = 0.6
"""Straightness of a list of waypoints above which one time scaling along a curve is tried.

It was faster for 56 of 500 random lists without torque and tool speed limits. None of the 56 was below 0.65. Random
positions of six joints have 0.35.
"""

STRAIGHT_PAST_ONE = 0.95
"""Straightness above which it is tried if the motion passes only one waypoint, which may be straight by chance.

It was faster for two of 80 such lists, both with 0.999 or more.
"""

DENSE = 0.5
"""Share of the time with a stop at each waypoint below which the waypoints count as dense, if they are many.

With dense waypoints the joints' own time scalings are much slower. Their search takes half a minute for 400 segments.
"""


@dataclass(frozen=True)
class Ruckig:
    """The fastest motion within velocity, acceleration and jerk limits, by the package ruckig.

    It goes from state to state (Berscheid and Kroeger 2021), and passes waypoints with the best velocities and
    accelerations found.

    Attributes:
        synchronization: `phase`: joint motions from rest to rest are straight lines in joint space. `time`: the joints
            only arrive together; each has a time scaling of its own.
        initial_velocity: Velocity of each joint at the first waypoint, rad/s or m/s; None: at rest.
        initial_acceleration: Acceleration of each joint at the first waypoint, rad/s^2 or m/s^2; None: none.
        final_velocity: Velocity of each joint at the last waypoint, rad/s or m/s; None: at rest.
    """

    kind: ClassVar[str] = "ruckig"
    summary: ClassVar[str] = (
        "As fast as velocity, acceleration and jerk limits allow, waypoints passed with the best rates found, C2."
    )
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_HARD
    capabilities: ClassVar[Capabilities] = Capabilities(passes_with_velocities=True, moves_at_its_ends=True)

    synchronization: Synchronization = field(
        default="phase",
        metadata={
            "description": "`phase`: joint motions from rest to rest are straight lines in joint space; "
            "`time`: the joints only arrive together."
        },
    )
    initial_velocity: tuple[float, ...] | None = field(
        default=None,
        metadata={"description": "Per joint at the first waypoint, rad/s or m/s; omitted: at rest."},
    )
    initial_acceleration: tuple[float, ...] | None = field(
        default=None,
        metadata={"description": "Per joint at the first waypoint, rad/s^2 or m/s^2; omitted: none."},
    )
    final_velocity: tuple[float, ...] | None = field(
        default=None,
        metadata={"description": "Per joint at the last waypoint, rad/s or m/s; omitted: at rest."},
    )

    def parametrize(self, path: JointPath) -> Trajectory:
        """Return the fastest motion found, or a motion in the requested durations."""
        ends = end_states(self, path.robot.dof)
        lines = self._lines(path, ends)
        parts = time_lines(path, lines, along_lines, partial(time_group, path))
        on_lines = set(lines.segments.tolist())
        for group in path.every_group:
            if group.first in on_lines:
                continue
            own = _ends_of(path, group.segments, ends)
            if not path.passed_at.keys().isdisjoint(group.segments.tolist()):
                parts += self._passing(path, group, own)
            elif group.is_spline or group.first in path.straight.segments:
                parts.append(self._time_joint_group(path, group, own))
            else:
                parts.append(time_group(path, group))
        return assemble(path, parts)

    def _time_joint_group(self, path: JointPath, group: SegmentGroup, ends: EndStates) -> SegmentedPolynomial:
        """Move each joint by its own time scaling, or all joints along one smooth curve if that is faster.

        The curve is faster if the waypoints are dense or on a straight line, or if limits of torque or tool speed bind.
        These limits slow the joints for a whole segment, but the motion along a curve only at the places that need it.
        """
        moves = ends.starts_moving or ends.ends_moving
        free = not moves and bool(np.isnan(path.durations[group.segments]).all())
        passes = free and len(group.segments) > 1
        found: list[SegmentedPolynomial] = []
        if passes and _straightness(path, group) > (STRAIGHT_LIST if len(group.segments) > 2 else STRAIGHT_PAST_ONE):
            found = _along_curve(path, group)
            if found and len(group.segments) > FEW_SEGMENTS:
                stopping = along_lines(path.straight_motions(group.segments))
                if _duration(found[0]) < DENSE * _duration(stopping):
                    return found[0]
        try:
            own, slowed = time_joint_group(path, group.segments, ends, self.synchronization, enforced(self))
        except InfeasibleDuration as refusal:
            if not moves and len(group.segments) == 1 and refusal.joint is None:
                return time_group(path, group)
            raise
        except LimitsUnsatisfiable:
            if passes and (found := found or _along_curve(path, group)):
                return found[0]
            raise
        if free and slowed:
            found = found or _along_curve(path, group)
        best = min([own, *found], key=_duration)
        if passes and slowed:
            travels, limits = np.diff(path.positions_of(group), axis=0), path.limits.of(group.segments)
            if least_stopping_time(travels, limits) < _duration(best):
                best = min(best, self._stopping(path, group, ends), key=_duration)
        return best

    def _passing(self, path: JointPath, group: SegmentGroup, ends: EndStates) -> list[SegmentedPolynomial]:
        """Return the motions of a segment group between waypoints with requested velocities.

        The acceleration at these waypoints is zero, which leaves the largest margin to the velocity limits.
        """
        cuts = [segment for segment in group.segments.tolist() if segment in path.passed_at]
        velocities = [ends.initial_velocity, *(path.passed_at[cut] for cut in cuts), ends.final_velocity]
        gains = [ends.initial_acceleration, *(np.zeros(path.robot.dof) for _ in cuts)]
        parts = np.split(group.segments, np.searchsorted(group.segments, cuts))
        return [
            time_joint_group(path, part, EndStates(begin, gain, end), self.synchronization, enforced(self))[0]
            for part, begin, gain, end in zip(parts, velocities[:-1], gains, velocities[1:], strict=True)
        ]

    def _stopping(self, path: JointPath, group: SegmentGroup, ends: EndStates) -> SegmentedPolynomial:
        """Return the motion that stops at each waypoint of a segment group."""
        if self.synchronization == "phase":
            lines = path.straight_motions(group.segments)
            return joined(time_lines(path, lines, along_lines, partial(time_group, path)))
        return joined([self._time_joint_group(path, one, ends) for one in path.straight_groups(group.segments)])

    def _lines(self, path: JointPath, ends: EndStates) -> StraightMotions:
        """Return the straight motions from rest to rest that have one time scaling for all joints."""
        motions = path.straight
        there = np.full(len(motions.segments), self.synchronization == "phase")
        there[motions.segments == path.moving[0]] &= not ends.starts_moving
        there[motions.segments == path.moving[-1]] &= not ends.ends_moving
        return motions.of(there)


def _ends_of(path: JointPath, segments: np.ndarray, ends: EndStates) -> EndStates:
    """Return the end states of some segments: the path's at its own ends, otherwise rest."""
    still = np.zeros(path.robot.dof)
    begin = (ends.initial_velocity, ends.initial_acceleration) if segments[0] == path.moving[0] else (still, still)
    return EndStates(*begin, ends.final_velocity if segments[-1] == path.moving[-1] else still)


def _duration(pieces: SegmentedPolynomial) -> float:
    return float(pieces.lengths.sum())


def _straightness(path: JointPath, group: SegmentGroup) -> float:
    """Return the mean magnitude of the cosines of the angles between adjacent chords of a segment group.

    It is 1 if all waypoints are on one straight line, even one back and forth. Joints are measured by their velocity
    limits, and each waypoint counts by the shorter chord: noise turns short ones most.
    """
    chords = np.diff(path.positions_of(group), axis=0) / counted_velocity(path.limits.velocity.narrower[group.segments])
    lengths = np.linalg.norm(chords, axis=1)
    directions = chords / lengths[:, None]
    cosines = (directions[:-1] * directions[1:]).sum(axis=1)
    return float(np.average(np.abs(cosines), weights=np.minimum(lengths[:-1], lengths[1:])))


def _along_curve(path: JointPath, group: SegmentGroup) -> list[SegmentedPolynomial]:
    """Return the fastest motion along a smooth curve through the waypoints; none if gravity exceeds a limit."""
    with suppress(LimitsUnsatisfiable):
        return [time_group(path, smoothed(path, group))]
    return []
