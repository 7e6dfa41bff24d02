"""Checks of a trajectory's samples under each interpolation of a controller, against the trajectory's limits."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from planner.certificate.checks import Certificate
from planner.certificate.limits import certificate_of
from planner.certificate.samples import INTERPOLATIONS, Interpolation, guarantees_of, interpolant
from planner.dynamics import SegmentDynamics
from planner.guarantees import EndStates
from planner.limits import SegmentLimits
from planner.spatial import FloatArray
from planner.tolerances import NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import shifted
from planner.trajectories.trajectory import Trajectory

OVERSHOOT = 0.01
"""Share of a limit by which a controller may exceed it between samples before a plan's answer warns: drives track no
better than that."""


@dataclass(frozen=True)
class SampleCertificate:
    """The check of a controller's interpolation of samples.

    Attributes:
        interpolation: The interpolation from sample to sample.
        certificate: The check of that.
    """

    interpolation: Interpolation
    certificate: Certificate


@dataclass(frozen=True)
class Overshoot:
    """A limit that a controller exceeds between samples within the limits.

    Attributes:
        quantity: `velocity` or `acceleration`.
        joint: Index of the joint.
        ratio: The ratio to the limit.
        time: Start of the interval, s.
    """

    quantity: str
    joint: int
    ratio: float
    time: float


def certify_sampling(
    dynamics: SegmentDynamics,
    trajectory: Trajectory,
    limits: SegmentLimits,
    time: FloatArray,
    ends: EndStates | None = None,
) -> list[SampleCertificate]:
    """Check a trajectory's samples under each interpolation of a controller.

    The function checks the interpolation against the limits in force at each time, and measures its distance from the
    waypoints.

    Args:
        dynamics: The robot, with its tool and payloads.
        trajectory: The sampled trajectory.
        limits: Limits of each of its segments.
        time: (N,), s, strictly increasing, from 0 to the duration.
        ends: The motion before and after; None: rest.
    """
    lengths, derivatives = np.diff(time), trajectory.evaluate(time)
    wanted = trajectory.at_arrivals
    return [
        SampleCertificate(
            interpolation,
            certificate_of(
                _on_segments(trajectory, lengths, interpolant(interpolation, lengths, derivatives)),
                dynamics.robots[0],
                limits,
                guarantees_of(interpolation),
                wanted,
                ends=ends,
                dynamics=dynamics,
            ),
        )
        for interpolation in INTERPOLATIONS
    ]


def worst_overshoot(
    trajectory: Trajectory,
    limits: SegmentLimits,
    time: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    continuous: Collection[str],
) -> Overshoot | None:
    """Find the limit that cubics between a trajectory's samples exceed because the samples are far apart.

    Continuous quantities approach the trajectory as samples get closer. Where the trajectory's acceleration jumps, a
    cubic exceeds it by up to two thirds at any sample distance. Its initial acceleration is the mean of the
    trajectory's over the interval, weighted by 4 - 6 u. The mean of |4 - 6 u| is 5/3. `certify_sampling` reports this.
    Peaks of cubics have a closed form, which costs little beside a plan.

    Args:
        trajectory: The sampled trajectory.
        limits: Limits of each of its segments; an interval has the wider limits of its two ends.
        time: (N,), s.
        position: (N, joints) at these times.
        velocity: (N, joints) at these times.
        continuous: The continuous quantities of the trajectory, of `velocity` and `acceleration`; only these are
            checked.

    Returns:
        The worst of what exceeds its limit by more than `OVERSHOOT`; None: there is none.
    """
    h = np.diff(time)[:, None]
    v0, v1, mean = velocity[:-1], velocity[1:], np.diff(position, axis=0) / h
    a0, a1 = (6.0 * mean - 4.0 * v0 - 2.0 * v1) / h, (2.0 * v0 + 4.0 * v1 - 6.0 * mean) / h
    turns = a0 * a1 < 0.0  # after the share a0 / (a0 - a1) of the interval the velocity has an extremum
    extremum = v0 + np.divide(a0 * a0 * h, 2.0 * (a0 - a1), out=np.zeros_like(a0), where=turns)
    peaks = {"velocity": np.abs([v0, v1, extremum]).max(axis=0), "acceleration": np.abs([a0, a1]).max(axis=0)}
    segments = trajectory.segments[trajectory.locate(time)[0]]
    found = []
    for quantity in continuous:
        limit = np.maximum(*np.abs(limits.bounds(quantity)))[segments]
        ratios = peaks[quantity] / np.maximum(limit[:-1], limit[1:])
        at, joint = np.unravel_index(int(ratios.argmax()), ratios.shape)
        found.append(Overshoot(quantity, int(joint), float(ratios[at, joint]), float(time[at])))
    worst = max(found, key=lambda overshoot: overshoot.ratio, default=None)
    return worst if worst is not None and worst.ratio > 1.0 + OVERSHOOT else None


def _on_segments(trajectory: Trajectory, lengths: FloatArray, coefficients: FloatArray) -> Trajectory:
    """Give the interpolation, cut where the segments of the trajectory meet, so that each piece lies on one of them."""
    run = replace(trajectory, lengths=lengths, coefficients=coefficients, segments=np.zeros(len(lengths), dtype=int))
    meet = trajectory.breakpoints[1:-1][np.diff(trajectory.segments) != 0]
    pieces, since = run.locate(meet)
    inside = np.minimum(since, lengths[pieces] - since) > NEGLIGIBLE_SHARE * lengths[pieces]
    starts = np.union1d(run.breakpoints[:-1], meet[inside])
    pieces, since = run.locate(starts)
    middles = starts + np.diff(starts, append=run.duration) / 2.0
    return replace(
        run,
        lengths=np.diff(starts, append=run.duration),
        coefficients=shifted(coefficients[pieces], since[:, None]),
        segments=trajectory.segments[trajectory.locate(middles)[0]],
    )
